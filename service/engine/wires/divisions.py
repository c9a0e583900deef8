"""The divisions of isoparametric curves, by resolution or by a goal, and how many curves there are.

For a goal, curves are divided evenly, finely enough for it. A chord over an interval of length h is
within h² max |C″| / 8 of its curve, at equal parameters. The second derivatives of all curves of a
patch along u are at most M_uu of the patch, and those along v at most M_vv
(`service.engine.bounds.second_derivatives`). Edges have bounds of their own, from their own nets.
The curves of a triangular patch are parallel to its sides, so their chords are sides of small
triangles, for which `bound_triangle_deviations` holds.

For angles: a Bézier curve turns by no more than its control polygon, so the number of its pieces is
the turn of the polygon divided by the angle. As for meshes, the angle is a goal, not a proved
bound.

Proof in docs/proofs.md: "Bending between samples".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.bounds.goal import Goal
from service.engine.bounds.second_derivatives import (
    bound_second_derivatives,
    bound_triangle_deviations,
    count_blocks,
)
from service.engine.connectivity.edges import EdgeCurves
from service.engine.connectivity.seams import Seams
from service.engine.options import MAX_RESOLUTION
from service.engine.plans.layout import Layout
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import PatchModel

CHORD_FRACTION = 0.75
"""Fraction of the tolerance for chords; the rest is for the rounding of points."""

MAX_PIECES = 1 << 12
"""Most divisions for angles: at a cusp no number of divisions is enough."""

GRID_DIVISIONS = 8
"""Second derivatives are bounded in blocks of a grid with this number of divisions in each
direction, because the bounds of small blocks are closer."""


@dataclass(frozen=True, eq=False, slots=True)
class Divisions:
    """The numbers of divisions of curves.

    Attributes
    ----------
    edges : ndarray of int, shape (E,)
        For each of the distinct edges of the model.
    along_u, along_v : ndarray of int, shape (P,)
        For the curves of constant v, and of constant u, across each patch; equal on triangles.
    """

    edges: Ints
    along_u: Ints
    along_v: Ints

    @staticmethod
    def even(seams: Seams, resolution: tuple[int, int]) -> "Divisions":
        """The divisions of a mesh by resolution."""
        along_u, along_v = (np.full(len(seams.edge), divisions) for divisions in resolution)
        is_triangle = seams.connectivity.is_triangle
        along_u[is_triangle] = along_v[is_triangle] = max(resolution)
        return Divisions(Layout.build(seams.connectivity, resolution).divisions, along_u, along_v)

    def count_curves(self, seams: Seams, counts: tuple[int, int]) -> tuple[int, int]:
        """Upper bounds of the number of curves, and of their samples together."""
        is_drawn = np.zeros(len(self.edges), dtype=bool)
        is_drawn[seams.edge[find_drawn(seams, counts)]] = True
        curves, samples = int(is_drawn.sum()), int((self.edges[is_drawn] + 1).sum())
        is_triangle = seams.connectivity.is_triangle
        # Curves of constant u run along v, and the reverse.
        for count, along in zip(counts, (self.along_v, self.along_u), strict=True):
            inner = max(count - 1, 0)
            curves += inner * int((~is_triangle).sum())
            samples += inner * int((along[~is_triangle] + 1).sum())
        inner = 3 * (max(*counts, 1) - 1)  # in three directions
        curves += inner * int(is_triangle.sum())
        samples += inner * int((self.along_u[is_triangle] + 1).sum())
        return curves, samples


def find_drawn(seams: Seams, counts: tuple[int, int]) -> Bools:
    """Which sides of patches are drawn, (P, 4): those in a direction that has curves."""
    is_drawn = np.zeros(seams.edge.shape, dtype=bool)
    is_drawn[:, :2], is_drawn[:, 2:] = counts[0] > 0, counts[1] > 0
    is_drawn[seams.connectivity.is_triangle] = True
    return is_drawn & ~seams.collapsed


def bound_isocurves(
    grids: int, triangles: int, resolution: tuple[int, int], counts: tuple[int, int]
) -> tuple[int, int]:
    """Upper bounds of the curves and of their samples.

    `grids` and `triangles` are the numbers of tensor-product and of triangular patches.
    """
    max_divisions = max(resolution)
    # In each of the three directions of a triangle, one border and n − 1 curves across it.
    curves = triangles * 3 * max(counts)
    points = curves * (max_divisions + 1)
    # Curves of constant u have the divisions along v, and the reverse.
    for count, divisions in zip(counts, reversed(resolution), strict=True):
        inner, borders = max(count - 1, 0), 2 * (count > 0)
        curves += grids * (inner + borders)
        points += grids * (inner * (divisions + 1) + borders * (max_divisions + 1))
    return curves, points


def count_goal_divisions(model: PatchModel, seams: Seams, goal: Goal) -> Divisions:
    """Numbers of divisions of all isoparametric curves."""
    edges = np.ones(seams.edge_count, dtype=np.intp)
    for group in seams.curves:
        edges[group.ids] = _divide_edges(group, goal)
    divisions_by_batch = [_divide_batch(batch, goal) for batch in model.batches]
    along_u, along_v = (
        np.concatenate([divisions_of_batch[axis] for divisions_of_batch in divisions_by_batch])
        for axis in (0, 1)
    )
    return Divisions(edges, along_u, along_v)


def _divide_edges(group: EdgeCurves, goal: Goal) -> Ints:
    """Numbers of divisions (E,) of edges, which are taken as patches of degree 0 along v."""
    weights = None if group.weights is None else group.weights[:, :, None]
    return _divide_batch(TensorPatches(group.points[:, :, None], weights), goal)[0]


def _divide_batch(batch: Patches, goal: Goal) -> tuple[Ints, Ints]:
    """Numbers of divisions (P,) along u, and along v, of the patches of a batch."""
    points = batch.points.reshape(batch.count, -1, 3)
    # With a camera, the tolerance of a patch depends on its distance from the eye.
    allowed = CHORD_FRACTION * goal.find_allowed(
        goal.measure_distances_to_eye(points.min(axis=1), points.max(axis=1))
    )
    if isinstance(batch, TrianglePatches):
        # At R divisions the deviation is at most bound / R²; `_count_pieces` divides by 8 R².
        bound = bound_triangle_deviations(batch, MAX_RESOLUTION) * MAX_RESOLUTION**2
        pieces = _count_pieces(8 * bound, allowed)
        if goal.angle < np.inf:
            tensor_points = batch.to_tensor().points
            turns = np.maximum(
                _measure_turns(tensor_points), _measure_turns(tensor_points.swapaxes(1, 2))
            )
            pieces = np.maximum(pieces, _count_pieces_by_angle(turns, goal))
        return pieces, pieces
    p, q = batch.degree
    divisions = GRID_DIVISIONS
    # Edges are taken as patches of degree 0 along v.
    blocks = count_blocks(divisions, max(p, 1)), count_blocks(divisions, max(q, 1))
    bends = bound_second_derivatives(batch, (divisions, divisions), blocks)
    counts = []
    for bend, points in ((bends.uu, batch.points), (bends.vv, batch.points.swapaxes(1, 2))):
        pieces = _count_pieces(bend.max(axis=(0, 1)), allowed)  # of all blocks of a patch
        if goal.angle < np.inf:
            pieces = np.maximum(pieces, _count_pieces_by_angle(_measure_turns(points), goal))
        counts.append(pieces)
    return counts[0], counts[1]


def _count_pieces(bend: FloatArray, allowed: FloatArray) -> Ints:
    """The least numbers R (P,) with bend / (8 R²) ≤ allowed, but at most `MAX_RESOLUTION`.

    `bend` has bounds of second derivatives, `allowed` the largest deviations, (P,) each.
    """
    with np.errstate(over="ignore", divide="ignore"):
        pieces = np.ceil(np.sqrt(bend / allowed / 8))
    return np.clip(pieces, 1, MAX_RESOLUTION).astype(np.intp)


def _count_pieces_by_angle(turns: FloatArray, goal: Goal) -> Ints:
    """Numbers of pieces (P,) of curves that turn by these angles, at most `MAX_PIECES`."""
    return np.clip(np.ceil(turns / goal.angle), 1, MAX_PIECES).astype(np.intp)


def _measure_turns(points: FloatArray) -> FloatArray:
    """Largest turns (P,), in radians, of the control polygons of curves.

    The last index of `points` (P, n+1, m, 3) is the coordinate; each patch has m curves.
    """
    legs = np.diff(points, axis=1)
    length = np.sqrt(np.square(legs).sum(axis=-1))
    first_legs, second_legs = legs[:, :-1], legs[:, 1:]
    cosine = (first_legs * second_legs).sum(axis=-1)
    cosine /= np.maximum(length[:, :-1] * length[:, 1:], np.finfo(float).tiny)
    has_no_angle = (length[:, :-1] == 0) | (length[:, 1:] == 0)
    angle = np.where(has_no_angle, 0.0, np.arccos(np.clip(cosine, -1.0, 1.0)))
    turns: FloatArray = angle.sum(axis=1).max(axis=1, initial=0.0)
    return turns
