"""Isoparametric curves of a model: the lines u = i/n_u and v = j/n_v of every patch.

The borders of patches are drawn, too; an edge that patches along is drawn once, through the samples
that the faces of a mesh by resolution use. Curves across a patch begin and end at points that are
computed from an edge alone, so that the curves of two neighbouring patches meet, bit for bit. On a
triangle the curves are r = i/n, s = i/n and t = i/n. A curve that is one point is not drawn.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.connectivity.edges import sample_edges
from service.engine.connectivity.seams import Seams, find_seams
from service.engine.evaluation.evaluate import evaluate
from service.engine.points.jets import evaluate_jets
from service.engine.wires.divisions import Divisions, find_drawn
from service.surface.batches import TensorPatches, TrianglePatches
from service.surface.lowered import PatchModel
from service.surface.sides import BEGINS, ENDS

AnyPatches = TypeVar("AnyPatches", TensorPatches, TrianglePatches)

MIN_RELATIVE_LENGTH = 2.0**-40
"""A curve shorter than this fraction of its largest coordinate counts as a point."""


_CORNERS = np.array(
    [
        [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]],
        [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 1.0]],
    ]
)
"""Parameters (u, v) of the corners of a tensor-product patch, and (s, t) of those of a triangle,
whose corners 1 and 3 are one point (`service.surface.sides`)."""


@dataclass(frozen=True, eq=False, slots=True)
class IsoCurves:
    """N curves with the same number of divisions.

    Attributes
    ----------
    points : ndarray of float64, shape (N, R+1, 3)
    patch : ndarray of int, shape (N,)
        For each curve, a patch on which it lies.
    first, last : ndarray of float64, shape (N, 2)
        In the parameters of this patch, the curve is the straight line from `first` to `last`.
    """

    points: FloatArray
    patch: Ints
    first: FloatArray
    last: FloatArray

    def take(self, is_chosen: Bools) -> "IsoCurves":
        """The chosen curves."""
        return IsoCurves(
            self.points[is_chosen],
            self.patch[is_chosen],
            self.first[is_chosen],
            self.last[is_chosen],
        )


def sample_isocurves(
    model: PatchModel, resolution: tuple[int, int], counts: tuple[int, int]
) -> list[IsoCurves]:
    """Sample all curves of a mesh by resolution, as `sample_divided_isocurves` does.

    Parameters
    ----------
    resolution : (Ru, Rv)
        Divisions of a patch of the mesh.
    """
    seams = find_seams(model.batches)
    return sample_divided_isocurves(model, seams, Divisions.even(seams, resolution), counts)


def sample_divided_isocurves(
    model: PatchModel, seams: Seams, divisions: Divisions, counts: tuple[int, int]
) -> list[IsoCurves]:
    """Sample all curves that are more than a point, borders first; in float64, model coordinates.

    Parameters
    ----------
    seams : Seams
        The seams of the model.
    counts : (n_u, n_v)
        Numbers of pieces into which curves of constant u, and of constant v, cut a patch; 0 draws
        none. A triangle takes the larger for all three directions.
    """
    runs = list(_sample_borders(seams, divisions.edges, counts))
    # The points where curves of constant u, and of constant v, begin and end.
    ends_of_u_curves, ends_of_v_curves = (_EdgePoints(seams, count) for count in counts)
    # All three directions of a triangle have the larger count.
    ends_in_triangles = ends_of_u_curves if counts[0] >= counts[1] else ends_of_v_curves
    first = 0
    for batch in model.batches:
        patches = np.arange(first, first + batch.count)
        first += batch.count
        if isinstance(batch, TrianglePatches):
            for count, rows in _groups(divisions.along_u[patches], ends_in_triangles):
                runs += _sample_across_triangles(
                    _take_patches(batch, rows), patches[rows], count, ends_in_triangles
                )
            continue
        for axis, (along, ends) in enumerate(
            ((divisions.along_v, ends_of_u_curves), (divisions.along_u, ends_of_v_curves))
        ):
            for count, rows in _groups(along[patches], ends):
                runs += _sample_across_grids(
                    _take_patches(batch, rows), patches[rows], count, axis, ends
                )
    return [curves for run in runs if len((curves := run.take(_find_lines(run.points))).points)]


def _groups(divisions: Ints, ends: "_EdgePoints | None" = None) -> Iterator[tuple[int, Ints]]:
    """For each distinct number of divisions, ascending: the number, and the rows that have it.

    Yields nothing if no curve runs across patches between the `ends`.
    """
    if ends is not None and ends.count < 2:
        return
    for number in np.unique(divisions).tolist():
        yield number, np.flatnonzero(divisions == number)


def _take_patches(batch: AnyPatches, rows: Ints) -> AnyPatches:
    """Patches `rows` of a batch; the batch itself if these are all patches."""
    return batch if len(rows) == batch.count else batch.take(rows)


class _EdgePoints:
    """Points at i/n of every edge, at which curves across patches begin and end."""

    def __init__(self, seams: Seams, count: int) -> None:
        self.count = count
        self._seams = seams
        if count > 1:
            self._points = sample_edges(seams.curves, None, count)  # None: of all edges

    def at(self, patches: Ints, side: int, i: int) -> FloatArray:
        """The points at i/n of one side of k patches, in the side's own direction: (k, 3)."""
        seams = self._seams
        index = np.where(seams.backward[patches, side], self.count - i, i)
        points = self._points[index, seams.edge[patches, side]]
        is_collapsed = seams.collapsed[patches, side]
        corner = seams.corner_points[seams.corner[patches, BEGINS[side]]]
        ends: FloatArray = np.where(is_collapsed[:, None], corner, points)
        return ends


