// Types of Surface Service, made from openapi.json by openapi-typescript: `make types`.
// Changes belong into the OpenAPI document.

export interface paths {
    "/v1/mesh": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * The mesh of a surface
         * @description Evaluates the surface and returns its mesh.
         *
         *     The response is in the format that `format` names or `Accept` prefers; JSON without either. The
         *     body is a JSON document with the options in it, or a file with the options in the query: a CAD
         *     file, of STEP, IGES or 3DM, or a file of control points. `Surface-Reading` says how many faces
         *     of a CAD file were read.
         */
        post: operations["createMesh"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/estimate": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * The size of a mesh, before it is computed
         * @description Reads the body of `POST /v1/mesh` and returns how large the mesh would be.
         *
         *     The response has the numbers of vertices and faces, the bytes in each format, and whether
         *     `POST /v1/mesh` would refuse the request. An estimate takes a small part of the time of the
         *     mesh. An invalid body is an error here too.
         */
        post: operations["estimateMesh"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/points": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Points of a surface, with derivatives and curvatures
         * @description Evaluates the surface at the given parameters, in float64, and returns columns.
         *
         *     Row k of each column belongs to row k of `uv` or `barycentric`. Partial derivatives are with
         *     respect to the surface's own parameters; at a knot they are the limits from the right. The
         *     parameters on a brep are those of the surface of a face, which `patch` names, and `inside` says
         *     whether the point is inside the trims of this face. In a group, `patch` counts the faces and
         *     Bézier patches of all members; points, derivatives and curvatures are those of the placed
         *     surfaces. Exact tubes have the patches that `/v1/project` names; ribbons, and other tubes, have
         *     none (`not_parametric`).
         */
        post: operations["queryPoints"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/convert": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * A surface in another form, with the same points
         * @description Applies the operations in their order and returns the converted surface.
         *
         *     The operations may be left out: a CAD file, sent as the body, then becomes JSON, with the report
         *     of reading it (`reading`). Of several patches or members, operations change all, or the one that
         *     `patch` names. The response is in the format that `format` names or `Accept`
         *     prefers; JSON without either. JSON is a body for the other calls. Corner points keep their
         *     digits, and patches that shared an edge still share it. Colours, texture coordinates and
         *     attributes are converted too.
         *
         *     STEP and IGES have the surface as it is defined, not its mesh: faces with their edges, names,
         *     colours of faces and of members, instances and units. Borders that are equal become one edge.
         *     VTU has Bézier cells, and no breps. Tubes and ribbons are not written in these formats.
         */
        post: operations["convertSurface"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/curve": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * A curve as points, tangents and lengths, or as lines
         * @description Samples the curve, evenly, within a tolerance, or at parameters of your choice.
         *
         *     Row k of each column belongs to point k. Derivatives are with respect to the parameter of the
         *     curve.
         *
         *     The response is in the format that `format` names or `Accept` prefers; JSON without either. In
         *     glTF, OOGL and OBJ a plane curve has z = 0; these formats have no derivatives.
         */
        post: operations["createCurve"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/project": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * The closest points of a surface or a curve, with proved distances
         * @description Looks for the closest points, and proves an interval that contains each distance.
         *
         *     Row k of each column belongs to point k. The search subdivides the whole surface: it needs no
         *     starting point, and misses no minimum. Of a brep, the closest point is on a trimmed face or on
         *     an edge, and `near_edge` says where an edge decides. Ribbons, and tubes that are not exact, have
         *     no closest points (`not_parametric`).
         *
         *     Many points are sent faster as a NumPy file. Then the query of the URL names a stored or
         *     built-in surface, and has the other fields.
         */
        post: operations["projectPoints"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/intersect": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Where rays hit a surface, or planes cut it
         * @description Looks for the hits of rays, or for the sections by planes, of the whole surface.
         *
         *     **Rays.** If a ray is `reached`, each point of the surface on the ray has its t in the
         *     `t_bounds` of a hit. Each hit is nearer to its ray than the thickness
         *     (`relative_thickness`). Hits on an edge or a corner that patches share count once. Faces of a
         *     brep have hits inside their trims only, and near their edges (`near_edge`).
         *
         *     **Planes.** A section is returned as polylines, which are within a tolerance of the exact
         *     section and contain all of its parts, however small. Polylines are closed where the surface, or
         *     the solid, is closed. The response is in the format that `format` names or `Accept` prefers;
         *     JSON without either.
         *
         *     Many rays are sent faster as a NumPy file with a point and a direction in each row. The query
         *     then names a stored or built-in surface, and has the other fields.
         *
         *     Ribbons, and tubes that are not exact, have no hits and no sections (`not_parametric`).
         */
        post: operations["intersectSurface"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/measure": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Area, volume, centroid and lengths of borders, each with a proved interval
         * @description Measures a surface: every number has an interval that provably contains the exact value.
         *
         *     A surface has a volume if it has no open edge and its patches are oriented consistently;
         *     otherwise `faulty_edges` lists the reasons. Where a `tolerance` takes more work than one request
         *     may take, the interval is wider, and `reached` is false. Faces of a brep are measured inside
         *     their trims; `edge_lengths` has the lengths of its edges. Ribbons, and tubes that are not exact,
         *     are not measured (`not_parametric`).
         */
        post: operations["measureSurface"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/check": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * How far anyone's mesh is from its surface, with proved intervals
         * @description Compares a mesh of any program with a surface of any kind.
         *
         *     One interval provably contains the largest distance from a point of the surface to the mesh, the
         *     other the largest distance from a point of the mesh to the surface; both with the place where
         *     that is. Then the faults of the mesh itself are counted.
         *
         *     The mesh is in the coordinates of the surface. It may be a file: as the body, when the query
         *     names a built-in or a stored surface and has the options; or inside the JSON document. The nodes
         *     of a glTF file are applied; what its root does to surfaces with `up: z` or with
         *     `metres_per_unit` is undone. No other units are converted.
         */
        post: operations["checkMesh"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/surfaces": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * The built-in surfaces
         * @description Lists the built-in surfaces, with the URLs of their meshes.
         */
        get: operations["listSurfaces"];
        put?: never;
        /**
         * Stores a surface
         * @description Stores the surface under the SHA-256 of its content, which becomes its id.
         *
         *     The status is 201 for a new surface, 200 for one that was stored already. All ways to write the
         *     same surface have one id: the order of keys, the form of numbers (`1`, `1.0`, `1e0`; 0 and −0)
         *     and explicit defaults make no difference; another value of a number makes another surface. A
         *     file of control points, with the other fields in the query, is the same surface as in JSON.
         *     `links` has the URLs of the meshes and of the picture, which clients may cache for ever.
         */
        post: operations["storeSurface"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/surfaces/{id}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * The definition of a surface
         * @description Returns the definition of a built-in or a stored surface: a body for the other calls.
         *
         *     The definition under a hash never changes. The `ETag` is the hash of the content, in quotes.
         */
        get: operations["getSurface"];
        put?: never;
        post?: never;
        /**
         * Removes a stored surface
         * @description Removes a stored surface, if the service allows it (`SURFACE_ALLOW_DELETE`).
         *
         *     Built-in surfaces cannot be removed (405). Other instances with the same store may serve cached
         *     meshes of the surface for half a minute. Caches that may keep a mesh of the surface for ever
         *     still have it: the service cannot delete it there. A surface that is stored again has the same
         *     id.
         */
        delete: operations["deleteSurface"];
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/surfaces/{id}/mesh.{suffix}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * The mesh of a surface, by URL
         * @description Returns a mesh by URL, for browsers and for caches between them and this service.
         *
         *     The mesh depends only on the parts of the URL: every service with the same version of the
         *     numbers returns the same mesh. Other processors and libraries may round the last digit of a
         *     number differently; then the entity tag differs too. `Link` names the canonical form of the URL:
         *     options in a fixed order, without defaults, `engine` at the end. Under that URL, caches may keep
         *     the mesh of a surface whose id is a hash for ever. They may keep other meshes for an hour; after
         *     that, `ETag` shows whether the mesh has changed.
         *
         *     The service computes equal requests at the same time once, and keeps responses in memory,
         *     compressed ones too.
         */
        get: operations["getSurfaceMesh"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/image": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * A picture of a surface
         * @description Draws a surface as PNG: no point of it is further than 0.25 pixels from where it is.
         *
         *     The body is that of `POST /v1/mesh`, with the options of a picture in place of those of a mesh.
         *     Normals, colours and curvatures are those of the surface at the places of the pixels.
         */
        post: operations["createImage"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/surfaces/{id}/image.png": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * The picture of a surface, by URL
         * @description Returns a picture by URL, as `GET /v1/surfaces/{id}/mesh.{suffix}` returns a mesh.
         *
         *     The picture depends only on the parts of the URL. Caches may keep it for ever under its
         *     canonical form, which `Link` names, if the id is a hash.
         */
        get: operations["getSurfaceImage"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/formats": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * The formats of meshes
         * @description Lists the formats of meshes, and what each can store.
         */
        get: operations["listFormats"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/health": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * State and versions, for people
         * @description The state of the service, its version, and the version of its numbers (`engine`).
         */
        get: operations["getHealth"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/health/live": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * 200 while the process runs
         * @description Responds at once, without any check.
         */
        get: operations["getLiveness"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/health/ready": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * 200 while the service is ready for new requests
         * @description Whether the service is ready for new requests.
         *
         *     The service is ready if a self-test (a tiny mesh, at most once in 5 s) gave the right numbers,
         *     stored surfaces can be read (also if none can be stored), and the service is not about to stop.
         */
        get: operations["getReadiness"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/jobs": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Your jobs
         * @description Lists the jobs of the caller whose results have not expired, the newest first.
         *
         *     The caller is the name of the key, or without keys the address. A key with the scope `admin`
         *     gets the jobs of all callers.
         */
        get: operations["listJobs"];
        put?: never;
        /**
         * Accepts a job: many requests, computed in the background
         * @description Checks all parts and accepts the job; the response has its state.
         *
         *     A part with a body is a POST of one of the calls that compute, a part without one is a GET of a
         *     mesh by URL. Its result is the same as that of the call, byte for byte. A job may take hours: no
         *     request waits for it, and a restart of the service does not lose it.
         *
         *     Many parts can be sent as `application/x-ndjson`, one part a line: then the service reads them
         *     as they come. The same parts are the same job, also in the other form and with other names: a
         *     second request joins it, and parts that any job has computed are not computed again. If a part
         *     is refused, the whole job is; the pointer of the error begins with `/parts/` and the index of
         *     the part.
         */
        post: operations["createJob"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/files": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Stores a file for parts of jobs
         * @description Keeps a file, which parts of jobs name by its id as their `file`.
         *
         *     The file is not read here: a part whose file cannot be read fails. A file is kept for twice the
         *     lifetime of jobs after it was stored or a job named it. The same bytes of the same type have the
         *     same id.
         */
        post: operations["storeJobFile"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/jobs/{id}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * The state of a job
         * @description Returns the state of a job: how many parts have ended, how fast, and how long it will take.
         *
         *     Until the job has ended, `Retry-After` says when to ask again; `/events` sends each change.
         */
        get: operations["getJob"];
        put?: never;
        post?: never;
        /**
         * Withdraws a job
         * @description Withdraws the caller: its work ends within two seconds if no other caller waits for the job.
         *
         *     The job is then `cancelled`. The results that are ready stay until they expire. If the same
         *     parts are posted again, only the others are computed.
         */
        delete: operations["withdrawJob"];
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/jobs/{id}/events": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * The state of a job as a stream of events
         * @description Sends the state of the job now, and then each change, at most two a second.
         *
         *     The data of each event `progress`, and of the last event, `end`, is the document of
         *     `GET /v1/jobs/{id}`. Between events, a comment every 15 s keeps the connection open. Before the
         *     service stops it ends the stream; an `EventSource` then connects again after a second.
         */
        get: operations["getJobEvents"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/jobs/{id}/results": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * The results of a job, as a list
         * @description Lists the parts `from` … `from + limit - 1` with their state, and the URL of each file.
         *
         *     A part that failed has its `problem` instead. The list may be read while the job runs.
         */
        get: operations["getJobResults"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/jobs/{id}/results/{part}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * The result of a part
         * @description Returns the file of a part that has succeeded; until then the response is 404.
         *
         *     It has the bytes and the media type that the part's call returns. It never changes: `ETag` is
         *     its SHA-256.
         */
        get: operations["getJobResult"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/stored": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * All stored surfaces
         * @description Lists the stored surfaces in the order of their ids, without reading them.
         *
         *     Who knows an id may read its surface, so this call needs a key with the scope `admin`, and a
         *     service without keys does not have it. A surface that is stored or deleted meanwhile may be
         *     missing or listed.
         */
        get: operations["listStored"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/sign": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Signs a URL of a private surface
         * @description Makes a URL that any client may read without a key until it expires.
         *
         *     It is for services whose surfaces and meshes are not public (`SURFACE_PUBLIC_READS=false`): for
         *     example, for a viewer on a page. The signature is valid for one path and its parameters, in any
         *     order, for `GET` and `HEAD`. The service does not check that the surface exists. It signs only
         *     URLs of its own surfaces and meshes, for at most seven days. Without `SURFACE_SIGNING_KEYS` this
         *     call does not exist.
         */
        post: operations["signAddress"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/metrics": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Metrics of the service, for Prometheus
         * @description In the text format of Prometheus, or as OpenMetrics if `Accept` names it. The operator decides whether this call exists, and whether it needs a key.
         */
        get: operations["getMetrics"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
}
export type webhooks = Record<string, never>;
export interface components {
    schemas: {
        /**
         * BezierConversion
         * @description Converts a B-spline to `patches`: one Bézier patch for each span, over shared vertices.
         *
         *     Surfaces that already consist of Bézier patches do not change.
         */
        BezierConversion: {
            /**
             * Op
             * @description The operation.
             * @constant
             */
            op: "bezier";
            /**
             * Patch
             * @description For `patches`, `multipatch` and `group`: the number of the patch that is changed, from 0, as POST /v1/points counts it. Its surface or member keeps its place, its name and its placement; a B-spline in a group is changed as a whole. By default all are changed.
             * @example 0
             */
            patch?: number;
        };
        /**
         * BezierCurveDefinition
         * @description One Bézier curve of any degree, in the plane or in space, rational if weights are given.
         *
         *     C(t) = Σ B_i(t) w_i P_i / Σ B_i(t) w_i for t from 0 to 1. A curve of n + 1 control points has
         *     degree n. If the last control point equals the first, the curve is closed.
         */
        BezierCurveDefinition: {
            /**
             * Type
             * @description The kind of curve; `bezier` is the default.
             * @default bezier
             * @constant
             */
            type?: "bezier";
            /**
             * Homogeneous
             * @description Whether control points are homogeneous: [w x, w y, w z, w], with no `weights` beside them. A point with w = 0 is a direction. If a w is 0 or negative, but none at a corner, the degree is raised, to 64 at most, until all weights are positive; this does not change the surface. It is stored, answered and hashed as points and weights.
             * @default false
             * @example true
             */
            homogeneous?: boolean;
            /**
             * Control Points
             * @description The control polygon: at least two points, all [x, y] or all [x, y, z]; [w x, w y, w] or [w x, w y, w z, w] if they are `homogeneous`.
             * @example [
             *       [
             *         0,
             *         0,
             *         0
             *       ],
             *       [
             *         1,
             *         2,
             *         0
             *       ],
             *       [
             *         3,
             *         2,
             *         1
             *       ],
             *       [
             *         4,
             *         0,
             *         1
             *       ]
             *     ]
             * @example [
             *       [
             *         1,
             *         0
             *       ],
             *       [
             *         1,
             *         1
             *       ],
             *       [
             *         0,
             *         1
             *       ]
             *     ]
             */
            control_points: number[][];
            /**
             * Weights
             * @description One weight for every control point: positive, or 0 for one that does not pull and is no end. Left out, the curve is polynomial.
             * @example [
             *       1,
             *       0.7071067811865476,
             *       1
             *     ]
             */
            weights?: number[];
            /**
             * Up
             * @description The model's vertical axis. With `z`, the root node of a glTF file rotates the model, since y is up in glTF; the coordinates do not change.
             * @default y
             * @example z
             * @enum {string}
             */
            up?: "y" | "z";
            /**
             * Name
             * @description Name of the surface or curve. Its part, its node in glTF and a comment in OOGL have this name.
             * @default curve
             * @example sail
             */
            name?: string;
        };
        /**
         * BezierDefinition
         * @description One tensor-product Bézier patch of any degree, rational if weights are given.
         *
         *     S(u, v) = Σ B_i(u) B_j(v) w_ij P_ij / Σ B_i(u) B_j(v) w_ij for u and v from 0 to 1. A net of
         *     r × c control points has degree (r − 1, c − 1); rows follow each other along u, columns
         *     along v.
         */
        BezierDefinition: {
            /**
             * Type
             * @description The kind of surface; `bezier` is the default.
             * @default bezier
             * @constant
             */
            type?: "bezier";
            /**
             * Homogeneous
             * @description Whether control points are homogeneous: [w x, w y, w z, w], with no `weights` beside them. A point with w = 0 is a direction. If a w is 0 or negative, but none at a corner, the degree is raised, to 64 at most, until all weights are positive; this does not change the surface. It is stored, answered and hashed as points and weights.
             * @default false
             * @example true
             */
            homogeneous?: boolean;
            /**
             * Control Net
             * @description Control points [x, y, z], or [x, y] in the plane z = 0, row by row; [w x, w y, w z, w] if they are `homogeneous`. Rows follow each other along u, points in a row along v; rows have equal lengths. At least 2 × 2 points; every coordinate is finite and within single precision.
             * @example [
             *       [
             *         [
             *           0,
             *           0,
             *           0
             *         ],
             *         [
             *           0,
             *           1,
             *           1
             *         ],
             *         [
             *           0,
             *           2,
             *           0
             *         ]
             *       ],
             *       [
             *         [
             *           1,
             *           0,
             *           1
             *         ],
             *         [
             *           1,
             *           1,
             *           2
             *         ],
             *         [
             *           1,
             *           2,
             *           1
             *         ]
             *       ]
             *     ]
             */
            control_net: ([
                number,
                number,
                number
            ] | [
                number,
                number
            ] | [
                number,
                number,
                number,
                number
            ])[][];
            /**
             * Weights
             * @description One weight for every control point, in the same rows: positive, or 0 for a point that does not pull and is no corner. Left out, the surface is polynomial.
             * @example [
             *       [
             *         1,
             *         0.7071067811865476,
             *         1
             *       ],
             *       [
             *         1,
             *         0.7071067811865476,
             *         1
             *       ]
             *     ]
             */
            weights?: number[][];
            /**
             * Colors
             * @description Colours. sRGB, each number from 0 to 1: [r, g, b], or [r, g, b, a] with the opacity. Formats without colours omit them. glTF files contain linear RGB, as the specification of glTF requires. Rows follow each other along u, as in the control net. The degree of this net may differ from that of the control net; degree 0 is one value.
             * @example [
             *       [
             *         [
             *           0.8,
             *           0.1,
             *           0.1
             *         ],
             *         [
             *           0.9,
             *           0.9,
             *           0.2
             *         ]
             *       ],
             *       [
             *         [
             *           0.1,
             *           0.2,
             *           0.8
             *         ],
             *         [
             *           0.2,
             *           0.8,
             *           0.3
             *         ]
             *       ]
             *     ]
             */
            colors?: number[][][];
            /**
             * Uvs
             * @description Texture coordinates [u, v], written without change. Vertices of the mesh then have texture coordinates also without the option `uvs`. Rows follow each other along u, as in the control net. The degree of this net may differ from that of the control net; degree 0 is one value.
             * @example [
             *       [
             *         [
             *           0,
             *           0
             *         ],
             *         [
             *           0,
             *           2
             *         ]
             *       ],
             *       [
             *         [
             *           1,
             *           0
             *         ],
             *         [
             *           1,
             *           2
             *         ]
             *       ]
             *     ]
             */
            uvs?: [
                number,
                number
            ][][];
            /**
             * Attributes
             * @description Functions of the parameters, by name: a temperature, a fourth coordinate. Every value is a list of 1 to 16 numbers. JSON has attributes by name. glTF has them as `_NAME`, split into pieces of four if there are more than four numbers. PLY has them as properties, sorted by name. Rows follow each other along u, as in the control net. The degree of this net may differ from that of the control net; degree 0 is one value.
             * @example {
             *       "temperature": [
             *         [
             *           [
             *             20
             *           ],
             *           [
             *             20
             *           ]
             *         ],
             *         [
             *           [
             *             35
             *           ],
             *           [
             *             60
             *           ]
             *         ]
             *       ]
             *     }
             */
            attributes?: {
                [key: string]: number[][][];
            };
            /**
             * Up
             * @description The model's vertical axis. With `z`, the root node of a glTF file rotates the model, since y is up in glTF; the coordinates do not change.
             * @default y
             * @example z
             * @enum {string}
             */
            up?: "y" | "z";
            /**
             * Name
             * @description Name of the surface or curve. Its part, its node in glTF and a comment in OOGL have this name.
             * @default surface
             * @example sail
             */
            name?: string;
        };
        /**
         * BezierNet
         * @description One tensor-product Bézier patch: the surface of a face of a `brep`.
         *
         *     S(u, v) = Σ B_i(u) B_j(v) w_ij P_ij / Σ B_i(u) B_j(v) w_ij for u and v from 0 to 1. A net of
         *     r × c control points has degree (r − 1, c − 1); rows follow each other along u, columns
         *     along v.
         */
        BezierNet: {
            /**
             * Type
             * @description The kind of surface; `bezier` is the default.
             * @default bezier
             * @constant
             */
            type?: "bezier";
            /**
             * Homogeneous
             * @description Whether control points are homogeneous: [w x, w y, w z, w], with no `weights` beside them. A point with w = 0 is a direction. If a w is 0 or negative, but none at a corner, the degree is raised, to 64 at most, until all weights are positive; this does not change the surface. It is stored, answered and hashed as points and weights.
             * @default false
             * @example true
             */
            homogeneous?: boolean;
            /**
             * Control Net
             * @description Control points [x, y, z], or [x, y] in the plane z = 0, row by row; [w x, w y, w z, w] if they are `homogeneous`. Rows follow each other along u, points in a row along v; rows have equal lengths. At least 2 × 2 points; every coordinate is finite and within single precision.
             * @example [
             *       [
             *         [
             *           0,
             *           0,
             *           0
             *         ],
             *         [
             *           0,
             *           1,
             *           1
             *         ],
             *         [
             *           0,
             *           2,
             *           0
             *         ]
             *       ],
             *       [
             *         [
             *           1,
             *           0,
             *           1
             *         ],
             *         [
             *           1,
             *           1,
             *           2
             *         ],
             *         [
             *           1,
             *           2,
             *           1
             *         ]
             *       ]
             *     ]
             */
            control_net: ([
                number,
                number,
                number
            ] | [
                number,
                number
            ] | [
                number,
                number,
                number,
                number
            ])[][];
            /**
             * Weights
             * @description One weight for every control point, in the same rows: positive, or 0 for a point that does not pull and is no corner. Left out, the surface is polynomial.
             * @example [
             *       [
             *         1,
             *         0.7071067811865476,
             *         1
             *       ],
             *       [
             *         1,
             *         0.7071067811865476,
             *         1
             *       ]
             *     ]
             */
            weights?: number[][];
        };
        /**
         * Boundary
         * @description An open border: a chain of edges, with the surface on their left.
         *
         *     Where neighbouring patches do not agree about their sides, the chain goes on all the same.
         */
        Boundary: {
            /** @description Its length. */
            length: components["schemas"]["Interval"];
            /**
             * Edges
             * @description Number of its edges.
             */
            edges: number;
            /**
             * Closed
             * @description Whether the border ends where it begins.
             */
            closed: boolean;
            /** @description Its first edge. */
            first_edge: components["schemas"]["EdgePlace"];
        };
        /**
         * Bounds
         * @description Bounding box of the stored vertices.
         */
        Bounds: {
            /**
             * Min
             * @description Least x, y and z.
             */
            min: [
                number,
                number,
                number
            ];
            /**
             * Max
             * @description Greatest x, y and z.
             */
            max: [
                number,
                number,
                number
            ];
        };
        /**
         * BrepDefinition
         * @description A solid, or open shells, of trimmed faces that share edges.
         *
         *     The words are those of ISO 10303-42. A *face* is the part of a surface inside its *loops*; a
         *     loop runs along *edges*, and an edge lies between two *vertices*. A solid is a closed *shell*,
         *     and further closed shells are its voids. One trimmed face is a brep of one face. Both faces at
         *     an edge get the very same vertices of the mesh, so that it has no cracks.
         */
        BrepDefinition: {
            /**
             * Type
             * @description The kind of surface.
             * @constant
             */
            type: "brep";
            /**
             * Vertices
             * @description The vertices [x, y, z]. Only a brep without edges has none.
             * @example [
             *       [
             *         0,
             *         0,
             *         0
             *       ],
             *       [
             *         10,
             *         0,
             *         0
             *       ],
             *       [
             *         10,
             *         10,
             *         0
             *       ],
             *       [
             *         0,
             *         10,
             *         0
             *       ],
             *       [
             *         7,
             *         5,
             *         0
             *       ]
             *     ]
             */
            vertices?: [
                number,
                number,
                number
            ][];
            /**
             * Vertex Uncertainties
             * @description For each vertex, how far it may be from the true one, in model units. The default is the uncertainty of the brep.
             * @example [
             *       0.000001,
             *       0.000001,
             *       0.000001,
             *       0.000001,
             *       0.000001
             *     ]
             */
            vertex_uncertainties?: number[];
            /**
             * Edges
             * @description The edges.
             * @default []
             * @example [
             *       {
             *         "vertices": [
             *           0,
             *           1
             *         ]
             *       },
             *       {
             *         "vertices": [
             *           1,
             *           2
             *         ]
             *       },
             *       {
             *         "vertices": [
             *           2,
             *           0
             *         ]
             *       }
             *     ]
             */
            edges?: components["schemas"]["EdgeDefinition"][];
            /**
             * Faces
             * @description The faces. The limits of faces and of control points are for the brep, or for the group with this brep, as a whole.
             * @example [
             *       {
             *         "loops": [
             *           {
             *             "edges": [
             *               0,
             *               1,
             *               2
             *             ]
             *           }
             *         ],
             *         "surface": {
             *           "control_net": [
             *             [
             *               [
             *                 0,
             *                 0,
             *                 0
             *               ],
             *               [
             *                 0,
             *                 9,
             *                 0
             *               ]
             *             ],
             *             [
             *               [
             *                 9,
             *                 0,
             *                 0
             *               ],
             *               [
             *                 9,
             *                 9,
             *                 0
             *               ]
             *             ]
             *           ]
             *         }
             *       }
             *     ]
             */
            faces: components["schemas"]["FaceDefinition"][];
            /**
             * Shells
             * @description The shells. Left out, all faces are one open shell. Of a solid, the first shell is the outer one.
             * @example [
             *       {
             *         "closed": false,
             *         "faces": [
             *           0
             *         ]
             *       }
             *     ]
             */
            shells?: components["schemas"]["ShellDefinition"][];
            /**
             * Uncertainty
             * @description How far points may be from the true ones, in model units. A given pcurve is used if it is at most this far from its edge. The default is 1e-6 of the diagonal of the box about vertices and edges.
             * @example 0.000001
             */
            uncertainty?: number;
            /**
             * Invalid Faces
             * @description What happens if a face is invalid: its loop is open, loops cross, an edge is far from its surface. With `refuse` the brep is refused; with `skip` the face is left out and listed in the report. If the edges of a face are further from its surface than the uncertainty, its loops never refuse the brep, because a gap is no mistake of the request.
             * @default refuse
             * @enum {string}
             */
            invalid_faces?: "refuse" | "skip";
            /**
             * Metres Per Unit
             * @description The unit of the coordinates in metres: 0.001 for millimetres. It is the scale of the root node of a glTF file, which is in metres, and reports of meshes repeat it. Tolerances, reports and other formats stay in the unit of the coordinates. That of a member of a group has no effect.
             * @example 0.001
             */
            metres_per_unit?: number;
            /**
             * Up
             * @description The model's vertical axis. With `z`, the root node of a glTF file rotates the model, since y is up in glTF; the coordinates do not change.
             * @default y
             * @example z
             * @enum {string}
             */
            up?: "y" | "z";
            /**
             * Name
             * @description Name of the surface or curve. Its part, its node in glTF and a comment in OOGL have this name.
             * @default brep
             * @example sail
             */
            name?: string;
        };
        /**
         * BsplineCurveDefinition
         * @description One B-spline curve in the plane or in space; with weights it is a NURBS curve.
         *
         *     C(t) = Σ N_i(t) w_i P_i / Σ N_i(t) w_i over the domain of its knots; n control points need
         *     n + degree + 1 knots. Each interval between neighbouring distinct knots of the domain becomes
         *     one Bézier piece.
         */
        BsplineCurveDefinition: {
            /**
             * Type
             * @description The kind of curve.
             * @constant
             */
            type: "bspline";
            /**
             * Homogeneous
             * @description Whether control points are homogeneous: [w x, w y, w z, w], with no `weights` beside them. A point with w = 0 is a direction. If a w is 0 or negative, but none at a corner, the degree is raised, to 64 at most, until all weights are positive; this does not change the surface. It is stored, answered and hashed as points and weights.
             * @default false
             * @example true
             */
            homogeneous?: boolean;
            /**
             * Control Points
             * @description The control polygon: at least degree + 1 points, all [x, y] or all [x, y, z]; [w x, w y, w] or [w x, w y, w z, w] if they are `homogeneous`. A periodic curve needs at least 3 points, and they are not repeated.
             * @example [
             *       [
             *         0,
             *         0
             *       ],
             *       [
             *         1,
             *         2
             *       ],
             *       [
             *         3,
             *         2
             *       ],
             *       [
             *         4,
             *         0
             *       ],
             *       [
             *         6,
             *         1
             *       ]
             *     ]
             */
            control_points: number[][];
            /**
             * Degree
             * @description Degree, 1 to 64. The default is 3.
             * @default 3
             * @example 2
             */
            degree?: number;
            /**
             * Knots
             * @description Knots: a list of numbers, or a name. Numbers never decrease, and each occurs at most degree times inside the domain; at a knot that occurs degree times the curve has a corner. With `clamped`, the default, the curve reaches its first and last control points; with `uniform` it does not; with `periodic` it closes smoothly. The intervals of named knots have length 1, and the first begins at 0.
             * @default clamped
             * @example periodic
             * @example [
             *       0,
             *       0,
             *       0,
             *       0,
             *       0.5,
             *       1,
             *       1,
             *       1,
             *       1
             *     ]
             */
            knots?: ("uniform" | "clamped" | "periodic") | number[];
            /**
             * Weights
             * @description One weight for every control point: positive, or 0 for one that does not pull and is no end. Left out, the curve is polynomial.
             * @example [
             *       1,
             *       2,
             *       1,
             *       2,
             *       1
             *     ]
             */
            weights?: number[];
            /**
             * Up
             * @description The model's vertical axis. With `z`, the root node of a glTF file rotates the model, since y is up in glTF; the coordinates do not change.
             * @default y
             * @example z
             * @enum {string}
             */
            up?: "y" | "z";
            /**
             * Name
             * @description Name of the surface or curve. Its part, its node in glTF and a comment in OOGL have this name.
             * @default curve
             * @example sail
             */
            name?: string;
        };
        /**
         * BsplineDefinition
         * @description One tensor-product B-spline surface; with weights it is a NURBS surface.
         *
         *     S(u, v) = Σ N_i(u) N_j(v) w_ij P_ij / Σ N_i(u) N_j(v) w_ij over the domain of its knots. A net
         *     of r × c control points needs r + p + 1 knots along u and c + q + 1 along v. Each cell between
         *     neighbouring distinct knots along u and along v becomes one Bézier patch.
         */
        BsplineDefinition: {
            /**
             * Type
             * @description The kind of surface.
             * @constant
             */
            type: "bspline";
            /**
             * Homogeneous
             * @description Whether control points are homogeneous: [w x, w y, w z, w], with no `weights` beside them. A point with w = 0 is a direction. If a w is 0 or negative, but none at a corner, the degree is raised, to 64 at most, until all weights are positive; this does not change the surface. It is stored, answered and hashed as points and weights.
             * @default false
             * @example true
             */
            homogeneous?: boolean;
            /**
             * Control Net
             * @description Control points [x, y, z], or [x, y] in the plane z = 0, row by row; [w x, w y, w z, w] if they are `homogeneous`. Rows follow each other along u, points in a row along v; rows have equal lengths. At least degree + 1 points in each direction (3 in a periodic direction); every coordinate is finite and within single precision.
             * @example [
             *       [
             *         [
             *           0,
             *           0,
             *           0
             *         ],
             *         [
             *           0,
             *           1,
             *           1
             *         ],
             *         [
             *           0,
             *           2,
             *           1
             *         ],
             *         [
             *           0,
             *           3,
             *           0
             *         ]
             *       ],
             *       [
             *         [
             *           1,
             *           0,
             *           1
             *         ],
             *         [
             *           1,
             *           1,
             *           2
             *         ],
             *         [
             *           1,
             *           2,
             *           2
             *         ],
             *         [
             *           1,
             *           3,
             *           1
             *         ]
             *       ],
             *       [
             *         [
             *           2,
             *           0,
             *           1
             *         ],
             *         [
             *           2,
             *           1,
             *           0
             *         ],
             *         [
             *           2,
             *           2,
             *           0
             *         ],
             *         [
             *           2,
             *           3,
             *           1
             *         ]
             *       ],
             *       [
             *         [
             *           3,
             *           0,
             *           0
             *         ],
             *         [
             *           3,
             *           1,
             *           1
             *         ],
             *         [
             *           3,
             *           2,
             *           1
             *         ],
             *         [
             *           3,
             *           3,
             *           0
             *         ]
             *       ]
             *     ]
             */
            control_net: ([
                number,
                number,
                number
            ] | [
                number,
                number
            ] | [
                number,
                number,
                number,
                number
            ])[][];
            /**
             * Degree
             * @description Degree along u and along v, 1 to 64, or one number for both. The default is 3.
             * @default [
             *       3,
             *       3
             *     ]
             * @example [
             *       3,
             *       2
             *     ]
             */
            degree?: number | [
                number,
                number
            ];
            /**
             * Knots
             * @description Knots along u and along v, each a list of numbers or a name; or one name for both. Numbers never decrease, and each occurs at most degree + 1 times. At a knot that occurs degree times the surface has a crease, and at one that occurs degree + 1 times it is discontinuous. With `clamped`, the default, the surface reaches its first and last control points; with `uniform` it does not; with `periodic` it closes smoothly, and its control points are not repeated. The intervals of named knots have length 1, and the first begins at 0. Knots that differ by less than 9e-13 of the length of the domain are made equal, unless this would make more than degree knots equal (degree + 1 at an end of the domain). The first and the last knot have no effect and may both be left out.
             * @default [
             *       "clamped",
             *       "clamped"
             *     ]
             * @example [
             *       "clamped",
             *       [
             *         0,
             *         0,
             *         0,
             *         0.5,
             *         1,
             *         1,
             *         1
             *       ]
             *     ]
             */
            knots?: ("uniform" | "clamped" | "periodic") | [
                ("uniform" | "clamped" | "periodic") | number[],
                ("uniform" | "clamped" | "periodic") | number[]
            ];
            /**
             * Weights
             * @description One weight for every control point, in the same rows: positive, or 0 for a point that does not pull and is no corner. Left out, the surface is polynomial.
             * @example [
             *       [
             *         1,
             *         1,
             *         1,
             *         1
             *       ],
             *       [
             *         1,
             *         2,
             *         2,
             *         1
             *       ],
             *       [
             *         1,
             *         2,
             *         2,
             *         1
             *       ],
             *       [
             *         1,
             *         1,
             *         1,
             *         1
             *       ]
             *     ]
             */
            weights?: number[][];
            /**
             * Colors
             * @description Colours. sRGB, each number from 0 to 1: [r, g, b], or [r, g, b, a] with the opacity. Formats without colours omit them. glTF files contain linear RGB, as the specification of glTF requires. Rows follow each other along u, as in the control net. A net with as many rows and columns as the control net is a spline of the same degree and knots. Any other net is one Bézier net over the whole domain; its degree may differ from that of the surface, and degree 0 is one value.
             * @example [
             *       [
             *         [
             *           0.8,
             *           0.1,
             *           0.1
             *         ],
             *         [
             *           0.9,
             *           0.9,
             *           0.2
             *         ]
             *       ],
             *       [
             *         [
             *           0.1,
             *           0.2,
             *           0.8
             *         ],
             *         [
             *           0.2,
             *           0.8,
             *           0.3
             *         ]
             *       ]
             *     ]
             */
            colors?: number[][][];
            /**
             * Uvs
             * @description Texture coordinates [u, v], written without change. Vertices of the mesh then have texture coordinates also without the option `uvs`. Rows follow each other along u, as in the control net. A net with as many rows and columns as the control net is a spline of the same degree and knots. Any other net is one Bézier net over the whole domain; its degree may differ from that of the surface, and degree 0 is one value.
             * @example [
             *       [
             *         [
             *           0,
             *           0
             *         ],
             *         [
             *           0,
             *           2
             *         ]
             *       ],
             *       [
             *         [
             *           1,
             *           0
             *         ],
             *         [
             *           1,
             *           2
             *         ]
             *       ]
             *     ]
             */
            uvs?: [
                number,
                number
            ][][];
            /**
             * Attributes
             * @description Functions of the parameters, by name: a temperature, a fourth coordinate. Every value is a list of 1 to 16 numbers. JSON has attributes by name. glTF has them as `_NAME`, split into pieces of four if there are more than four numbers. PLY has them as properties, sorted by name. Rows follow each other along u, as in the control net. A net with as many rows and columns as the control net is a spline of the same degree and knots. Any other net is one Bézier net over the whole domain; its degree may differ from that of the surface, and degree 0 is one value.
             * @example {
             *       "temperature": [
             *         [
             *           [
             *             20
             *           ],
             *           [
             *             20
             *           ]
             *         ],
             *         [
             *           [
             *             35
             *           ],
             *           [
             *             60
             *           ]
             *         ]
             *       ]
             *     }
             */
            attributes?: {
                [key: string]: number[][][];
            };
            /**
             * Up
             * @description The model's vertical axis. With `z`, the root node of a glTF file rotates the model, since y is up in glTF; the coordinates do not change.
             * @default y
             * @example z
             * @enum {string}
             */
            up?: "y" | "z";
            /**
             * Name
             * @description Name of the surface or curve. Its part, its node in glTF and a comment in OOGL have this name.
             * @default surface
             * @example sail
             */
            name?: string;
        };
        /**
         * BsplineNet
         * @description One tensor-product B-spline surface: the surface of a face of a `brep`.
         *
         *     S(u, v) = Σ N_i(u) N_j(v) w_ij P_ij / Σ N_i(u) N_j(v) w_ij over the domain of its knots. A net
         *     of r × c control points needs r + p + 1 knots along u and c + q + 1 along v. Each cell between
         *     neighbouring distinct knots along u and along v becomes one Bézier patch.
         */
        BsplineNet: {
            /**
             * Type
             * @description The kind of surface.
             * @constant
             */
            type: "bspline";
            /**
             * Homogeneous
             * @description Whether control points are homogeneous: [w x, w y, w z, w], with no `weights` beside them. A point with w = 0 is a direction. If a w is 0 or negative, but none at a corner, the degree is raised, to 64 at most, until all weights are positive; this does not change the surface. It is stored, answered and hashed as points and weights.
             * @default false
             * @example true
             */
            homogeneous?: boolean;
            /**
             * Control Net
             * @description Control points [x, y, z], or [x, y] in the plane z = 0, row by row; [w x, w y, w z, w] if they are `homogeneous`. Rows follow each other along u, points in a row along v; rows have equal lengths. At least degree + 1 points in each direction (3 in a periodic direction); every coordinate is finite and within single precision.
             * @example [
             *       [
             *         [
             *           0,
             *           0,
             *           0
             *         ],
             *         [
             *           0,
             *           1,
             *           1
             *         ],
             *         [
             *           0,
             *           2,
             *           1
             *         ],
             *         [
             *           0,
             *           3,
             *           0
             *         ]
             *       ],
             *       [
             *         [
             *           1,
             *           0,
             *           1
             *         ],
             *         [
             *           1,
             *           1,
             *           2
             *         ],
             *         [
             *           1,
             *           2,
             *           2
             *         ],
             *         [
             *           1,
             *           3,
             *           1
             *         ]
             *       ],
             *       [
             *         [
             *           2,
             *           0,
             *           1
             *         ],
             *         [
             *           2,
             *           1,
             *           0
             *         ],
             *         [
             *           2,
             *           2,
             *           0
             *         ],
             *         [
             *           2,
             *           3,
             *           1
             *         ]
             *       ],
             *       [
             *         [
             *           3,
             *           0,
             *           0
             *         ],
             *         [
             *           3,
             *           1,
             *           1
             *         ],
             *         [
             *           3,
             *           2,
             *           1
             *         ],
             *         [
             *           3,
             *           3,
             *           0
             *         ]
             *       ]
             *     ]
             */
            control_net: ([
                number,
                number,
                number
            ] | [
                number,
                number
            ] | [
                number,
                number,
                number,
                number
            ])[][];
            /**
             * Degree
             * @description Degree along u and along v, 1 to 64, or one number for both. The default is 3.
             * @default [
             *       3,
             *       3
             *     ]
             * @example [
             *       3,
             *       2
             *     ]
             */
            degree?: number | [
                number,
                number
            ];
            /**
             * Knots
             * @description Knots along u and along v, each a list of numbers or a name; or one name for both. Numbers never decrease, and each occurs at most degree + 1 times. At a knot that occurs degree times the surface has a crease, and at one that occurs degree + 1 times it is discontinuous. With `clamped`, the default, the surface reaches its first and last control points; with `uniform` it does not; with `periodic` it closes smoothly, and its control points are not repeated. The intervals of named knots have length 1, and the first begins at 0. Knots that differ by less than 9e-13 of the length of the domain are made equal, unless this would make more than degree knots equal (degree + 1 at an end of the domain). The first and the last knot have no effect and may both be left out.
             * @default [
             *       "clamped",
             *       "clamped"
             *     ]
             * @example [
             *       "clamped",
             *       [
             *         0,
             *         0,
             *         0,
             *         0.5,
             *         1,
             *         1,
             *         1
             *       ]
             *     ]
             */
            knots?: ("uniform" | "clamped" | "periodic") | [
                ("uniform" | "clamped" | "periodic") | number[],
                ("uniform" | "clamped" | "periodic") | number[]
            ];
            /**
             * Weights
             * @description One weight for every control point, in the same rows: positive, or 0 for a point that does not pull and is no corner. Left out, the surface is polynomial.
             * @example [
             *       [
             *         1,
             *         1,
             *         1,
             *         1
             *       ],
             *       [
             *         1,
             *         2,
             *         2,
             *         1
             *       ],
             *       [
             *         1,
             *         2,
             *         2,
             *         1
             *       ],
             *       [
             *         1,
             *         1,
             *         1,
             *         1
             *       ]
             *     ]
             */
            weights?: number[][];
        };
        /**
         * CameraDefinition
         * @description A perspective camera: its position, and how large an error appears in its picture.
         *
         *     The direction of the camera is not needed, because the mesh must be near enough for every
         *     direction.
         */
        CameraDefinition: {
            /**
             * Position
             * @description The position of the camera, in model coordinates.
             * @example [
             *       4,
             *       3,
             *       9
             *     ]
             */
            position: [
                number,
                number,
                number
            ];
            /**
             * Field Of View
             * @description Vertical field of view: the angle, in radians, between the upper and the lower border of the picture.
             * @example 0.8
             */
            field_of_view: number;
            /**
             * Height
             * @description Height of the picture in pixels.
             * @example 1080
             */
            height: number;
        };
        /**
         * CheckRequest
         * @description A surface, and a mesh that is compared with it.
         */
        CheckRequest: {
            /**
             * Quad Diagonal
             * @description How a face of four corners 0, 1, 2, 3 becomes two triangles: by the diagonal between the corners 0 and 2, or 1 and 3.
             * @default 02
             * @example 13
             * @enum {string}
             */
            quad_diagonal?: "02" | "13";
            /**
             * Relative Tolerance
             * @description The largest width of each of the two intervals, as a share of its `high`. Where that takes more work than one request may take, the interval is wider, and `reached` is false.
             * @default 0.1
             * @example 0.02
             */
            relative_tolerance?: number;
            /**
             * Distances
             * @description Whether the response has the mesh as it was read, and the distances of its vertices and of the middles of its triangles from the surface, as colours need them.
             * @default false
             * @example true
             */
            distances?: boolean;
            /** @description The surface, by its control points. */
            surface: components["schemas"]["SurfaceDefinition"];
            /**
             * Reading
             * @description The report of reading a file, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "faces": 300,
             *       "format": "step",
             *       "skipped_faces": []
             *     }
             */
            reading?: Record<string, never>;
            /**
             * Orientation
             * @description The report of the operation `orient`, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "not_orientable": [],
             *       "turned": [
             *         2
             *       ]
             *     }
             */
            orientation?: Record<string, never>;
            /**
             * Mesh
             * @description The mesh, in the coordinates of the surface: its vertices and faces, or a file. Who made it, and how, does not matter.
             */
            mesh: components["schemas"]["MeshDefinition"] | components["schemas"]["MeshFile"];
        };
        /**
         * CheckedMesh
         * @description A mesh as it was read, in the coordinates of the surface.
         */
        CheckedMesh: {
            /**
             * Vertices
             * @description Positions [x, y, z].
             */
            vertices: [
                number,
                number,
                number
            ][];
            /**
             * Faces
             * @description For each triangle the numbers of its vertices, from 0.
             */
            faces: [
                number,
                number,
                number
            ][];
        };
        /**
         * ClosestPoints
         * @description Closest points in columns, float64: row k belongs to point k of the request.
         */
        ClosestPoints: {
            /**
             * Positions
             * @description The closest points.
             */
            positions: number[][];
            /**
             * Distances
             * @description Distances from the points of the request.
             */
            distances: number[];
            /**
             * Distance Bounds
             * @description Intervals [low, high] that contain the exact least distance to the surface or curve. Proved,
             *     rounding included.
             */
            distance_bounds: [
                number,
                number
            ][];
            /**
             * Reached
             * @description Whether the interval of distance meets `relative_tolerance`. The interval is wider if too
             *     many places are almost equally near, as for the centre of a sphere.
             */
            reached: boolean[];
            /**
             * Tied
             * @description Whether another place may be as near as this place, or further by at most 1/16 of
             *     `relative_tolerance`; if `reached` is false, the search could not rule out all such places.
             *     Places nearer to this place than about 1/1000 of the bounding box's diagonal do not count.
             */
            tied: boolean[];
            /**
             * Patch
             * @description For a surface: the index of the patch, or of the face of a brep, in the order of the request;
             *     where several patches meet, the first of them. In a group, the Bézier patches and faces of each
             *     member follow those of the member before. Left out for a surface with one domain.
             */
            patch?: number[];
            /**
             * Uv
             * @description For a surface: parameters (u, v), in the domain of the surface if it has one, else in the
             *     domain of the patch; for triangles the last two barycentric coordinates, (s, t). For a brep:
             *     parameters of the surface of the face.
             */
            uv?: [
                number,
                number
            ][];
            /**
             * Normals
             * @description For a surface: unit normals in the direction of du × dv, or their limits at poles; on a face
             *     of a brep that is `reversed`, in the opposite direction.
             */
            normals?: [
                number,
                number,
                number
            ][];
            /**
             * On Boundary
             * @description For a surface: whether the closest point is on an edge of only one patch or face.
             */
            on_boundary?: boolean[];
            /**
             * Near Edge
             * @description For a brep, or a group with one: whether the closest point is on an edge of a face, or nearer
             *     to one than the proved gap between this edge and the surface of the face.
             */
            near_edge?: boolean[];
            /**
             * Signs
             * @description For a surface, with `sign`; proved: -1 inside, 1 outside, so that sign times distance is the
             *     signed distance. A point is inside if the winding number of the surface about the point is not
             *     0; the direction of the normals does not matter. Null if the sign is unknown: on the surface or
             *     very close to it; after the limit of work, which some 10,000 points close to the surface may
             *     reach; and for all points if the surface is open or inconsistently oriented. Breps are closed if
             *     all their shells are, and no face is left out. A point is then inside if it is in a solid and
             *     not in a void; outside only if all members of a group are closed. Null nearer to an edge than
             *     its gap.
             */
            signs?: (number | null)[];
            /**
             * Parameters
             * @description For a curve: parameters in its domain.
             */
            parameters?: number[];
            /**
             * Tangents
             * @description For a curve: unit tangents.
             */
            tangents?: number[][];
            /**
             * Skipped Faces
             * @description For a brep with `"invalid_faces": "skip"`: invalid faces that took no part; left out if there
             *     are none.
             */
            skipped_faces?: components["schemas"]["LeftOutFace"][];
        };
        /**
         * CollapsedEdges
         * @description Edges of a brep that became one vertex.
         */
        CollapsedEdges: {
            /**
             * Count
             * @description Their number.
             */
            count: number;
            /**
             * Longest Chain
             * @description The greatest length of connected edges that became one vertex, in model units.
             */
            longest_chain: number;
        };
        /**
         * ConvertRequest
         * @description A surface, and the operations to apply to it, one after the other.
         *
         *     Without operations, the response has the surface itself: it is the way to look at what a file
         *     contains.
         */
        ConvertRequest: {
            /** @description The surface, by its control points. */
            surface: components["schemas"]["SurfaceDefinition"];
            /**
             * Reading
             * @description The report of reading a file, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "faces": 300,
             *       "format": "step",
             *       "skipped_faces": []
             *     }
             */
            reading?: Record<string, never>;
            /**
             * Orientation
             * @description The report of the operation `orient`, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "not_orientable": [],
             *       "turned": [
             *         2
             *       ]
             *     }
             */
            orientation?: Record<string, never>;
            /**
             * Operations
             * @description The operations; each is applied to the result of the one before. Left out, the surface stays as it is.
             * @example [
             *       {
             *         "degree": [
             *           3,
             *           3
             *         ],
             *         "op": "elevate"
             *       },
             *       {
             *         "op": "split",
             *         "u": 0.5
             *       }
             *     ]
             */
            operations?: components["schemas"]["OperationDefinition"][];
        };
        /**
         * CurvatureRange
         * @description Least and greatest curvature at the vertices.
         */
        CurvatureRange: {
            /**
             * Gaussian
             * @description Per square of the model unit.
             */
            gaussian: [
                number,
                number
            ];
            /**
             * Mean
             * @description Per model unit.
             */
            mean: [
                number,
                number
            ];
        };
        /**
         * Curve
         * @description A sampled curve as JSON: columns of float64; row k of each column belongs to point k.
         */
        Curve: {
            /**
             * Points
             * @description Points with as many coordinates as the control points have.
             */
            points: number[][];
            /**
             * Tangents
             * @description Unit tangents; left out if `tangents` is false. At a corner or a cusp, the tangent where the
             *     next piece begins.
             */
            tangents?: number[][];
            /**
             * Parameters
             * @description Parameters in the domain of the curve.
             */
            parameters: number[];
            /**
             * Arc Lengths
             * @description Length of the curve up to each point; left out if `arc_lengths` is false.
             */
            arc_lengths?: number[];
            /**
             * Dt
             * @description First derivatives, by the parameter of the curve; at a knot from the right.
             */
            dt?: (number | null)[][];
            /**
             * Degenerate
             * @description Whether the first derivative vanishes, as at a cusp: tangents, curvatures and torsions there
             *     are limits from the right, at the end of the curve from the left.
             */
            degenerate?: boolean[];
            /**
             * Dtt
             * @description Second derivatives.
             */
            dtt?: (number | null)[][];
            /**
             * Curvature
             * @description Curvatures, 1/r on a circle of radius r; of a curve in the plane positive where it turns
             *     left. Null where they are infinite, as at most cusps, and where the curve is one point.
             */
            curvature?: (number | null)[];
            /**
             * Dttt
             * @description Third derivatives.
             */
            dttt?: (number | null)[][];
            /**
             * Torsion
             * @description Torsions of a curve in space, positive where it twists like a right-handed screw; null where
             *     they are infinite, and where the curve is straight.
             */
            torsion?: (number | null)[];
            report: components["schemas"]["CurveReport"];
        };
        /**
         * CurveBounds
         * @description Bounding box of the stored points.
         */
        CurveBounds: {
            /**
             * Min
             * @description Least x, y and, in space, z.
             */
            min: number[];
            /**
             * Max
             * @description Greatest x, y and, in space, z.
             */
            max: number[];
        };
        /** @description A curve: its `type` names the kind; the default is `bezier`. */
        CurveDefinition: components["schemas"]["BezierCurveDefinition"] | components["schemas"]["BsplineCurveDefinition"];
        /**
         * CurveReport
         * @description Facts about a curve.
         */
        CurveReport: {
            /**
             * Points
             * @description Number of points.
             */
            points: number;
            /**
             * Pieces
             * @description Number of Bézier pieces.
             */
            pieces: number;
            /**
             * Length
             * @description Length of the curve itself, to about 12 digits.
             */
            length: number;
            /**
             * Closed
             * @description Whether the curve ends where it begins; its last point is then equal to the first.
             */
            closed: boolean;
            /**
             * Deviation Bound
             * @description Proved, in model units: no point of the curve is further than this from the lines. The lines
             *     join the points as they are in the file, after rounding. Left out with `parameters`.
             */
            deviation_bound?: number;
            bounds: components["schemas"]["CurveBounds"];
            /**
             * Engine
             * @description Version of the engine: equal requests give equal numbers while it is the same.
             */
            engine: number;
        };
        /**
         * CurveRequest
         * @description A curve, and the options with which it is sampled.
         */
        CurveRequest: {
            /**
             * Resolution
             * @description Divisions of every piece of the curve. A Bézier curve is one piece; a B-spline has one piece for every knot span.
             * @default 16
             * @example 16
             */
            resolution?: number;
            /**
             * Tolerance
             * @description In place of a resolution: the largest distance, in model units, of the curve from the straight lines between its points. Pieces are halved until this is proved.
             * @example 0.001
             */
            tolerance?: number;
            /**
             * Parameters
             * @description In place of a resolution or a tolerance: the parameters of the points, in any order, in the domain of the curve; for a Bézier curve from 0 to 1. A knot belongs to the span that begins at it, and the end of the domain belongs to the last span. Only for JSON.
             * @example [
             *       0,
             *       0.5,
             *       1
             *     ]
             */
            parameters?: number[];
            /**
             * Derivatives
             * @description Order of the derivatives that points carry. 1 adds `dt` and `degenerate`; 2 adds `dtt` and `curvature`; 3 adds `dttt` and, for curves in space, `torsion`. Only for JSON.
             * @default 0
             * @example 2
             */
            derivatives?: number;
            /**
             * Tangents
             * @description Whether points carry unit tangents.
             * @default true
             */
            tangents?: boolean;
            /**
             * Arc Lengths
             * @description Whether each point carries the length of the curve from its beginning to the point.
             * @default true
             */
            arc_lengths?: boolean;
            /** @description The curve, by its control points. */
            curve: components["schemas"]["CurveDefinition"];
        };
        /**
         * Deviation
         * @description An interval that contains the largest distance from one shape to the other, and a place.
         *
         *     `low` and `high` are proved, rounding included, in the units of the control points.
         */
        Deviation: {
            /**
             * Low
             * @description The largest distance is at least this.
             */
            low: number;
            /**
             * High
             * @description No point is further away than this.
             */
            high: number;
            /**
             * Point
             * @description A point [x, y, z] of the one shape that is nearly so far from the other: for
             *     `surface_to_mesh` of the surface, for `mesh_to_surface` of the mesh.
             */
            point: [
                number,
                number,
                number
            ];
            /**
             * Patch
             * @description The patch of the surface, or the face of a brep, on which `point` is, or to which it is
             *     nearest; in the order of the request. In a group, the Bézier patches and faces of each member
             *     follow those of the member before. Left out for a surface with one domain.
             */
            patch?: number;
            /**
             * Uv
             * @description The parameters (u, v) of that place, in the domain of the surface if it has one, else in the
             *     domain of the patch; for triangles the last two barycentric coordinates, (s, t). Left out for
             *     ribbons, and tubes that are not exact, which have no parameters.
             */
            uv?: [
                number,
                number
            ];
            /**
             * Triangle
             * @description A triangle of the mesh, counted from 0 after faces of four corners were divided: for
             *     `surface_to_mesh` the one that is nearest to `point`, for `mesh_to_surface` the one that `point`
             *     is on.
             */
            triangle: number;
        };
        /**
         * EdgeDefinition
         * @description An edge: a curve of space between two vertices.
         *
         *     An edge without a `curve` is a straight line between its vertices.
         */
        EdgeDefinition: {
            /**
             * Vertices
             * @description The numbers, from 0, of the vertices at which the curve begins and ends. A closed curve begins and ends at one vertex, whose number is there twice. A `degenerate` edge has one vertex.
             * @example [
             *       0,
             *       1
             *     ]
             * @example [
             *       4,
             *       4
             *     ]
             */
            vertices: number[];
            /**
             * @description The curve, with control points [x, y, z]. Its `up` and `name` have no effect.
             * @example {
             *       "control_points": [
             *         [
             *           0,
             *           0,
             *           0
             *         ],
             *         [
             *           1,
             *           2,
             *           0
             *         ],
             *         [
             *           3,
             *           2,
             *           1
             *         ]
             *       ]
             *     }
             */
            curve?: components["schemas"]["CurveDefinition"];
            /**
             * Uncertainty
             * @description How far the curve may be from the true edge, in model units; an edge that is no longer than this may become a point. The default is the uncertainty of the brep.
             * @example 0.000001
             */
            uncertainty?: number;
            /**
             * Degenerate
             * @description Whether the edge is a point: a side of a surface that is collapsed, as at the pole of a sphere. Such an edge has one vertex and no curve.
             * @default false
             */
            degenerate?: boolean;
        };
        /**
         * EdgePlace
         * @description A side of a patch; or an edge, as a face of a brep uses it.
         */
        EdgePlace: {
            /**
             * Surface
             * @description The index of the group's member. Only for sides of patches in groups.
             */
            surface?: number;
            /**
             * Patch
             * @description The index of the patch, or in a `multipatch` the index of the surface, in the order of the
             *     request; left out for a surface with one domain. With `edge` it is the index of the face, and in
             *     groups the faces and patches of all members are counted one after the other.
             */
            patch?: number;
            /**
             * Side
             * @description The side: u or v for rectangular patches, s, r or t for triangles.
             * @enum {string}
             */
            side?: "u=0" | "u=1" | "v=0" | "v=1" | "s=0" | "r=0" | "t=0";
            /**
             * Uv
             * @description Parameters at both ends of a side: (u, v) in the domain of the surface if it has one, else in
             *     the domain of the patch; (s, t) for triangles.
             */
            uv?: [
                [
                    number,
                    number
                ],
                [
                    number,
                    number
                ]
            ];
            /**
             * Edge
             * @description The index of an edge in `edge_lengths`. Left out for borders that are given by parameter
             *     curves alone.
             */
            edge?: number;
        };
        /**
         * ElevateDefinition
         * @description Raises the degree without changing the points of the surface. Degrees cannot be lowered.
         *
         *     For formats that require p = q, raise a patch to [n, n]. A B-spline keeps its continuity,
         *     because the multiplicity of each knot increases as much as the degree; the result is clamped.
         */
        ElevateDefinition: {
            /**
             * Op
             * @description The operation.
             * @constant
             */
            op: "elevate";
            /**
             * Degree
             * @description The new degree, [p, q] or one number for both; of triangles one number.
             * @example [
             *       3,
             *       3
             *     ]
             * @example 4
             */
            degree: number | [
                number,
                number
            ];
            /**
             * Patch
             * @description For `patches`, `multipatch` and `group`: the number of the patch that is changed, from 0, as POST /v1/points counts it. Its surface or member keeps its place, its name and its placement; a B-spline in a group is changed as a whole. By default all are changed.
             * @example 0
             */
            patch?: number;
        };
        /**
         * Estimate
         * @description The size of a mesh before it is computed.
         */
        Estimate: {
            /**
             * Vertices
             * @description Number of positions, as in the report: a position with several normals counts once.
             */
            vertices: number;
            /**
             * Triangles
             * @description Number of triangles.
             */
            triangles: number;
            /**
             * Quads
             * @description Number of quads.
             */
            quads: number;
            /**
             * Exact
             * @description Whether these three numbers will be exactly those of the report. If not, they are upper
             *     bounds: for a tolerance (usually 10 times the numbers of the report) or a budget, for tubes and
             *     ribbons, for wires with faces, and for a mesh with too many vertices.
             */
            exact: boolean;
            /**
             * Bytes
             * @description Bytes of the response in every format that can store the mesh: upper bounds, except for
             *     `exact_bytes`. Numbers in text count with their largest length.
             */
            bytes: {
                /** @description Bytes as glb. */
                glb?: number;
                /** @description Bytes as gltf. */
                gltf?: number;
                /** @description Bytes as json. */
                json?: number;
                /** @description Bytes as oogl. */
                oogl?: number;
                /** @description Bytes as stl. */
                stl?: number;
                /** @description Bytes as obj. */
                obj?: number;
                /** @description Bytes as ply. */
                ply?: number;
                /** @description Bytes as off. */
                off?: number;
                /** @description Bytes as 3mf. */
                "3mf"?: number;
                /** @description Bytes as npz. */
                npz?: number;
            };
            /**
             * Exact Bytes
             * @description The formats whose number of bytes is exact.
             */
            exact_bytes: ("glb" | "gltf" | "json" | "oogl" | "stl" | "obj" | "ply" | "off" | "3mf" | "npz")[];
            /**
             * Memory
             * @description The most memory that the work takes, in bytes, by format. The service refuses a request that
             *     needs more memory than one request may take (`too_much_memory`); a large request may have to
             *     wait.
             */
            memory: {
                /** @description Bytes of memory for the mesh as glb. */
                glb?: number;
                /** @description Bytes of memory for the mesh as gltf. */
                gltf?: number;
                /** @description Bytes of memory for the mesh as json. */
                json?: number;
                /** @description Bytes of memory for the mesh as oogl. */
                oogl?: number;
                /** @description Bytes of memory for the mesh as stl. */
                stl?: number;
                /** @description Bytes of memory for the mesh as obj. */
                obj?: number;
                /** @description Bytes of memory for the mesh as ply. */
                ply?: number;
                /** @description Bytes of memory for the mesh as off. */
                off?: number;
                /** @description Bytes of memory for the mesh as 3mf. */
                "3mf"?: number;
                /** @description Bytes of memory for the mesh as npz. */
                npz?: number;
            };
            /**
             * Accepted
             * @description Whether `POST /v1/mesh` would return a mesh for this body in one of the formats.
             */
            accepted: boolean;
            /**
             * Certain
             * @description Whether `POST /v1/mesh` is certain to do what `accepted` says. With a tolerance it is certain
             *     if the bounds above are within all limits. If they are not, or with a budget, the computation
             *     may show that the mesh is too large, or the tolerance too small.
             */
            certain: boolean;
            /**
             * Refused
             * @description The reasons for refusals, by format.
             */
            refused: components["schemas"]["Refusal"][];
        };
        /**
         * FaceDefinition
         * @description A face: the part of a surface that is inside its loops.
         *
         *     A face without loops is its whole surface, with its natural borders. Where the surface is
         *     closed, or collapses to a point, the face is closed there.
         */
        FaceDefinition: {
            /**
             * Name
             * @description Name of the face.
             * @example top
             */
            name?: string;
            /**
             * Color
             * @description Colour of the face: red, green, blue and, as an optional fourth number, opacity; sRGB, each from 0 to 1. The colour of a member of a group applies to faces without one.
             * @example [
             *       0.8,
             *       0.2,
             *       0.1
             *     ]
             */
            color?: number[];
            /**
             * Reversed
             * @description Whether the normal of the face is −(du × dv).
             * @default false
             */
            reversed?: boolean;
            /**
             * Surface
             * @description The surface, which may be larger than the face. It is continuous: inside its domain no knot occurs more than degree times.
             * @example {
             *       "control_net": [
             *         [
             *           [
             *             0,
             *             0,
             *             0
             *           ],
             *           [
             *             0,
             *             10,
             *             0
             *           ]
             *         ],
             *         [
             *           [
             *             10,
             *             0,
             *             0
             *           ],
             *           [
             *             10,
             *             10,
             *             0
             *           ]
             *         ]
             *       ]
             *     }
             */
            surface: components["schemas"]["BezierNet"] | components["schemas"]["BsplineNet"];
            /**
             * Loops
             * @description The loops, in any order: material is on the left of each of them.
             * @default []
             * @example [
             *       {
             *         "edges": [
             *           0,
             *           1,
             *           2,
             *           3
             *         ]
             *       },
             *       {
             *         "edges": [
             *           4
             *         ],
             *         "reversed": [
             *           true
             *         ]
             *       }
             *     ]
             */
            loops?: components["schemas"]["LoopDefinition"][];
        };
        /**
         * FaultyEdge
         * @description A side that is a reason why the surface encloses no volume.
         */
        FaultyEdge: {
            /**
             * Surface
             * @description The index of the group's member. Only for sides of patches in groups.
             */
            surface?: number;
            /**
             * Patch
             * @description The index of the patch, or in a `multipatch` the index of the surface, in the order of the
             *     request; left out for a surface with one domain. With `edge` it is the index of the face, and in
             *     groups the faces and patches of all members are counted one after the other.
             */
            patch?: number;
            /**
             * Side
             * @description The side: u or v for rectangular patches, s, r or t for triangles.
             * @enum {string}
             */
            side?: "u=0" | "u=1" | "v=0" | "v=1" | "s=0" | "r=0" | "t=0";
            /**
             * Uv
             * @description Parameters at both ends of a side: (u, v) in the domain of the surface if it has one, else in
             *     the domain of the patch; (s, t) for triangles.
             */
            uv?: [
                [
                    number,
                    number
                ],
                [
                    number,
                    number
                ]
            ];
            /**
             * Edge
             * @description The index of an edge in `edge_lengths`. Left out for borders that are given by parameter
             *     curves alone.
             */
            edge?: number;
            /**
             * Open
             * @description True if no other side shares the edge. False if the sides on the edge are not pairs of
             *     opposite directions: a patch has the wrong orientation, or more than two patches meet.
             */
            open: boolean;
        };
        /**
         * Format
         * @description A format of meshes.
         */
        Format: {
            /**
             * Name
             * @description Name for `?format=`.
             */
            name: string;
            /**
             * Title
             * @description A short title of the format.
             */
            title: string;
            /**
             * Media Type
             * @description Media type for `Accept`.
             */
            media_type: string;
            /**
             * Suffix
             * @description Suffix of files and of mesh URLs.
             */
            suffix: string;
            /**
             * Quads
             * @description Whether it can store quads.
             */
            quads: boolean;
            /**
             * Overlays
             * @description Whether it can store lines.
             */
            overlays: boolean;
            /**
             * Uvs
             * @description Whether it can store texture coordinates.
             */
            uvs: boolean;
            /**
             * Colors
             * @description Whether it can store colours of vertices.
             */
            colors: boolean;
            /**
             * Attributes
             * @description Whether it can store attributes.
             */
            attributes: boolean;
            /**
             * Precision
             * @description Precision of positions.
             * @enum {string}
             */
            precision: "float32" | "float64";
            /**
             * Quantize
             * @description Whether it supports `quantize`.
             */
            quantize: boolean;
            /**
             * Compression
             * @description The kinds of `compression` that this service supports for it, beside `none`.
             */
            compression: "meshopt"[];
        };
        /**
         * FormatList
         * @description The formats of meshes.
         */
        FormatList: {
            /**
             * Formats
             * @description The formats, one entry each.
             */
            formats: components["schemas"]["Format"][];
        };
        /**
         * GroupDefinition
         * @description Several surfaces in one model, each with a name, a base colour and a placement.
         *
         *     In glTF every member is a named node, below that of its `parent`, and equal surfaces share one
         *     mesh. In other formats the group is one mesh, and its parts have the names of the members. If
         *     the `up` of a surface differs from that of the group, the surface is rotated by a quarter turn
         *     about x before it is placed; members below it are not.
         */
        GroupDefinition: {
            /**
             * Type
             * @description The kind of surface.
             * @constant
             */
            type: "group";
            /**
             * Definitions
             * @description Surfaces that members name by their numbers, from 0. If the group has a `parent`, a member without a surface, or a `brep`, a surface counts once in the limits of the document, however often it is placed; otherwise it counts for each member.
             * @default []
             * @example [
             *       {
             *         "control_net": [
             *           [
             *             [
             *               0,
             *               0,
             *               0
             *             ],
             *             [
             *               0,
             *               1,
             *               0
             *             ]
             *           ],
             *           [
             *             [
             *               1,
             *               0,
             *               0
             *             ],
             *             [
             *               1,
             *               1,
             *               1
             *             ]
             *           ]
             *         ]
             *       }
             *     ]
             */
            definitions?: components["schemas"]["MemberSurfaceDefinition"][];
            /**
             * Members
             * @description The members. The limit of control points is for all of them together.
             * @example [
             *       {
             *         "color": [
             *           0.9,
             *           0.8,
             *           0.6
             *         ],
             *         "name": "sail",
             *         "surface": {
             *           "control_net": [
             *             [
             *               [
             *                 0,
             *                 0,
             *                 0
             *               ],
             *               [
             *                 0,
             *                 1,
             *                 0
             *               ]
             *             ],
             *             [
             *               [
             *                 1,
             *                 0,
             *                 0
             *               ],
             *               [
             *                 1,
             *                 1,
             *                 1
             *               ]
             *             ]
             *           ]
             *         }
             *       }
             *     ]
             */
            members: components["schemas"]["MemberDefinition"][];
            /**
             * Metres Per Unit
             * @description The unit of the coordinates in metres: 0.001 for millimetres. It is the scale of the root node of a glTF file, which is in metres, and reports of meshes repeat it. Tolerances, reports and other formats stay in the unit of the coordinates. That of a member of a group has no effect.
             * @example 0.001
             */
            metres_per_unit?: number;
            /**
             * Up
             * @description The model's vertical axis. With `z`, the root node of a glTF file rotates the model, since y is up in glTF; the coordinates do not change.
             * @default y
             * @example z
             * @enum {string}
             */
            up?: "y" | "z";
            /**
             * Name
             * @description Name of the group, and of the root node of a glTF file.
             * @default group
             * @example tea service
             */
            name?: string;
        };
        /**
         * Health
         * @description The health of the service.
         */
        Health: {
            /**
             * Status
             * @description State of the service.
             * @enum {string}
             */
            status: "live" | "ready" | "unready" | "draining";
            /**
             * Computing
             * @description Whether the self-test computed the right mesh.
             * @enum {string}
             */
            computing?: "ready" | "unavailable";
            /**
             * Store
             * @description Whether stored surfaces can be read.
             * @enum {string}
             */
            store?: "ready" | "unavailable";
            /**
             * Writes
             * @description Whether surfaces can be stored, by the last write or by a test of writing each minute. If
             *     not, the service still serves stored surfaces, and is ready.
             * @enum {string}
             */
            writes?: "ready" | "read_only" | "full" | "unavailable";
            /**
             * Version
             * @description Version of the service.
             */
            version?: string;
            /**
             * Engine
             * @description Version of the numbers. It changes when the service computes other numbers for the same
             *     request.
             */
            engine?: number;
        };
        /**
         * InsertDefinition
         * @description Inserts a knot into a B-spline: one more row or column of control points, the same points.
         *
         *     At a knot that is there already, its multiplicity increases, up to the degree. The direction
         *     becomes clamped. For several knots, repeat the operation.
         */
        InsertDefinition: {
            /**
             * Op
             * @description The operation.
             * @constant
             */
            op: "insert";
            /**
             * U
             * @description The new knot along u: inside the surface's domain. It adds a row of control points.
             * @example 0.5
             */
            u?: number;
            /**
             * V
             * @description The new knot along v: inside the surface's domain. It adds a column of control points.
             * @example 0.25
             */
            v?: number;
            /**
             * Patch
             * @description For `patches`, `multipatch` and `group`: the number of the patch that is changed, from 0, as POST /v1/points counts it. Its surface or member keeps its place, its name and its placement; a B-spline in a group is changed as a whole. Needed if there are several.
             * @example 0
             */
            patch?: number;
        };
        /**
         * IntersectRequest
         * @description A surface, and rays that hit it or planes that cut it.
         */
        IntersectRequest: {
            /** @description The surface, by its control points. */
            surface: components["schemas"]["SurfaceDefinition"];
            /**
             * Reading
             * @description The report of reading a file, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "faces": 300,
             *       "format": "step",
             *       "skipped_faces": []
             *     }
             */
            reading?: Record<string, never>;
            /**
             * Orientation
             * @description The report of the operation `orient`, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "not_orientable": [],
             *       "turned": [
             *         2
             *       ]
             *     }
             */
            orientation?: Record<string, never>;
            /** @description The rays that may hit the surface. */
            rays?: components["schemas"]["Rays"];
            /** @description The planes that may cut the surface, in place of rays. */
            planes?: components["schemas"]["PlaneSet"];
            /**
             * Hits
             * @description Which hits of a ray are returned: the first, or all.
             * @default first
             * @enum {string}
             */
            hits?: "first" | "all";
            /**
             * Relative Thickness
             * @description At borders, and where a ray only touches the surface, a ray within this distance counts as a hit. A share of the diagonal of the bounding box of the control points.
             * @default 1e-9
             * @example 0.000001
             */
            relative_thickness?: number;
            /**
             * Tolerance
             * @description For planes: the largest distance, in model units, of a section from its polyline.
             * @example 0.001
             */
            tolerance?: number;
            /**
             * Relative Tolerance
             * @description The tolerance as a share of the diagonal of the bounding box of the control points, in place of `tolerance`.
             * @default 0.001
             * @example 0.0001
             */
            relative_tolerance?: number;
        };
        /**
         * Intersections
         * @description Hits of rays, or sections by planes.
         */
        Intersections: components["schemas"]["RayHits"] | components["schemas"]["Sections"];
        /**
         * Interval
         * @description An approximate number, and an interval that certainly contains the exact value.
         */
        Interval: {
            /**
             * Value
             * @description An approximation, near the middle of the interval.
             */
            value: number;
            /**
             * Low
             * @description The exact value is not less than this.
             */
            low: number;
            /**
             * High
             * @description The exact value is not greater than this.
             */
            high: number;
        };
        /**
         * Issue
         * @description One error, and where it is: a pointer, a parameter or a header.
         */
        Issue: {
            /**
             * Code
             * @description Stable code of the error, for programs; the description of this document lists them. Later
             *     versions may add codes.
             * @example ragged
             */
            code: string;
            /**
             * Pointer
             * @description JSON pointer (RFC 6901) into the body; empty for the whole body.
             */
            pointer?: string;
            /**
             * Parameter
             * @description Name of the path or query parameter, instead of a pointer.
             */
            parameter?: string;
            /**
             * Header
             * @description Name of the header, instead of a pointer.
             */
            header?: string;
            /**
             * Detail
             * @description Text of the error, for people.
             */
            detail: string;
            /**
             * Got
             * @description A description of the input, which does not repeat it.
             */
            got?: string;
            /**
             * Needed
             * @description A description of valid input.
             */
            needed?: string;
        };
        /**
         * Job
         * @description The state of a job.
         */
        Job: {
            /**
             * Id
             * @description The hash of the ids of its parts: the same parts are the same job.
             */
            id: string;
            /**
             * State
             * @description `succeeded`: all parts did. `failed`: all have ended, and at least one failed. `cancelled`:
             *     no caller waits for it.
             * @enum {string}
             */
            state: "queued" | "running" | "succeeded" | "failed" | "cancelled";
            /**
             * Engine
             * @description Version of the numbers with which it is computed.
             */
            engine: number;
            parts: components["schemas"]["PartCounts"];
            /**
             * Created
             * Format: date-time
             * @description When it was accepted first.
             * @example 2026-11-29T14:40:20.125Z
             */
            created: string;
            /**
             * Started
             * @description When its first part began; null before.
             */
            started: string | null;
            /**
             * Ended
             * @description When its last part ended; null before.
             */
            ended: string | null;
            /**
             * Expires
             * Format: date-time
             * @description When its results are deleted, or while it runs the earliest time of that.
             * @example 2026-11-29T14:40:20.125Z
             */
            expires: string;
            /**
             * Rate
             * @description Parts a second lately; 0 if none has ended lately.
             */
            rate: number;
            /**
             * Seconds Left
             * @description The remaining parts divided by `rate`; null if the rate is 0.
             */
            seconds_left: number | null;
            /**
             * Waiting For
             * @description Only while the job waits for more than its turn: the code of what it waits for, such as
             *     `disk_full`. It goes on by itself.
             */
            waiting_for?: string;
            links: components["schemas"]["JobLinks"];
        };
        /**
         * JobFile
         * @description A file for parts of jobs.
         */
        JobFile: {
            /**
             * Id
             * @description For the `file` of parts: the hash of its bytes, and the name of its format.
             */
            id: string;
            /**
             * Bytes
             * @description Its bytes.
             */
            bytes: number;
        };
        /**
         * JobLinks
         * @description URLs of a job, without the host.
         */
        JobLinks: {
            /**
             * Self
             * @description The state.
             */
            self: string;
            /**
             * Events
             * @description The state as a stream of events, until the job has ended.
             */
            events: string;
            /**
             * Results
             * @description The list of the results.
             */
            results: string;
        };
        /**
         * JobList
         * @description Jobs of a caller.
         */
        JobList: {
            /**
             * Jobs
             * @description The jobs, the newest first.
             */
            jobs: components["schemas"]["Job"][];
        };
        /**
         * JobRequest
         * @description A job: its parts are computed independently of each other, in any order.
         */
        JobRequest: {
            /**
             * Parts
             * @description The parts. Results list them in this order, by index.
             */
            parts: components["schemas"]["PartDefinition"][];
        };
        /**
         * JobResult
         * @description One part of a job: its state, and its file or its error.
         */
        JobResult: {
            /**
             * Part
             * @description Index of the part.
             */
            part: number;
            /**
             * Name
             * @description The name that the part was given; without one, its index.
             */
            name: string;
            /**
             * State
             * @description As the states of a job.
             * @enum {string}
             */
            state: "queued" | "running" | "succeeded" | "failed" | "cancelled";
            /**
             * Media Type
             * @description Media type of the file. This field and the next three only if the part has succeeded.
             */
            media_type?: string;
            /**
             * Bytes
             * @description Bytes of the file.
             */
            bytes?: number;
            /**
             * Sha256
             * @description Hash of the file.
             */
            sha256?: string;
            /**
             * Link
             * @description URL of the file, without the host.
             */
            link?: string;
            /**
             * @description The error of a part that failed, as its call would return it. Its pointers are those of the
             *     job: `/parts/3/body/…`.
             */
            problem?: components["schemas"]["Problem"];
        };
        /**
         * JobResults
         * @description A range of a job's results.
         */
        JobResults: {
            /**
             * Results
             * @description The parts of the range, in their order.
             */
            results: components["schemas"]["JobResult"][];
            /**
             * Next
             * @description URL of the next range, without the host; left out in the last.
             */
            next?: string;
        };
        /**
         * LeftOutFace
         * @description A face of a brep that took no part in the answer, because it is invalid.
         */
        LeftOutFace: {
            /**
             * Patch
             * @description Number of the face in the request, as `patch`; in a group, in the first copy of its brep.
             */
            patch: number;
            /**
             * Code
             * @description The code of the error that would refuse the brep.
             */
            code: string;
            /**
             * Got
             * @description A description of the face, with figures.
             */
            got: string;
            /**
             * Needed
             * @description A description of a valid face.
             */
            needed: string;
        };
        /**
         * LoopDefinition
         * @description A loop: edges that follow each other around a face, with the face on their left.
         *
         *     Left is as seen with du × dv towards the viewer, also if the face is reversed. Loops are given
         *     by their `edges`, by `pcurves`, or by both.
         */
        LoopDefinition: {
            /**
             * Edges
             * @description The numbers of the edges, from 0, in the order of the loop. Left out, the loop is given by its pcurves alone, and its edges belong to this face only.
             * @example [
             *       0,
             *       1,
             *       2,
             *       3
             *     ]
             */
            edges?: number[];
            /**
             * Reversed
             * @description For each edge, whether the loop runs from its end to its start; left out, none does.
             * @example [
             *       false,
             *       true,
             *       false,
             *       false
             *     ]
             */
            reversed?: boolean[];
            /**
             * Pcurves
             * @description For each edge, its curve in the parameters of the surface, with control points [u, v]; or null, and the service makes it. A pcurve runs in the direction of its edge, also where the loop is reversed, and at the parameters of the edge up to an affine map. A pcurve that does not, or that is further from the edge than the uncertainty, is made anew.
             * @example [
             *       {
             *         "control_points": [
             *           [
             *             0,
             *             0
             *           ],
             *           [
             *             1,
             *             0
             *           ]
             *         ]
             *       },
             *       null,
             *       null,
             *       null
             *     ]
             */
            pcurves?: (components["schemas"]["CurveDefinition"] | null)[];
        };
        /**
         * MeasureRequest
         * @description A surface to measure.
         */
        MeasureRequest: {
            /** @description The surface, by its control points. */
            surface: components["schemas"]["SurfaceDefinition"];
            /**
             * Reading
             * @description The report of reading a file, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "faces": 300,
             *       "format": "step",
             *       "skipped_faces": []
             *     }
             */
            reading?: Record<string, never>;
            /**
             * Orientation
             * @description The report of the operation `orient`, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "not_orientable": [],
             *       "turned": [
             *         2
             *       ]
             *     }
             */
            orientation?: Record<string, never>;
            /**
             * Tolerance
             * @description The largest width of intervals: relative to the area, to the length of all borders and to the volume of the whole surface; for the centroid relative to the diagonal of the bounding box of the control points. Intervals that take more work than one request may take are wider, and `reached` is false.
             * @default 0.000001
             * @example 1e-9
             */
            tolerance?: number;
            /**
             * Weld Tolerance
             * @description A share of the diagonal of the bounding box of the control points. Control points on borders of patches that are nearer to each other than this count as one point, as in a mesh. The interval of a volume includes every way to close the gaps between such points.
             * @default 1e-12
             * @example 0.000001
             */
            weld_tolerance?: number;
        };
        /**
         * MemberDefinition
         * @description One member of a group: a surface with a name, a base colour and a placement.
         *
         *     A member has a `surface`, or the number of one as its `definition`. A member with neither is a
         *     frame for others, such as an assembly.
         */
        MemberDefinition: {
            /**
             * @description The surface, of any kind except `group`.
             * @example {
             *       "control_net": [
             *         [
             *           [
             *             0,
             *             0,
             *             0
             *           ],
             *           [
             *             0,
             *             1,
             *             0
             *           ]
             *         ],
             *         [
             *           [
             *             1,
             *             0,
             *             0
             *           ],
             *           [
             *             1,
             *             1,
             *             1
             *           ]
             *         ]
             *       ]
             *     }
             */
            surface?: components["schemas"]["MemberSurfaceDefinition"];
            /**
             * Definition
             * @description The number, from 0, of the surface in `definitions`, in place of `surface`.
             * @example 0
             */
            definition?: number;
            /**
             * Parent
             * @description The number, from 0, of an earlier member. This member is then in the frame of that one: its matrix is multiplied from the left by the matrices of all members above it, and without a `color` it has the colour of the nearest of them that has one. At most 100 levels.
             * @example 0
             */
            parent?: number;
            /**
             * Name
             * @description Name of the member: of its node in glTF, and of its part in other formats, there after the names of its parents: `machine/bolt`. The default is the name of the surface, or `assembly` without one.
             * @example left wing
             */
            name?: string;
            /**
             * Color
             * @description Base colour: red, green, blue and, as an optional fourth number, opacity; sRGB, each from 0 to 1.
             * @example [
             *       0.8,
             *       0.2,
             *       0.1
             *     ]
             */
            color?: number[];
            /**
             * Matrix
             * @description Placement of the surface, and of the members below this one: an affine 4 × 4 matrix, row by row, that acts on columns (x, y, z, 1). Its last row is 0, 0, 0, 1. It may mirror, but must not flatten. The default is the identity.
             * @example [
             *       [
             *         1,
             *         0,
             *         0,
             *         2
             *       ],
             *       [
             *         0,
             *         1,
             *         0,
             *         0
             *       ],
             *       [
             *         0,
             *         0,
             *         -1,
             *         0
             *       ],
             *       [
             *         0,
             *         0,
             *         0,
             *         1
             *       ]
             *     ]
             */
            matrix?: [
                [
                    number,
                    number,
                    number,
                    number
                ],
                [
                    number,
                    number,
                    number,
                    number
                ],
                [
                    number,
                    number,
                    number,
                    number
                ],
                [
                    number,
                    number,
                    number,
                    number
                ]
            ];
        };
        /** @description A surface in a group: any but a group. */
        MemberSurfaceDefinition: components["schemas"]["BezierDefinition"] | components["schemas"]["BsplineDefinition"] | components["schemas"]["PatchesDefinition"] | components["schemas"]["TriangleDefinition"] | components["schemas"]["MultipatchDefinition"] | components["schemas"]["TubeDefinition"] | components["schemas"]["RibbonDefinition"] | components["schemas"]["BrepDefinition"];
        /**
         * Mesh
         * @description A mesh as JSON.
         */
        Mesh: {
            /**
             * Vertices
             * @description Positions [x, y, z]; a welded vertex is one row. Float64, with the fewest digits that give
             *     the same number.
             */
            vertices: [
                number,
                number,
                number
            ][];
            /**
             * Faces
             * @description For each corner of each face an index of `vertices`, counter-clockwise seen from the normal's
             *     tip. Faces are sorted by part; the quads of a part are before its triangles.
             */
            faces: number[][];
            /**
             * Normals
             * @description Unit normals, float32; left out if `normals` is false. Row k belongs to row k of `vertices`,
             *     unless the mesh has `attribute_faces`.
             */
            normals?: [
                number,
                number,
                number
            ][];
            /**
             * Uvs
             * @description Texture coordinates of the surface; if it has none and `uvs` is true, its parameters (u, v).
             *     Float64, exact enough to evaluate the surface at the vertex again. Row k belongs to row k of
             *     `normals`.
             */
            uvs?: [
                number,
                number
            ][];
            /**
             * Colors
             * @description Colours of the surface, if it has any: sRGB, or sRGB and opacity, from 0 to 1; float32. Row k
             *     belongs to row k of `normals`.
             */
            colors?: number[][];
            /**
             * Attributes
             * @description Values of the surface's attributes by name, float64. Row k belongs to row k of `normals`.
             */
            attributes?: {
                [key: string]: number[][];
            };
            /**
             * Attribute Faces
             * @description If a position has several normals, colours or other values, as at a crease: for each corner
             *     of each face, in the shape of `faces`, an index of `normals`, `uvs`, `colors` and
             *     `attributes`.
             */
            attribute_faces?: number[][];
            /**
             * Parts
             * @description The parts, each with its range of `faces`; those of a brep are its faces. Empty for breps of
             *     more than 10,000 faces.
             */
            parts: components["schemas"]["MeshPart"][];
            /**
             * Lines
             * @description The overlays of the request, if any.
             */
            lines?: components["schemas"]["MeshLines"][];
            report: components["schemas"]["MeshReport"];
        };
        /**
         * MeshCheck
         * @description How far a mesh and its surface are apart, and the faults of the mesh itself.
         *
         *     Two vertices at the same position count as one where edges are counted, because many files have
         *     a vertex for each corner of each triangle.
         */
        MeshCheck: {
            /**
             * @description The largest distance from a point of the surface to the mesh: large where the mesh has a hole
             *     or leaves something out.
             */
            surface_to_mesh: components["schemas"]["Deviation"];
            /**
             * @description The largest distance from a point of the mesh to the surface: large where the mesh has
             *     something that the surface does not have.
             */
            mesh_to_surface: components["schemas"]["Deviation"];
            /**
             * Open Edges
             * @description Edges of one triangle only. A mesh of a closed surface has none, unless it has cracks or
             *     holes.
             */
            open_edges: number;
            /**
             * Non Manifold Edges
             * @description Edges of three or more triangles.
             */
            non_manifold_edges: number;
            /**
             * Flipped Edges
             * @description Edges of two triangles that run along it in the same direction: one of the two is turned
             *     over.
             */
            flipped_edges: number;
            /**
             * Degenerate Faces
             * @description Triangles without area, up to rounding.
             */
            degenerate_faces: number;
            /**
             * Max Normal Angle
             * @description The largest angle, in radians, between a normal of the mesh and that of the surface nearby:
             *     of the triangles, at their middles, and there also the mean of the vertex normals that the mesh
             *     has. Measured, not proved. Left out if all triangles are degenerate.
             */
            max_normal_angle?: number;
            /**
             * Max Normal Angle Triangle
             * @description The triangle with that angle.
             */
            max_normal_angle_triangle?: number;
            /**
             * Reached
             * @description Whether both intervals are as narrow as `relative_tolerance` says.
             */
            reached: boolean;
            /**
             * Limit
             * @description Only if `reached` is false, why: narrower intervals would take more `work` than this service
             *     gives a request; the deviation is so small that `rounding` decides; or the surface has a part so
             *     `thin` that no closer bound is proved.
             * @enum {string}
             */
            limit?: "work" | "rounding" | "thin";
            /**
             * Vertices
             * @description Number of vertices of the mesh, as it was read.
             */
            vertices: number;
            /**
             * Triangles
             * @description Number of its triangles, after faces of four corners were divided.
             */
            triangles: number;
            /**
             * Skipped Faces
             * @description For a brep with `"invalid_faces": "skip"`: invalid faces that took no part; left out if there
             *     are none.
             */
            skipped_faces?: components["schemas"]["LeftOutFace"][];
            /**
             * Mesh
             * @description With `distances`: the mesh as it was read.
             */
            mesh?: components["schemas"]["CheckedMesh"];
            /**
             * Distances
             * @description With `distances`: for each vertex of `mesh` its distance from the surface, right to the width
             *     of the interval of `mesh_to_surface`.
             */
            distances?: number[];
            /**
             * Middle Distances
             * @description With `distances`: for each triangle of `mesh` the distance of its middle, the mean of its
             *     corners. Most meshes have their vertices on the surface, and are furthest from it in between.
             */
            middle_distances?: number[];
        };
        /**
         * MeshDefinition
         * @description A mesh by its vertices and faces, as `POST /v1/mesh` writes it with `format=json`.
         */
        MeshDefinition: {
            /**
             * Vertices
             * @description Positions [x, y, z], in the coordinates of the surface.
             * @example [
             *       [
             *         0,
             *         0,
             *         0
             *       ],
             *       [
             *         1,
             *         0,
             *         0
             *       ],
             *       [
             *         1,
             *         1,
             *         0
             *       ],
             *       [
             *         0,
             *         1,
             *         0
             *       ]
             *     ]
             */
            vertices: [
                number,
                number,
                number
            ][];
            /**
             * Faces
             * @description For each face the numbers of its three or four vertices, from 0, counter-clockwise seen from outside.
             * @example [
             *       [
             *         0,
             *         1,
             *         2,
             *         3
             *       ]
             *     ]
             */
            faces: number[][];
            /**
             * Normals
             * @description Normals [x, y, z] of any length, one for every vertex; [0, 0, 0] stands for none. If there are `attribute_faces`, they say which normal a corner has.
             * @example [
             *       [
             *         0,
             *         0,
             *         1
             *       ],
             *       [
             *         0,
             *         0,
             *         1
             *       ],
             *       [
             *         0,
             *         0,
             *         1
             *       ],
             *       [
             *         0,
             *         0,
             *         1
             *       ]
             *     ]
             */
            normals?: [
                number,
                number,
                number
            ][];
            /**
             * Attribute Faces
             * @description For each corner of `faces` the number of its normal, if that is not the number of its vertex.
             * @example [
             *       [
             *         0,
             *         1,
             *         2,
             *         3
             *       ]
             *     ]
             */
            attribute_faces?: number[][];
            /**
             * Uvs
             * @description It is ignored, so that a mesh of this service can be sent as it is.
             */
            uvs?: unknown;
            /**
             * Colors
             * @description It is ignored, so that a mesh of this service can be sent as it is.
             */
            colors?: unknown;
            /**
             * Attributes
             * @description It is ignored, so that a mesh of this service can be sent as it is.
             */
            attributes?: unknown;
            /**
             * Parts
             * @description It is ignored, so that a mesh of this service can be sent as it is.
             */
            parts?: unknown;
            /**
             * Lines
             * @description It is ignored, so that a mesh of this service can be sent as it is.
             */
            lines?: unknown;
            /**
             * Report
             * @description It is ignored, so that a mesh of this service can be sent as it is.
             */
            report?: unknown;
        };
        /**
         * MeshFile
         * @description A file with a mesh, inside a document.
         */
        MeshFile: {
            /**
             * File
             * @description The bytes of the file, in base64 (RFC 4648, section 4).
             * @example T0ZGCjMgMSAwCjAgMCAwCjEgMCAwCjAgMSAwCjMgMCAxIDIK
             */
            file: string;
            /**
             * Format
             * @description The format of the file.
             * @example off
             * @enum {string}
             */
            format: "glb" | "gltf" | "obj" | "ply" | "stl" | "off";
        };
        /**
         * MeshLines
         * @description Lines beside the faces: an overlay of the request.
         */
        MeshLines: {
            /**
             * Name
             * @description Name of the overlay.
             */
            name: string;
            /**
             * Vertices
             * @description Positions of the overlay.
             */
            vertices: [
                number,
                number,
                number
            ][];
            /**
             * Segments
             * @description Each line segment as a pair of indices of these `vertices`.
             */
            segments: [
                number,
                number
            ][];
        };
        /**
         * MeshPart
         * @description A named part of the surface, and its range of faces.
         */
        MeshPart: {
            /**
             * Name
             * @description Name of the part.
             */
            name: string;
            /**
             * Faces
             * @description Index of the first face, and index after the last face.
             */
            faces: [
                number,
                number
            ];
            /**
             * Color
             * @description Base colour [r, g, b, a], sRGB, if the part has one.
             */
            color?: [
                number,
                number,
                number,
                number
            ];
        };
        /**
         * MeshReport
         * @description Facts about a mesh.
         */
        MeshReport: {
            /**
             * Vertices
             * @description Number of positions: a position with several normals counts once.
             */
            vertices: number;
            /**
             * Triangles
             * @description Number of triangles.
             */
            triangles: number;
            /**
             * Quads
             * @description Number of quads.
             */
            quads: number;
            /**
             * Patches
             * @description Number of Bézier patches; tubes and ribbons have none. For breps those of all faces.
             */
            patches: number;
            bounds: components["schemas"]["Bounds"];
            /**
             * Watertight
             * @description Whether every edge belongs to exactly two faces.
             */
            watertight: boolean;
            /**
             * Boundary Edges
             * @description Edges that belong to only one face.
             */
            boundary_edges: number;
            /**
             * Poles Repaired
             * @description Samples where du × dv vanishes, so that the normal is a limit.
             */
            poles_repaired: number;
            /**
             * Closed U
             * @description Whether the surface closes along u: its curves at the least and the greatest u are the same.
             *     This and the next three fields are only for a surface with one rectangular domain of (u, v).
             */
            closed_u?: boolean;
            /**
             * Closed V
             * @description Whether the surface closes along v: its curves at the least and greatest v are the same.
             */
            closed_v?: boolean;
            /**
             * Continuity U
             * @description If the surface closes along u, its continuity there: C1 for equal partials du, G1 for equal
             *     tangent planes, else C0.
             * @enum {string}
             */
            continuity_u?: "C0" | "G1" | "C1";
            /**
             * Continuity V
             * @description If the surface closes along v, its continuity there: as `continuity_u`, with dv.
             * @enum {string}
             */
            continuity_v?: "C0" | "G1" | "C1";
            /**
             * Deviation Bound
             * @description Proved, in model units: no point of the surface is further than this from the faces, with the
             *     coordinates that the file has after rounding. Never above the tolerance of the request, except
             *     for breps whose edges are further than that from their faces (`reached`). For breps it holds for
             *     faces and for edges. Left out if the mesh has no faces, or only faces of tubes and ribbons.
             */
            deviation_bound?: number;
            /**
             * Mesh Deviation Bound
             * @description With `two_sided`; proved: no point of the faces is further than this from the surface. Null
             *     for a brep without such a bound; `mesh_deviation_reason` says why.
             */
            mesh_deviation_bound?: number | null;
            /**
             * Mesh Deviation Reason
             * @description Why `mesh_deviation_bound` is null.
             * @example The part is too thin for this tolerance.
             */
            mesh_deviation_reason?: string;
            /**
             * Reached
             * @description Whether `deviation_bound` is at most the tolerance. This and the next fields are only for
             *     breps, and groups with breps: sums and greatest values over all of them.
             * @example true
             */
            reached?: boolean;
            /**
             * Gap Bound
             * @description Proved, in model units: no point of an edge is further than this from the point of its
             *     parameter curve at the same parameter, on the surface of the face.
             * @example 1.5e-7
             */
            gap_bound?: number;
            /**
             * Pcurves Replaced
             * @description Number of given parameter curves that were made anew, because they were too far from their
             *     edges.
             * @example 2
             */
            pcurves_replaced?: number;
            /**
             * Complete
             * @description Whether all faces have triangles: none is in `skipped_faces`, and none is degenerate.
             * @example true
             */
            complete?: boolean;
            /**
             * Non Manifold Edges
             * @description Number of edges with more than two coedges in one shell that could not be put in pairs.
             * @example 0
             */
            non_manifold_edges?: number;
            /**
             * Double Edges
             * @description Number of pairs of vertices that more than two triangles join; those along
             *     `non_manifold_edges` do not count.
             * @example 0
             */
            double_edges?: number;
            /**
             * Degenerate Faces
             * @description Number of faces without triangles that are not in `skipped_faces`: they are too narrow for
             *     the tolerance. `reached` is false unless all their edges are in the mesh.
             * @example 0
             */
            degenerate_faces?: number;
            /**
             * Collapsed Edges
             * @description Edges that became one vertex, because they are shorter than their uncertainty.
             * @example {
             *       "count": 1,
             *       "longest_chain": 2e-7
             *     }
             */
            collapsed_edges?: components["schemas"]["CollapsedEdges"];
            /**
             * Skipped Faces
             * @description Invalid faces that were left out, with `"invalid_faces": "skip"`.
             * @example [
             *       {
             *         "code": "edge_not_on_surface",
             *         "face": 3,
             *         "got": "an edge 2.5 from the surface",
             *         "needed": "at most 1/10 of the diagonal of the face"
             *       }
             *     ]
             */
            skipped_faces?: components["schemas"]["SkippedFace"][];
            /**
             * Normal Angle
             * @description With `angle_tolerance`: the largest measured angle, in radians, between the normals at the
             *     two ends of an edge.
             */
            normal_angle?: number;
            /**
             * Curvature
             * @description With `curvatures`: the least and greatest curvatures at the vertices.
             */
            curvature?: components["schemas"]["CurvatureRange"];
            /**
             * Merged Knots
             * @description Number of knots that differed from the knot before only by rounding, and were made equal to
             *     that knot; left out if it is 0.
             */
            merged_knots?: number;
            /**
             * Moved
             * @description The largest distance, in model units, by which a point of the surface was moved to join
             *     control points (`weld_tolerance`). All bounds include this distance; left out if it is 0.
             */
            moved?: number;
            /**
             * Turned
             * @description With `orient`: the numbers of the patches that were turned, as `POST /v1/points` counts them
             *     (`patch`); of a B-spline in a group its first. At most the first 10,000.
             * @example [
             *       2
             *     ]
             */
            turned?: number[];
            /**
             * Not Orientable
             * @description With `orient`: the numbers of the patches of surfaces without a consistent orientation, such
             *     as a Möbius strip, which were not turned. At most the first 10,000.
             * @example []
             */
            not_orientable?: number[];
            /**
             * Metres Per Unit
             * @description The unit of all lengths in metres, if the surface has a `metres_per_unit`.
             */
            metres_per_unit?: number;
            /**
             * Parts
             * @description The bound of each part, in the order of the parts; left out if no part has a bound, and for
             *     breps of more than 10,000 faces. The parts of a brep are its faces.
             */
            parts?: components["schemas"]["PartReport"][];
            /**
             * Engine
             * @description Version of the numbers. It changes when the service computes other numbers for the same
             *     request.
             */
            engine: number;
        };
        /**
         * MeshRequest
         * @description A surface, and the options of its mesh.
         */
        MeshRequest: {
            /**
             * Resolution
             * @description Divisions of every patch: one number, or [u, v]; by default 16. A patch has (u + 1) × (v + 1) vertices. A triangle uses the larger number n for all sides and has (n + 1)(n + 2)/2 vertices. Not together with a tolerance, `max_triangles` or `max_bytes`, and not for breps.
             * @example 16
             * @example [
             *       16,
             *       32
             *     ]
             */
            resolution?: number | [
                number,
                number
            ];
            /**
             * Tolerance
             * @description The largest distance of the surface from the mesh, in model units. No point of the surface is further than this from the mesh in the file. This is proved, not sampled, and the report has the proved bound. Use a tolerance in place of a resolution. Patches are divided where the surface bends, and in the direction in which it bends; the division of a shared edge depends on the edge alone. A tolerance below the rounding of the written vertices is refused (`tolerance_too_small`).
             * @example 0.001
             */
            tolerance?: number;
            /**
             * Relative Tolerance
             * @description The tolerance as a share of the model's diagonal, which is the diagonal of the bounding box of all control points (for a group, of all members after placement). Not together with `tolerance`. Breps, and groups with breps, are meshed with 0.001 if the request has no option of accuracy. The box of a brep does not contain the parts of surfaces outside of its faces, and no mesh of a brep is coarser than 0.02.
             * @example 0.001
             */
            relative_tolerance?: number;
            /**
             * Angle Tolerance
             * @description The largest angle in radians between the normals at the two ends of an edge. This angle is an aim and is not proved; the report has the largest measured angle, `normal_angle`. Use it alone, or together with a tolerance.
             * @example 0.2
             */
            angle_tolerance?: number;
            /**
             * Max Triangles
             * @description The most triangles of the mesh. Without a tolerance, the service makes the deviation as small as it can with this number of triangles; a number below that of the coarsest mesh is refused (`budget_too_small`). Together with a tolerance, this number is a limit: if the mesh needs more triangles, the request is refused (`too_many_triangles`).
             * @example 2000
             */
            max_triangles?: number;
            /**
             * Max Bytes
             * @description The most bytes of the response in its format. With and without a tolerance, this option limits bytes as `max_triangles` limits triangles.
             * @example 100000
             */
            max_bytes?: number;
            /**
             * Two Sided
             * @description Whether to bound the distance from the mesh to the surface too. No point of the mesh is then further from the surface than twice the tolerance. The report has the bound, `mesh_deviation_bound`. Needs a tolerance (`angle_tolerance` is not enough), `max_triangles` or `max_bytes`.
             * @default false
             * @example true
             */
            two_sided?: boolean;
            /**
             * Faces
             * @description Kind of faces: `triangles`, `quads` or `none`. `quads` is allowed only if the format has quads. With `none` the file has only isoparametric curves and overlays.
             * @default triangles
             * @example quads
             * @enum {string}
             */
            faces?: "triangles" | "quads" | "none";
            /**
             * Normals
             * @description Whether vertices carry analytic unit normals.
             * @default true
             */
            normals?: boolean;
            /**
             * Uvs
             * @description Whether vertices carry their parameters (u, v). For a B-spline they are in the domain of its knots; for `patches`, in each patch from 0 to 1. If the surface has texture coordinates (`uvs`), vertices always carry these in place of the parameters.
             * @default false
             */
            uvs?: boolean;
            /**
             * Curvatures
             * @description Whether vertices carry the Gaussian and mean curvature of the exact surface. Formats with attributes write them as `gaussian_curvature` and `mean_curvature`. Signs are those of `POST /v1/points`: mean curvature is positive where the surface bends towards its normal, so a sphere of radius r with outward normals has −1/r. In a group they are the curvatures of the surfaces after placement. A curvature that is infinite or has no limit, for example at the apex of a cone, is written as 0; the curvatures of wires are written as 0, too. The report has the least and the greatest curvature. Not for tubes and ribbons.
             * @default false
             * @example true
             */
            curvatures?: boolean;
            /**
             * Weld
             * @description Whether patches share the vertices of common edges. With `false` every sample of every patch is a vertex of its own, even samples at a pole that no face uses. Vertices are then ordered patch by patch; sample (i, j) of a patch is its vertex number i (Rv + 1) + j, where Rv is the number of divisions along v. Not for breps.
             * @default true
             */
            weld?: boolean;
            /**
             * Crease Angle
             * @description Angle in radians. If the normals of neighbouring patches differ by more, the common edge is a crease: each patch keeps its own normals there. So do faces of breps.
             * @default 0.017453292519943295
             * @example 0.5
             */
            crease_angle?: number;
            /**
             * Weld Tolerance
             * @description A share of the model's diagonal. Control points on borders of patches that are nearer to each other than this count as one point. So sides that are equal up to rounding become one edge, closed surfaces have no gaps, and collapsed sides become poles. Near points, and points connected by a chain of near points, form a cluster; in a cluster wider than the tolerance, only points nearer than 1/8 of the tolerance become one. Patches without width are left out of the mesh. When two sides become one edge, the edge gets the positions of the side whose control points come first in lexicographic order, whatever the order of the patches. Far from the origin, where coordinates are too coarse for this tolerance, points nearer to each other than 2^-50 times the largest coordinate count as near. The report has the largest move of a point as `moved`, and every bound includes it. If two borders are the same curve with different knots, the surfaces are split at these knots. With 0, only points that are equal bit for bit are joined.
             * @default 1e-12
             * @example 1e-9
             */
            weld_tolerance?: number;
            /**
             * Orient
             * @description Whether to turn patches so that neighbours agree about the side to which their normals point, and closed surfaces have a positive volume. A turned patch has u and v exchanged. Of an open surface the side stays on which most patches are. A surface without a consistent orientation, such as a Möbius strip, is not turned. The report lists the patches (`turned`, `not_orientable`). Breps, tubes and ribbons stay as they are.
             * @default false
             * @example true
             */
            orient?: boolean;
            /**
             * Overlays
             * @description Lines to draw in addition to the faces, if the format has lines. For breps `boundary` has all edges, drawn through vertices of the mesh; they have no `control_net`.
             * @default []
             * @example [
             *       "control_net",
             *       "boundary"
             *     ]
             */
            overlays?: ("control_net" | "boundary")[];
            /**
             * Isocurves
             * @description Isoparametric curves: one number n, or [n_u, n_v]. Every patch (of a B-spline, every knot span) gets the curves u = i/n_u and v = j/n_v, with its borders; a shared border is drawn once. A triangle gets the curves r = i/n, s = i/n and t = i/n. 0 draws no curves in that direction. Not for breps.
             * @default [
             *       0,
             *       0
             *     ]
             * @example 4
             * @example [
             *       1,
             *       2
             *     ]
             */
            isocurves?: number | [
                number,
                number
            ];
            /**
             * Wires
             * @description The form of isoparametric curves: `lines`, `tubes` or `ribbons`. `lines` is allowed only if the format has lines. Ribbons lie flat on the surface, 1/20 of their width above its faces.
             * @default lines
             * @example tubes
             * @enum {string}
             */
            wires?: "lines" | "tubes" | "ribbons";
            /**
             * Wire Width
             * @description Diameter of the tubes or width of the ribbons, in model units. By default 1/300 of the diagonal of the bounding box of the control points.
             * @example 0.02
             */
            wire_width?: number;
            /**
             * Wire Sides
             * @description Sides of a tube.
             * @default 8
             * @example 12
             */
            wire_sides?: number;
            /**
             * Method
             * @description The algorithm that computes samples: `matrix`, `de_casteljau` or `forward_difference`. `matrix`: products with Bernstein bases. `de_casteljau`: repeated interpolation of control points, the most stable and by far the slowest. `forward_difference`: additions along rows, for degrees up to 8 (16 if the format stores float64), with an error that grows with the resolution. `docs/methods.md` compares the accuracy of these algorithms.
             * @default matrix
             * @example de_casteljau
             * @enum {string}
             */
            method?: "matrix" | "de_casteljau" | "forward_difference";
            /**
             * Oogl
             * @description Form of an OOGL file: `cquad`, `mesh`, `off` or `bez`. The default is `cquad` for grids of quads, else `off`. `bez` stores the exact patches; a triangle is stored as a four-sided patch with one side collapsed to a point. Other formats ignore this option.
             * @example bez
             * @enum {string}
             */
            oogl?: "cquad" | "mesh" | "off" | "bez";
            /**
             * Quantize
             * @description Whether glTF is written in 16-bit integers (`KHR_mesh_quantization`). Positions are multiples of a step, a power of two, at most 1/32,766 of the longest side of the bounding box of the control points. Normals are exact within 0.002°. Colours, and texture coordinates from 0 to 1, have 16 bits. Every vertex moves by at most 0.87 steps; the proved deviation includes this move, and a tolerance holds for the written file. All parts of a surface use the same step and origin, and members of a group that meet use the same, too, so that seams have no gaps. Other formats refuse this option (`unsupported_by_format`).
             * @default false
             * @example true
             */
            quantize?: boolean;
            /**
             * Compression
             * @description Compression of the arrays of glTF: `none` or `meshopt`. With `meshopt` (`EXT_meshopt_compression`) vertices and triangles have another order. No number changes; but together with `quantize`, normals change by at most 0.1°. Readers need a decoder (three.js and Babylon.js have one). Other formats refuse `meshopt`. A service without the library refuses it, too (`compression_unavailable`); `GET /v1/formats` lists the compressions of the service.
             * @default none
             * @example meshopt
             * @enum {string}
             */
            compression?: "none" | "meshopt";
            /**
             * Stl
             * @description Form of an STL file: `binary`, or `ascii`, a text with the same numbers and some four times the length. Other formats ignore this option.
             * @default binary
             * @example ascii
             * @enum {string}
             */
            stl?: "binary" | "ascii";
            /** @description The surface, by its control points. */
            surface: components["schemas"]["SurfaceDefinition"];
            /**
             * Reading
             * @description The report of reading a file, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "faces": 300,
             *       "format": "step",
             *       "skipped_faces": []
             *     }
             */
            reading?: Record<string, never>;
            /**
             * Orientation
             * @description The report of the operation `orient`, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "not_orientable": [],
             *       "turned": [
             *         2
             *       ]
             *     }
             */
            orientation?: Record<string, never>;
            /**
             * @description The camera that will see the mesh; requires `pixel_tolerance`. A query cannot have it.
             * @example {
             *       "field_of_view": 0.8,
             *       "height": 1080,
             *       "position": [
             *         4,
             *         3,
             *         9
             *       ]
             *     }
             */
            camera?: components["schemas"]["CameraDefinition"];
            /**
             * Pixel Tolerance
             * @description The largest error in the picture of the `camera`, in pixels; requires `camera`. It holds in the middle of the picture: at the angle θ from there an error appears up to 1 / cos² θ times as large. The tolerance of each part of the surface follows from its least distance from the camera. A `tolerance` in the same request applies, too.
             * @example 0.5
             */
            pixel_tolerance?: number;
        };
        /**
         * MultipatchDefinition
         * @description Bézier patches, B-splines and triangles that form one surface.
         *
         *     Each of these surfaces is a part, with its own degrees, knots and parameters; its `name` is the
         *     name of the part. Where the borders of two parts are equal, the parts share vertices. The
         *     library G+Smo has such surfaces.
         */
        MultipatchDefinition: {
            /**
             * Type
             * @description The kind of surface.
             * @constant
             */
            type: "multipatch";
            /**
             * Surfaces
             * @description The patches and splines. If one of them has `colors`, `uvs` or `attributes`, all must have them. Their own `up` has no effect. The limit of control points is for all of them together.
             * @example [
             *       {
             *         "control_net": [
             *           [
             *             [
             *               0,
             *               0,
             *               0
             *             ],
             *             [
             *               0,
             *               1,
             *               0
             *             ]
             *           ],
             *           [
             *             [
             *               1,
             *               0,
             *               0
             *             ],
             *             [
             *               1,
             *               1,
             *               1
             *             ]
             *           ]
             *         ],
             *         "name": "left"
             *       },
             *       {
             *         "control_net": [
             *           [
             *             [
             *               1,
             *               0,
             *               0
             *             ],
             *             [
             *               1,
             *               1,
             *               1
             *             ]
             *           ],
             *           [
             *             [
             *               2,
             *               0,
             *               1
             *             ],
             *             [
             *               2,
             *               1,
             *               0
             *             ]
             *           ]
             *         ],
             *         "degree": 1,
             *         "name": "right",
             *         "type": "bspline"
             *       }
             *     ]
             */
            surfaces: (components["schemas"]["BezierDefinition"] | components["schemas"]["BsplineDefinition"] | components["schemas"]["TriangleDefinition"])[];
            /**
             * Up
             * @description The model's vertical axis. With `z`, the root node of a glTF file rotates the model, since y is up in glTF; the coordinates do not change.
             * @default y
             * @example z
             * @enum {string}
             */
            up?: "y" | "z";
            /**
             * Name
             * @description Name of the surface or curve. Its part, its node in glTF and a comment in OOGL have this name.
             * @default surface
             * @example sail
             */
            name?: string;
        };
        /** @description A step of a conversion: `op` names its kind. */
        OperationDefinition: components["schemas"]["ElevateDefinition"] | components["schemas"]["SplitDefinition"] | components["schemas"]["RestrictDefinition"] | components["schemas"]["InsertDefinition"] | components["schemas"]["TransposeDefinition"] | components["schemas"]["ReverseDefinition"] | components["schemas"]["BezierConversion"] | components["schemas"]["TriangleConversion"] | components["schemas"]["UntrimDefinition"] | components["schemas"]["SelectDefinition"] | components["schemas"]["OrientDefinition"];
        /**
         * OrientDefinition
         * @description Turns patches so that neighbours agree, and closed surfaces have a positive volume.
         *
         *     Neighbours are found as in a mesh. A turned patch has u and v exchanged. Of an open surface the
         *     side stays on which most patches are, or else that of the first. A surface inside another one
         *     points outwards, too. What has no consistent orientation, such as a Möbius strip, is not turned.
         *     Breps, tubes and ribbons stay as they are. The response lists the patches (`orientation`).
         */
        OrientDefinition: {
            /**
             * Op
             * @description The operation.
             * @constant
             */
            op: "orient";
            /**
             * Weld Tolerance
             * @description A share of the diagonal of the bounding box of the control points: control points on borders that are nearer than this count as one, as in a mesh.
             * @default 1e-12
             * @example 1e-9
             */
            weld_tolerance?: number;
        };
        /**
         * Orientation
         * @description Which patches were turned, so that neighbours agree and volumes are positive.
         *
         *     Numbers are those of the surface before the operation, as `POST /v1/points` counts them
         *     (`patch`); of a B-spline in a group its first.
         */
        Orientation: {
            /**
             * Turned
             * @description The patches that were turned.
             */
            turned: number[];
            /**
             * Not Orientable
             * @description The patches of surfaces without a consistent orientation, such as a Möbius strip, which were
             *     not turned.
             */
            not_orientable: number[];
        };
        /**
         * PageLinks
         * @description URLs, without the host.
         */
        PageLinks: {
            /**
             * Next
             * @description URL of the next page; missing on the last one.
             */
            next?: string;
        };
        /**
         * PartCounts
         * @description Numbers of parts by their state.
         */
        PartCounts: {
            /**
             * Total
             * @description All parts.
             */
            total: number;
            /**
             * Queued
             * @description Parts that wait, and in a job without askers those that were not computed.
             */
            queued: number;
            /**
             * Running
             * @description Parts of batches that are computed now.
             */
            running: number;
            /**
             * Succeeded
             * @description Parts whose results are ready.
             */
            succeeded: number;
            /**
             * Failed
             * @description Parts that were refused or ran out of time.
             */
            failed: number;
        };
        /**
         * PartDefinition
         * @description One part of a job: a request that this service would also answer at once.
         *
         *     With a body the part is a POST of one of the calls that compute; with a file a POST of
         *     `/v1/mesh`, `/v1/measure` or `/v1/convert` that has this file as its body, and all other fields
         *     in the query; with neither a GET of a mesh by URL.
         */
        PartDefinition: {
            /**
             * Name
             * @description A name for the part, which results repeat; the default is its index.
             * @example lid
             */
            name?: string;
            /**
             * Path
             * @description Path and query of the request, without the host.
             * @example /v1/mesh?format=glb
             * @example /v1/surfaces/utah-teapot/mesh.glb?resolution=8
             */
            path: string;
            /**
             * Body
             * @description The JSON body of a POST.
             * @example {
             *       "surface": {
             *         "control_net": [
             *           [
             *             [
             *               0,
             *               0,
             *               0
             *             ],
             *             [
             *               0,
             *               1,
             *               0
             *             ]
             *           ],
             *           [
             *             [
             *               1,
             *               0,
             *               0
             *             ],
             *             [
             *               1,
             *               1,
             *               0
             *             ]
             *           ]
             *         ]
             *       }
             *     }
             */
            body?: {
                [key: string]: unknown;
            };
            /**
             * File
             * @description The id of a file that `POST /v1/files` has stored: the body of the POST, in place of a JSON body.
             * @example 0000000000000000000000000000000000000000000000000000000000000000.step
             */
            file?: string;
        };
        /**
         * PartMeasures
         * @description A named part, a member of a group, or a shell of a brep with several shells.
         */
        PartMeasures: {
            /**
             * Name
             * @description Its name.
             */
            name: string;
            /** @description Its area. */
            area: components["schemas"]["Interval"];
            /**
             * Volume
             * @description The volume that the part encloses. Left out if the part alone is not closed.
             */
            volume?: components["schemas"]["Interval"];
            /**
             * Centroid
             * @description The centroid of that volume, x, y, z.
             */
            centroid?: [
                components["schemas"]["Interval"],
                components["schemas"]["Interval"],
                components["schemas"]["Interval"]
            ];
        };
        /**
         * PartReport
         * @description Facts about a part.
         */
        PartReport: {
            /**
             * Name
             * @description Name of the part, of the face of a brep, or of the member of a group.
             */
            name: string;
            /**
             * Deviation Bound
             * @description The `deviation_bound` of the part alone; left out for tubes and ribbons, and for faces that
             *     have no triangles.
             */
            deviation_bound?: number;
        };
        /**
         * PatchesDefinition
         * @description Many Bézier patches over shared vertices, as in the files of the teapot.
         *
         *     Patches are grids of one degree or of several, triangles of one degree, or both. If neighbouring
         *     patches list the same vertices, or vertices with equal coordinates, their common edge has no
         *     gap.
         */
        PatchesDefinition: {
            /**
             * Type
             * @description The kind of surface.
             * @constant
             */
            type: "patches";
            /**
             * Homogeneous
             * @description Whether control points are homogeneous: [w x, w y, w z, w], with no `weights` beside them. A point with w = 0 is a direction. If a w is 0 or negative, but none at a corner, the degree is raised, to 64 at most, until all weights are positive; this does not change the surface. It is stored, answered and hashed as points and weights.
             * @default false
             * @example true
             */
            homogeneous?: boolean;
            /**
             * Vertices
             * @description Control points [x, y, z], or [x, y] in the plane z = 0, that the patches share; [w x, w y, w z, w] if they are `homogeneous`.
             * @example [
             *       [
             *         0,
             *         0,
             *         0
             *       ],
             *       [
             *         0,
             *         1,
             *         0
             *       ],
             *       [
             *         1,
             *         0,
             *         0
             *       ],
             *       [
             *         1,
             *         1,
             *         1
             *       ],
             *       [
             *         2,
             *         0,
             *         0
             *       ],
             *       [
             *         2,
             *         1,
             *         0
             *       ]
             *     ]
             */
            vertices: ([
                number,
                number,
                number
            ] | [
                number,
                number
            ] | [
                number,
                number,
                number,
                number
            ])[];
            /**
             * Weights
             * @description One weight for every vertex, positive, or 0 for a point that does not pull; that of a corner is positive.
             * @example [
             *       1,
             *       1,
             *       0.5,
             *       0.5,
             *       1,
             *       1
             *     ]
             */
            weights?: number[];
            /**
             * Patches
             * @description For each patch a grid of vertex numbers (from 0), whose rows follow each other along u: 4 × 4 numbers for a bicubic patch. Grids may have different shapes. May be left out if there are `triangles`.
             * @example [
             *       [
             *         [
             *           0,
             *           1
             *         ],
             *         [
             *           2,
             *           3
             *         ]
             *       ],
             *       [
             *         [
             *           2,
             *           3
             *         ],
             *         [
             *           4,
             *           5
             *         ]
             *       ]
             *     ]
             */
            patches?: number[][][];
            /**
             * Triangles
             * @description For each triangular patch, vertex numbers (from 0) in rows of n + 1, n, … 1 numbers as in the control net of a `triangle`. All triangles have one degree n, which may differ from that of the grids. For triangles of several degrees use a `multipatch`.
             * @example [
             *       [
             *         [
             *           2,
             *           1
             *         ],
             *         [
             *           0
             *         ]
             *       ]
             *     ]
             */
            triangles?: number[][][];
            /**
             * Parts
             * @description For the name of each part, the numbers of its patches, from 0: numbers count the grids first, then the triangles. A patch belongs to at most one part. All other patches form a part with the surface's name. Parts are sorted by the first patch number in their lists.
             * @example {
             *       "left": [
             *         0
             *       ],
             *       "right": [
             *         1
             *       ]
             *     }
             */
            parts?: {
                [key: string]: number[];
            };
            /**
             * Colors
             * @description Colours. sRGB, each number from 0 to 1: [r, g, b], or [r, g, b, a] with the opacity. Formats without colours omit them. glTF files contain linear RGB, as the specification of glTF requires. One value for every vertex; over a patch, the values are the Bernstein coefficients.
             * @example [
             *       [
             *         1,
             *         0,
             *         0
             *       ],
             *       [
             *         1,
             *         0,
             *         0
             *       ],
             *       [
             *         1,
             *         1,
             *         0
             *       ],
             *       [
             *         1,
             *         1,
             *         0
             *       ],
             *       [
             *         0,
             *         0,
             *         1
             *       ],
             *       [
             *         0,
             *         0,
             *         1
             *       ]
             *     ]
             */
            colors?: number[][];
            /**
             * Uvs
             * @description Texture coordinates [u, v], written without change. Vertices of the mesh then have texture coordinates also without the option `uvs`. One value for every vertex; over a patch, the values are the Bernstein coefficients.
             * @example [
             *       [
             *         0,
             *         0
             *       ],
             *       [
             *         0,
             *         1
             *       ],
             *       [
             *         0.5,
             *         0
             *       ],
             *       [
             *         0.5,
             *         1
             *       ],
             *       [
             *         1,
             *         0
             *       ],
             *       [
             *         1,
             *         1
             *       ]
             *     ]
             */
            uvs?: [
                number,
                number
            ][];
            /**
             * Attributes
             * @description Functions of the parameters, by name: a temperature, a fourth coordinate. Every value is a list of 1 to 16 numbers. JSON has attributes by name. glTF has them as `_NAME`, split into pieces of four if there are more than four numbers. PLY has them as properties, sorted by name. One value for every vertex; over a patch, the values are the Bernstein coefficients.
             * @example {
             *       "temperature": [
             *         [
             *           20
             *         ],
             *         [
             *           20
             *         ],
             *         [
             *           35
             *         ],
             *         [
             *           60
             *         ],
             *         [
             *           20
             *         ],
             *         [
             *           20
             *         ]
             *       ]
             *     }
             */
            attributes?: {
                [key: string]: number[][];
            };
            /**
             * Up
             * @description The model's vertical axis. With `z`, the root node of a glTF file rotates the model, since y is up in glTF; the coordinates do not change.
             * @default y
             * @example z
             * @enum {string}
             */
            up?: "y" | "z";
            /**
             * Name
             * @description Name of the surface or curve. Its part, its node in glTF and a comment in OOGL have this name.
             * @default surface
             * @example sail
             */
            name?: string;
        };
        /**
         * PictureRequest
         * @description A surface, and the options of its picture.
         */
        PictureRequest: {
            /**
             * Width
             * @description Pixels.
             * @default 512
             * @example 800
             */
            width?: number;
            /**
             * Height
             * @description Pixels.
             * @default 512
             * @example 600
             */
            height?: number;
            /**
             * Azimuth
             * @description Degrees about the vertical axis: with 0 the camera looks along −z, with 90 along −x, in the frame that is turned y-up.
             * @default 30
             * @example 90
             */
            azimuth?: number;
            /**
             * Elevation
             * @description Degrees: with 90 the camera looks straight down.
             * @default 25
             * @example 0
             */
            elevation?: number;
            /**
             * Zoom
             * @description How much larger the surface is than in a picture that shows all of it; with a `position`, than with the field of view.
             * @default 1
             * @example 2
             */
            zoom?: number;
            /**
             * Position
             * @description The position of the camera, in model units and in the frame that is turned y-up: from a surface with `up: z`, (x, y, z) is (x, z, −y) there. Needs `target`, and replaces `azimuth` and `elevation`. A camera on the surface is refused (`camera_on_surface`).
             * @example [
             *       4,
             *       3,
             *       9
             *     ]
             */
            position?: [
                number,
                number,
                number
            ];
            /**
             * Target
             * @description The point in the middle of the picture; needs `position`.
             * @example [
             *       0,
             *       1,
             *       0
             *     ]
             */
            target?: [
                number,
                number,
                number
            ];
            /**
             * Field Of View
             * @description Vertical field of view: the angle, in radians, between the upper and the lower border of the picture.
             * @default 0.5235987755982988
             * @example 0.8
             */
            field_of_view?: number;
            /**
             * Orthographic
             * @description Whether parallel lines stay parallel. With a `position`, the picture shows as much of the target as with perspective.
             * @default false
             * @example true
             */
            orthographic?: boolean;
            /**
             * Background
             * @description `transparent`, or an sRGB colour as `rrggbb` with small letters; it may begin with `#`.
             * @default transparent
             * @example ffffff
             */
            background?: string;
            /**
             * Look
             * @description `shaded` in the colours of the surface, or the Gaussian or the mean curvature as colours: blue below 0, orange above; nine tenths of the picture are in their range.
             * @default shaded
             * @example mean
             * @enum {string}
             */
            look?: "shaded" | "gaussian" | "mean";
            /**
             * Edges
             * @description Whether the borders of patches, and of a part its edges, are drawn.
             * @default false
             * @example true
             */
            edges?: boolean;
            /**
             * Isocurves
             * @description Draws the curves u = i/n and v = j/n of every patch: one n, or [n_u, n_v].
             * @default [
             *       0,
             *       0
             *     ]
             * @example 4
             * @example [
             *       4,
             *       0
             *     ]
             */
            isocurves?: number | [
                number,
                number
            ];
            /**
             * Control Net
             * @description Whether the control net is drawn.
             * @default false
             * @example true
             */
            control_net?: boolean;
            /** @description The surface, by its control points. */
            surface: components["schemas"]["SurfaceDefinition"];
            /**
             * Reading
             * @description The report of reading a file, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "faces": 300,
             *       "format": "step",
             *       "skipped_faces": []
             *     }
             */
            reading?: Record<string, never>;
            /**
             * Orientation
             * @description The report of the operation `orient`, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "not_orientable": [],
             *       "turned": [
             *         2
             *       ]
             *     }
             */
            orientation?: Record<string, never>;
        };
        /**
         * PlaneSet
         * @description Planes n · p = d, where n is the unit normal; row k of each field belongs to plane k.
         */
        PlaneSet: {
            /**
             * Normals
             * @description Normals of the planes, [x, y, z], of any length but 0; or one normal for all planes.
             * @example [
             *       [
             *         0,
             *         0,
             *         1
             *       ]
             *     ]
             */
            normals: [
                number,
                number,
                number
            ][];
            /**
             * Offsets
             * @description Distances d of the planes from the origin, in the direction of their normals: at most 1,000 numbers, or one number for all planes.
             * @example [
             *       0.5,
             *       1,
             *       1.5
             *     ]
             */
            offsets?: number[];
            /**
             * Points
             * @description In place of `offsets`: one point [x, y, z] of each plane, or one point for all planes.
             * @example [
             *       [
             *         0,
             *         0,
             *         0.5
             *       ]
             *     ]
             */
            points?: [
                number,
                number,
                number
            ][];
        };
        /**
         * Points
         * @description Points of a surface in columns, float64, one row for each requested place.
         *
         *     A derivative or curvature beyond the range of float64 is null.
         */
        Points: {
            /**
             * Positions
             * @description The points [x, y, z].
             */
            positions: [
                number,
                number,
                number
            ][];
            /**
             * Du
             * @description First partials along u, in the parameters of the surface.
             */
            du?: [
                number | null,
                number | null,
                number | null
            ][];
            /**
             * Dv
             * @description First partials along v.
             */
            dv?: [
                number | null,
                number | null,
                number | null
            ][];
            /**
             * Normals
             * @description Unit normals along du × dv; where du × dv vanishes, their limits from inside the surface. If
             *     du and dv are parallel at a corner of a patch, or inside a patch, there may be another limit
             *     along u than along v: then the limit along the diagonal is given, which stays the same if u and
             *     v are exchanged.
             */
            normals?: [
                number,
                number,
                number
            ][];
            /**
             * Degenerate
             * @description Whether du × dv vanishes, as at a pole: normals and curvatures there are limits, along the
             *     line in the domain that leads straight inwards.
             */
            degenerate?: boolean[];
            /**
             * Duu
             * @description Second partials along u.
             */
            duu?: [
                number | null,
                number | null,
                number | null
            ][];
            /**
             * Duv
             * @description Mixed second partials.
             */
            duv?: [
                number | null,
                number | null,
                number | null
            ][];
            /**
             * Dvv
             * @description Second partials along v.
             */
            dvv?: [
                number | null,
                number | null,
                number | null
            ][];
            /**
             * Gaussian Curvature
             * @description Gaussian curvatures, k1 · k2; null where they are infinite, as at the apex of a cone, or
             *     have no limit.
             */
            gaussian_curvature?: (number | null)[];
            /**
             * Mean Curvature
             * @description Mean curvatures, (k1 + k2)/2; positive where the surface bends towards its normal, so that a
             *     sphere with outward normals has −1/r; null where they are infinite, as at the apex of a cone, or
             *     have no limit.
             */
            mean_curvature?: (number | null)[];
            /**
             * Principal Curvatures
             * @description Principal curvatures [k1, k2], k1 ≥ k2; null where they are infinite, as at the apex of a
             *     cone, or have no limit.
             */
            principal_curvatures?: [
                number | null,
                number | null
            ][];
            /**
             * Inside
             * @description For a brep, or a group with one: whether the point is inside the trims of its face; points of
             *     untrimmed patches are. Proved, rounding included.
             *     Null where this is not decided: on a border of the face, nearer to an edge than the proved gap
             *     between this edge and the surface, and on a face that was left out. Seams and poles are no
             *     borders.
             */
            inside?: (boolean | null)[];
        };
        /**
         * PointsRequest
         * @description Parameters at which a surface is evaluated, and the derivatives to return.
         */
        PointsRequest: {
            /** @description The surface, by its control points. */
            surface: components["schemas"]["SurfaceDefinition"];
            /**
             * Reading
             * @description The report of reading a file, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "faces": 300,
             *       "format": "step",
             *       "skipped_faces": []
             *     }
             */
            reading?: Record<string, never>;
            /**
             * Orientation
             * @description The report of the operation `orient`, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "not_orientable": [],
             *       "turned": [
             *         2
             *       ]
             *     }
             */
            orientation?: Record<string, never>;
            /**
             * Uv
             * @description Parameters [u, v], one pair for each point, in the domain of the surface; for a patch, both are from 0 to 1. A knot belongs to the span that begins at it, and the end of the domain belongs to the last span.
             * @example [
             *       [
             *         0.5,
             *         0.5
             *       ],
             *       [
             *         0,
             *         1
             *       ]
             *     ]
             */
            uv?: [
                number,
                number
            ][];
            /**
             * Barycentric
             * @description For triangles, in place of `uv`: barycentric coordinates [r, s, t], none negative, with the sum 1. `du` is then the derivative in the direction (−1, 1, 0), and `dv` in the direction (−1, 0, 1).
             * @example [
             *       [
             *         0.5,
             *         0.25,
             *         0.25
             *       ],
             *       [
             *         1,
             *         0,
             *         0
             *       ]
             *     ]
             */
            barycentric?: [
                number,
                number,
                number
            ][];
            /**
             * Patch
             * @description For `patches`, `multipatch`, `brep` and `group` with more than one patch, surface or face: the number of the patch, surface or face on which the points are, from 0 in the order of the request. In a group, the faces of a brep and the Bézier patches of other members follow those of the member before. One number for all points, or a list with one number for each point. Required for these surfaces, and only for these; a `brep` or a `group` of one face or patch may have it, too.
             * @example 0
             */
            patch?: number | number[];
            /**
             * Derivatives
             * @description Order of the partials. 0 returns `positions` alone; 1 adds `du`, `dv`, `normals` and `degenerate`; 2 adds `duu`, `duv`, `dvv` and the curvatures.
             * @default 1
             * @example 2
             */
            derivatives?: number;
        };
        /**
         * Problem
         * @description An error response (RFC 9457).
         */
        Problem: {
            /**
             * Type
             * @description Always `about:blank`; `code` says more.
             * @constant
             */
            type: "about:blank";
            /**
             * Title
             * @description The phrase of the HTTP status.
             */
            title: string;
            /**
             * Status
             * @description The HTTP status.
             */
            status: number;
            /**
             * Code
             * @description Stable code of the kind of problem, for programs.
             * @enum {string}
             */
            code: "body_too_large" | "body_too_slow" | "busy" | "compute_limited" | "damaged_object" | "engine_gone" | "internal_error" | "invalid_request" | "job_quota_full" | "key_needed" | "key_unknown" | "malformed_body" | "malformed_json" | "method_not_allowed" | "not_acceptable" | "not_found" | "out_of_time" | "part_crashed" | "rate_limited" | "result_too_large" | "scope_needed" | "signature_expired" | "signature_invalid" | "store_full" | "store_unavailable" | "too_many_jobs" | "unknown_job" | "unknown_result" | "unknown_suffix" | "unknown_surface" | "unsupported_by_format" | "unsupported_media_type";
            /**
             * Detail
             * @description The problem in words, for people.
             */
            detail: string;
            /**
             * Errors
             * @description The errors; at most 20 of them.
             */
            errors: components["schemas"]["Issue"][];
        };
        /**
         * ProjectRequest
         * @description A surface or a curve, and points: the service finds the closest point for each of them.
         */
        ProjectRequest: {
            /** @description The surface: all of its patches, and all members of a group, are searched together; of a brep its trimmed faces and its edges. */
            surface?: components["schemas"]["SurfaceDefinition"];
            /** @description A curve, in place of the surface. */
            curve?: components["schemas"]["CurveDefinition"];
            /**
             * Reading
             * @description The report of reading a file, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "faces": 300,
             *       "format": "step",
             *       "skipped_faces": []
             *     }
             */
            reading?: Record<string, never>;
            /**
             * Orientation
             * @description The report of the operation `orient`, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "not_orientable": [],
             *       "turned": [
             *         2
             *       ]
             *     }
             */
            orientation?: Record<string, never>;
            /**
             * Points
             * @description Points [x, y, z], or [x, y] for a curve in the plane. At most 100,000.
             * @example [
             *       [
             *         0,
             *         0,
             *         2
             *       ],
             *       [
             *         1.5,
             *         0,
             *         0
             *       ]
             *     ]
             */
            points: number[][];
            /**
             * Relative Tolerance
             * @description The largest width of an interval in `distance_bounds`, as a share of the diagonal of the bounding box of the control points.
             * @default 1e-9
             * @example 0.000001
             */
            relative_tolerance?: number;
            /**
             * Sign
             * @description Whether the response says which points are inside a closed surface (`signs`).
             * @default false
             * @example true
             */
            sign?: boolean;
        };
        /**
         * RayHits
         * @description Hits in columns; the real numbers are float64.
         *
         *     `reached` and `counts` have a row for each ray; the other columns have a row for each hit.
         *
         *     Hits are sorted by ray, and for each ray by t. The thickness is the `relative_thickness` of the
         *     request times the diagonal of the bounding box of the control points.
         */
        RayHits: {
            /**
             * Reached
             * @description For each ray, whether its first hit is listed; with `hits` "all", whether all its hits are
             *     listed. False if the search reached its limit of work, for example because the surface is a line
             *     along the ray; or if the ray begins so far away that rounding is larger than the thickness.
             */
            reached: boolean[];
            /**
             * Counts
             * @description For each ray, the number of its hits in this response.
             */
            counts: number[];
            /**
             * Ray
             * @description The index of the ray.
             */
            ray: number[];
            /**
             * T
             * @description The hit is at origin + t · direction, with the direction of the request. For a hit that is a
             *     segment, its beginning.
             */
            t: number[];
            /**
             * T Bounds
             * @description Intervals [low, high] of t. Proved, rounding included: they contain all common points of the
             *     ray and the surface at this hit. For a segment within the surface, its ends.
             */
            t_bounds: [
                number,
                number
            ][];
            /**
             * Positions
             * @description The points of the surface. They are closer to the ray than the thickness.
             */
            positions: number[][];
            /**
             * Patch
             * @description The index of the patch, or of the face of a brep, in the order of the request; where several
             *     patches meet, one of them. In a group, the Bézier patches and faces of each member follow those
             *     of the member before. Left out for a surface with one domain.
             */
            patch?: number[];
            /**
             * Uv
             * @description Parameters (u, v), in the domain of the surface if it has one, else in the domain of the
             *     patch; for triangles the last two barycentric coordinates, (s, t). For a brep: parameters of the
             *     surface of the face.
             */
            uv: [
                number,
                number
            ][];
            /**
             * Normals
             * @description Unit normals in the direction of du × dv, or their limits at poles; on a face of a brep that
             *     is `reversed`, in the opposite direction.
             */
            normals: [
                number,
                number,
                number
            ][];
            /**
             * Kind
             * @description Whether the ray crosses the surface, touches it (it is tangent, or meets an edge without
             *     crossing), or runs within it along a segment.
             */
            kind: ("crossing" | "touching" | "along")[];
            /**
             * Entering
             * @description For a crossing, whether the ray runs against the normal: into a closed surface whose normals
             *     point outwards. Null for the other kinds.
             */
            entering: (boolean | null)[];
            /**
             * Near Edge
             * @description For a brep, or a group with one: whether the ray is nearer to an edge of a face than the
             *     thickness and the proved gap between this edge and the surface, together. Such a hit counts once
             *     for all faces that meet there, and a ray through a gap between two faces has one, too.
             */
            near_edge?: boolean[];
            /**
             * Skipped Faces
             * @description For a brep with `"invalid_faces": "skip"`: invalid faces that took no part; left out if there
             *     are none.
             */
            skipped_faces?: components["schemas"]["LeftOutFace"][];
        };
        /**
         * Rays
         * @description Rays origin + t · direction with t ≥ 0; row k of both fields belongs to ray k.
         */
        Rays: {
            /**
             * Origins
             * @description Starting points of the rays, [x, y, z], at most 100,000; or one for all.
             * @example [
             *       [
             *         0,
             *         0,
             *         9
             *       ],
             *       [
             *         1,
             *         0,
             *         9
             *       ]
             *     ]
             */
            origins: [
                number,
                number,
                number
            ][];
            /**
             * Directions
             * @description Directions of the rays, [x, y, z], of any length but 0; or one for all.
             * @example [
             *       [
             *         0,
             *         0,
             *         -1
             *       ]
             *     ]
             */
            directions: [
                number,
                number,
                number
            ][];
        };
        /**
         * Reading
         * @description The report of reading a CAD file: its content, and every face that could not be read.
         */
        Reading: {
            /**
             * Format
             * @description Name of the format.
             * @example step
             */
            format: string;
            /**
             * Schema
             * @description Schema that the file names.
             * @example AUTOMOTIVE_DESIGN
             */
            schema?: string;
            /**
             * System
             * @description System that wrote the file, as the file says.
             */
            system?: string;
            /**
             * Units
             * @description Names of the units of length in the file; that of the surface is first.
             */
            units: string[];
            /**
             * Metres Per Unit
             * @description Metres in a unit of the surface; missing if the file does not say.
             */
            metres_per_unit?: number;
            /**
             * Uncertainty
             * @description The largest uncertainty of lengths that the file states, in units of the surface.
             */
            uncertainty?: number;
            /**
             * Products
             * @description Products, each once, however often it is placed; so are all counts.
             */
            products: number;
            /**
             * Solids
             * @description Solids.
             */
            solids: number;
            /**
             * Closed Shells
             * @description Closed shells.
             */
            closed_shells: number;
            /**
             * Open Shells
             * @description Open shells; loose faces are one.
             */
            open_shells: number;
            /**
             * Faces
             * @description Faces of the surface.
             */
            faces: number;
            /**
             * Skipped Entities
             * @description Numbers of entities that were not read, by their keyword or type.
             * @example {
             *       "GEOMETRIC_SET": 2
             *     }
             */
            skipped_entities: {
                [key: string]: number;
            };
            /**
             * Skipped Faces
             * @description All faces of the file that are not in the surface.
             */
            skipped_faces: components["schemas"]["UnreadFace"][];
            /**
             * Changed Names
             * @description Names that were shortened, or lost characters that names cannot have.
             */
            changed_names: number;
            /**
             * Edge Gap
             * @description Largest distance from an edge to a surface that was found, in units of the surface.
             */
            edge_gap: number;
            /**
             * Vertex Gap
             * @description Largest distance from a vertex to an edge that was found.
             */
            vertex_gap: number;
            /**
             * Unfollowed References
             * @description References to other files; none of them was opened.
             */
            unfollowed_references: number;
            /**
             * Open Edges
             * @description Edges of only one face. Where faces do not share edges in the file (IGES): the borders of
             *     open shells, and borders that agree only in part; else in shells that the file calls closed,
             *     which are then read as open.
             */
            open_edges: number;
        };
        /**
         * Refusal
         * @description A reason for which `POST /v1/mesh` would refuse the request.
         */
        Refusal: {
            /**
             * Formats
             * @description The formats that would be refused.
             */
            formats: ("glb" | "gltf" | "json" | "oogl" | "stl" | "obj" | "ply" | "off" | "3mf" | "npz")[];
            /**
             * Code
             * @description The code of the error that `POST /v1/mesh` would return.
             */
            code: string;
            /**
             * Pointer
             * @description JSON pointer (RFC 6901) into the body.
             */
            pointer: string;
            /**
             * Detail
             * @description Text of the error, for people.
             */
            detail: string;
            /**
             * Got
             * @description A description of the input, which does not repeat it.
             */
            got: string;
            /**
             * Needed
             * @description A description of valid input.
             */
            needed: string;
        };
        /**
         * RestrictDefinition
         * @description Cuts a piece out of one patch or a B-spline.
         *
         *     The piece of a patch is a patch with parameters from 0 to 1. The piece of a B-spline keeps its
         *     parameters and its knots inside the piece; a direction that is cut is clamped. Of a periodic
         *     B-spline, a piece may go over the seam: it begins at most one period below the domain, and is at
         *     most one period long.
         */
        RestrictDefinition: {
            /**
             * Op
             * @description The operation.
             * @constant
             */
            op: "restrict";
            /**
             * U
             * @description First and last u of the piece; by default the whole range.
             * @example [
             *       0.25,
             *       0.75
             *     ]
             */
            u?: [
                number,
                number
            ];
            /**
             * V
             * @description First and last v of the piece; by default the whole range.
             * @example [
             *       0,
             *       0.5
             *     ]
             */
            v?: [
                number,
                number
            ];
            /**
             * Patch
             * @description For `patches`, `multipatch` and `group`: the number of the patch that is changed, from 0, as POST /v1/points counts it. Its surface or member keeps its place, its name and its placement; a B-spline in a group is changed as a whole. Needed if there are several.
             * @example 0
             */
            patch?: number;
        };
        /**
         * ReverseDefinition
         * @description Reverses u or v of every patch. Normals change their sign.
         *
         *     In a triangle, `u` exchanges r and s, and `v` exchanges r and t. Knots that are numbers over [a,
         *     b] become numbers over [−b, −a], without rounding; named knots do not change. Reversing a
         *     surface twice gives the same surface.
         */
        ReverseDefinition: {
            /**
             * Op
             * @description The operation.
             * @constant
             */
            op: "reverse";
            /**
             * Direction
             * @description The parameter that runs backwards.
             * @example u
             * @enum {string}
             */
            direction: "u" | "v";
            /**
             * Patch
             * @description For `patches`, `multipatch` and `group`: the number of the patch that is changed, from 0, as POST /v1/points counts it. Its surface or member keeps its place, its name and its placement; a B-spline in a group is changed as a whole. By default all are changed.
             * @example 0
             */
            patch?: number;
        };
        /**
         * RibbonDefinition
         * @description A flat stripe along a curve that faces a direction, or a camera.
         *
         *     The line across the ribbon is at right angles to the curve and to the direction that the ribbon
         *     faces. `resolution` is the number of divisions of each Bézier piece of the curve. Corners up to
         *     90° are mitred, and sharper corners are rounded. Where the line turns round at a corner, or gets
         *     another width at a control point that is repeated, no faces join its two directions or widths.
         */
        RibbonDefinition: {
            /**
             * Type
             * @description The kind of surface.
             * @constant
             */
            type: "ribbon";
            /**
             * @description The curve along which the surface runs. Its `up` and `name` are ignored; the surface has its own.
             * @example {
             *       "control_points": [
             *         [
             *           0,
             *           0,
             *           0
             *         ],
             *         [
             *           1,
             *           2,
             *           0
             *         ],
             *         [
             *           3,
             *           2,
             *           1
             *         ],
             *         [
             *           4,
             *           0,
             *           1
             *         ]
             *       ]
             *     }
             */
            curve: components["schemas"]["CurveDefinition"];
            /**
             * Width
             * @description Width. One number, or a list of the coefficients of a Bézier function over the whole curve. The function has the first coefficient as its value at the beginning of the curve, and the last as its value at the end. No coefficient is negative, and at least one is above 0.
             * @example 0.2
             * @example [
             *       0,
             *       0.3,
             *       0
             *     ]
             */
            width: number | number[];
            /**
             * Facing
             * @description Direction that the ribbon faces, of any length but 0. The default, without a `camera`, is [0, 0, 1].
             * @example [
             *       0,
             *       1,
             *       0
             *     ]
             */
            facing?: [
                number,
                number,
                number
            ];
            /**
             * Camera
             * @description A point that the ribbon faces, in place of a direction.
             * @example [
             *       0,
             *       2,
             *       10
             *     ]
             */
            camera?: [
                number,
                number,
                number
            ];
            /**
             * Up
             * @description The model's vertical axis. With `z`, the root node of a glTF file rotates the model, since y is up in glTF; the coordinates do not change.
             * @default y
             * @example z
             * @enum {string}
             */
            up?: "y" | "z";
            /**
             * Name
             * @description Name of the surface or curve. Its part, its node in glTF and a comment in OOGL have this name.
             * @default ribbon
             * @example sail
             */
            name?: string;
        };
        /**
         * Section
         * @description The section of a surface by one plane.
         */
        Section: {
            /**
             * Normal
             * @description Unit normal of the plane.
             */
            normal: [
                number,
                number,
                number
            ];
            /**
             * Offset
             * @description Signed distance of the plane from the origin, along the normal.
             */
            offset: number;
            /**
             * X Axis
             * @description Unit vector along x in the coordinates of the plane, which the SVG format uses.
             */
            x_axis: [
                number,
                number,
                number
            ];
            /**
             * Y Axis
             * @description Unit vector along y in the coordinates of the plane: x × y is the normal.
             */
            y_axis: [
                number,
                number,
                number
            ];
            /**
             * Polylines
             * @description The polylines; empty where the plane does not cut the surface.
             */
            polylines: components["schemas"]["SectionLine"][];
            /**
             * Touching
             * @description Points where the surface touches the plane, or is closer to it than rounding can resolve.
             */
            touching: [
                number,
                number,
                number
            ][];
            /**
             * Coplanar
             * @description Indices of the patches that lie in the plane, or of faces of a brep, in the order of the
             *     request; their border is part of the polylines.
             */
            coplanar: number[];
        };
        /**
         * SectionLine
         * @description A polyline of a section.
         */
        SectionLine: {
            /**
             * Closed
             * @description Whether the polyline is closed; its last point is then equal to its first.
             */
            closed: boolean;
            /**
             * Points
             * @description Points of the surface and of the plane, in model units. Seen from the tip of the plane's
             *     normal, the normals of the surface point to the right of the polyline.
             */
            points: [
                number,
                number,
                number
            ][];
        };
        /**
         * SectionReport
         * @description Facts about all sections.
         */
        SectionReport: {
            /**
             * Planes
             * @description Number of planes.
             */
            planes: number;
            /**
             * Polylines
             * @description Number of polylines.
             */
            polylines: number;
            /**
             * Points
             * @description Number of points of all polylines.
             */
            points: number;
            /**
             * Deviation Bound
             * @description Proved, in model units: no point of a section is further than this from its polylines.
             */
            deviation_bound: number;
            /**
             * Skipped Faces
             * @description For a brep with `"invalid_faces": "skip"`: invalid faces that took no part; left out if there
             *     are none.
             */
            skipped_faces?: components["schemas"]["LeftOutFace"][];
            /**
             * Engine
             * @description Version of the engine: equal requests give equal numbers while it is the same.
             */
            engine: number;
        };
        /**
         * Sections
         * @description Sections of a surface by planes, in their order.
         */
        Sections: {
            /**
             * Sections
             * @description The section by each plane.
             */
            sections: components["schemas"]["Section"][];
            report: components["schemas"]["SectionReport"];
        };
        /**
         * SelectDefinition
         * @description Answers with a brep of some faces, with their edges and vertices.
         *
         *     Faces, edges and vertices get new numbers: faces in the order of the operation, the others in
         *     their own order. A shell stays closed only if all its faces are chosen.
         */
        SelectDefinition: {
            /**
             * Op
             * @description The operation.
             * @constant
             */
            op: "select";
            /**
             * Faces
             * @description The numbers of the faces, from 0, each once.
             * @example [
             *       0
             *     ]
             */
            faces: number[];
            /**
             * Member
             * @description Of a group, the number of the member, from 0, which is a brep; the result has no placement.
             * @example 0
             */
            member?: number;
        };
        /**
         * ShellDefinition
         * @description A shell: faces that are connected at their edges.
         */
        ShellDefinition: {
            /**
             * Faces
             * @description The numbers of the faces, from 0. Each face belongs to one shell.
             * @example [
             *       0,
             *       1,
             *       2,
             *       3,
             *       4,
             *       5
             *     ]
             */
            faces: number[];
            /**
             * Closed
             * @description Whether the shell is closed: then it is refused if an edge of it has a border.
             * @default false
             */
            closed?: boolean;
        };
        /**
         * SignRequest
         * @description A URL to be signed: until it expires, any client may read it without a key.
         */
        SignRequest: {
            /**
             * Url
             * @description URL of a surface or of a mesh, without the host, as in the `links` of a stored surface; options of a mesh may follow as a query.
             * @example /v1/surfaces/utah-teapot/mesh.glb?resolution=16
             */
            url: string;
            /**
             * Expires
             * @description The time when the URL expires, in seconds since 1970 (Unix time); at most seven days from now. The same time always gives the same URL, which browsers can cache.
             * @example 1800000000
             */
            expires?: number;
            /**
             * Seconds
             * @description Seconds from now until the URL expires, in place of `expires`.
             * @example 3600
             */
            seconds?: number;
        };
        /**
         * SignedAddress
         * @description A URL that any client may read without a key.
         */
        SignedAddress: {
            /**
             * Url
             * @description The URL, with `expires` and `signature` at its end.
             */
            url: string;
            /**
             * Expires
             * @description The time when it expires, in Unix time.
             */
            expires: number;
        };
        /**
         * SkippedFace
         * @description A face of a brep that was left out: it is invalid, or becomes so at this tolerance.
         */
        SkippedFace: {
            /**
             * Face
             * @description Number of the face in the brep.
             */
            face: number;
            /**
             * Code
             * @description The code of the error that would refuse the brep.
             */
            code: string;
            /**
             * Got
             * @description A description of the face, with figures.
             */
            got: string;
            /**
             * Needed
             * @description A description of a valid face.
             */
            needed: string;
        };
        /**
         * SplitDefinition
         * @description Splits one patch or a B-spline into two or four pieces, or a triangle into three.
         *
         *     A patch becomes `patches` over shared vertices. A B-spline becomes a `group` of B-splines that
         *     keep their parameters; as a member of a group, a `multipatch` of them. Piece k along u and l
         *     along v has the number k · (number of pieces along v) + l. A triangle is split at a point into
         *     three triangles, each between the point and one side: the point replaces the corner r = 1 in the
         *     first, s = 1 in the second, t = 1 in the third.
         */
        SplitDefinition: {
            /**
             * Op
             * @description The operation.
             * @constant
             */
            op: "split";
            /**
             * U
             * @description Where to cut across u: inside the surface's domain.
             * @example 0.5
             */
            u?: number;
            /**
             * V
             * @description Where to cut across v: inside the surface's domain.
             * @example 0.25
             */
            v?: number;
            /**
             * At
             * @description Where to cut a triangle: barycentric coordinates [r, s, t] of a point inside.
             * @example [
             *       0.25,
             *       0.25,
             *       0.5
             *     ]
             */
            at?: [
                number,
                number,
                number
            ];
            /**
             * Patch
             * @description For `patches`, `multipatch` and `group`: the number of the patch that is changed, from 0, as POST /v1/points counts it. Its surface or member keeps its place, its name and its placement; a B-spline in a group is changed as a whole. Needed if there are several.
             * @example 0
             */
            patch?: number;
        };
        /**
         * StoredEntry
         * @description A stored surface in a list.
         */
        StoredEntry: {
            /**
             * Id
             * @description SHA-256 of the content: 64 hexadecimal digits.
             */
            id: string;
            /**
             * Bytes
             * @description Bytes of the content.
             */
            bytes: number;
            /**
             * Time
             * @description When it was stored, or stored again after damage: RFC 3339, UTC.
             * @example 2026-01-31T12:00:00.000Z
             */
            time: string;
        };
        /**
         * StoredLinks
         * @description URLs, without the host.
         */
        StoredLinks: {
            /**
             * Self
             * @description URL of the definition.
             */
            self: string;
            /**
             * Mesh
             * @description URL of the mesh by suffix, for this version of the engine: clients may cache the mesh for
             *     ever. Add options before `engine`, which is at the end of a canonical URL.
             */
            mesh: {
                /** @description glTF 2.0, binary. */
                glb: string;
                /** @description glTF 2.0, one JSON document. */
                gltf: string;
                /** @description Vertices and faces as JSON. */
                json: string;
                /** @description OOGL, read by Geomview. */
                oogl: string;
                /** @description STL, binary. */
                stl: string;
                /** @description Wavefront OBJ. */
                obj: string;
                /** @description PLY, binary. */
                ply: string;
                /** @description OFF. */
                off: string;
                /** @description 3MF, binary. */
                "3mf": string;
                /** @description Arrays of NumPy, binary. */
                npz: string;
            };
            /**
             * Image
             * @description URL of the picture, for this version of the engine, as that of the mesh.
             */
            image: string;
        };
        /**
         * StoredList
         * @description Stored surfaces in the order of their ids.
         */
        StoredList: {
            /**
             * Surfaces
             * @description The surfaces, at most `limit`.
             */
            surfaces: components["schemas"]["StoredEntry"][];
            links: components["schemas"]["PageLinks"];
        };
        /**
         * StoredSurface
         * @description A stored surface.
         */
        StoredSurface: {
            /**
             * Id
             * @description SHA-256 of the content: 64 hexadecimal digits.
             */
            id: string;
            links: components["schemas"]["StoredLinks"];
            /** @description The report of reading, if the surface came from a CAD file. It is not stored. */
            reading?: components["schemas"]["Reading"];
        };
        /** @description A surface: its `type` names the kind; the default is `bezier`. */
        SurfaceDefinition: components["schemas"]["BezierDefinition"] | components["schemas"]["BsplineDefinition"] | components["schemas"]["PatchesDefinition"] | components["schemas"]["TriangleDefinition"] | components["schemas"]["MultipatchDefinition"] | components["schemas"]["TubeDefinition"] | components["schemas"]["RibbonDefinition"] | components["schemas"]["BrepDefinition"] | components["schemas"]["GroupDefinition"];
        /**
         * SurfaceDocument
         * @description A surface without options. Clients may add options, and send it to the other calls.
         */
        SurfaceDocument: {
            /** @description The definition, in the form of a request. */
            surface: components["schemas"]["SurfaceDefinition"];
            /** @description The report of reading, if the surface came from a CAD file. Other calls ignore it. */
            reading?: components["schemas"]["Reading"];
            /** @description The report of the last operation `orient`. Other calls ignore it. */
            orientation?: components["schemas"]["Orientation"];
        };
        /**
         * SurfaceLinks
         * @description URLs, without the host.
         */
        SurfaceLinks: {
            /**
             * Self
             * @description URL of the definition.
             */
            self: string;
            /**
             * Mesh
             * @description URL of the mesh by suffix; add options as a query.
             */
            mesh: {
                /** @description glTF 2.0, binary. */
                glb: string;
                /** @description glTF 2.0, one JSON document. */
                gltf: string;
                /** @description Vertices and faces as JSON. */
                json: string;
                /** @description OOGL, read by Geomview. */
                oogl: string;
                /** @description STL, binary. */
                stl: string;
                /** @description Wavefront OBJ. */
                obj: string;
                /** @description PLY, binary. */
                ply: string;
                /** @description OFF. */
                off: string;
                /** @description 3MF, binary. */
                "3mf": string;
                /** @description Arrays of NumPy, binary. */
                npz: string;
            };
            /**
             * Image
             * @description URL of the picture; add options as a query.
             */
            image: string;
        };
        /**
         * SurfaceList
         * @description The built-in surfaces.
         */
        SurfaceList: {
            /**
             * Surfaces
             * @description The built-in surfaces, one entry each.
             */
            surfaces: components["schemas"]["SurfaceSummary"][];
        };
        /**
         * SurfaceMeasures
         * @description Measures of a surface, in the units of its control points.
         */
        SurfaceMeasures: {
            /** @description The area of all patches. */
            area: components["schemas"]["Interval"];
            /**
             * Volume
             * @description The volume that the patches enclose: positive where normals point outwards, and negative
             *     where they point inwards. Left out of surfaces that are open or not consistently oriented.
             */
            volume?: components["schemas"]["Interval"];
            /**
             * Centroid
             * @description The centroid of that volume, x, y, z.
             */
            centroid?: [
                components["schemas"]["Interval"],
                components["schemas"]["Interval"],
                components["schemas"]["Interval"]
            ];
            /**
             * Closed
             * @description Whether the surface has no border and a consistent orientation: on every edge, as many sides
             *     run in one direction as in the other.
             */
            closed: boolean;
            /** @description The length of all open borders. */
            boundary_length: components["schemas"]["Interval"];
            /**
             * Boundary Count
             * @description Number of open borders.
             */
            boundary_count: number;
            /**
             * Boundaries
             * @description The first 100 open borders.
             */
            boundaries: components["schemas"]["Boundary"][];
            /**
             * Open Edges
             * @description Number of sides that share their edge with no other side.
             */
            open_edges: number;
            /**
             * Inconsistent Edges
             * @description Number of sides on shared edges whose sides are not pairs of opposite directions.
             */
            inconsistent_edges: number;
            /**
             * Faulty Edges
             * @description The first 100 of the open and the inconsistent sides.
             */
            faulty_edges: components["schemas"]["FaultyEdge"][];
            /**
             * Parts
             * @description The parts in their order, or the members of a group. Their intervals are as exact as the
             *     whole surface needs: for a small part they may be wider than `tolerance`.
             */
            parts: components["schemas"]["PartMeasures"][];
            /**
             * Reached
             * @description Whether all intervals of the whole surface are at most `tolerance` wide. They are wider where
             *     rounding or gaps that were closed (`moved`) require it, where a quantity takes more work than
             *     one request may take, and for a volume of zero.
             */
            reached: boolean;
            /**
             * Moved
             * @description The largest distance by which control points were moved so that borders meet. The intervals
             *     include the effect of this.
             */
            moved: number;
            /**
             * Edge Lengths
             * @description The lengths of the edges of breps, member after member: the first 100,000. This and the next
             *     fields are only for breps, and groups with breps, whose areas are those of faces as parameter
             *     curves trim them.
             */
            edge_lengths?: components["schemas"]["Interval"][];
            /**
             * Gap Bound
             * @description Proved: no point of an edge is further than this from the border of a face. The interval of
             *     the volume includes all ways to close the gaps between faces within this distance of edges.
             */
            gap_bound?: number;
            /**
             * Skipped Faces
             * @description Invalid faces that were left out, with `"invalid_faces": "skip"`, if there are any. A brep
             *     with such faces is not closed.
             */
            skipped_faces?: components["schemas"]["LeftOutFace"][];
        };
        /**
         * SurfaceRequest
         * @description A surface to store.
         */
        SurfaceRequest: {
            /** @description The surface, by its control points. */
            surface: components["schemas"]["SurfaceDefinition"];
            /**
             * Reading
             * @description The report of reading a file, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "faces": 300,
             *       "format": "step",
             *       "skipped_faces": []
             *     }
             */
            reading?: Record<string, never>;
            /**
             * Orientation
             * @description The report of the operation `orient`, as a response of `POST /v1/convert` has it beside the surface. It is ignored, so that the response can be sent as it is.
             * @example {
             *       "not_orientable": [],
             *       "turned": [
             *         2
             *       ]
             *     }
             */
            orientation?: Record<string, never>;
        };
        /**
         * SurfaceSummary
         * @description A built-in surface.
         */
        SurfaceSummary: {
            /**
             * Id
             * @description A readable id.
             */
            id: string;
            /**
             * Title
             * @description A short title.
             */
            title: string;
            /**
             * Description
             * @description A sentence about the surface.
             */
            description: string;
            /**
             * Up
             * @description The vertical axis.
             * @enum {string}
             */
            up: "y" | "z";
            /**
             * Patches
             * @description Number of Bézier patches, also of the surfaces of faces; tubes and ribbons have none.
             */
            patches: number;
            /**
             * Degree
             * @description Highest degrees [p, q] of its patches. For a triangle of degree n, [n, n]; for a tube or a
             *     ribbon, the degree of its curve, and 0.
             */
            degree: [
                number,
                number
            ];
            links: components["schemas"]["SurfaceLinks"];
        };
        /**
         * TransposeDefinition
         * @description Exchanges u and v of every patch, or s and t of a triangle. Normals change their sign.
         */
        TransposeDefinition: {
            /**
             * Op
             * @description The operation.
             * @constant
             */
            op: "transpose";
            /**
             * Patch
             * @description For `patches`, `multipatch` and `group`: the number of the patch that is changed, from 0, as POST /v1/points counts it. Its surface or member keeps its place, its name and its placement; a B-spline in a group is changed as a whole. By default all are changed.
             * @example 0
             */
            patch?: number;
        };
        /**
         * TriangleConversion
         * @description Converts half of a patch of degree (p, q) to a triangular patch of degree p + q.
         *
         *     The corners r = 1, s = 1 and t = 1 of the triangle are at (u, v) = (0, 0), (1, 0) and (0, 1) for
         *     the `lower` half, and at (1, 1), (0, 1) and (1, 0) for the `upper` half. The conversion is
         *     exact.
         */
        TriangleConversion: {
            /**
             * Op
             * @description The operation.
             * @constant
             */
            op: "triangle";
            /**
             * Half
             * @description Which half: `lower` or `upper` of the diagonal from (1, 0) to (0, 1).
             * @example lower
             * @enum {string}
             */
            half: "lower" | "upper";
            /**
             * Patch
             * @description For `patches`, `multipatch` and `group`: the number of the patch that is changed, from 0, as POST /v1/points counts it. Its surface or member keeps its place, its name and its placement; a B-spline in a group is changed as a whole. Needed if there are several.
             * @example 0
             */
            patch?: number;
        };
        /**
         * TriangleDefinition
         * @description One triangular Bézier patch of any degree, rational if weights are given.
         *
         *     S(r, s, t) = Σ n!/(i! j! k!) r^i s^j t^k w_ijk b_ijk / Σ n!/(i! j! k!) r^i s^j t^k w_ijk for
         *     r + s + t = 1. The net has n + 1 rows of n + 1, n, … 1 control points. Row k has the points
         *     b_ijk with this k, in the order of ascending j. So the first row is the side t = 0, and the last
         *     row is the corner t = 1.
         */
        TriangleDefinition: {
            /**
             * Type
             * @description The kind of surface.
             * @constant
             */
            type: "triangle";
            /**
             * Homogeneous
             * @description Whether control points are homogeneous: [w x, w y, w z, w], with no `weights` beside them. A point with w = 0 is a direction. If a w is 0 or negative, but none at a corner, the degree is raised, to 64 at most, until all weights are positive; this does not change the surface. It is stored, answered and hashed as points and weights.
             * @default false
             * @example true
             */
            homogeneous?: boolean;
            /**
             * Control Net
             * @description Control points [x, y, z], or [x, y] in the plane z = 0, row by row; [w x, w y, w z, w] if they are `homogeneous`. Each row has one point less than the row before. At least two rows; every coordinate is finite and within single precision. Seen from the side to which the normal points, each row goes from left to right, and is above the row before.
             * @example [
             *       [
             *         [
             *           0,
             *           0,
             *           0
             *         ],
             *         [
             *           1,
             *           0,
             *           1
             *         ],
             *         [
             *           2,
             *           0,
             *           0
             *         ]
             *       ],
             *       [
             *         [
             *           0,
             *           1,
             *           1
             *         ],
             *         [
             *           1,
             *           1,
             *           1
             *         ]
             *       ],
             *       [
             *         [
             *           0,
             *           2,
             *           0
             *         ]
             *       ]
             *     ]
             */
            control_net: ([
                number,
                number,
                number
            ] | [
                number,
                number
            ] | [
                number,
                number,
                number,
                number
            ])[][];
            /**
             * Weights
             * @description One weight for every control point, in the same rows: positive, or 0 for a point that does not pull and is no corner. Left out, the surface is polynomial.
             * @example [
             *       [
             *         1,
             *         0.7071067811865476,
             *         1
             *       ],
             *       [
             *         0.7071067811865476,
             *         0.7071067811865476
             *       ],
             *       [
             *         1
             *       ]
             *     ]
             */
            weights?: number[][];
            /**
             * Colors
             * @description Colours. sRGB, each number from 0 to 1: [r, g, b], or [r, g, b, a] with the opacity. Formats without colours omit them. glTF files contain linear RGB, as the specification of glTF requires. In rows as in the control net: each row has one value less than the row before. The degree of this net may differ from that of the control net; degree 0 is one value.
             * @example [
             *       [
             *         [
             *           0.8,
             *           0.1,
             *           0.1
             *         ],
             *         [
             *           0.9,
             *           0.9,
             *           0.2
             *         ]
             *       ],
             *       [
             *         [
             *           0.1,
             *           0.2,
             *           0.8
             *         ]
             *       ]
             *     ]
             */
            colors?: number[][][];
            /**
             * Uvs
             * @description Texture coordinates [u, v], written without change. Vertices of the mesh then have texture coordinates also without the option `uvs`. In rows as in the control net: each row has one value less than the row before. The degree of this net may differ from that of the control net; degree 0 is one value.
             * @example [
             *       [
             *         [
             *           0,
             *           0
             *         ],
             *         [
             *           1,
             *           0
             *         ]
             *       ],
             *       [
             *         [
             *           0,
             *           1
             *         ]
             *       ]
             *     ]
             */
            uvs?: [
                number,
                number
            ][][];
            /**
             * Attributes
             * @description Functions of the parameters, by name: a temperature, a fourth coordinate. Every value is a list of 1 to 16 numbers. JSON has attributes by name. glTF has them as `_NAME`, split into pieces of four if there are more than four numbers. PLY has them as properties, sorted by name. In rows as in the control net: each row has one value less than the row before. The degree of this net may differ from that of the control net; degree 0 is one value.
             * @example {
             *       "temperature": [
             *         [
             *           [
             *             20
             *           ],
             *           [
             *             20
             *           ]
             *         ],
             *         [
             *           [
             *             35
             *           ]
             *         ]
             *       ]
             *     }
             */
            attributes?: {
                [key: string]: number[][][];
            };
            /**
             * Up
             * @description The model's vertical axis. With `z`, the root node of a glTF file rotates the model, since y is up in glTF; the coordinates do not change.
             * @default y
             * @example z
             * @enum {string}
             */
            up?: "y" | "z";
            /**
             * Name
             * @description Name of the surface or curve. Its part, its node in glTF and a comment in OOGL have this name.
             * @default surface
             * @example sail
             */
            name?: string;
        };
        /**
         * TubeDefinition
         * @description A round tube about a curve: a wire, a hair, a knot.
         *
         *     From ring to ring the tube turns about the curve as little as possible. A closed curve gives a
         *     closed tube. `resolution` is the number of divisions of each Bézier piece of the curve. Corners
         *     up to 90° are mitred, and sharper corners are rounded. Where radius × curvature exceeds 1, the
         *     tube intersects itself; where it is 1, the inside of the bend is one vertex. A control point
         *     that is repeated adds no faces.
         */
        TubeDefinition: {
            /**
             * Type
             * @description The kind of surface.
             * @constant
             */
            type: "tube";
            /**
             * @description The curve along which the surface runs. Its `up` and `name` are ignored; the surface has its own.
             * @example {
             *       "control_points": [
             *         [
             *           0,
             *           0,
             *           0
             *         ],
             *         [
             *           1,
             *           2,
             *           0
             *         ],
             *         [
             *           3,
             *           2,
             *           1
             *         ],
             *         [
             *           4,
             *           0,
             *           1
             *         ]
             *       ]
             *     }
             */
            curve: components["schemas"]["CurveDefinition"];
            /**
             * Radius
             * @description Radius. One number, or a list of the coefficients of a Bézier function over the whole curve. The function has the first coefficient as its value at the beginning of the curve, and the last as its value at the end. No coefficient is negative, and at least one is above 0.
             * @example 0.1
             * @example [
             *       0.2,
             *       0.1,
             *       0
             *     ]
             */
            radius: number | number[];
            /**
             * Sides
             * @description Sides of the regular polygon that approximates the circle.
             * @default 16
             * @example 48
             */
            sides?: number;
            /**
             * Caps
             * @description Whether the ends of an open tube are closed by flat discs, which have normals of their own. An end where the radius is 0 is a point.
             * @default true
             */
            caps?: boolean;
            /**
             * Up
             * @description The model's vertical axis. With `z`, the root node of a glTF file rotates the model, since y is up in glTF; the coordinates do not change.
             * @default y
             * @example z
             * @enum {string}
             */
            up?: "y" | "z";
            /**
             * Name
             * @description Name of the surface or curve. Its part, its node in glTF and a comment in OOGL have this name.
             * @default tube
             * @example sail
             */
            name?: string;
        };
        /**
         * UnreadFace
         * @description A face of a CAD file that is not in the surface.
         */
        UnreadFace: {
            /**
             * Entity
             * @description Its number in the file.
             * @example #120
             */
            entity: string;
            /**
             * Reason
             * @description Why it could not be read.
             */
            reason: string;
        };
        /**
         * UntrimDefinition
         * @description Answers with the whole surface of one face of a brep: a patch or a B-spline.
         *
         *     Its parameters are those of the face, also if the face is reversed. It has the name of the face,
         *     or else of the brep.
         */
        UntrimDefinition: {
            /**
             * Op
             * @description The operation.
             * @constant
             */
            op: "untrim";
            /**
             * Face
             * @description The number of the face, from 0. Needed without `patch`.
             * @example 0
             */
            face?: number;
            /**
             * Member
             * @description Of a group, the number of the member, from 0, which is a brep; the result has no placement.
             * @example 0
             */
            member?: number;
            /**
             * Patch
             * @description In place of both: the number of the face among all faces and patches, as POST /v1/points counts them.
             * @example 0
             */
            patch?: number;
        };
    };
    responses: {
        /** @description The body is not JSON. The body is not of the type that its `Content-Type` says. */
        MalformedJson: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description This call needs a key. The service does not know this key. */
        KeyNeeded: {
            headers: {
                /**
                 * @description How to send a key (RFC 6750).
                 * @example Bearer realm="surface"
                 */
                "WWW-Authenticate": string;
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description This key does not permit this call. */
        ScopeNeeded: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description This key does not permit this call. The signature does not belong to this URL. The signature of this URL has expired. */
        Forbidden: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description Too many requests in a short time; `Retry-After` says when to try again. */
        TooManyRequests: {
            headers: {
                /**
                 * @description Seconds after which to try again.
                 * @example 3
                 */
                "Retry-After": number;
                "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                RateLimit: components["headers"]["RateLimit"];
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description No surface has this id. No format has this suffix. */
        UnknownSurface: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description This URL does not support this method; `Allow` lists the methods that it supports. */
        MethodNotAllowed: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The service writes no format or coding that you accept. */
        NotAcceptable: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The service writes no format or coding that you accept. */
        CodingNotAcceptable: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The URL names a version of the engine (`engine=…`) that this service does not have. */
        EngineGone: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The body did not arrive in time. */
        BodyTooSlow: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The body has too many bytes. */
        BodyTooLarge: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description This call does not read bodies of this type, or compressed ones. */
        UnsupportedMediaType: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The surface or an option is invalid; `errors` says what and where. A query parameter is invalid; `errors` says which. The format cannot store what the request asks for. The result would exceed a limit. */
        InvalidRequest: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The surface or an option is invalid; `errors` says what and where. The format cannot store what the request asks for. */
        InvalidQuery: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The stored surface is damaged and was not sent. To repair it, store the surface again. The service has made an error and has logged it. You may try again. */
        DamagedObject: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The service is busy; nothing was computed. `Retry-After` says when to try again. Too many requests in a short time; `Retry-After` says when to try again. Your requests have used too much computing time; `Retry-After` says when to try again. */
        Busy: {
            headers: {
                /**
                 * @description Seconds after which to try again.
                 * @example 3
                 */
                "Retry-After": number;
                "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                RateLimit: components["headers"]["RateLimit"];
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The result was not ready in time: the service is busy, or the request asks for much work. `Retry-After` says when to try again; a job has more time (`Prefer: respond-async`). */
        OutOfTime: {
            headers: {
                /**
                 * @description Seconds after which to try again.
                 * @example 3
                 */
                "Retry-After": number;
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The store does not work at the moment. The service has logged the error. */
        StoreFailed: {
            headers: {
                /**
                 * @description Seconds after which to try again.
                 * @example 3
                 */
                "Retry-After": number;
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The result was not ready in time: the service is busy, or the request asks for much work. `Retry-After` says when to try again; a job has more time (`Prefer: respond-async`). The store does not work at the moment. The service has logged the error. */
        Unavailable: {
            headers: {
                /**
                 * @description Seconds after which to try again.
                 * @example 3
                 */
                "Retry-After": number;
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The surface or an option is invalid; `errors` says what and where. */
        InvalidJob: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description No job has this id. */
        UnknownJob: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The part has no result now, or there is no such part. */
        UnknownResult: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description You have the largest number of jobs that have not ended; `Retry-After` says when to try again. The service is busy; nothing was computed. `Retry-After` says when to try again. Too many requests in a short time; `Retry-After` says when to try again. */
        TooManyJobs: {
            headers: {
                /**
                 * @description Seconds after which to try again.
                 * @example 3
                 */
                "Retry-After": number;
                "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                RateLimit: components["headers"]["RateLimit"];
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The store has no room for another job; nothing was accepted. The store has no room for another surface; nothing was stored. */
        JobQuotaFull: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The store has no room for another surface; nothing was stored. */
        StoreFull: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        /** @description The service has made an error and has logged it. You may try again. */
        InternalError: {
            headers: {
                "X-Request-Id": components["headers"]["RequestId"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
    };
    parameters: never;
    requestBodies: never;
    headers: {
        /**
         * @description Id of the request. The operator finds it in the log, so quote it in a question. A client may send its own in this header, of at most 128 letters, digits and `._:/+=@-`; otherwise the service makes a random one.
         * @example 0af7651916cd43dd8448eb211c80319c
         */
        RequestId: string;
        /**
         * @description Sent if requests or their computing time are limited (`SURFACE_RATE_LIMIT`, `SURFACE_COMPUTE_LIMIT`): with one key, or from one address, `q` requests, or thread seconds, are allowed in `w` seconds (draft-ietf-httpapi-ratelimit-headers).
         * @example "requests";q=60;w=60, "compute";q=30;w=60;qu="thread-seconds"
         */
        "RateLimit-Policy": string;
        /**
         * @description Sent with `RateLimit-Policy`: `r`, how many requests or thread seconds may follow at once, and `t`, the seconds until all `q` may.
         * @example "requests";r=57;t=3, "compute";r=29;t=1
         */
        RateLimit: string;
    };
    pathItems: never;
}
export type BezierConversion = components['schemas']['BezierConversion'];
export type BezierCurveDefinition = components['schemas']['BezierCurveDefinition'];
export type BezierDefinition = components['schemas']['BezierDefinition'];
export type BezierNet = components['schemas']['BezierNet'];
export type Boundary = components['schemas']['Boundary'];
export type Bounds = components['schemas']['Bounds'];
export type BrepDefinition = components['schemas']['BrepDefinition'];
export type BsplineCurveDefinition = components['schemas']['BsplineCurveDefinition'];
export type BsplineDefinition = components['schemas']['BsplineDefinition'];
export type BsplineNet = components['schemas']['BsplineNet'];
export type CameraDefinition = components['schemas']['CameraDefinition'];
export type CheckRequest = components['schemas']['CheckRequest'];
export type CheckedMesh = components['schemas']['CheckedMesh'];
export type ClosestPoints = components['schemas']['ClosestPoints'];
export type CollapsedEdges = components['schemas']['CollapsedEdges'];
export type ConvertRequest = components['schemas']['ConvertRequest'];
export type CurvatureRange = components['schemas']['CurvatureRange'];
export type Curve = components['schemas']['Curve'];
export type CurveBounds = components['schemas']['CurveBounds'];
export type CurveDefinition = components['schemas']['CurveDefinition'];
export type CurveReport = components['schemas']['CurveReport'];
export type CurveRequest = components['schemas']['CurveRequest'];
export type Deviation = components['schemas']['Deviation'];
export type EdgeDefinition = components['schemas']['EdgeDefinition'];
export type EdgePlace = components['schemas']['EdgePlace'];
export type ElevateDefinition = components['schemas']['ElevateDefinition'];
export type Estimate = components['schemas']['Estimate'];
export type FaceDefinition = components['schemas']['FaceDefinition'];
export type FaultyEdge = components['schemas']['FaultyEdge'];
export type Format = components['schemas']['Format'];
export type FormatList = components['schemas']['FormatList'];
export type GroupDefinition = components['schemas']['GroupDefinition'];
export type Health = components['schemas']['Health'];
export type InsertDefinition = components['schemas']['InsertDefinition'];
export type IntersectRequest = components['schemas']['IntersectRequest'];
export type Intersections = components['schemas']['Intersections'];
export type Interval = components['schemas']['Interval'];
export type Issue = components['schemas']['Issue'];
export type Job = components['schemas']['Job'];
export type JobFile = components['schemas']['JobFile'];
export type JobLinks = components['schemas']['JobLinks'];
export type JobList = components['schemas']['JobList'];
export type JobRequest = components['schemas']['JobRequest'];
export type JobResult = components['schemas']['JobResult'];
export type JobResults = components['schemas']['JobResults'];
export type LeftOutFace = components['schemas']['LeftOutFace'];
export type LoopDefinition = components['schemas']['LoopDefinition'];
export type MeasureRequest = components['schemas']['MeasureRequest'];
export type MemberDefinition = components['schemas']['MemberDefinition'];
export type MemberSurfaceDefinition = components['schemas']['MemberSurfaceDefinition'];
export type Mesh = components['schemas']['Mesh'];
export type MeshCheck = components['schemas']['MeshCheck'];
export type MeshDefinition = components['schemas']['MeshDefinition'];
export type MeshFile = components['schemas']['MeshFile'];
export type MeshLines = components['schemas']['MeshLines'];
export type MeshPart = components['schemas']['MeshPart'];
export type MeshReport = components['schemas']['MeshReport'];
export type MeshRequest = components['schemas']['MeshRequest'];
export type MultipatchDefinition = components['schemas']['MultipatchDefinition'];
export type OperationDefinition = components['schemas']['OperationDefinition'];
export type OrientDefinition = components['schemas']['OrientDefinition'];
export type Orientation = components['schemas']['Orientation'];
export type PageLinks = components['schemas']['PageLinks'];
export type PartCounts = components['schemas']['PartCounts'];
export type PartDefinition = components['schemas']['PartDefinition'];
export type PartMeasures = components['schemas']['PartMeasures'];
export type PartReport = components['schemas']['PartReport'];
export type PatchesDefinition = components['schemas']['PatchesDefinition'];
export type PictureRequest = components['schemas']['PictureRequest'];
export type PlaneSet = components['schemas']['PlaneSet'];
export type Points = components['schemas']['Points'];
export type PointsRequest = components['schemas']['PointsRequest'];
export type Problem = components['schemas']['Problem'];
export type ProjectRequest = components['schemas']['ProjectRequest'];
export type RayHits = components['schemas']['RayHits'];
export type Rays = components['schemas']['Rays'];
export type Reading = components['schemas']['Reading'];
export type Refusal = components['schemas']['Refusal'];
export type RestrictDefinition = components['schemas']['RestrictDefinition'];
export type ReverseDefinition = components['schemas']['ReverseDefinition'];
export type RibbonDefinition = components['schemas']['RibbonDefinition'];
export type Section = components['schemas']['Section'];
export type SectionLine = components['schemas']['SectionLine'];
export type SectionReport = components['schemas']['SectionReport'];
export type Sections = components['schemas']['Sections'];
export type SelectDefinition = components['schemas']['SelectDefinition'];
export type ShellDefinition = components['schemas']['ShellDefinition'];
export type SignRequest = components['schemas']['SignRequest'];
export type SignedAddress = components['schemas']['SignedAddress'];
export type SkippedFace = components['schemas']['SkippedFace'];
export type SplitDefinition = components['schemas']['SplitDefinition'];
export type StoredEntry = components['schemas']['StoredEntry'];
export type StoredLinks = components['schemas']['StoredLinks'];
export type StoredList = components['schemas']['StoredList'];
export type StoredSurface = components['schemas']['StoredSurface'];
export type SurfaceDefinition = components['schemas']['SurfaceDefinition'];
export type SurfaceDocument = components['schemas']['SurfaceDocument'];
export type SurfaceLinks = components['schemas']['SurfaceLinks'];
export type SurfaceList = components['schemas']['SurfaceList'];
export type SurfaceMeasures = components['schemas']['SurfaceMeasures'];
export type SurfaceRequest = components['schemas']['SurfaceRequest'];
export type SurfaceSummary = components['schemas']['SurfaceSummary'];
export type TransposeDefinition = components['schemas']['TransposeDefinition'];
export type TriangleConversion = components['schemas']['TriangleConversion'];
export type TriangleDefinition = components['schemas']['TriangleDefinition'];
export type TubeDefinition = components['schemas']['TubeDefinition'];
export type UnreadFace = components['schemas']['UnreadFace'];
export type UntrimDefinition = components['schemas']['UntrimDefinition'];
export type ResponseMalformedJson = components['responses']['MalformedJson'];
export type ResponseKeyNeeded = components['responses']['KeyNeeded'];
export type ResponseScopeNeeded = components['responses']['ScopeNeeded'];
export type ResponseForbidden = components['responses']['Forbidden'];
export type ResponseTooManyRequests = components['responses']['TooManyRequests'];
export type ResponseUnknownSurface = components['responses']['UnknownSurface'];
export type ResponseMethodNotAllowed = components['responses']['MethodNotAllowed'];
export type ResponseNotAcceptable = components['responses']['NotAcceptable'];
export type ResponseCodingNotAcceptable = components['responses']['CodingNotAcceptable'];
export type ResponseEngineGone = components['responses']['EngineGone'];
export type ResponseBodyTooSlow = components['responses']['BodyTooSlow'];
export type ResponseBodyTooLarge = components['responses']['BodyTooLarge'];
export type ResponseUnsupportedMediaType = components['responses']['UnsupportedMediaType'];
export type ResponseInvalidRequest = components['responses']['InvalidRequest'];
export type ResponseInvalidQuery = components['responses']['InvalidQuery'];
export type ResponseDamagedObject = components['responses']['DamagedObject'];
export type ResponseBusy = components['responses']['Busy'];
export type ResponseOutOfTime = components['responses']['OutOfTime'];
export type ResponseStoreFailed = components['responses']['StoreFailed'];
export type ResponseUnavailable = components['responses']['Unavailable'];
export type ResponseInvalidJob = components['responses']['InvalidJob'];
export type ResponseUnknownJob = components['responses']['UnknownJob'];
export type ResponseUnknownResult = components['responses']['UnknownResult'];
export type ResponseTooManyJobs = components['responses']['TooManyJobs'];
export type ResponseJobQuotaFull = components['responses']['JobQuotaFull'];
export type ResponseStoreFull = components['responses']['StoreFull'];
export type ResponseInternalError = components['responses']['InternalError'];
export type HeaderRequestId = components['headers']['RequestId'];
export type HeaderRateLimitPolicy = components['headers']['RateLimit-Policy'];
export type HeaderRateLimit = components['headers']['RateLimit'];
export type $defs = Record<string, never>;
export interface operations {
    createMesh: {
        parameters: {
            query?: {
                /** @description Format of the response; takes precedence over `Accept`. */
                format?: "glb" | "gltf" | "json" | "oogl" | "stl" | "obj" | "ply" | "off" | "3mf" | "npz";
                /** @description With a file: The kind of surface: `bezier` or `bspline` for one net, `patches` for many. */
                type?: "bezier" | "bspline" | "patches";
                /** @description With a file: Degree of a `bspline`: one number, or one for u and one for v. */
                degree?: number[];
                /** @description With a file: Knots of a `bspline`: `clamped`, `uniform` or `periodic`, or a name for u and one for v. */
                knots?: ("uniform" | "clamped" | "periodic")[];
                /** @description With a file: Whether points of four numbers in an array of NumPy are homogeneous, [w x, w y, w z, w]: `true`, or `false`, the default: [x, y, z, weight]. */
                homogeneous?: boolean;
                /** @description With a file: The model's vertical axis, `y` or `z`. A CAD file has `z`, unless this says `y`. */
                up?: "y" | "z";
                /** @description With a file: Name of the surface. A CAD file has names of its own; this is that of the whole. */
                name?: string;
                /** @description With a file: Whether an invalid face of a CAD file is left out and listed in the report (`skip`, the default), or refuses the file (`refuse`). */
                invalid_faces?: "refuse" | "skip";
                /** @description With a file: Divisions of every patch: one number, or [u, v]; by default 16. A patch has (u + 1) × (v + 1) vertices. A triangle uses the larger number n for all sides and has (n + 1)(n + 2)/2 vertices. Not together with a tolerance, `max_triangles` or `max_bytes`, and not for breps. */
                resolution?: number | [
                    number,
                    number
                ];
                /** @description With a file: The largest distance of the surface from the mesh, in model units. No point of the surface is further than this from the mesh in the file. This is proved, not sampled, and the report has the proved bound. Use a tolerance in place of a resolution. Patches are divided where the surface bends, and in the direction in which it bends; the division of a shared edge depends on the edge alone. A tolerance below the rounding of the written vertices is refused (`tolerance_too_small`). */
                tolerance?: number;
                /** @description With a file: The tolerance as a share of the model's diagonal, which is the diagonal of the bounding box of all control points (for a group, of all members after placement). Not together with `tolerance`. Breps, and groups with breps, are meshed with 0.001 if the request has no option of accuracy. The box of a brep does not contain the parts of surfaces outside of its faces, and no mesh of a brep is coarser than 0.02. */
                relative_tolerance?: number;
                /** @description With a file: The largest angle in radians between the normals at the two ends of an edge. This angle is an aim and is not proved; the report has the largest measured angle, `normal_angle`. Use it alone, or together with a tolerance. */
                angle_tolerance?: number;
                /** @description With a file: The most triangles of the mesh. Without a tolerance, the service makes the deviation as small as it can with this number of triangles; a number below that of the coarsest mesh is refused (`budget_too_small`). Together with a tolerance, this number is a limit: if the mesh needs more triangles, the request is refused (`too_many_triangles`). */
                max_triangles?: number;
                /** @description With a file: The most bytes of the response in its format. With and without a tolerance, this option limits bytes as `max_triangles` limits triangles. */
                max_bytes?: number;
                /** @description With a file: Whether to bound the distance from the mesh to the surface too. No point of the mesh is then further from the surface than twice the tolerance. The report has the bound, `mesh_deviation_bound`. Needs a tolerance (`angle_tolerance` is not enough), `max_triangles` or `max_bytes`. Default: false. */
                two_sided?: boolean;
                /** @description With a file: Kind of faces: `triangles`, `quads` or `none`. `quads` is allowed only if the format has quads. With `none` the file has only isoparametric curves and overlays. Default: "triangles". */
                faces?: "triangles" | "quads" | "none";
                /** @description With a file: Whether vertices carry analytic unit normals. Default: true. */
                normals?: boolean;
                /** @description With a file: Whether vertices carry their parameters (u, v). For a B-spline they are in the domain of its knots; for `patches`, in each patch from 0 to 1. If the surface has texture coordinates (`uvs`), vertices always carry these in place of the parameters. Default: false. */
                uvs?: boolean;
                /** @description With a file: Whether vertices carry the Gaussian and mean curvature of the exact surface. Formats with attributes write them as `gaussian_curvature` and `mean_curvature`. Signs are those of `POST /v1/points`: mean curvature is positive where the surface bends towards its normal, so a sphere of radius r with outward normals has −1/r. In a group they are the curvatures of the surfaces after placement. A curvature that is infinite or has no limit, for example at the apex of a cone, is written as 0; the curvatures of wires are written as 0, too. The report has the least and the greatest curvature. Not for tubes and ribbons. Default: false. */
                curvatures?: boolean;
                /** @description With a file: Whether patches share the vertices of common edges. With `false` every sample of every patch is a vertex of its own, even samples at a pole that no face uses. Vertices are then ordered patch by patch; sample (i, j) of a patch is its vertex number i (Rv + 1) + j, where Rv is the number of divisions along v. Not for breps. Default: true. */
                weld?: boolean;
                /** @description With a file: Angle in radians. If the normals of neighbouring patches differ by more, the common edge is a crease: each patch keeps its own normals there. So do faces of breps. Default: 0.017453292519943295. */
                crease_angle?: number;
                /** @description With a file: A share of the model's diagonal. Control points on borders of patches that are nearer to each other than this count as one point. So sides that are equal up to rounding become one edge, closed surfaces have no gaps, and collapsed sides become poles. Near points, and points connected by a chain of near points, form a cluster; in a cluster wider than the tolerance, only points nearer than 1/8 of the tolerance become one. Patches without width are left out of the mesh. When two sides become one edge, the edge gets the positions of the side whose control points come first in lexicographic order, whatever the order of the patches. Far from the origin, where coordinates are too coarse for this tolerance, points nearer to each other than 2^-50 times the largest coordinate count as near. The report has the largest move of a point as `moved`, and every bound includes it. If two borders are the same curve with different knots, the surfaces are split at these knots. With 0, only points that are equal bit for bit are joined. Default: 1e-12. */
                weld_tolerance?: number;
                /** @description With a file: Whether to turn patches so that neighbours agree about the side to which their normals point, and closed surfaces have a positive volume. A turned patch has u and v exchanged. Of an open surface the side stays on which most patches are. A surface without a consistent orientation, such as a Möbius strip, is not turned. The report lists the patches (`turned`, `not_orientable`). Breps, tubes and ribbons stay as they are. Default: false. */
                orient?: boolean;
                /** @description With a file: Lines to draw in addition to the faces, if the format has lines. For breps `boundary` has all edges, drawn through vertices of the mesh; they have no `control_net`. Default: []. */
                overlays?: ("control_net" | "boundary")[];
                /** @description With a file: Isoparametric curves: one number n, or [n_u, n_v]. Every patch (of a B-spline, every knot span) gets the curves u = i/n_u and v = j/n_v, with its borders; a shared border is drawn once. A triangle gets the curves r = i/n, s = i/n and t = i/n. 0 draws no curves in that direction. Not for breps. Default: [0, 0]. */
                isocurves?: number | [
                    number,
                    number
                ];
                /** @description With a file: The form of isoparametric curves: `lines`, `tubes` or `ribbons`. `lines` is allowed only if the format has lines. Ribbons lie flat on the surface, 1/20 of their width above its faces. Default: "lines". */
                wires?: "lines" | "tubes" | "ribbons";
                /** @description With a file: Diameter of the tubes or width of the ribbons, in model units. By default 1/300 of the diagonal of the bounding box of the control points. */
                wire_width?: number;
                /** @description With a file: Sides of a tube. Default: 8. */
                wire_sides?: number;
                /** @description With a file: The algorithm that computes samples: `matrix`, `de_casteljau` or `forward_difference`. `matrix`: products with Bernstein bases. `de_casteljau`: repeated interpolation of control points, the most stable and by far the slowest. `forward_difference`: additions along rows, for degrees up to 8 (16 if the format stores float64), with an error that grows with the resolution. `docs/methods.md` compares the accuracy of these algorithms. Default: "matrix". */
                method?: "matrix" | "de_casteljau" | "forward_difference";
                /** @description With a file: Form of an OOGL file: `cquad`, `mesh`, `off` or `bez`. The default is `cquad` for grids of quads, else `off`. `bez` stores the exact patches; a triangle is stored as a four-sided patch with one side collapsed to a point. Other formats ignore this option. */
                oogl?: "cquad" | "mesh" | "off" | "bez";
                /** @description With a file: Whether glTF is written in 16-bit integers (`KHR_mesh_quantization`). Positions are multiples of a step, a power of two, at most 1/32,766 of the longest side of the bounding box of the control points. Normals are exact within 0.002°. Colours, and texture coordinates from 0 to 1, have 16 bits. Every vertex moves by at most 0.87 steps; the proved deviation includes this move, and a tolerance holds for the written file. All parts of a surface use the same step and origin, and members of a group that meet use the same, too, so that seams have no gaps. Other formats refuse this option (`unsupported_by_format`). Default: false. */
                quantize?: boolean;
                /** @description With a file: Compression of the arrays of glTF: `none` or `meshopt`. With `meshopt` (`EXT_meshopt_compression`) vertices and triangles have another order. No number changes; but together with `quantize`, normals change by at most 0.1°. Readers need a decoder (three.js and Babylon.js have one). Other formats refuse `meshopt`. A service without the library refuses it, too (`compression_unavailable`); `GET /v1/formats` lists the compressions of the service. Default: "none". */
                compression?: "none" | "meshopt";
                /** @description With a file: Form of an STL file: `binary`, or `ascii`, a text with the same numbers and some four times the length. Other formats ignore this option. Default: "binary". */
                stl?: "binary" | "ascii";
            };
            header?: {
                /** @description `respond-async` (RFC 7240): makes a job of one part of this call (`POST /v1/jobs`). The response, in place of the result, is then 202 with the state of this job, a `Job`, and the headers `Location`, `Retry-After` and `Preference-Applied`. Ignored for a file of points or of rays, and for a file of a mesh that, with its surface, would be too long as JSON. */
                Prefer?: string;
            };
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["MeshRequest"];
                "application/x-npy": Blob;
                "model/x-oogl": string;
                "text/x-teapot": string;
                "model/obj": string;
                "application/vnd.geomdl+json": string;
                "model/step": Blob;
                "model/iges": Blob;
                "model/vnd.3dm": Blob;
            };
        };
        responses: {
            /** @description The mesh. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description A name to save the file under. Not sent with JSON.
                     * @example attachment; filename="sail.glb"
                     */
                    "Content-Disposition"?: string;
                    /**
                     * @description Number of vertices, as in the report. Not sent with a file of exact patches.
                     * @example 8257
                     */
                    "Surface-Vertices"?: number;
                    /**
                     * @description Number of triangles, as in the report. Not sent with a file of exact patches.
                     * @example 16256
                     */
                    "Surface-Triangles"?: number;
                    /**
                     * @description The `deviation_bound` of the report, in model units. Sent with every format, because some cannot store a report; OBJ and PLY have it in a comment too. Not sent with a file of exact patches, or if the report has no bound.
                     * @example 0.0005
                     */
                    "Surface-Deviation-Bound"?: number;
                    /**
                     * @description The `gap_bound` of the report, in model units. Sent for breps, with every format.
                     * @example 1e-7
                     */
                    "Surface-Gap-Bound"?: number;
                    /**
                     * @description Counts of the faces of a CAD file that was sent as the body, as a dictionary of RFC 8941: `faces` in the surface, and `skipped` ones that are not in it. `POST /v1/convert` returns the whole report.
                     * @example faces=300; skipped=2
                     */
                    "Surface-Reading"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`: this preference.
                     * @example respond-async
                     */
                    "Preference-Applied"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. URL of the job, without the host.
                     * @example /v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3
                     */
                    Location?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. Seconds after which to ask again. Not sent when the job has ended.
                     * @example 1
                     */
                    "Retry-After"?: number;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Mesh"];
                    "model/gltf-binary": Blob;
                    "model/gltf+json": {
                        [key: string]: unknown;
                    };
                    "model/x-oogl": string;
                    "model/stl": Blob;
                    "model/obj": string;
                    "model/x-ply": Blob;
                    "model/x-off": string;
                    "model/3mf": Blob;
                    "application/x-npz": Blob;
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            406: components["responses"]["NotAcceptable"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["OutOfTime"];
            507: components["responses"]["JobQuotaFull"];
        };
    };
    estimateMesh: {
        parameters: {
            query?: {
                /** @description The format to estimate for; without it, all formats. */
                format?: "glb" | "gltf" | "json" | "oogl" | "stl" | "obj" | "ply" | "off" | "3mf" | "npz";
                /** @description With a file: The kind of surface: `bezier` or `bspline` for one net, `patches` for many. */
                type?: "bezier" | "bspline" | "patches";
                /** @description With a file: Degree of a `bspline`: one number, or one for u and one for v. */
                degree?: number[];
                /** @description With a file: Knots of a `bspline`: `clamped`, `uniform` or `periodic`, or a name for u and one for v. */
                knots?: ("uniform" | "clamped" | "periodic")[];
                /** @description With a file: Whether points of four numbers in an array of NumPy are homogeneous, [w x, w y, w z, w]: `true`, or `false`, the default: [x, y, z, weight]. */
                homogeneous?: boolean;
                /** @description With a file: The model's vertical axis, `y` or `z`. A CAD file has `z`, unless this says `y`. */
                up?: "y" | "z";
                /** @description With a file: Name of the surface. A CAD file has names of its own; this is that of the whole. */
                name?: string;
                /** @description With a file: Whether an invalid face of a CAD file is left out and listed in the report (`skip`, the default), or refuses the file (`refuse`). */
                invalid_faces?: "refuse" | "skip";
                /** @description With a file: Divisions of every patch: one number, or [u, v]; by default 16. A patch has (u + 1) × (v + 1) vertices. A triangle uses the larger number n for all sides and has (n + 1)(n + 2)/2 vertices. Not together with a tolerance, `max_triangles` or `max_bytes`, and not for breps. */
                resolution?: number | [
                    number,
                    number
                ];
                /** @description With a file: The largest distance of the surface from the mesh, in model units. No point of the surface is further than this from the mesh in the file. This is proved, not sampled, and the report has the proved bound. Use a tolerance in place of a resolution. Patches are divided where the surface bends, and in the direction in which it bends; the division of a shared edge depends on the edge alone. A tolerance below the rounding of the written vertices is refused (`tolerance_too_small`). */
                tolerance?: number;
                /** @description With a file: The tolerance as a share of the model's diagonal, which is the diagonal of the bounding box of all control points (for a group, of all members after placement). Not together with `tolerance`. Breps, and groups with breps, are meshed with 0.001 if the request has no option of accuracy. The box of a brep does not contain the parts of surfaces outside of its faces, and no mesh of a brep is coarser than 0.02. */
                relative_tolerance?: number;
                /** @description With a file: The largest angle in radians between the normals at the two ends of an edge. This angle is an aim and is not proved; the report has the largest measured angle, `normal_angle`. Use it alone, or together with a tolerance. */
                angle_tolerance?: number;
                /** @description With a file: The most triangles of the mesh. Without a tolerance, the service makes the deviation as small as it can with this number of triangles; a number below that of the coarsest mesh is refused (`budget_too_small`). Together with a tolerance, this number is a limit: if the mesh needs more triangles, the request is refused (`too_many_triangles`). */
                max_triangles?: number;
                /** @description With a file: The most bytes of the response in its format. With and without a tolerance, this option limits bytes as `max_triangles` limits triangles. */
                max_bytes?: number;
                /** @description With a file: Whether to bound the distance from the mesh to the surface too. No point of the mesh is then further from the surface than twice the tolerance. The report has the bound, `mesh_deviation_bound`. Needs a tolerance (`angle_tolerance` is not enough), `max_triangles` or `max_bytes`. Default: false. */
                two_sided?: boolean;
                /** @description With a file: Kind of faces: `triangles`, `quads` or `none`. `quads` is allowed only if the format has quads. With `none` the file has only isoparametric curves and overlays. Default: "triangles". */
                faces?: "triangles" | "quads" | "none";
                /** @description With a file: Whether vertices carry analytic unit normals. Default: true. */
                normals?: boolean;
                /** @description With a file: Whether vertices carry their parameters (u, v). For a B-spline they are in the domain of its knots; for `patches`, in each patch from 0 to 1. If the surface has texture coordinates (`uvs`), vertices always carry these in place of the parameters. Default: false. */
                uvs?: boolean;
                /** @description With a file: Whether vertices carry the Gaussian and mean curvature of the exact surface. Formats with attributes write them as `gaussian_curvature` and `mean_curvature`. Signs are those of `POST /v1/points`: mean curvature is positive where the surface bends towards its normal, so a sphere of radius r with outward normals has −1/r. In a group they are the curvatures of the surfaces after placement. A curvature that is infinite or has no limit, for example at the apex of a cone, is written as 0; the curvatures of wires are written as 0, too. The report has the least and the greatest curvature. Not for tubes and ribbons. Default: false. */
                curvatures?: boolean;
                /** @description With a file: Whether patches share the vertices of common edges. With `false` every sample of every patch is a vertex of its own, even samples at a pole that no face uses. Vertices are then ordered patch by patch; sample (i, j) of a patch is its vertex number i (Rv + 1) + j, where Rv is the number of divisions along v. Not for breps. Default: true. */
                weld?: boolean;
                /** @description With a file: Angle in radians. If the normals of neighbouring patches differ by more, the common edge is a crease: each patch keeps its own normals there. So do faces of breps. Default: 0.017453292519943295. */
                crease_angle?: number;
                /** @description With a file: A share of the model's diagonal. Control points on borders of patches that are nearer to each other than this count as one point. So sides that are equal up to rounding become one edge, closed surfaces have no gaps, and collapsed sides become poles. Near points, and points connected by a chain of near points, form a cluster; in a cluster wider than the tolerance, only points nearer than 1/8 of the tolerance become one. Patches without width are left out of the mesh. When two sides become one edge, the edge gets the positions of the side whose control points come first in lexicographic order, whatever the order of the patches. Far from the origin, where coordinates are too coarse for this tolerance, points nearer to each other than 2^-50 times the largest coordinate count as near. The report has the largest move of a point as `moved`, and every bound includes it. If two borders are the same curve with different knots, the surfaces are split at these knots. With 0, only points that are equal bit for bit are joined. Default: 1e-12. */
                weld_tolerance?: number;
                /** @description With a file: Whether to turn patches so that neighbours agree about the side to which their normals point, and closed surfaces have a positive volume. A turned patch has u and v exchanged. Of an open surface the side stays on which most patches are. A surface without a consistent orientation, such as a Möbius strip, is not turned. The report lists the patches (`turned`, `not_orientable`). Breps, tubes and ribbons stay as they are. Default: false. */
                orient?: boolean;
                /** @description With a file: Lines to draw in addition to the faces, if the format has lines. For breps `boundary` has all edges, drawn through vertices of the mesh; they have no `control_net`. Default: []. */
                overlays?: ("control_net" | "boundary")[];
                /** @description With a file: Isoparametric curves: one number n, or [n_u, n_v]. Every patch (of a B-spline, every knot span) gets the curves u = i/n_u and v = j/n_v, with its borders; a shared border is drawn once. A triangle gets the curves r = i/n, s = i/n and t = i/n. 0 draws no curves in that direction. Not for breps. Default: [0, 0]. */
                isocurves?: number | [
                    number,
                    number
                ];
                /** @description With a file: The form of isoparametric curves: `lines`, `tubes` or `ribbons`. `lines` is allowed only if the format has lines. Ribbons lie flat on the surface, 1/20 of their width above its faces. Default: "lines". */
                wires?: "lines" | "tubes" | "ribbons";
                /** @description With a file: Diameter of the tubes or width of the ribbons, in model units. By default 1/300 of the diagonal of the bounding box of the control points. */
                wire_width?: number;
                /** @description With a file: Sides of a tube. Default: 8. */
                wire_sides?: number;
                /** @description With a file: The algorithm that computes samples: `matrix`, `de_casteljau` or `forward_difference`. `matrix`: products with Bernstein bases. `de_casteljau`: repeated interpolation of control points, the most stable and by far the slowest. `forward_difference`: additions along rows, for degrees up to 8 (16 if the format stores float64), with an error that grows with the resolution. `docs/methods.md` compares the accuracy of these algorithms. Default: "matrix". */
                method?: "matrix" | "de_casteljau" | "forward_difference";
                /** @description With a file: Form of an OOGL file: `cquad`, `mesh`, `off` or `bez`. The default is `cquad` for grids of quads, else `off`. `bez` stores the exact patches; a triangle is stored as a four-sided patch with one side collapsed to a point. Other formats ignore this option. */
                oogl?: "cquad" | "mesh" | "off" | "bez";
                /** @description With a file: Whether glTF is written in 16-bit integers (`KHR_mesh_quantization`). Positions are multiples of a step, a power of two, at most 1/32,766 of the longest side of the bounding box of the control points. Normals are exact within 0.002°. Colours, and texture coordinates from 0 to 1, have 16 bits. Every vertex moves by at most 0.87 steps; the proved deviation includes this move, and a tolerance holds for the written file. All parts of a surface use the same step and origin, and members of a group that meet use the same, too, so that seams have no gaps. Other formats refuse this option (`unsupported_by_format`). Default: false. */
                quantize?: boolean;
                /** @description With a file: Compression of the arrays of glTF: `none` or `meshopt`. With `meshopt` (`EXT_meshopt_compression`) vertices and triangles have another order. No number changes; but together with `quantize`, normals change by at most 0.1°. Readers need a decoder (three.js and Babylon.js have one). Other formats refuse `meshopt`. A service without the library refuses it, too (`compression_unavailable`); `GET /v1/formats` lists the compressions of the service. Default: "none". */
                compression?: "none" | "meshopt";
                /** @description With a file: Form of an STL file: `binary`, or `ascii`, a text with the same numbers and some four times the length. Other formats ignore this option. Default: "binary". */
                stl?: "binary" | "ascii";
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["MeshRequest"];
                "application/x-npy": Blob;
                "model/x-oogl": string;
                "text/x-teapot": string;
                "model/obj": string;
                "application/vnd.geomdl+json": string;
                "model/step": Blob;
                "model/iges": Blob;
                "model/vnd.3dm": Blob;
            };
        };
        responses: {
            /** @description The estimate. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description Counts of the faces of a CAD file that was sent as the body, as a dictionary of RFC 8941: `faces` in the surface, and `skipped` ones that are not in it. `POST /v1/convert` returns the whole report.
                     * @example faces=300; skipped=2
                     */
                    "Surface-Reading"?: string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Estimate"];
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["OutOfTime"];
        };
    };
    queryPoints: {
        parameters: {
            query?: never;
            header?: {
                /** @description `respond-async` (RFC 7240): makes a job of one part of this call (`POST /v1/jobs`). The response, in place of the result, is then 202 with the state of this job, a `Job`, and the headers `Location`, `Retry-After` and `Preference-Applied`. Ignored for a file of points or of rays, and for a file of a mesh that, with its surface, would be too long as JSON. */
                Prefer?: string;
            };
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["PointsRequest"];
            };
        };
        responses: {
            /** @description The points. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`: this preference.
                     * @example respond-async
                     */
                    "Preference-Applied"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. URL of the job, without the host.
                     * @example /v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3
                     */
                    Location?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. Seconds after which to ask again. Not sent when the job has ended.
                     * @example 1
                     */
                    "Retry-After"?: number;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Points"];
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["OutOfTime"];
            507: components["responses"]["JobQuotaFull"];
        };
    };
    convertSurface: {
        parameters: {
            query?: {
                /** @description Format of the response; takes precedence over `Accept`. */
                format?: "json" | "step" | "iges" | "vtu";
                /** @description With a file: The kind of surface: `bezier` or `bspline` for one net, `patches` for many. */
                type?: "bezier" | "bspline" | "patches";
                /** @description With a file: Degree of a `bspline`: one number, or one for u and one for v. */
                degree?: number[];
                /** @description With a file: Knots of a `bspline`: `clamped`, `uniform` or `periodic`, or a name for u and one for v. */
                knots?: ("uniform" | "clamped" | "periodic")[];
                /** @description With a file: Whether points of four numbers in an array of NumPy are homogeneous, [w x, w y, w z, w]: `true`, or `false`, the default: [x, y, z, weight]. */
                homogeneous?: boolean;
                /** @description With a file: The model's vertical axis, `y` or `z`. A CAD file has `z`, unless this says `y`. */
                up?: "y" | "z";
                /** @description With a file: Name of the surface. A CAD file has names of its own; this is that of the whole. */
                name?: string;
                /** @description With a file: Whether an invalid face of a CAD file is left out and listed in the report (`skip`, the default), or refuses the file (`refuse`). */
                invalid_faces?: "refuse" | "skip";
                /** @description With a file: the operations, as JSON. */
                operations?: string;
            };
            header?: {
                /** @description `respond-async` (RFC 7240): makes a job of one part of this call (`POST /v1/jobs`). The response, in place of the result, is then 202 with the state of this job, a `Job`, and the headers `Location`, `Retry-After` and `Preference-Applied`. Ignored for a file of points or of rays, and for a file of a mesh that, with its surface, would be too long as JSON. */
                Prefer?: string;
            };
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["ConvertRequest"];
                "application/x-npy": Blob;
                "model/x-oogl": string;
                "text/x-teapot": string;
                "model/obj": string;
                "application/vnd.geomdl+json": string;
                "model/step": Blob;
                "model/iges": Blob;
                "model/vnd.3dm": Blob;
            };
        };
        responses: {
            /** @description The surface. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description A name to save the file under. Not sent with JSON.
                     * @example attachment; filename="sail.glb"
                     */
                    "Content-Disposition"?: string;
                    /**
                     * @description What a file of definitions has: faces, definitions, instances, and the length of a unit in metres; `unit=assumed` if the surface has no unit, so that one unit is 1 mm. Not sent with JSON.
                     * @example faces=6; definitions=1; instances=1; metres_per_unit=0.001; unit=assumed
                     */
                    "Surface-Writing"?: string;
                    /**
                     * @description Counts of the faces of a CAD file that was sent as the body, as a dictionary of RFC 8941: `faces` in the surface, and `skipped` ones that are not in it. `POST /v1/convert` returns the whole report.
                     * @example faces=300; skipped=2
                     */
                    "Surface-Reading"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`: this preference.
                     * @example respond-async
                     */
                    "Preference-Applied"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. URL of the job, without the host.
                     * @example /v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3
                     */
                    Location?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. Seconds after which to ask again. Not sent when the job has ended.
                     * @example 1
                     */
                    "Retry-After"?: number;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SurfaceDocument"];
                    "model/step": string;
                    "model/iges": string;
                    "model/x-vtu": Blob;
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            406: components["responses"]["NotAcceptable"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["OutOfTime"];
            507: components["responses"]["JobQuotaFull"];
        };
    };
    createCurve: {
        parameters: {
            query?: {
                /** @description Format of the response; takes precedence over `Accept`. */
                format?: "glb" | "gltf" | "json" | "oogl" | "obj";
            };
            header?: {
                /** @description `respond-async` (RFC 7240): makes a job of one part of this call (`POST /v1/jobs`). The response, in place of the result, is then 202 with the state of this job, a `Job`, and the headers `Location`, `Retry-After` and `Preference-Applied`. Ignored for a file of points or of rays, and for a file of a mesh that, with its surface, would be too long as JSON. */
                Prefer?: string;
            };
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["CurveRequest"];
            };
        };
        responses: {
            /** @description The curve. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description A name to save the file under. Not sent with JSON.
                     * @example attachment; filename="sail.glb"
                     */
                    "Content-Disposition"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`: this preference.
                     * @example respond-async
                     */
                    "Preference-Applied"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. URL of the job, without the host.
                     * @example /v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3
                     */
                    Location?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. Seconds after which to ask again. Not sent when the job has ended.
                     * @example 1
                     */
                    "Retry-After"?: number;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Curve"];
                    "model/gltf-binary": Blob;
                    "model/gltf+json": {
                        [key: string]: unknown;
                    };
                    "model/x-oogl": string;
                    "model/obj": string;
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            406: components["responses"]["NotAcceptable"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["OutOfTime"];
            507: components["responses"]["JobQuotaFull"];
        };
    };
    projectPoints: {
        parameters: {
            query?: {
                /** @description With a file: the id of a built-in or a stored surface. */
                surface?: string;
                /** @description With a file: The largest width of an interval in `distance_bounds`, as a share of the diagonal of the bounding box of the control points. Default: 1e-09. */
                relative_tolerance?: number;
                /** @description With a file: Whether the response says which points are inside a closed surface (`signs`). Default: false. */
                sign?: boolean;
            };
            header?: {
                /** @description `respond-async` (RFC 7240): makes a job of one part of this call (`POST /v1/jobs`). The response, in place of the result, is then 202 with the state of this job, a `Job`, and the headers `Location`, `Retry-After` and `Preference-Applied`. Ignored for a file of points or of rays, and for a file of a mesh that, with its surface, would be too long as JSON. */
                Prefer?: string;
            };
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["ProjectRequest"];
                "application/x-npy": Blob;
            };
        };
        responses: {
            /** @description The closest points. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`: this preference.
                     * @example respond-async
                     */
                    "Preference-Applied"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. URL of the job, without the host.
                     * @example /v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3
                     */
                    Location?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. Seconds after which to ask again. Not sent when the job has ended.
                     * @example 1
                     */
                    "Retry-After"?: number;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["ClosestPoints"];
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            404: components["responses"]["UnknownSurface"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["OutOfTime"];
            507: components["responses"]["JobQuotaFull"];
        };
    };
    intersectSurface: {
        parameters: {
            query?: {
                /** @description Format of the response; takes precedence over `Accept`. */
                format?: "glb" | "gltf" | "json" | "oogl" | "obj" | "svg";
                /** @description With a file: the id of a built-in or a stored surface. */
                surface?: string;
                /** @description With a file: Which hits of a ray are returned: the first, or all. Default: "first". */
                hits?: "first" | "all";
                /** @description With a file: At borders, and where a ray only touches the surface, a ray within this distance counts as a hit. A share of the diagonal of the bounding box of the control points. Default: 1e-09. */
                relative_thickness?: number;
                /** @description With a file: For planes: the largest distance, in model units, of a section from its polyline. */
                tolerance?: number;
                /** @description With a file: The tolerance as a share of the diagonal of the bounding box of the control points, in place of `tolerance`. Default: 0.001. */
                relative_tolerance?: number;
            };
            header?: {
                /** @description `respond-async` (RFC 7240): makes a job of one part of this call (`POST /v1/jobs`). The response, in place of the result, is then 202 with the state of this job, a `Job`, and the headers `Location`, `Retry-After` and `Preference-Applied`. Ignored for a file of points or of rays, and for a file of a mesh that, with its surface, would be too long as JSON. */
                Prefer?: string;
            };
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["IntersectRequest"];
                "application/x-npy": Blob;
            };
        };
        responses: {
            /** @description The hits, or the sections. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description A name to save the file under. Not sent with JSON.
                     * @example attachment; filename="sail.glb"
                     */
                    "Content-Disposition"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`: this preference.
                     * @example respond-async
                     */
                    "Preference-Applied"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. URL of the job, without the host.
                     * @example /v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3
                     */
                    Location?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. Seconds after which to ask again. Not sent when the job has ended.
                     * @example 1
                     */
                    "Retry-After"?: number;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Intersections"];
                    "model/gltf-binary": Blob;
                    "model/gltf+json": {
                        [key: string]: unknown;
                    };
                    "model/x-oogl": string;
                    "model/obj": string;
                    "image/svg+xml": string;
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            404: components["responses"]["UnknownSurface"];
            406: components["responses"]["NotAcceptable"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["OutOfTime"];
            507: components["responses"]["JobQuotaFull"];
        };
    };
    measureSurface: {
        parameters: {
            query?: {
                /** @description With a file: The kind of surface: `bezier` or `bspline` for one net, `patches` for many. */
                type?: "bezier" | "bspline" | "patches";
                /** @description With a file: Degree of a `bspline`: one number, or one for u and one for v. */
                degree?: number[];
                /** @description With a file: Knots of a `bspline`: `clamped`, `uniform` or `periodic`, or a name for u and one for v. */
                knots?: ("uniform" | "clamped" | "periodic")[];
                /** @description With a file: Whether points of four numbers in an array of NumPy are homogeneous, [w x, w y, w z, w]: `true`, or `false`, the default: [x, y, z, weight]. */
                homogeneous?: boolean;
                /** @description With a file: The model's vertical axis, `y` or `z`. A CAD file has `z`, unless this says `y`. */
                up?: "y" | "z";
                /** @description With a file: Name of the surface. A CAD file has names of its own; this is that of the whole. */
                name?: string;
                /** @description With a file: Whether an invalid face of a CAD file is left out and listed in the report (`skip`, the default), or refuses the file (`refuse`). */
                invalid_faces?: "refuse" | "skip";
                /** @description With a file: The largest width of intervals: relative to the area, to the length of all borders and to the volume of the whole surface; for the centroid relative to the diagonal of the bounding box of the control points. Intervals that take more work than one request may take are wider, and `reached` is false. Default: 1e-06. */
                tolerance?: number;
                /** @description With a file: A share of the diagonal of the bounding box of the control points. Control points on borders of patches that are nearer to each other than this count as one point, as in a mesh. The interval of a volume includes every way to close the gaps between such points. Default: 1e-12. */
                weld_tolerance?: number;
            };
            header?: {
                /** @description `respond-async` (RFC 7240): makes a job of one part of this call (`POST /v1/jobs`). The response, in place of the result, is then 202 with the state of this job, a `Job`, and the headers `Location`, `Retry-After` and `Preference-Applied`. Ignored for a file of points or of rays, and for a file of a mesh that, with its surface, would be too long as JSON. */
                Prefer?: string;
            };
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["MeasureRequest"];
                "application/x-npy": Blob;
                "model/x-oogl": string;
                "text/x-teapot": string;
                "model/obj": string;
                "application/vnd.geomdl+json": string;
                "model/step": Blob;
                "model/iges": Blob;
                "model/vnd.3dm": Blob;
            };
        };
        responses: {
            /** @description The measures. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description Counts of the faces of a CAD file that was sent as the body, as a dictionary of RFC 8941: `faces` in the surface, and `skipped` ones that are not in it. `POST /v1/convert` returns the whole report.
                     * @example faces=300; skipped=2
                     */
                    "Surface-Reading"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`: this preference.
                     * @example respond-async
                     */
                    "Preference-Applied"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. URL of the job, without the host.
                     * @example /v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3
                     */
                    Location?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. Seconds after which to ask again. Not sent when the job has ended.
                     * @example 1
                     */
                    "Retry-After"?: number;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SurfaceMeasures"];
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["OutOfTime"];
            507: components["responses"]["JobQuotaFull"];
        };
    };
    checkMesh: {
        parameters: {
            query?: {
                /** @description With a file: the id of a built-in or a stored surface. */
                surface?: string;
                /** @description With a file: How a face of four corners 0, 1, 2, 3 becomes two triangles: by the diagonal between the corners 0 and 2, or 1 and 3. Default: "02". */
                quad_diagonal?: "02" | "13";
                /** @description With a file: The largest width of each of the two intervals, as a share of its `high`. Where that takes more work than one request may take, the interval is wider, and `reached` is false. Default: 0.1. */
                relative_tolerance?: number;
                /** @description With a file: Whether the response has the mesh as it was read, and the distances of its vertices and of the middles of its triangles from the surface, as colours need them. Default: false. */
                distances?: boolean;
            };
            header?: {
                /** @description `respond-async` (RFC 7240): makes a job of one part of this call (`POST /v1/jobs`). The response, in place of the result, is then 202 with the state of this job, a `Job`, and the headers `Location`, `Retry-After` and `Preference-Applied`. Ignored for a file of points or of rays, and for a file of a mesh that, with its surface, would be too long as JSON. */
                Prefer?: string;
            };
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["CheckRequest"];
                "model/gltf-binary": Blob;
                "model/gltf+json": Blob;
                "model/obj": Blob;
                "model/x-ply": Blob;
                "model/stl": Blob;
                "model/x-off": Blob;
            };
        };
        responses: {
            /** @description The intervals, and the faults of the mesh. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`: this preference.
                     * @example respond-async
                     */
                    "Preference-Applied"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. URL of the job, without the host.
                     * @example /v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3
                     */
                    Location?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. Seconds after which to ask again. Not sent when the job has ended.
                     * @example 1
                     */
                    "Retry-After"?: number;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["MeshCheck"];
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            404: components["responses"]["UnknownSurface"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["OutOfTime"];
            507: components["responses"]["JobQuotaFull"];
        };
    };
    listSurfaces: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The built-in surfaces. */
            200: {
                headers: {
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description How long it may be kept.
                     * @example public, max-age=3600, must-revalidate
                     */
                    "Cache-Control": string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SurfaceList"];
                };
            };
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["TooManyRequests"];
            500: components["responses"]["InternalError"];
        };
    };
    storeSurface: {
        parameters: {
            query?: {
                /** @description With a file: The kind of surface: `bezier` or `bspline` for one net, `patches` for many. */
                type?: "bezier" | "bspline" | "patches";
                /** @description With a file: Degree of a `bspline`: one number, or one for u and one for v. */
                degree?: number[];
                /** @description With a file: Knots of a `bspline`: `clamped`, `uniform` or `periodic`, or a name for u and one for v. */
                knots?: ("uniform" | "clamped" | "periodic")[];
                /** @description With a file: Whether points of four numbers in an array of NumPy are homogeneous, [w x, w y, w z, w]: `true`, or `false`, the default: [x, y, z, weight]. */
                homogeneous?: boolean;
                /** @description With a file: The model's vertical axis, `y` or `z`. A CAD file has `z`, unless this says `y`. */
                up?: "y" | "z";
                /** @description With a file: Name of the surface. A CAD file has names of its own; this is that of the whole. */
                name?: string;
                /** @description With a file: Whether an invalid face of a CAD file is left out and listed in the report (`skip`, the default), or refuses the file (`refuse`). */
                invalid_faces?: "refuse" | "skip";
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["SurfaceRequest"];
                "application/x-npy": Blob;
                "model/x-oogl": string;
                "text/x-teapot": string;
                "model/obj": string;
                "application/vnd.geomdl+json": string;
                "model/step": Blob;
                "model/iges": Blob;
                "model/vnd.3dm": Blob;
            };
        };
        responses: {
            /** @description The surface was stored already. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description URL of the definition, without the host.
                     * @example /v1/surfaces/412350f1bb8449e44bb5c629638f78f030401eb156e91c9a12dc48077018581e
                     */
                    Location: string;
                    /**
                     * @description Counts of the faces of a CAD file that was sent as the body, as a dictionary of RFC 8941: `faces` in the surface, and `skipped` ones that are not in it. `POST /v1/convert` returns the whole report.
                     * @example faces=300; skipped=2
                     */
                    "Surface-Reading"?: string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["StoredSurface"];
                };
            };
            /** @description The surface is stored. */
            201: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description URL of the definition, without the host.
                     * @example /v1/surfaces/412350f1bb8449e44bb5c629638f78f030401eb156e91c9a12dc48077018581e
                     */
                    Location: string;
                    /**
                     * @description Counts of the faces of a CAD file that was sent as the body, as a dictionary of RFC 8941: `faces` in the surface, and `skipped` ones that are not in it. `POST /v1/convert` returns the whole report.
                     * @example faces=300; skipped=2
                     */
                    "Surface-Reading"?: string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["StoredSurface"];
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Unavailable"];
            507: components["responses"]["StoreFull"];
        };
    };
    getSurface: {
        parameters: {
            query?: {
                /** @description Only in a signed URL: when it expires, in Unix time. */
                expires?: number;
                /** @description Only in a signed URL, as `POST /v1/sign` makes it: its last parameter. */
                signature?: string;
            };
            header?: {
                /**
                 * @description Entity tags of responses that the client has, or `*`.
                 * @example "3q2-7wEAAAAAAAAAAAAAAA"
                 */
                "If-None-Match"?: string;
            };
            path: {
                /** @description Id of a surface: the name of a built-in one, or the id of a stored one. */
                id: ("utah-teapot" | "utah-teapot-original" | "bourke-1111" | "bourke-1111-colors" | "tveit" | "saddle" | "heated-panel" | "cylinder" | "cone" | "sphere" | "torus" | "monkey-saddle" | "octahedral-sphere" | "rounded-box" | "trefoil-tube" | "ribbon" | "hair" | "tea-service" | "bspline-hills" | "nurbs-goblet" | "bspline-ring" | "swept-wing" | "ship-hull" | "plate-with-holes" | "pipe-tee" | "gear" | "impeller" | "screw-thread" | "crossed-holes") | string;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The definition of a surface. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The hash of the content, in quotes.
                     * @example "412350f1bb8449e44bb5c629638f78f030401eb156e91c9a12dc48077018581e"
                     */
                    ETag: string;
                    /**
                     * @description `public, max-age=31536000, immutable` if the id is a hash; else `public, max-age=3600, must-revalidate`.
                     * @example public, max-age=31536000, immutable
                     */
                    "Cache-Control": string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SurfaceDocument"];
                };
            };
            /** @description The client has the definition already: `If-None-Match` lists its tag. */
            304: {
                headers: {
                    /**
                     * @description The hash of the content, in quotes.
                     * @example "412350f1bb8449e44bb5c629638f78f030401eb156e91c9a12dc48077018581e"
                     */
                    ETag: string;
                    /**
                     * @description `public, max-age=31536000, immutable` if the id is a hash; else `public, max-age=3600, must-revalidate`.
                     * @example public, max-age=31536000, immutable
                     */
                    "Cache-Control": string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["UnknownSurface"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["Busy"];
            500: components["responses"]["DamagedObject"];
            503: components["responses"]["Unavailable"];
        };
    };
    deleteSurface: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /** @description Id of a stored surface. */
                id: string;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The surface is removed. */
            204: {
                headers: {
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            404: components["responses"]["UnknownSurface"];
            405: components["responses"]["MethodNotAllowed"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["TooManyRequests"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["StoreFailed"];
        };
    };
    getSurfaceMesh: {
        parameters: {
            query?: {
                /** @description Divisions of every patch: one number, or [u, v]; by default 16. A patch has (u + 1) × (v + 1) vertices. A triangle uses the larger number n for all sides and has (n + 1)(n + 2)/2 vertices. Not together with a tolerance, `max_triangles` or `max_bytes`, and not for breps. */
                resolution?: number | [
                    number,
                    number
                ];
                /** @description The largest distance of the surface from the mesh, in model units. No point of the surface is further than this from the mesh in the file. This is proved, not sampled, and the report has the proved bound. Use a tolerance in place of a resolution. Patches are divided where the surface bends, and in the direction in which it bends; the division of a shared edge depends on the edge alone. A tolerance below the rounding of the written vertices is refused (`tolerance_too_small`). */
                tolerance?: number;
                /** @description The tolerance as a share of the model's diagonal, which is the diagonal of the bounding box of all control points (for a group, of all members after placement). Not together with `tolerance`. Breps, and groups with breps, are meshed with 0.001 if the request has no option of accuracy. The box of a brep does not contain the parts of surfaces outside of its faces, and no mesh of a brep is coarser than 0.02. */
                relative_tolerance?: number;
                /** @description The largest angle in radians between the normals at the two ends of an edge. This angle is an aim and is not proved; the report has the largest measured angle, `normal_angle`. Use it alone, or together with a tolerance. */
                angle_tolerance?: number;
                /** @description The most triangles of the mesh. Without a tolerance, the service makes the deviation as small as it can with this number of triangles; a number below that of the coarsest mesh is refused (`budget_too_small`). Together with a tolerance, this number is a limit: if the mesh needs more triangles, the request is refused (`too_many_triangles`). */
                max_triangles?: number;
                /** @description The most bytes of the response in its format. With and without a tolerance, this option limits bytes as `max_triangles` limits triangles. */
                max_bytes?: number;
                /** @description Whether to bound the distance from the mesh to the surface too. No point of the mesh is then further from the surface than twice the tolerance. The report has the bound, `mesh_deviation_bound`. Needs a tolerance (`angle_tolerance` is not enough), `max_triangles` or `max_bytes`. */
                two_sided?: boolean;
                /** @description Kind of faces: `triangles`, `quads` or `none`. `quads` is allowed only if the format has quads. With `none` the file has only isoparametric curves and overlays. */
                faces?: "triangles" | "quads" | "none";
                /** @description Whether vertices carry analytic unit normals. */
                normals?: boolean;
                /** @description Whether vertices carry their parameters (u, v). For a B-spline they are in the domain of its knots; for `patches`, in each patch from 0 to 1. If the surface has texture coordinates (`uvs`), vertices always carry these in place of the parameters. */
                uvs?: boolean;
                /** @description Whether vertices carry the Gaussian and mean curvature of the exact surface. Formats with attributes write them as `gaussian_curvature` and `mean_curvature`. Signs are those of `POST /v1/points`: mean curvature is positive where the surface bends towards its normal, so a sphere of radius r with outward normals has −1/r. In a group they are the curvatures of the surfaces after placement. A curvature that is infinite or has no limit, for example at the apex of a cone, is written as 0; the curvatures of wires are written as 0, too. The report has the least and the greatest curvature. Not for tubes and ribbons. */
                curvatures?: boolean;
                /** @description Whether patches share the vertices of common edges. With `false` every sample of every patch is a vertex of its own, even samples at a pole that no face uses. Vertices are then ordered patch by patch; sample (i, j) of a patch is its vertex number i (Rv + 1) + j, where Rv is the number of divisions along v. Not for breps. */
                weld?: boolean;
                /** @description Angle in radians. If the normals of neighbouring patches differ by more, the common edge is a crease: each patch keeps its own normals there. So do faces of breps. */
                crease_angle?: number;
                /** @description A share of the model's diagonal. Control points on borders of patches that are nearer to each other than this count as one point. So sides that are equal up to rounding become one edge, closed surfaces have no gaps, and collapsed sides become poles. Near points, and points connected by a chain of near points, form a cluster; in a cluster wider than the tolerance, only points nearer than 1/8 of the tolerance become one. Patches without width are left out of the mesh. When two sides become one edge, the edge gets the positions of the side whose control points come first in lexicographic order, whatever the order of the patches. Far from the origin, where coordinates are too coarse for this tolerance, points nearer to each other than 2^-50 times the largest coordinate count as near. The report has the largest move of a point as `moved`, and every bound includes it. If two borders are the same curve with different knots, the surfaces are split at these knots. With 0, only points that are equal bit for bit are joined. */
                weld_tolerance?: number;
                /** @description Whether to turn patches so that neighbours agree about the side to which their normals point, and closed surfaces have a positive volume. A turned patch has u and v exchanged. Of an open surface the side stays on which most patches are. A surface without a consistent orientation, such as a Möbius strip, is not turned. The report lists the patches (`turned`, `not_orientable`). Breps, tubes and ribbons stay as they are. */
                orient?: boolean;
                /** @description Lines to draw in addition to the faces, if the format has lines. For breps `boundary` has all edges, drawn through vertices of the mesh; they have no `control_net`. */
                overlays?: ("control_net" | "boundary")[];
                /** @description Isoparametric curves: one number n, or [n_u, n_v]. Every patch (of a B-spline, every knot span) gets the curves u = i/n_u and v = j/n_v, with its borders; a shared border is drawn once. A triangle gets the curves r = i/n, s = i/n and t = i/n. 0 draws no curves in that direction. Not for breps. */
                isocurves?: number | [
                    number,
                    number
                ];
                /** @description The form of isoparametric curves: `lines`, `tubes` or `ribbons`. `lines` is allowed only if the format has lines. Ribbons lie flat on the surface, 1/20 of their width above its faces. */
                wires?: "lines" | "tubes" | "ribbons";
                /** @description Diameter of the tubes or width of the ribbons, in model units. By default 1/300 of the diagonal of the bounding box of the control points. */
                wire_width?: number;
                /** @description Sides of a tube. */
                wire_sides?: number;
                /** @description The algorithm that computes samples: `matrix`, `de_casteljau` or `forward_difference`. `matrix`: products with Bernstein bases. `de_casteljau`: repeated interpolation of control points, the most stable and by far the slowest. `forward_difference`: additions along rows, for degrees up to 8 (16 if the format stores float64), with an error that grows with the resolution. `docs/methods.md` compares the accuracy of these algorithms. */
                method?: "matrix" | "de_casteljau" | "forward_difference";
                /** @description Form of an OOGL file: `cquad`, `mesh`, `off` or `bez`. The default is `cquad` for grids of quads, else `off`. `bez` stores the exact patches; a triangle is stored as a four-sided patch with one side collapsed to a point. Other formats ignore this option. */
                oogl?: "cquad" | "mesh" | "off" | "bez";
                /** @description Whether glTF is written in 16-bit integers (`KHR_mesh_quantization`). Positions are multiples of a step, a power of two, at most 1/32,766 of the longest side of the bounding box of the control points. Normals are exact within 0.002°. Colours, and texture coordinates from 0 to 1, have 16 bits. Every vertex moves by at most 0.87 steps; the proved deviation includes this move, and a tolerance holds for the written file. All parts of a surface use the same step and origin, and members of a group that meet use the same, too, so that seams have no gaps. Other formats refuse this option (`unsupported_by_format`). */
                quantize?: boolean;
                /** @description Compression of the arrays of glTF: `none` or `meshopt`. With `meshopt` (`EXT_meshopt_compression`) vertices and triangles have another order. No number changes; but together with `quantize`, normals change by at most 0.1°. Readers need a decoder (three.js and Babylon.js have one). Other formats refuse `meshopt`. A service without the library refuses it, too (`compression_unavailable`); `GET /v1/formats` lists the compressions of the service. */
                compression?: "none" | "meshopt";
                /** @description Form of an STL file: `binary`, or `ascii`, a text with the same numbers and some four times the length. Other formats ignore this option. */
                stl?: "binary" | "ascii";
                /** @description Version of the engine. With this parameter, the URL of a surface whose id is a hash always returns the same bytes. A service with another version returns 410. */
                engine?: 4;
                /** @description Only in a signed URL: when it expires, in Unix time. */
                expires?: number;
                /** @description Only in a signed URL, as `POST /v1/sign` makes it: its last parameter. */
                signature?: string;
            };
            header?: {
                /**
                 * @description Entity tags of responses that the client has, or `*`.
                 * @example "3q2-7wEAAAAAAAAAAAAAAA"
                 */
                "If-None-Match"?: string;
                /**
                 * @description Codings that the client accepts, optionally with quality values: `zstd`, `gzip`, `identity`. Small bodies, and bodies that would not become smaller, are not compressed.
                 * @example zstd, gzip
                 */
                "Accept-Encoding"?: string;
            };
            path: {
                /** @description Id of a surface: the name of a built-in one, or the id of a stored one. */
                id: ("utah-teapot" | "utah-teapot-original" | "bourke-1111" | "bourke-1111-colors" | "tveit" | "saddle" | "heated-panel" | "cylinder" | "cone" | "sphere" | "torus" | "monkey-saddle" | "octahedral-sphere" | "rounded-box" | "trefoil-tube" | "ribbon" | "hair" | "tea-service" | "bspline-hills" | "nurbs-goblet" | "bspline-ring" | "swept-wing" | "ship-hull" | "plate-with-holes" | "pipe-tee" | "gear" | "impeller" | "screw-thread" | "crossed-holes") | string;
                /** @description Suffix of the response's format; `Accept` is not read. */
                suffix: "glb" | "gltf" | "json" | "oogl" | "stl" | "obj" | "ply" | "off" | "3mf" | "npz";
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The mesh. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description A name to save the file under.
                     * @example inline; filename="sail.glb"
                     */
                    "Content-Disposition": string;
                    /**
                     * @description Number of vertices, as in the report. Not sent with a file of exact patches.
                     * @example 8257
                     */
                    "Surface-Vertices"?: number;
                    /**
                     * @description Number of triangles, as in the report. Not sent with a file of exact patches.
                     * @example 16256
                     */
                    "Surface-Triangles"?: number;
                    /**
                     * @description The `deviation_bound` of the report, in model units. Sent with every format, because some cannot store a report; OBJ and PLY have it in a comment too. Not sent with a file of exact patches, or if the report has no bound.
                     * @example 0.0005
                     */
                    "Surface-Deviation-Bound"?: number;
                    /**
                     * @description The `gap_bound` of the report, in model units. Sent for breps, with every format.
                     * @example 1e-7
                     */
                    "Surface-Gap-Bound"?: number;
                    /**
                     * @description Strong tag of the bytes in this coding.
                     * @example "3q2-7wEAAAAAAAAAAAAAAA"
                     */
                    ETag: string;
                    /**
                     * @description `public, max-age=31536000, immutable` for canonical URLs of surfaces whose id is a hash; else `public, max-age=3600, must-revalidate`.
                     * @example public, max-age=3600, must-revalidate
                     */
                    "Cache-Control": string;
                    /**
                     * @description Request headers that the response depends on.
                     * @example Accept-Encoding
                     */
                    Vary: string;
                    /**
                     * @description The canonical URL.
                     * @example </v1/surfaces/utah-teapot/mesh.glb?engine=4>; rel="canonical"
                     */
                    Link: string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Mesh"];
                    "model/gltf-binary": Blob;
                    "model/gltf+json": {
                        [key: string]: unknown;
                    };
                    "model/x-oogl": string;
                    "model/stl": Blob;
                    "model/obj": string;
                    "model/x-ply": Blob;
                    "model/x-off": string;
                    "model/3mf": Blob;
                    "application/x-npz": Blob;
                };
            };
            /** @description The client has the mesh already: `If-None-Match` lists its tag in a coding that the client accepts. */
            304: {
                headers: {
                    /**
                     * @description Strong tag of the bytes in this coding.
                     * @example "3q2-7wEAAAAAAAAAAAAAAA"
                     */
                    ETag: string;
                    /**
                     * @description `public, max-age=31536000, immutable` for canonical URLs of surfaces whose id is a hash; else `public, max-age=3600, must-revalidate`.
                     * @example public, max-age=3600, must-revalidate
                     */
                    "Cache-Control": string;
                    /**
                     * @description Request headers that the response depends on.
                     * @example Accept-Encoding
                     */
                    Vary: string;
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["UnknownSurface"];
            406: components["responses"]["CodingNotAcceptable"];
            410: components["responses"]["EngineGone"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["Busy"];
            500: components["responses"]["DamagedObject"];
            503: components["responses"]["Unavailable"];
        };
    };
    createImage: {
        parameters: {
            query?: {
                /** @description With a file: The kind of surface: `bezier` or `bspline` for one net, `patches` for many. */
                type?: "bezier" | "bspline" | "patches";
                /** @description With a file: Degree of a `bspline`: one number, or one for u and one for v. */
                degree?: number[];
                /** @description With a file: Knots of a `bspline`: `clamped`, `uniform` or `periodic`, or a name for u and one for v. */
                knots?: ("uniform" | "clamped" | "periodic")[];
                /** @description With a file: Whether points of four numbers in an array of NumPy are homogeneous, [w x, w y, w z, w]: `true`, or `false`, the default: [x, y, z, weight]. */
                homogeneous?: boolean;
                /** @description With a file: The model's vertical axis, `y` or `z`. A CAD file has `z`, unless this says `y`. */
                up?: "y" | "z";
                /** @description With a file: Name of the surface. A CAD file has names of its own; this is that of the whole. */
                name?: string;
                /** @description With a file: Whether an invalid face of a CAD file is left out and listed in the report (`skip`, the default), or refuses the file (`refuse`). */
                invalid_faces?: "refuse" | "skip";
                /** @description With a file: Pixels. Default: 512. */
                width?: number;
                /** @description With a file: Pixels. Default: 512. */
                height?: number;
                /** @description With a file: Degrees about the vertical axis: with 0 the camera looks along −z, with 90 along −x, in the frame that is turned y-up. Default: 30.0. */
                azimuth?: number;
                /** @description With a file: Degrees: with 90 the camera looks straight down. Default: 25.0. */
                elevation?: number;
                /** @description With a file: How much larger the surface is than in a picture that shows all of it; with a `position`, than with the field of view. Default: 1.0. */
                zoom?: number;
                /** @description With a file: The position of the camera, in model units and in the frame that is turned y-up: from a surface with `up: z`, (x, y, z) is (x, z, −y) there. Needs `target`, and replaces `azimuth` and `elevation`. A camera on the surface is refused (`camera_on_surface`). */
                position?: [
                    number,
                    number,
                    number
                ];
                /** @description With a file: The point in the middle of the picture; needs `position`. */
                target?: [
                    number,
                    number,
                    number
                ];
                /** @description With a file: Vertical field of view: the angle, in radians, between the upper and the lower border of the picture. Default: 0.5235987755982988. */
                field_of_view?: number;
                /** @description With a file: Whether parallel lines stay parallel. With a `position`, the picture shows as much of the target as with perspective. Default: false. */
                orthographic?: boolean;
                /** @description With a file: `transparent`, or an sRGB colour as `rrggbb` with small letters; it may begin with `#`. Default: "transparent". */
                background?: string;
                /** @description With a file: `shaded` in the colours of the surface, or the Gaussian or the mean curvature as colours: blue below 0, orange above; nine tenths of the picture are in their range. Default: "shaded". */
                look?: "shaded" | "gaussian" | "mean";
                /** @description With a file: Whether the borders of patches, and of a part its edges, are drawn. Default: false. */
                edges?: boolean;
                /** @description With a file: Draws the curves u = i/n and v = j/n of every patch: one n, or [n_u, n_v]. Default: [0, 0]. */
                isocurves?: number | [
                    number,
                    number
                ];
                /** @description With a file: Whether the control net is drawn. Default: false. */
                control_net?: boolean;
            };
            header?: {
                /** @description `respond-async` (RFC 7240): makes a job of one part of this call (`POST /v1/jobs`). The response, in place of the result, is then 202 with the state of this job, a `Job`, and the headers `Location`, `Retry-After` and `Preference-Applied`. Ignored for a file of points or of rays, and for a file of a mesh that, with its surface, would be too long as JSON. */
                Prefer?: string;
            };
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["PictureRequest"];
                "application/x-npy": Blob;
                "model/x-oogl": string;
                "text/x-teapot": string;
                "model/obj": string;
                "application/vnd.geomdl+json": string;
                "model/step": Blob;
                "model/iges": Blob;
                "model/vnd.3dm": Blob;
            };
        };
        responses: {
            /** @description The picture. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description A name to save the file under. Not sent with JSON.
                     * @example attachment; filename="sail.glb"
                     */
                    "Content-Disposition"?: string;
                    /**
                     * @description Counts of the faces of a CAD file that was sent as the body, as a dictionary of RFC 8941: `faces` in the surface, and `skipped` ones that are not in it. `POST /v1/convert` returns the whole report.
                     * @example faces=300; skipped=2
                     */
                    "Surface-Reading"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`: this preference.
                     * @example respond-async
                     */
                    "Preference-Applied"?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. URL of the job, without the host.
                     * @example /v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3
                     */
                    Location?: string;
                    /**
                     * @description Only in the response 202 to `Prefer: respond-async`. Seconds after which to ask again. Not sent when the job has ended.
                     * @example 1
                     */
                    "Retry-After"?: number;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "image/png": Blob;
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["OutOfTime"];
            507: components["responses"]["JobQuotaFull"];
        };
    };
    getSurfaceImage: {
        parameters: {
            query?: {
                /** @description Pixels. */
                width?: number;
                /** @description Pixels. */
                height?: number;
                /** @description Degrees about the vertical axis: with 0 the camera looks along −z, with 90 along −x, in the frame that is turned y-up. */
                azimuth?: number;
                /** @description Degrees: with 90 the camera looks straight down. */
                elevation?: number;
                /** @description How much larger the surface is than in a picture that shows all of it; with a `position`, than with the field of view. */
                zoom?: number;
                /** @description The position of the camera, in model units and in the frame that is turned y-up: from a surface with `up: z`, (x, y, z) is (x, z, −y) there. Needs `target`, and replaces `azimuth` and `elevation`. A camera on the surface is refused (`camera_on_surface`). */
                position?: [
                    number,
                    number,
                    number
                ];
                /** @description The point in the middle of the picture; needs `position`. */
                target?: [
                    number,
                    number,
                    number
                ];
                /** @description Vertical field of view: the angle, in radians, between the upper and the lower border of the picture. */
                field_of_view?: number;
                /** @description Whether parallel lines stay parallel. With a `position`, the picture shows as much of the target as with perspective. */
                orthographic?: boolean;
                /** @description `transparent`, or an sRGB colour as `rrggbb` with small letters; it may begin with `#`. */
                background?: string;
                /** @description `shaded` in the colours of the surface, or the Gaussian or the mean curvature as colours: blue below 0, orange above; nine tenths of the picture are in their range. */
                look?: "shaded" | "gaussian" | "mean";
                /** @description Whether the borders of patches, and of a part its edges, are drawn. */
                edges?: boolean;
                /** @description Draws the curves u = i/n and v = j/n of every patch: one n, or [n_u, n_v]. */
                isocurves?: number | [
                    number,
                    number
                ];
                /** @description Whether the control net is drawn. */
                control_net?: boolean;
                /** @description Version of the engine. With this parameter, the URL of a surface whose id is a hash always returns the same bytes. A service with another version returns 410. */
                engine?: 4;
                /** @description Only in a signed URL: when it expires, in Unix time. */
                expires?: number;
                /** @description Only in a signed URL, as `POST /v1/sign` makes it: its last parameter. */
                signature?: string;
            };
            header?: {
                /**
                 * @description Entity tags of responses that the client has, or `*`.
                 * @example "3q2-7wEAAAAAAAAAAAAAAA"
                 */
                "If-None-Match"?: string;
                /**
                 * @description Codings that the client accepts, optionally with quality values: `zstd`, `gzip`, `identity`. Small bodies, and bodies that would not become smaller, are not compressed.
                 * @example zstd, gzip
                 */
                "Accept-Encoding"?: string;
            };
            path: {
                /** @description Id of a surface: the name of a built-in one, or the id of a stored one. */
                id: ("utah-teapot" | "utah-teapot-original" | "bourke-1111" | "bourke-1111-colors" | "tveit" | "saddle" | "heated-panel" | "cylinder" | "cone" | "sphere" | "torus" | "monkey-saddle" | "octahedral-sphere" | "rounded-box" | "trefoil-tube" | "ribbon" | "hair" | "tea-service" | "bspline-hills" | "nurbs-goblet" | "bspline-ring" | "swept-wing" | "ship-hull" | "plate-with-holes" | "pipe-tee" | "gear" | "impeller" | "screw-thread" | "crossed-holes") | string;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The picture. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    /**
                     * @description A name to save the file under. Not sent with JSON.
                     * @example attachment; filename="sail.glb"
                     */
                    "Content-Disposition"?: string;
                    /**
                     * @description Strong tag of the bytes in this coding.
                     * @example "3q2-7wEAAAAAAAAAAAAAAA"
                     */
                    ETag: string;
                    /**
                     * @description `public, max-age=31536000, immutable` for canonical URLs of surfaces whose id is a hash; else `public, max-age=3600, must-revalidate`.
                     * @example public, max-age=3600, must-revalidate
                     */
                    "Cache-Control": string;
                    /**
                     * @description Request headers that the response depends on.
                     * @example Accept-Encoding
                     */
                    Vary: string;
                    /**
                     * @description The canonical URL.
                     * @example </v1/surfaces/utah-teapot/image.png?engine=4>; rel="canonical"
                     */
                    Link: string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "image/png": Blob;
                };
            };
            /** @description The client has the picture already: `If-None-Match` lists its tag. */
            304: {
                headers: {
                    /**
                     * @description Strong tag of the bytes in this coding.
                     * @example "3q2-7wEAAAAAAAAAAAAAAA"
                     */
                    ETag: string;
                    /**
                     * @description `public, max-age=31536000, immutable` for canonical URLs of surfaces whose id is a hash; else `public, max-age=3600, must-revalidate`.
                     * @example public, max-age=3600, must-revalidate
                     */
                    "Cache-Control": string;
                    /**
                     * @description Request headers that the response depends on.
                     * @example Accept-Encoding
                     */
                    Vary: string;
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["Forbidden"];
            404: components["responses"]["UnknownSurface"];
            406: components["responses"]["CodingNotAcceptable"];
            410: components["responses"]["EngineGone"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["Busy"];
            500: components["responses"]["DamagedObject"];
            503: components["responses"]["Unavailable"];
        };
    };
    listFormats: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The formats of meshes. */
            200: {
                headers: {
                    /**
                     * @description The coding. Not sent if the body is not compressed.
                     * @example zstd
                     */
                    "Content-Encoding"?: string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["FormatList"];
                };
            };
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["TooManyRequests"];
            500: components["responses"]["InternalError"];
        };
    };
    getHealth: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description State and versions, for people. */
            200: {
                headers: {
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Health"];
                };
            };
            500: components["responses"]["InternalError"];
        };
    };
    getLiveness: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The process runs. */
            200: {
                headers: {
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Health"];
                };
            };
            500: components["responses"]["InternalError"];
        };
    };
    getReadiness: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The service is ready for new requests. */
            200: {
                headers: {
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    /**
                     * @example {
                     *       "status": "ready",
                     *       "computing": "ready",
                     *       "store": "ready",
                     *       "writes": "ready"
                     *     }
                     */
                    "application/json": components["schemas"]["Health"];
                };
            };
            500: components["responses"]["InternalError"];
            /** @description Send no new requests here: a part does not work, or the service is about to stop. */
            503: {
                headers: {
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Health"];
                };
            };
        };
    };
    listJobs: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The jobs. */
            200: {
                headers: {
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["JobList"];
                };
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["TooManyRequests"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["StoreFailed"];
        };
    };
    createJob: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["JobRequest"];
                "application/x-ndjson": string;
            };
        };
        responses: {
            /** @description All parts have succeeded already. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description URL of the job, without the host.
                     * @example /v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3
                     */
                    Location: string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Job"];
                };
            };
            /** @description The job is accepted. */
            202: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    /**
                     * @description URL of the job, without the host.
                     * @example /v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3
                     */
                    Location: string;
                    /**
                     * @description Seconds after which to ask again. Not sent when the job has ended.
                     * @example 1
                     */
                    "Retry-After"?: number;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Job"];
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidJob"];
            429: components["responses"]["TooManyJobs"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Unavailable"];
            507: components["responses"]["JobQuotaFull"];
        };
    };
    storeJobFile: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/x-npy": Blob;
                "model/x-oogl": string;
                "text/x-teapot": string;
                "model/obj": string;
                "application/vnd.geomdl+json": string;
                "model/step": Blob;
                "model/iges": Blob;
                "model/vnd.3dm": Blob;
            };
        };
        responses: {
            /** @description The file was stored already. */
            200: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["JobFile"];
                };
            };
            /** @description The file is stored. */
            201: {
                headers: {
                    /**
                     * @description Times in milliseconds by step; `wait`: waiting for a thread, memory or other requests. `cache;desc=hit` if nothing was computed for this request.
                     * @example cache;desc=miss, surface;dur=0.310, wait;dur=0.020, mesh;dur=1.920, compress;dur=4.200
                     */
                    "Server-Timing": string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["JobFile"];
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Unavailable"];
            507: components["responses"]["JobQuotaFull"];
        };
    };
    getJob: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /** @description Id of a job. */
                id: string;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The state. */
            200: {
                headers: {
                    /**
                     * @description Seconds after which to ask again. Not sent when the job has ended.
                     * @example 1
                     */
                    "Retry-After"?: number;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Job"];
                };
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            404: components["responses"]["UnknownJob"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["TooManyRequests"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["StoreFailed"];
        };
    };
    withdrawJob: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /** @description Id of a job. */
                id: string;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description You no longer wait for the job. */
            204: {
                headers: {
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            404: components["responses"]["UnknownJob"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["TooManyRequests"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["StoreFailed"];
        };
    };
    getJobEvents: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                /** @description Id of a job. */
                id: string;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Events `progress`, and at the end of the job one event `end`. */
            200: {
                headers: {
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    /**
                     * @example event: progress
                     *     data: {"id":"5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3","state":"running","engine":4,"parts":{"total":100,"queued":56,"running":2,"succeeded":41,"failed":1},"created":"2026-11-29T14:40:20.125Z","started":"2026-11-29T14:40:21.125Z","ended":null,"expires":"2026-12-06T14:40:20.125Z","rate":12.5,"seconds_left":5,"links":{"self":"/v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3","events":"/v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3/events","results":"/v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3/results"}}
                     *     retry: 1000
                     *
                     *     event: end
                     *     data: {"id":"5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3","state":"succeeded","engine":4,"parts":{"total":2,"queued":0,"running":0,"succeeded":2,"failed":0},"created":"2026-11-29T14:40:20.125Z","started":"2026-11-29T14:40:21.125Z","ended":"2026-11-29T14:40:22.125Z","expires":"2026-12-06T14:40:22.125Z","rate":0.0,"seconds_left":null,"links":{"self":"/v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3","events":"/v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3/events","results":"/v1/jobs/5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3/results"}}
                     *     retry: 1000
                     */
                    "text/event-stream": string;
                };
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            404: components["responses"]["UnknownJob"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["TooManyRequests"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["StoreFailed"];
        };
    };
    getJobResults: {
        parameters: {
            query?: {
                /** @description Index of the first part. */
                from?: number;
                /** @description The most parts. */
                limit?: number;
            };
            header?: never;
            path: {
                /** @description Id of a job. */
                id: string;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The results. */
            200: {
                headers: {
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["JobResults"];
                };
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            404: components["responses"]["UnknownJob"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["TooManyRequests"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["StoreFailed"];
        };
    };
    getJobResult: {
        parameters: {
            query?: never;
            header?: {
                /**
                 * @description Entity tags of responses that the client has, or `*`.
                 * @example "3q2-7wEAAAAAAAAAAAAAAA"
                 */
                "If-None-Match"?: string;
            };
            path: {
                /** @description Index of a part. */
                part: number;
                /** @description Id of a job. */
                id: string;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description The file. */
            200: {
                headers: {
                    /**
                     * @description The SHA-256 of the file, in quotes.
                     * @example "5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3"
                     */
                    ETag: string;
                    /**
                     * @description The file never changes.
                     * @example public, max-age=31536000, immutable
                     */
                    "Cache-Control": string;
                    /**
                     * @description A name to save the file under. Not sent with JSON.
                     * @example attachment; filename="lid.glb"
                     */
                    "Content-Disposition"?: string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "model/gltf-binary": Blob;
                    "model/gltf+json": {
                        [key: string]: unknown;
                    };
                    "application/json": {
                        [key: string]: unknown;
                    };
                    "model/x-oogl": string;
                    "model/stl": Blob;
                    "model/obj": string;
                    "model/x-ply": Blob;
                    "model/x-off": string;
                    "model/3mf": Blob;
                    "application/x-npz": Blob;
                    "model/step": string;
                    "model/iges": string;
                    "model/x-vtu": Blob;
                    "image/svg+xml": string;
                };
            };
            /** @description The client has the file already. */
            304: {
                headers: {
                    /**
                     * @description The SHA-256 of the file, in quotes.
                     * @example "5aca0b8044c07cface56e0975f6ad9e7309f1ec2198e5b662af48a86fa1c8db3"
                     */
                    ETag: string;
                    /**
                     * @description The file never changes.
                     * @example public, max-age=31536000, immutable
                     */
                    "Cache-Control": string;
                    /**
                     * @description A name to save the file under. Not sent with JSON.
                     * @example attachment; filename="lid.glb"
                     */
                    "Content-Disposition"?: string;
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            404: components["responses"]["UnknownResult"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["TooManyRequests"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["StoreFailed"];
        };
    };
    listStored: {
        parameters: {
            query?: {
                /** @description The last id of the page before; by default, the list begins with the first. */
                after?: string;
                /** @description Most entries of the page. */
                limit?: number;
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description A page of the list. */
            200: {
                headers: {
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["StoredList"];
                };
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["TooManyRequests"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["Unavailable"];
        };
    };
    signAddress: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["SignRequest"];
            };
        };
        responses: {
            /** @description The URL. */
            200: {
                headers: {
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SignedAddress"];
                };
            };
            400: components["responses"]["MalformedJson"];
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            408: components["responses"]["BodyTooSlow"];
            413: components["responses"]["BodyTooLarge"];
            415: components["responses"]["UnsupportedMediaType"];
            422: components["responses"]["InvalidRequest"];
            429: components["responses"]["Busy"];
            500: components["responses"]["InternalError"];
            503: components["responses"]["OutOfTime"];
        };
    };
    getMetrics: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description All metrics. */
            200: {
                headers: {
                    "RateLimit-Policy": components["headers"]["RateLimit-Policy"];
                    RateLimit: components["headers"]["RateLimit"];
                    "X-Request-Id": components["headers"]["RequestId"];
                    [name: string]: unknown;
                };
                content: {
                    /**
                     * @example # HELP surface_cache_hits_total Responses sent from the cache.
                     *     # TYPE surface_cache_hits_total counter
                     *     surface_cache_hits_total 1204.0
                     */
                    "text/plain": string;
                    /**
                     * @example # HELP surface_cache_hits Responses sent from the cache.
                     *     # TYPE surface_cache_hits counter
                     *     surface_cache_hits_total 1204.0
                     *     # EOF
                     */
                    "application/openmetrics-text": string;
                };
            };
            401: components["responses"]["KeyNeeded"];
            403: components["responses"]["ScopeNeeded"];
            422: components["responses"]["InvalidQuery"];
            429: components["responses"]["TooManyRequests"];
            500: components["responses"]["InternalError"];
        };
    };
}
