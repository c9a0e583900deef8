"""The schemas of answers in the OpenAPI document, by hand."""

from typing import Any, get_args

from service.api.openapi.references import Json, ref
from service.api.problems import INTERNAL_ERROR, METHOD_NOT_ALLOWED, NOT_FOUND, PROBLEMS
from service.encoders.format import Compression
from service.encoders.registry import FORMATS
from service.errors import MAX_ISSUES
from service.surface.channels import MAX_DIMENSION


def _object(properties: dict[str, Json], required: list[str] | None = None, **more: Any) -> Json:
    return {
        "type": "object",
        "properties": properties,
        "required": list(properties) if required is None else required,
        **more,
    }


def _numbers(count: int, text: str, most: int | None = None) -> Json:
    longest = count if most is None else most
    row = {"type": "array", "items": {"type": "number"}, "minItems": count, "maxItems": longest}
    return {"type": "array", "items": row, "description": text}


def _indices(low: int, high: int, text: str) -> Json:
    index = {"type": "integer", "minimum": 0}
    row = {"type": "array", "items": index, "minItems": low, "maxItems": high}
    return {"type": "array", "items": row, "description": text}


def _text(description: str, **more: Any) -> Json:
    return {"type": "string", "description": description, **more}


def _list(name: str, description: str) -> Json:
    return {"type": "array", "items": ref(name), "description": description}


def _count(description: str) -> Json:
    return {"type": "integer", "minimum": 0, "description": description}


def _length(description: str) -> Json:
    return {"type": "number", "minimum": 0, "description": description}


def _bound(text: str) -> Json:
    number = {"type": "number"}
    return {"type": "array", "items": number, "minItems": 3, "maxItems": 3, "description": text}


def _range(text: str) -> Json:
    number = {"type": "number"}
    return {"type": "array", "items": number, "minItems": 2, "maxItems": 2, "description": text}


_BOUNDS = {"min": _bound("Least x, y and z."), "max": _bound("Greatest x, y and z.")}

_CONTINUITY = ["C0", "G1", "C1"]

_REPORT = _object(
    {
        "vertices": _count("Number of positions: one with several normals counts once."),
        "triangles": _count("Number of triangles."),
        "quads": _count("Number of quads."),
        "patches": _count("Number of Bézier patches; tubes and ribbons have none."),
        "bounds": _object(_BOUNDS, description="Of the vertices as stored."),
        "watertight": {
            "type": "boolean",
            "description": "Whether every edge is used by exactly two faces.",
        },
        "boundary_edges": _count("Edges that only one face uses."),
        "poles_repaired": _count("Samples whose normal is a limit, since du × dv vanishes there."),
        "closed_u": {
            "type": "boolean",
            "description": "Whether the surface closes along u: its last line is its first one. "
            "Left out, as the next three, for several patches that are not one surface.",
        },
        "closed_v": {"type": "boolean", "description": "The same along v."},
        "continuity_u": _text(
            "There if it closes along u: whether it does so with one partial du (C1), with one "
            "tangent plane (G1), or with neither (C0).",
            enum=_CONTINUITY,
        ),
        "continuity_v": _text("The same along v.", enum=_CONTINUITY),
        "deviation_bound": _length(
            "Proved, in model units: no point of the surface is further than this from the faces "
            "as they are written, their rounding included. Never above a tolerance that was asked "
            "for; left out where there are no faces of a parametric surface."
        ),
        "mesh_deviation_bound": _length(
            "There if it was asked for (`two_sided`), and proved as well: no point of the faces is "
            "further than this from the surface."
        ),
        "normal_angle": {
            "type": "number",
            "minimum": 0,
            "description": "There if it was asked for (`angle_tolerance`): radians, the largest "
            "measured between the normals at two vertices that an edge joins.",
        },
        "curvature": _object(
            {
                "gaussian": _range("Per square of the model unit."),
                "mean": _range("Per model unit."),
            },
            description="There if it was asked for (`curvatures`): least and greatest curvature "
            "of the vertices.",
        ),
        "parts": {
            "type": "array",
            "description": "The bound of every part by itself, in the order of the parts.",
            "items": _object(
                {
                    "name": _text("Name of the part; of a group, of the member."),
                    "deviation_bound": _length(
                        "As that of the whole; left out of what has no parameters."
                    ),
                },
                ["name"],
            ),
        },
        "engine": {"type": "integer", "description": "Version of the numbers."},
    },
    [
        "vertices",
        "triangles",
        "quads",
        "patches",
        "bounds",
        "watertight",
        "boundary_edges",
        "poles_repaired",
        "engine",
    ],
    description="What is known about a mesh.",
)

