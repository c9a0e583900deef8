// Valid and invalid uses of the types in openapi/surface-service.d.ts. Each invalid use follows a
// comment @ts-expect-error: the compiler must refuse it. The program is compiled and never run.

import createClient from 'openapi-fetch';
import type {
  BsplineDefinition, CurveDefinition, Format, Issue, Mesh, MeshReport, MeshRequest, operations, paths,
  Points, Problem, StoredSurface, SurfaceDefinition,
} from '../../openapi/surface-service';

type MeshQuery = NonNullable<operations['getSurfaceMesh']['parameters']['query']>;
type Headers = operations['getSurfaceMesh']['responses'][200]['headers'];

type Equal<A, B> = [A] extends [B] ? ([B] extends [A] ? true : false) : false;

/** A call compiles only if `A` and `B` are the same type. */
function assertSame<A, B>(_: Equal<A, B>): void {}

// Requests: fields with defaults may be left out.
const net: [number, number, number][][] = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]];
const patch: SurfaceDefinition = { control_net: net };
const spline: BsplineDefinition = {
  type: 'bspline', control_net: net, degree: [1, 1], knots: ['clamped', [0, 0, 1, 1]],
};
const tube: SurfaceDefinition = {
  type: 'tube', curve: { control_points: [[0, 0], [1, 0, 1]] }, radius: 0.1,
};
const group: SurfaceDefinition = {
  type: 'group', members: [{ surface: patch, name: 'sail', color: [1, 0, 0] }, { surface: tube }],
};
export const requests: MeshRequest[] = [
  { surface: patch },
  { surface: spline, resolution: 4 },
  { surface: group, resolution: [4, 8], faces: 'quads', overlays: ['boundary'] },
  { surface: patch, tolerance: 0.01, two_sided: true },
  {
    surface: patch,
    camera: { position: [4, 3, 9], field_of_view: 0.8, height: 1080 },
    pixel_tolerance: 0.5,
  },
];

// @ts-expect-error a surface needs a control net
export const empty: SurfaceDefinition = { type: 'bezier' };
export const flat: SurfaceDefinition = { control_net: [[[0, 0], [0, 1]], [[1, 0], [1, 1]]] };
// @ts-expect-error a point needs two or three numbers
export const line: SurfaceDefinition = { control_net: [[[0], [1]], [[1], [2]]] };
// @ts-expect-error a coordinate is a number, not a text
export const text: SurfaceDefinition = { control_net: [[['0', 0, 0]]] };
// @ts-expect-error no kind of surface has this name
export const kind: SurfaceDefinition = { type: 'nurbs', control_net: net };
// @ts-expect-error this field belongs to another kind of surface
export const mixed: SurfaceDefinition = { type: 'tube', control_net: net };
// @ts-expect-error a group must not contain a group
export const nested: SurfaceDefinition = { type: 'group', members: [{ surface: group }] };
// @ts-expect-error no option has this name
export const misspelt: MeshRequest = { surface: patch, resolutions: 4 };
// @ts-expect-error the option does not have this value
export const unknown: MeshRequest = { surface: patch, faces: 'hexagons' };
// @ts-expect-error a resolution has one or two numbers
export const three: MeshRequest = { surface: patch, resolution: [1, 2, 3] };
// @ts-expect-error null is refused everywhere
export const none: MeshRequest = { surface: patch, tolerance: null };
// @ts-expect-error a request needs a surface
export const options: MeshRequest = { resolution: 4 };
// @ts-expect-error a curve has no control net
export const curve: CurveDefinition = { control_net: net };

// In each case, TypeScript knows the kind by the value of `type`.
export function countItems(surface: SurfaceDefinition): number {
  switch (surface.type) {
    case 'group': return surface.members.length;
    case 'patches': return surface.vertices.length;
    case 'multipatch': return surface.surfaces.length;
    case 'brep': return surface.faces.length;
    case 'tube': case 'ribbon': return surface.curve.control_points.length;
    default: return surface.control_net.flat().length;
  }
}

// Responses: a field that may be missing is optional, all others are not.
declare const mesh: Mesh;
declare const points: Points;
declare const problem: Problem;
declare const format: Format;
assertSame<Mesh['vertices'][number], [number, number, number]>(true);
assertSame<Mesh['report'], MeshReport>(true);
assertSame<Headers['ETag'], string>(true);
assertSame<StoredSurface['links']['mesh']['glb'], string>(true);
assertSame<Format['compression'], 'meshopt'[]>(true);
assertSame<Problem['errors'][number], Issue>(true);
export const height: number = mesh.report.bounds.max[1] + mesh.vertices.length;
export const second: number | null | undefined = points.mean_curvature?.[0];
export const quads: boolean = format.quads;
// @ts-expect-error a mesh may have no normals
export const normals: number[][] = mesh.normals;
// @ts-expect-error a report may have no deviation bound
export const bound: number = mesh.report.deviation_bound;
// @ts-expect-error no problem has this code
export const teapot: boolean = problem.code === 'im_a_teapot';

// Requests by openapi-fetch: paths, queries and bodies. (In responses it turns tuples into lists.)
const service = createClient<paths, 'application/json' | 'application/problem+json'>();
export async function calls(): Promise<string | undefined> {
  const { data, error } = await service.POST('/v1/mesh', { body: { surface: patch } });
  const vertices: number[][] | undefined = data?.vertices;
  const issues: Issue[] | undefined = error?.errors;
  // @ts-expect-error the response does not have this field
  const positions: number[][] | undefined = data?.positions;
  // @ts-expect-error this path does not exist
  await service.GET('/v2/mesh');
  // @ts-expect-error the path does not have this method
  await service.PUT('/v1/mesh', { body: { surface: patch } });
  // @ts-expect-error a body needs a surface
  await service.POST('/v1/mesh', { body: {} });
  const stored = await service.POST('/v1/surfaces', { body: { surface: patch } });
  const link: string | undefined = stored.data?.links.mesh.glb;
  const path = { id: stored.data?.id ?? 'saddle', suffix: 'glb' } as const;
  const address = '/v1/surfaces/{id}/mesh.{suffix}';
  const query = { resolution: [4, 8], engine: 4 } satisfies MeshQuery;
  const { data: file } = await service.GET(address, { params: { path, query }, parseAs: 'blob' });
  assertSame<typeof file, Blob | undefined>(true);
  // @ts-expect-error no file has this suffix
  await service.GET(address, { params: { path: { ...path, suffix: 'fbx' } } });
  // @ts-expect-error the path needs an id
  await service.GET(address, { params: { path: { suffix: 'glb' } } });
  // @ts-expect-error a query cannot have a camera
  const seen: MeshQuery = { camera: { position: [0, 0, 1], field_of_view: 1, height: 1 } };
  if (link || file || seen) return link;
  return vertices && positions ? undefined : issues?.[0]?.pointer;
}
