"""Models of many patches: reversed, rotated, elevated, weighted, beside triangles."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from service.engine.accuracy import Accuracy
from service.engine.bounds.goal import Goal, View
from tests.engine.adaptive.refining import Refined, build_refined, check_refined
from tests.engine.meshing import build_mesh
from tools.certify.models import BODIES, Complex, build_complex

CLOSED = ("tori", "pyramids", "prisms", "double pyramids")
"""Kinds of models without an open edge."""


def count_uses(refined: Refined) -> Counter[frozenset[int]]:
    """The number of triangles at every edge, over all patches."""
    rows = refined.triangulation.vertex[refined.triangulation.triangles].tolist()
    return Counter(frozenset(edge) for row in rows for edge in pairwise([*row, row[0]]))


def list_side_bytes(refined: Refined, face: int) -> list[bytes]:
    """The points of each side of a face that is not one point, as bytes; the list is sorted.

    Of both directions of a side, it has the one whose bytes are less.
    """
    bits = []
    for side in range(4):
        if not refined.border.collapsed[face, side]:
            rows = slice(*refined.border.start[4 * face + side : 4 * face + side + 2])
            points = refined.triangulation.positions[refined.border.vertex[rows]]
            bits.append(min(points.tobytes(), points[::-1].tobytes()))
    return sorted(bits)


def find_alike_patches(whole: Complex) -> list[int]:
    """Patches whose edges have the same control points and weights in all patches at the edge.

    Other edges have another degree, or weights with another factor, in one of their patches.
    """
    others = [patches for edge, patches in whole.edges().items() if edge not in whole.alike]
    touched = {patch for patches in others for patch in patches}
    return [k for k in range(len(whole.nets)) if k not in touched]


@pytest.mark.parametrize("kind", BODIES)
@pytest.mark.parametrize("seed", [6, 7])
def test_random_models_are_joined_in_any_order(kind: str, seed: int) -> None:
    """Degrees are mixed with seed 6 and equal with seed 7.

    The goal of fans and rings has a view, too.
    """
    whole = build_complex(kind, seed)
    patches = range(len(whole.nets))
    eye = np.array([2.0, -3.0, 1.0])
    goal = Goal(0.2, view=View(eye, 0.05, 0.1)) if kind in ("fans", "rings") else Goal(0.2)
    result = build_refined(whole.model(patches), goal)
    check_refined(result, 0.2)
    edge_counts = Counter(count_uses(result).values())  # by the number of triangles at the edges
    assert set(edge_counts) <= {1, 2}
    # The mesh has open edges only if the model has edges of one patch. They form closed loops: each
    # of their vertices is at two of them.
    patches_by_edge = whole.edges()
    uses = Counter(vertex for edge in find_open_edges(result) for vertex in edge)
    assert (edge_counts[1] == 0) == (kind in CLOSED)
    assert (edge_counts[1] == 0) == all(len(p) == 2 for p in patches_by_edge.values())
    assert all(times == 2 for times in uses.values())
    # The same patches in another order, each in a batch of its own.
    order = np.random.default_rng(seed).permutation(len(whole.nets)).tolist()
    reordered = build_refined(whole.model(order, together=False), goal)
    for row, k in enumerate(order):
        assert reordered.list_face_bytes(row) == result.list_face_bytes(k)
    for k in find_alike_patches(whole)[:2]:
        alone = build_refined(whole.model([k]), goal)
        assert list_side_bytes(alone, 0) == list_side_bytes(result, k)
        assert alone.list_face_bytes(0) == result.list_face_bytes(k)


def find_open_edges(refined: Refined) -> list[list[int]]:
    """The edges that only one triangle has."""
    return [sorted(edge) for edge, times in count_uses(refined).items() if times == 1]


@pytest.mark.parametrize("seed", range(6))
def test_neighbours_with_opposite_directions_have_the_same_border_alone(seed: int) -> None:
    """The first patch has the edge as u = 0, the second one reversed: both are meshed alone."""
    rng = np.random.default_rng(seed)
    edge = np.array([[0.0, 0, 0], [0, 1, 0], [0, 2, 0], [0, 3, 0]])
    edge += rng.normal(size=(4, 3)) * 0.5 + rng.normal(size=3) * 10
    points = []
    for net, step in ((edge, 1.0), (edge[::-1], -1.0)):
        rows = [net + [step * k, 0, 0] + 0.2 * rng.normal(size=(4, 3)) * (k > 0) for k in range(4)]
        mesh = build_mesh([np.array(rows)], accuracy=Accuracy(tolerance=0.01), uvs=True)
        assert mesh.uvs is not None
        points.append({tuple(point) for point in mesh.positions[mesh.uvs[:, 0] == 0].tolist()})
    assert points[0] == points[1]
    assert len(points[0]) > 4
