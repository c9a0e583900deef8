"""Small surfaces of every kind, with and without channels; and whole requests for meshes of them.

Tests use these as parameters, so that each test runs on every kind and every group of options.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeAlias

Json: TypeAlias = dict[str, Any]

ARC = [[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]]
WAVES = [[[i, j, (i * j) % 3] for j in range(5)] for i in range(4)]
RGBA = [[[0.1, 0.2, 0.8, 1], [0.9, 0.3, 0.1, 0.5]], [[1, 1, 0, 0.2], [0, 1, 0, 1]]]
RGB = [[[0.9, 0.1, 0.1], [0.1, 0.1, 0.9]]]
UVS = [[[0, 0], [0, 2]], [[1, 0], [1, 2]]]
ATTRIBUTES = {"temperature": [[[20], [95]]], "strain": [[[1, 2, 3, 4, 5, 6]]]}

PATCH: Json = {
    "control_net": [[[0, 0, 0], [0, 1, 1], [0, 2, 0]], [[1, 0, 1], [1, 1, 2], [1, 2, 1]]]
}
BSPLINE: Json = {"type": "bspline", "control_net": WAVES, "degree": [2, 3]}
TRIANGLE: Json = {
    "type": "triangle",
    "control_net": [[[0, 0, 0], [2, 0, 2], [4, 0, 0]], [[0, 2, 2], [2, 2, 0]], [[0, 4, 0]]],
}
TENT: Json = {
    "type": "patches",
    "vertices": [[0, 0, 0], [0, 1, 0], [1, 0, 1], [1, 1, 1], [2, 0.5, 0]],
    "patches": [[[0, 1], [2, 3]]],
    "triangles": [[[2, 4], [3]]],
    "parts": {"roof": [0], "end": [1]},
}
TUBE: Json = {"type": "tube", "curve": {"control_points": ARC}, "radius": [0.3, 0.1], "sides": 7}
RIBBON: Json = {
    "type": "ribbon",
    "curve": {"type": "bspline", "control_points": [*ARC, [5, 1, 2]]},
    "width": [0, 0.5, 0],
    "camera": [2, 1, 9],
    "up": "z",
}

SURFACES: Mapping[str, Json] = MappingProxyType(
    {
        "bezier": PATCH,
        "bezier with channels": PATCH | {"colors": RGBA, "uvs": UVS, "attributes": ATTRIBUTES},
        "bspline": BSPLINE,
        "bspline that closes": {
            "type": "bspline",
            "control_net": [
                [[x, y, 0], [2 * x, 2 * y, 1], [x, y, 2]]
                for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))
            ],
            "degree": [3, 2],
            "knots": ["periodic", [0, 0, 0, 1, 1, 1]],
            "weights": [[1, 2, 1], [1, 1, 3], [1, 2, 1], [2, 1, 1]],
            "up": "z",
        },
        "bspline with channels": BSPLINE
        | {
            "colors": [[[i / 3, j / 4, 0.5] for j in range(5)] for i in range(4)],
            "uvs": UVS,
            "attributes": ATTRIBUTES,
        },
        "triangle": TRIANGLE | {"weights": [[1, 2, 1], [3, 1], [1]], "up": "z"},
        "triangle with channels": TRIANGLE
        | {
            "colors": [[[0.9, 0.1, 0.1], [0.1, 0.1, 0.9]], [[0.2, 0.8, 0.2]]],
            "uvs": [[[0, 0], [1, 0]], [[0, 1]]],
            "attributes": {"temperature": [[[20], [95]], [[40]]]},
        },
        "patches and triangles": TENT,
        "patches with channels": TENT
        | {
            "colors": [[k / 5, 1 - k / 5, 0.5, 1 - k / 9] for k in range(5)],
            "uvs": [[k, k % 2] for k in range(5)],
            "attributes": {"temperature": [[20 * k] for k in range(5)]},
        },
        "patches of several degrees": {
            "type": "patches",
            "vertices": [[k // 3, k % 3 / 2, (k * k) % 5] for k in range(11)],
            "patches": [[[0, 2], [3, 5]], [[3, 4, 5], [6, 7, 8]], [[6, 8], [9, 10]]],
            "parts": {"middle": [1]},
        },
        "multipatch": {
            "type": "multipatch",
            "surfaces": [
                BSPLINE | {"knots": ["clamped", [2, 2, 2, 2, 3, 5, 5, 5, 5]], "name": "sheet"},
                {"control_net": [[[3, j, 0] for j in (0, 4)], [[5, 0, 0], [5, 4, 1]]]},
                TRIANGLE | {"weights": [[1, 2, 1], [3, 1], [1]]},
                PATCH | {"name": "patch", "up": "z"},
            ],
            "up": "z",
        },
        "tube": TUBE,
        "tube that closes": {
            "type": "tube",
            "curve": {
                "type": "bspline",
                "control_points": [[2, 0, 0], [0, 2, 1], [-2, 0, 0], [0, -2, 1]],
                "knots": "periodic",
            },
            "radius": 0.4,
            "sides": 5,
            "up": "z",
        },
        "ribbon": RIBBON,
        "group": {
            "type": "group",
            "up": "z",
            "members": [
                {"surface": PATCH | {"colors": RGB}, "name": "painted"},
                {"surface": PATCH, "name": "left", "color": [0.2, 0.4, 0.8]},
                {
                    "surface": PATCH,
                    "name": "right",
                    "color": [0.8, 0.2, 0.2, 0.5],
                    "matrix": [[-1, 0, 0, 9], [0, 2, 0.5, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
                },
                {"surface": TUBE, "name": "wire", "color": [0.1, 0.1, 0.1]},
                {
                    "surface": TRIANGLE,
                    "matrix": [[1, 0, 0, 0], [0, 1, 0, 7], [0, 0, 1, 0], [0, 0, 0, 1]],
                },
            ],
        },
    }
)
"""JSON definitions of surfaces, by a title that tests show."""

WIRES: Mapping[str, Json] = MappingProxyType(
    {
        f"isocurves as {wires}{' alone' if faces == 'none' else ''}": {
            "surface": TENT,
            "isocurves": [2, 1],
            "wires": wires,
            "faces": faces,
            "wire_width": 0.05,
            "wire_sides": 5,
        }
        for wires in ("lines", "tubes", "ribbons")
        for faces in ("triangles", "none")
    }
)
"""Whole requests for wireframes, by a title."""

ADAPTIVE: Mapping[str, Json] = MappingProxyType(
    {
        f"{name} by tolerance": {"surface": SURFACES[name], **options}
        for name, options in (
            ("bezier with channels", {"tolerance": 0.05}),
            ("bspline that closes", {"relative_tolerance": 0.02}),
            ("triangle with channels", {"angle_tolerance": 0.5}),
            (
                "patches with channels",
                {
                    "camera": {"position": [1, 0.5, 4], "field_of_view": 0.8, "height": 90},
                    "pixel_tolerance": 1,
                },
            ),
        )
    }
    | {
        "group by tolerance": {
            "surface": SURFACES["group"]
            | {
                # The service refuses to mesh tubes by tolerance.
                "members": [
                    member
                    for member in SURFACES["group"]["members"]
                    if member["surface"] is not TUBE
                ]
            },
            "tolerance": 0.05,
            "two_sided": True,
        }
    }
)
"""Whole requests for meshes by tolerance, by a title."""

WITH_CURVATURES: Mapping[str, Json] = MappingProxyType(
    {
        f"{name} with curvatures": request | {"curvatures": True}
        for name, request in (
            ("patches and triangles", {"surface": TENT, "resolution": [3, 4]}),
            ("bezier with channels", ADAPTIVE["bezier with channels by tolerance"]),
            # One-sided, because `ADAPTIVE` has the two-sided group.
            ("group", ADAPTIVE["group by tolerance"] | {"two_sided": False}),
        )
    }
)
"""Whole requests for meshes with curvatures, by a title."""

REQUESTS: Mapping[str, Json] = MappingProxyType(
    {name: {"surface": surface, "resolution": [3, 4]} for name, surface in SURFACES.items()}
    | {name: request | {"resolution": 3} for name, request in WIRES.items()}
    | dict(ADAPTIVE)
    | dict(WITH_CURVATURES)
)
"""All whole requests: each surface by resolution, wireframes, meshes by tolerance and with
curvatures."""

CURVES: Mapping[str, Json] = MappingProxyType(
    {
        "plane": {"control_points": [[1, 0], [1, 1], [0, 1]], "weights": [1, 0.5, 1]},
        "space": {"control_points": ARC, "up": "z", "name": "handle"},
        "closed": {
            "type": "bspline",
            "control_points": [[2, 0, 0], [0, 2, 1], [-2, 0, 0], [0, -2, 1]],
            "knots": "periodic",
        },
    }
)
"""JSON definitions of curves, by a title."""