_MESH = _object(
    {
        "vertices": _numbers(
            3,
            "Positions [x, y, z], welded ones once; float64, shortest digits that round-trip.",
        ),
        "faces": _indices(
            3,
            4,
            "Rows of `vertices` for each corner of each face, counter-clockwise seen from the "
            "normal's tip; part by part, the quads of a part before its triangles.",
        ),
        "normals": _numbers(
            3,
            "Unit normals, float32; left out if `normals` is false. Row by row those of "
            "`vertices`, unless there are `attribute_faces`.",
        ),
        "uvs": _numbers(
            2,
            "Texture coordinates of the surface, or if it has none and `uvs` is true, parameters "
            "(u, v); float32. In the rows of `normals`.",
        ),
        "colors": _numbers(
            3,
            "Colours of the surface, if it has any: sRGB, or sRGB and opacity, from 0 to 1; "
            "float32. In the rows of `normals`.",
            most=4,
        ),
        "attributes": {
            "type": "object",
            "additionalProperties": _numbers(1, "Rows of numbers.", most=MAX_DIMENSION),
            "description": "Values of the surface's attributes by name, float64. In the rows of "
            "`normals`.",
        },
        "attribute_faces": _indices(
            3,
            4,
            "There if a position has several normals, colours or the like, as at a crease: in the "
            "shape of `faces`, the rows of `normals`, `uvs`, `colors` and `attributes` for each "
            "corner of each face.",
        ),
        "parts": {
            "type": "array",
            "description": "Named runs [first, last) of `faces`.",
            "items": _object(
                {
                    "name": _text("Name of the part."),
                    "faces": {
                        "type": "array",
                        "items": {"type": "integer"},
                        "minItems": 2,
                        "maxItems": 2,
                        "description": "First face, and the one after the last.",
                    },
                    "color": {
                        "type": "array",
                        "items": {"type": "number", "minimum": 0, "maximum": 1},
                        "minItems": 4,
                        "maxItems": 4,
                        "description": "Base colour [r, g, b, a], sRGB, where one was told.",
                    },
                },
                ["name", "faces"],
            ),
        },
        "lines": {
            "type": "array",
            "description": "Overlays, if any were asked for.",
            "items": _object(
                {
                    "name": _text("Name of the overlay."),
                    "vertices": _numbers(3, "Positions of its own."),
                    "segments": _indices(2, 2, "Pairs of rows of its `vertices`."),
                }
            ),
        },
        "report": ref("MeshReport"),
    },
    ["vertices", "faces", "parts", "report"],
    description="A mesh as JSON.",
)

_ISSUE = _object(
    {
        "code": _text(
            "What is wrong, stable, for programs; the list stands at the head of this document. "
            "There may be more of them in later versions.",
            examples=["ragged"],
        ),
        "pointer": _text("JSON pointer (RFC 6901) into the body; empty for the whole of it."),
        "parameter": _text("Name of the path or query parameter, instead of a pointer."),
        "header": _text("Name of the header, instead of a pointer."),
        "detail": _text("What is wrong, for people."),
        "got": _text("What was found, described and not repeated."),
        "needed": _text("What would have been right."),
    },
    ["code", "detail"],
    description="One thing that is wrong, and where: a pointer, a parameter or a header.",
)

_KINDS = sorted(
    {
        problem.code
        for problem in (*PROBLEMS.values(), NOT_FOUND, METHOD_NOT_ALLOWED, INTERNAL_ERROR)
    }
)

