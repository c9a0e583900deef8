"""Half spheres, cut by planes through the axis: their edges run through both poles."""

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

from oracles.solids import read_solid
from service.bases.arrays import FloatArray
from service.engine.brep.preparation.prepare import prepare
from tests.engine.brep.solid_documents import count_cracks, lower

CENTER, RADIUS = np.array([1.0, 2.0, 3.0]), 7.0
"""The sphere among the solids; its axis is parallel to z."""


def find_point(across: FloatArray, angle: float, radius: float = RADIUS) -> list[float]:
    """A point of the plane through the axis and a direction."""
    axis = np.array([0.0, 0.0, 1.0])
    point: list[float] = (CENTER + radius * (cos(angle) * across + sin(angle) * axis)).tolist()
    return point


def build_arc(across: FloatArray, begin: float, end: float) -> dict[str, Any]:
    """An arc around the centre as four quadratic pieces."""
    angles = np.linspace(begin, end, 9)
    weight = cos((end - begin) / 8)
    points = [
        find_point(across, angle, RADIUS / weight if k % 2 else RADIUS)
        for k, angle in enumerate(angles.tolist())
    ]
    return {
        "type": "bspline",
        "degree": 2,
        "knots": [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4],
        "control_points": points,
        "weights": [weight if k % 2 else 1.0 for k in range(9)],
    }


def build_half(turn: float, arcs: int, *, other: bool) -> dict[str, Any]:
    """The half of the sphere on one side of a plane, with a border of some arcs."""
    across = np.array([cos(turn), sin(turn), 0.0])
    stops = 0.4 + 2 * pi * np.arange(arcs + 1) / arcs
    edges = [
        {"vertices": [k, (k + 1) % arcs], "curve": build_arc(across, stops[k], stops[k + 1])}
        for k in range(arcs)
    ]
    corners = [(-1, -1), (-1, 1), (1, -1), (1, 1)]
    a, b, c, d = (
        (CENTER + 8 * (x * across + np.array([0.0, 0.0, y]))).tolist() for x, y in corners
    )
    numbers = list(range(arcs))
    ball = {"edges": numbers[::-1] if other else numbers, "reversed": [other] * arcs}
    return {
        "type": "brep",
        "vertices": [find_point(across, angle) for angle in stops[:-1].tolist()],
        "edges": edges,
        "faces": [
            {"surface": read_solid("sphere")["faces"][0]["surface"], "loops": [ball]},
            {
                "surface": {"control_net": [[a, b], [c, d]]},
                "loops": [{"edges": numbers}],
                "reversed": not other,
            },
        ],
        "shells": [{"faces": [0, 1], "closed": True}],
    }


@pytest.mark.parametrize("other", [False, True])
@pytest.mark.parametrize(("turn", "arcs"), [(0.0, 1), (1.1, 2)])
def test_a_half_sphere_is_closed(turn: float, arcs: int, other: bool) -> None:
    prepared = prepare(lower(build_half(turn, arcs, other=other)))
    assert prepared.gaps.max() < 1e-9 * prepared.diagonal
    # Both poles are vertices now, and the face of the sphere runs along both sides of poles.
    assert prepared.is_degenerate[np.unique(prepared.coedge_edges)].sum() == 2
    assert prepared.loop_counts.tolist() == [arcs + 4, arcs + 2]
    heights = prepared.vertices[prepared.model_vertices :, 2]
    assert {round(z, 6) for z in heights.tolist()} >= {CENTER[2] - RADIUS, CENTER[2] + RADIUS}
    assert count_cracks(prepared) == 0


@pytest.mark.parametrize("radius", [0.4, 1.3])
def test_an_edge_with_its_vertex_beside_a_pole_does_not_run_along_it(radius: float) -> None:
    """A circle whose vertex is nearest to the pole, 7e-6 away, too far to be at it."""
    tilt = radius + 1e-6
    axis, x = np.array([sin(tilt), 0, cos(tilt)]), np.array([-cos(tilt), 0, sin(tilt)])
    y = np.cross(axis, x)
    ring = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
    points = [
        (CENTER + RADIUS * (cos(radius) * axis + sin(radius) * (a * x + b * y))).tolist()
        for a, b in ring
    ]
    curve = {**build_arc(x, 0.0, 2 * pi), "control_points": points}
    ball = read_solid("sphere")["faces"][0]
    document = {
        "type": "brep",
        "vertices": [points[0]],
        "edges": [{"vertices": [0, 0], "curve": curve}],
        "faces": [{"surface": ball["surface"], "loops": [{"edges": [0]}]}],
    }
    prepared = prepare(lower(document))
    assert not prepared.skipped_faces
    assert prepared.loop_counts.tolist() == [1]
    assert prepared.gaps.max() < 1e-7 * prepared.diagonal
