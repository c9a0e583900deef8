"""Examples of requests, and of the meshes that they give: computed, hence true."""

from functools import cache
from typing import Any

import orjson

from service.api.openapi.references import Json
from service.encoders.registry import BY_NAME
from service.pipeline.mesh import render
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document

_STRIP = [[[0, 1], [2, 3]], [[2, 3], [4, 5]]]
"""Two patches of degree (1, 1) over six vertices; they share the edge of the two in the middle."""

_WING = {"control_net": [[[0, 0, 0], [0, 0, 1]], [[1, 0, 0], [1, 1, 0.5]]]}

_WAVE = {
    "control_net": [[[i, j, (i % 2) * (j % 3)] for j in range(4)] for i in range(4)],
}
"""A bicubic patch that bends more along v than along u."""

_CIRCLE = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]

REQUESTS: Json = {
    "patch": {
        "summary": "One patch of degree (1, 2)",
        "value": {
            "surface": {
                "type": "bezier",
                "control_net": [
                    [[0, 0, 0], [0, 1, 1], [0, 2, 0]],
                    [[1, 0, 1], [1, 1, 2], [1, 2, 1]],
                ],
            },
            "resolution": [16, 32],
        },
    },
    "rational": {
        "summary": "A quarter of a cylinder, exactly",
        "value": {
            "surface": {
                "control_net": [
                    [[1, 0, 0], [1, 1, 0], [0, 1, 0]],
                    [[1, 0, 1], [1, 1, 1], [0, 1, 1]],
                ],
                "weights": [[1, 0.7071067811865476, 1], [1, 0.7071067811865476, 1]],
                "up": "z",
                "name": "quarter",
            },
            "resolution": 8,
        },
    },
    "nurbs": {
        "summary": "A NURBS surface that closes: a full circle of nine points, drawn up",
        "value": {
            "surface": {
                "type": "bspline",
                "control_net": [[[x, y, 0], [2 * x, 2 * y, 1], [x, y, 2]] for x, y in _CIRCLE],
                "degree": [2, 2],
                "knots": [[0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4], "clamped"],
                "weights": [
                    [1, 1, 1] if x * y == 0 else [0.7071067811865476] * 3 for x, y in _CIRCLE
                ],
                "up": "z",
                "name": "drum",
            },
            "resolution": 8,
        },
    },
    "colors": {
        "summary": "A patch with colours, texture coordinates and a temperature",
        "value": {
            "surface": {
                "control_net": [
                    [[0, 0, 0], [0, 1, 1], [0, 2, 0]],
                    [[1, 0, 1], [1, 1, 2], [1, 2, 1]],
                ],
                "colors": [[[0.1, 0.2, 0.8], [0.9, 0.3, 0.1]]],
                "uvs": [[[0, 0], [0, 1]], [[1, 0], [1, 1]]],
                "attributes": {"temperature": [[[20], [95], [20]]]},
            },
            "resolution": 8,
        },
    },
    "patches": {
        "summary": "Two patches that share an edge, with their boundary",
        "value": {
            "surface": {
                "type": "patches",
                "vertices": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1], [2, 0, 0], [2, 1, 0]],
                "patches": _STRIP,
                "parts": {"left": [0], "right": [1]},
            },
            "faces": "quads",
            "overlays": ["boundary"],
        },
    },
    "group": {
        "summary": "A patch and its mirror image, in two colours",
        "value": {
            "surface": {
                "type": "group",
                "members": [
                    {"surface": _WING, "name": "right", "color": [0.2, 0.4, 0.8]},
                    {
                        "surface": _WING,
                        "name": "left",
                        "color": [0.8, 0.2, 0.2, 0.5],
                        "matrix": [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
                    },
                ],
            },
        },
    },
    "tube": {
        "summary": "A wire that tapers along a closed B-spline",
        "value": {
            "surface": {
                "type": "tube",
                "curve": {
                    "type": "bspline",
                    "control_points": [[2, 0, 0], [0, 2, 1], [-2, 0, 0], [0, -2, 1]],
                    "knots": "periodic",
                },
                "radius": [0.3, 0.1, 0.1, 0.3],
                "sides": 12,
                "up": "z",
                "name": "ring",
            },
            "resolution": 8,
        },
    },
    "triangle": {
        "summary": "A triangular patch of degree 2, with parameters and curvatures, no normals",
        "value": {
            "surface": {
                "type": "triangle",
                "control_net": [
                    [[0, 0, 0], [2, 0, 2], [4, 0, 0]],
                    [[0, 2, 2], [2, 2, 0]],
                    [[0, 4, 0]],
                ],
            },
            "normals": False,
            "uvs": True,
            "curvatures": True,
        },
    },
    "ribbon": {
        "summary": "A ribbon, widest in the middle, that faces a point",
        "value": {
            "surface": {
                "type": "ribbon",
                "curve": {"control_points": [[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]]},
                "width": [0, 0.5, 0],
                "camera": [2, 1, 9],
            },
            "resolution": 24,
        },
    },
    "wireframe": {
        "summary": "Two patches as tubes along their isoparametric curves, without faces",
        "value": {
            "surface": {
                "type": "patches",
                "vertices": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1], [2, 0, 0], [2, 1, 0]],
                "patches": _STRIP,
            },
            "faces": "none",
            "isocurves": [2, 4],
            "wires": "tubes",
            "wire_width": 0.02,
            "wire_sides": 6,
        },
    },
    "tolerance": {
        "summary": "No further from its mesh than a thousandth of its size, nor the mesh from it",
        "value": {
            "surface": _WAVE,
            "relative_tolerance": 0.001,
            "angle_tolerance": 0.3,
            "two_sided": True,
        },
    },
    "limits": {
        "summary": "Within a hundredth of a unit, or refused if that takes more than is allowed",
        "value": {
            "surface": _WAVE,
            "tolerance": 0.01,
            "max_triangles": 5000,
            "max_bytes": 1_000_000,
        },
    },
    "camera": {
        "summary": "Within half a pixel of a picture that is taken from a point",
        "value": {
            "surface": _WAVE,
            "camera": {"position": [1.5, -4, 3], "field_of_view": 0.8, "height": 1080},
            "pixel_tolerance": 0.5,
        },
    },
    "samples": {
        "summary": "By de Casteljau's algorithm, every sample of every patch a vertex of its own; "
        "or, as OOGL, the exact patches",
        "value": {
            "surface": {
                "type": "patches",
                "vertices": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1], [2, 0, 0], [2, 1, 0]],
                "patches": _STRIP,
            },
            "method": "de_casteljau",
            "weld": False,
            "crease_angle": 0.5,
            "oogl": "bez",
        },
    },
    "compact": {
        "summary": "As small as glTF can be: whole numbers, compressed; with `format=glb`",
        "value": {"surface": _WAVE, "quantize": True, "compression": "meshopt"},
    },
}


_MESHES: dict[str, tuple[str, Json]] = {
    "MeshOfPatch": (
        "A patch: row k of the normals belongs to row k of the vertices",
        {"surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}},
    ),
    "MeshWithCrease": (
        "Two patches that meet at an angle: `attribute_faces` name the normals",
        {
            "surface": {
                "type": "patches",
                "vertices": [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 1], [2, 1, 1]],
                "patches": _STRIP,
                "name": "ramp",
            },
            "faces": "quads",
        },
    ),
}


@cache
def meshes() -> Json:
    """Examples of the JSON mesh by name: patches of one division."""
    return {
        name: {"summary": summary, "value": _mesh(request | {"resolution": 1})}
        for name, (summary, request) in _MESHES.items()
    }


def _mesh(request: Json) -> Any:
    wanted = validate_document(MeshRequest, request)
    mesh = render(wanted.to_surface(), wanted.mesh_options(), BY_NAME["json"])
    return orjson.loads(mesh)
