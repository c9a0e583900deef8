"""Small breps as documents."""

from typing import Any

_HALF = 0.7071067811865476

PLATE: dict[str, Any] = {
    "type": "brep",
    "name": "plate",
    "up": "z",
    "uncertainty": 1e-6,
    "invalid_faces": "refuse",
    "vertices": [[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0], [7, 5, 0]],
    "vertex_uncertainties": [1e-6, 1e-6, 1e-6, 1e-6, 1e-6],
    "edges": [
        {"vertices": [0, 1]},
        {"vertices": [1, 2]},
        {"vertices": [2, 3]},
        {"vertices": [3, 0]},
        {
            "vertices": [4, 4],
            "uncertainty": 1e-5,
            "curve": {
                "type": "bspline",
                "degree": 2,
                "knots": [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4],
                "control_points": [
                    [7, 5, 0], [7, 7, 0], [5, 7, 0], [3, 7, 0], [3, 5, 0],
                    [3, 3, 0], [5, 3, 0], [7, 3, 0], [7, 5, 0],
                ],
                "weights": [1, _HALF, 1, _HALF, 1, _HALF, 1, _HALF, 1],
            },
        },
    ],
    "faces": [
        {
            "name": "top",
            "color": [0.8, 0.2, 0.1],
            "reversed": False,
            "surface": {"control_net": [[[0, 0, 0], [0, 10, 0]], [[10, 0, 0], [10, 10, 0]]]},
            "loops": [
                {"edges": [0, 1, 2, 3]},
                {"edges": [4], "reversed": [True], "pcurves": [None]},
            ],
        }
    ],
    "shells": [{"faces": [0], "closed": False}],
}  # fmt: skip
"""A square of plane with a round hole: one trimmed face."""


def build_box(size: tuple[float, float, float] = (2, 3, 4)) -> dict[str, Any]:
    """A box: a closed shell of six faces, whose normals point outwards."""
    x, y, z = size
    vertices = [[i * x, j * y, k * z] for k in range(2) for j in range(2) for i in range(2)]
    rings = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    numbers: dict[tuple[int, int], int] = {}
    faces = []
    for ring in rings:
        edges, flags = [], []
        for first, last in zip(ring, (*ring[1:], ring[0]), strict=True):
            pair = min(first, last), max(first, last)
            edges.append(numbers.setdefault(pair, len(numbers)))
            flags.append(first > last)
        a, b, c, d = (vertices[corner] for corner in ring)
        faces.append(
            {
                "surface": {"control_net": [[a, d], [b, c]]},
                "loops": [{"edges": edges, "reversed": flags}],
            }
        )
    return {
        "type": "brep",
        "vertices": vertices,
        "edges": [{"vertices": list(pair)} for pair in numbers],
        "faces": faces,
        "shells": [{"faces": list(range(6)), "closed": True}],
    }