_PROBLEM = _object(
    {
        "type": _text("Always `about:blank`; `code` tells more.", const="about:blank"),
        "title": _text("The phrase of the status."),
        "status": {"type": "integer", "description": "The status again."},
        "code": _text("Kind of problem, stable, for programs.", enum=_KINDS),
        "detail": _text("Kind of problem, for people."),
        "errors": {
            "type": "array",
            "maxItems": MAX_ISSUES,
            "items": ref("Issue"),
            "description": f"What is wrong, place by place; at most {MAX_ISSUES} of them.",
        },
    },
    description="An error answer (RFC 9457).",
)

_SUMMARY = _object(
    {
        "id": _text("The id, readable."),
        "title": _text("A short title."),
        "description": _text("What it is."),
        "up": _text("The vertical axis.", enum=["y", "z"]),
        "patches": _count("Number of Bézier patches; tubes and ribbons have none."),
        "degree": {
            "type": "array",
            "items": {"type": "integer"},
            "minItems": 2,
            "maxItems": 2,
            "description": "Highest degree [p, q] of its patches; a triangle counts as [n, n]. Of "
            "what is swept along a curve, that of the curve and 0.",
        },
        "links": _object(
            {
                "self": _text("Address of the definition."),
                "mesh": _object(
                    {fmt.suffix: _text(f"{fmt.title}.") for fmt in FORMATS},
                    description="Address of the mesh by suffix; options are added as a query.",
                ),
            },
            description="Addresses, without the host.",
        ),
    },
    description="A built-in surface.",
)

_COMPRESSIONS = [kind for kind in get_args(Compression) if kind != "none"]

_FORMAT = _object(
    {
        "name": _text("Name for `?format=`."),
        "title": _text("What it is."),
        "media_type": _text("Media type for `Accept`."),
        "suffix": _text("Suffix of files and of mesh URLs."),
        "quads": {"type": "boolean", "description": "Whether it can hold quads."},
        "overlays": {"type": "boolean", "description": "Whether it can hold lines."},
        "uvs": {"type": "boolean", "description": "Whether it can hold texture coordinates."},
        "colors": {"type": "boolean", "description": "Whether it can hold colours of vertices."},
        "attributes": {"type": "boolean", "description": "Whether it can hold attributes."},
        "precision": _text("Precision of positions.", enum=["float32", "float64"]),
        "quantize": {"type": "boolean", "description": "Whether it takes `quantize`."},
        "compression": {
            "type": "array",
            "items": {"type": "string", "enum": _COMPRESSIONS},
            "description": "The kinds of `compression` that it takes here, beside `none`.",
            "examples": [_COMPRESSIONS],
        },
    },
    description="A format that meshes are written in.",
)

ANSWERS: dict[str, Json] = {
    "Mesh": _MESH,
    "MeshReport": _REPORT,
    "Problem": _PROBLEM,
    "Issue": _ISSUE,
    "SurfaceSummary": _SUMMARY,
    "SurfaceList": _object(
        {"surfaces": _list("SurfaceSummary", "One entry a surface.")},
        description="The built-in surfaces.",
    ),
    "SurfaceDocument": _object(
        {
            "surface": ref("SurfaceDefinition")
            | {"description": "The definition, as a request would give it."}
        },
        description="A surface alone: a body for the other calls, to which options may be added.",
    ),
    "Format": _FORMAT,
    "FormatList": _object(
        {"formats": _list("Format", "One entry a format.")}, description="The formats of meshes."
    ),
    "Health": _object(
        {
            "status": _text("State of the service.", enum=["live", "ready", "unready", "draining"]),
            "computing": _text("Whether meshes come out right.", enum=["ready", "unavailable"]),
            "store": _text("Whether surfaces can be kept.", enum=["ready", "unavailable"]),
            "version": _text("Version of the service."),
            "engine": {"type": "integer", "description": "Version of the numbers."},
        },
        ["status"],
        description="How the service is.",
    ),
}
