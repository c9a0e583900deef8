"""The divisions of isoparametric curves, and upper bounds of the size of a mesh.

**Curves** are divided evenly, finely enough for the goal. A chord over an interval of length h is
within h² max |C″| / 8 of its curve, parameter by parameter. The second derivatives of all curves of
a patch along u are within M_uu of the patch, and so along v
(`service.engine.bounds.second_derivatives`); those of its sides are those of the edges' own nets.
The curves of a triangular patch are parallel to its sides, so bounds for small triangles hold for
their edges.

For angles, a Bézier curve turns by no more than its control polygon, so the number of its pieces is
the turn of the polygon divided by the angle. As for meshes, the angle is a goal, not a proved
bound.

**Meshes.** Every triangle within a cell of sides h_u, h_v is within (h_u² M_uu + 2 h_u h_v M_uv +
h_v² M_vv) / 8 of the surface. So 1/h_u ≥ √(M_uu / (8 ε')) and so on, with ε' a third of ε, are fine
enough for ε. Estimates and certificates use nets, which are further away than the surface, but
hardly twice as far: cells that are fine enough for ε/2 are not cut. So a patch is cut into at most
the number of cells computed here, where both numbers are powers of 2.

A cut adds at most two vertices to the inside of a face. A face with V_i vertices inside and V_b on
its border has 2 V_i + V_b − 2 triangles; so n cells with b pieces around them have at most 2 n + b
vertices and 4 n + b triangles. Most meshes have a tenth of that.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.bounds.second_derivatives import (
    bound_second_derivatives,
    bound_triangle_deviations,
    count_blocks,
)
from service.engine.evaluation.evaluate import evaluate
from service.engine.mesh.edges import EdgeCurves
from service.engine.mesh.seams import Seams, find_seams
from service.engine.options import MAX_RESOLUTION, MeshOptions
from service.engine.wires.draw import count_most_solids
from service.engine.wires.isocurves import Divisions, IsoCurves, sample_divided_isocurves
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import PatchModel

SHARE = 0.75
"""Share of the tolerance for chords; the rest is for the rounding of points."""

MOST_PIECES = 1 << 12
"""Most divisions for angles: at a cusp no number of divisions is enough."""

BLOCKS = 8
"""Number of parts of each direction whose second derivatives are bounded one by one."""


def sample_goal_isocurves(
    model: PatchModel, seams: Seams, goal: Goal, options: MeshOptions, most: int
) -> list[IsoCurves]:
    """The curves, as lines that are within the tolerance of a goal.

    Raises
    ------
    TooLarge
        `too_many_triangles` if they have more than `most` samples, or as tubes or ribbons more
        triangles than that.
    """
    divisions = count_goal_divisions(model, seams, goal)
    MeshLimits(most).count(
        count_line_pieces(divisions.count_curves(seams, options.isocurves), options)
    )
    return sample_divided_isocurves(model, seams, divisions, options.isocurves)


def count_line_pieces(size: tuple[int, int], options: MeshOptions) -> int:
    """The count of curves of a size (curves, samples) against the limit of triangles.

    Lines count their samples; tubes and ribbons count their triangles.
    """
    return count_most_solids(*size, options)[1] if options.has_solid_wires else size[1]


def count_goal_divisions(model: PatchModel, seams: Seams, goal: Goal) -> Divisions:
    """Numbers of divisions of all isoparametric curves."""
    edges = np.ones(len(seams.users), dtype=np.intp)
    for group in seams.curves:
        edges[group.ids] = _divide_edges(group, goal)
    across = [_divide_batch(batch, goal) for batch in model.batches]
    along_u, along_v = (np.concatenate([both[axis] for both in across]) for axis in (0, 1))
    return Divisions(edges, along_u, along_v)


def _divide_edges(group: EdgeCurves, goal: Goal) -> Ints:
    """Numbers of divisions of edges (E,), taken as patches of degree 0 in the other direction."""
    weights = None if group.weights is None else group.weights[:, :, None]
    return _divide_batch(TensorPatches(group.points[:, :, None], weights), goal)[0]


def _divide_batch(batch: Patches, goal: Goal) -> tuple[Ints, Ints]:
    """Numbers of divisions along u and along v of the patches of a batch, (P,) each."""
    points = batch.points.reshape(batch.count, -1, 3)
    allowed = SHARE * goal.find_allowed(
        goal.measure_distances_to_eye(points.min(axis=1), points.max(axis=1))
    )
    if isinstance(batch, TrianglePatches):
        bound = bound_triangle_deviations(batch, MAX_RESOLUTION) * MAX_RESOLUTION**2
        pieces = _count_pieces(8 * bound, allowed)
        if goal.angle < np.inf:
            square = batch.to_tensor().points
            turns = np.maximum(_measure_turns(square), _measure_turns(square.swapaxes(1, 2)))
            pieces = np.maximum(pieces, _count_pieces_by_angle(turns, goal))
        return pieces, pieces
    p, q = batch.degree
    blocks = count_blocks(BLOCKS, max(p, 1)), count_blocks(BLOCKS, max(q, 1))
    bends = bound_second_derivatives(batch, (BLOCKS, BLOCKS), blocks)
    divisions = []
    for bend, points in ((bends.uu, batch.points), (bends.vv, batch.points.swapaxes(1, 2))):
        pieces = _count_pieces(bend.max(axis=(0, 1)), allowed)
        if goal.angle < np.inf:
            pieces = np.maximum(pieces, _count_pieces_by_angle(_measure_turns(points), goal))
        divisions.append(pieces)
    return divisions[0], divisions[1]


def _count_pieces(bend: FloatArray, allowed: FloatArray) -> Ints:
    """The least R with bend / (8 R²) within what is allowed, at most `MAX_RESOLUTION`."""
    with np.errstate(over="ignore", divide="ignore"):
        pieces = np.ceil(np.sqrt(bend / allowed / 8))
    return np.clip(pieces, 1, MAX_RESOLUTION).astype(np.intp)


def _count_pieces_by_angle(turns: FloatArray, goal: Goal) -> Ints:
    """Numbers of pieces of curves with these turns, at most `MOST_PIECES`."""
    return np.clip(np.ceil(turns / goal.angle), 1, MOST_PIECES).astype(np.intp)


def _measure_turns(points: FloatArray) -> FloatArray:
    """Largest turns, in radians, of control polygons along the second axis of (P, n+1, m, 3)."""
    legs = np.diff(points, axis=1)
    length = np.sqrt(np.square(legs).sum(axis=-1))
    one, two = legs[:, :-1], legs[:, 1:]
    cosine = (one * two).sum(axis=-1)
    cosine /= np.maximum(length[:, :-1] * length[:, 1:], np.finfo(float).tiny)
    still = (length[:, :-1] == 0) | (length[:, 1:] == 0)
    angle = np.where(still, 0.0, np.arccos(np.clip(cosine, -1.0, 1.0)))
    turns: FloatArray = angle.sum(axis=1).max(axis=1, initial=0.0)
    return turns


PARTS, FINEST, FEWEST = 6, 30, 4
"""Each of the three terms may take a share of 1/`PARTS` of the tolerance; sides are halved at most
`FINEST` times here, and have at least `FEWEST` pieces, as closed ones do."""

SAMPLES, SMOOTH, CHUNK = 8, 0.5, 1 << 16
"""Divisions of patches whose normals are sampled; distance of unit normals beyond which a step is
no smooth turn; and samples in one block."""


class MostTriangles(NamedTuple):
    """Upper bounds: vertices, triangles, and points of the lines beside them."""

    vertices: int
    triangles: int
    points: int


def bound_triangles(model: PatchModel, goal: Goal, options: MeshOptions) -> MostTriangles:
    """Bounds for one model.

    Vertices are counted once for every patch. Cuts for angles are not counted.
    """
    cells, pieces = _bound_cells(model, goal)
    vertices, triangles = (2 * cells + pieces, 4 * cells + pieces) if options.has_faces else (0, 0)
    points = pieces if "boundary" in options.overlays else 0
    if options.has_wires:
        seams = find_seams(model.batches)
        curves, samples = count_goal_divisions(model, seams, goal).count_curves(
            seams, options.isocurves
        )
        if options.has_solid_wires:
            more = count_most_solids(curves, samples, options)
            vertices, triangles = vertices + more[0], triangles + more[1]
        else:
            points += samples
    return MostTriangles(vertices, triangles, points)


def estimate_least_triangles(model: PatchModel, angle: float) -> float:
    """The number of triangles that a mesh needs, at least, to keep to an angle along each edge.

    On the unit sphere the normals of a mesh are triangles with sides up to the angle α, of the area
    √3/4 α² at most; together they cover ∫ |K| dA, which is estimated from some samples. An eighth
    of that number is returned: an estimate with a wide margin, not a proof. Places where normals
    turn far between two samples do not count: they may be creases, where no division helps.
    """
    area = 0.0
    for batch in model.batches:
        grids = batch.to_tensor() if isinstance(batch, TrianglePatches) else batch
        for rows in row_slices(grids.count, SAMPLES**2, CHUNK):
            chosen = grids.take(np.arange(grids.count)[rows])
            normals = evaluate(chosen, (SAMPLES, SAMPLES)).normals
            assert normals is not None
            a, b, c = normals[:, :-1, :-1], normals[:, 1:, :-1], normals[:, :-1, 1:]
            along_u, along_v = b - a, c - a
            size = np.square(np.cross(along_u, along_v)).sum(axis=-1)
            near = np.maximum(np.square(along_u).sum(axis=-1), np.square(along_v).sum(axis=-1))
            area += float(np.sqrt(size[near < SMOOTH**2]).sum())
    return area / (sqrt(3) / 4 * angle**2) / 8


def _bound_cells(model: PatchModel, goal: Goal) -> tuple[int, int]:
    """Upper bounds of the cells, and of the pieces of the borders of patches."""
    nearest = np.array([goal.find_nearest_distance(*model.bounds)])
    part = max(float(goal.find_allowed(nearest)[0]) / PARTS, float(np.finfo(np.float64).tiny))
    cells = pieces = 0
    for batch in model.batches:
        patches = batch.to_tensor() if isinstance(batch, TrianglePatches) else batch
        bends = bound_second_derivatives(patches, (1, 1), (1, 1))
        uu, uv, vv = (each[0, 0] / (8 * part) for each in (bends.uu, 2 * bends.uv, bends.vv))
        along = [np.exp2(np.clip(np.ceil(np.log2(m + 1e-300) / 2), 0, FINEST)) for m in (uu, vv)]
        # The mixed term M_uv bounds the product of both numbers.
        cells += int(np.minimum(np.maximum(along[0] * along[1], 2 * uv), 4.0**FINEST).sum())
        pieces += int(sum(2 * np.maximum(side, FEWEST).sum() for side in along))
    return cells, pieces