def _sample_borders(seams: Seams, divisions: Ints, counts: tuple[int, int]) -> Iterator[IsoCurves]:
    """Sample every edge that is drawn once, with the parameters of one of its patches."""
    sides = np.flatnonzero(find_drawn(seams, counts))
    edges, first_use = np.unique(seams.edge.ravel()[sides], return_index=True)
    first_sides = sides[first_use]
    is_backward = seams.backward.ravel()[first_sides]
    kind = seams.connectivity.is_triangle[first_sides // 4].astype(np.intp)
    begin, end = (_CORNERS[kind, corner[first_sides % 4]] for corner in (BEGINS, ENDS))
    for count, rows in _groups(divisions[edges]):
        is_chosen = np.zeros(len(divisions), dtype=bool)
        is_chosen[edges[rows]] = True
        is_reversed = is_backward[rows, None]
        yield IsoCurves(
            sample_edges(seams.curves, is_chosen, count).swapaxes(0, 1),
            first_sides[rows] // 4,
            np.where(is_reversed, end[rows], begin[rows]),
            np.where(is_reversed, begin[rows], end[rows]),
        )


def _sample_across_grids(
    batch: TensorPatches,
    patches: Ints,
    divisions: int,
    axis: int,
    ends: _EdgePoints,
) -> Iterator[IsoCurves]:
    """Sample the curves of constant u (axis 0) or v (axis 1) between the borders of patches.

    Yields the curves of one constant parameter at a time.
    """
    steps = (ends.count, divisions) if axis == 0 else (divisions, ends.count)
    grids = evaluate(batch, steps, normals=False).positions
    for i in range(1, ends.count):
        points = (grids[:, i] if axis == 0 else grids[:, :, i]).astype(np.float64)
        # A curve of constant u begins and ends on the sides v = 0 and v = 1, and the reverse.
        low, high = (2, 3) if axis == 0 else (0, 1)
        points[:, 0], points[:, -1] = ends.at(patches, low, i), ends.at(patches, high, i)
        first, last = np.zeros((len(patches), 2)), np.ones((len(patches), 2))
        first[:, axis] = last[:, axis] = i / ends.count
        yield IsoCurves(points, patches, first, last)


def _sample_across_triangles(
    batch: TrianglePatches, patches: Ints, divisions: int, ends: _EdgePoints
) -> Iterator[IsoCurves]:
    """Sample the curves s = i/n, r = i/n and t = i/n between the borders of triangles.

    Their parameters are (s, t).
    """
    n = ends.count
    for i in range(1, n):
        # With this count, samples of the mesh on the curve are also samples of the curve: if there
        # are any, divisions · i / n is a whole number.
        count = -(-divisions * (n - i) // n)
        fraction, remainder = i / n, (n - i) / n
        # For each direction: the parameters of both ends; then, for both, the side of the triangle
        # on which it lies, and its number among the points at 0/n … n/n of this side.
        for begin, end, sides in (
            ((fraction, 0.0), (fraction, remainder), ((2, i), (1, n - i))),
            ((remainder, 0.0), (0.0, remainder), ((2, n - i), (0, n - i))),
            ((0.0, fraction), (remainder, fraction), ((0, i), (1, i))),
        ):
            along = np.arange(count + 1) / count
            line = (1 - along)[:, None] * begin + along[:, None] * end
            s, t = (np.tile(column, len(patches)) for column in line.T)
            index = np.repeat(np.arange(len(patches)), count + 1)
            points = evaluate_jets(batch, index, s, t, 0).partials[0].reshape(-1, count + 1, 3)
            points[:, 0], points[:, -1] = (ends.at(patches, *side) for side in sides)
            first, last = (np.tile(parameters, (len(patches), 1)) for parameters in (begin, end))
            yield IsoCurves(points, patches, first, last)


def _find_lines(points: FloatArray) -> Bools:
    """Whether a curve is more than a point."""
    size = np.ptp(points, axis=1).max(axis=1)
    is_line: Bools = size > MIN_RELATIVE_LENGTH * np.abs(points).max(axis=(1, 2))
    return is_line
