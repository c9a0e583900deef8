"""Bounds of triangles over which the surface is near the mesh, but not near their own triangles.

Where a surface is parametrised unevenly, it runs ahead of the mesh: over a triangle of places it is
partly near the triangles beside. Cutting such a triangle does not help, because the surface over
the halves is ahead by as much. So it is divided for the measurement alone: each piece is compared
with the triangle of the mesh that is nearest to its middle, among those that share a corner with
the triangle, and a piece that is too far from it is divided into four.

Proof in docs/proofs.md: "Triangles of trimmed faces".
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, find_begins, row_slices
from service.engine.adaptive.cutting.cells import estimate_piece_cost
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.certificate import PieceMeasure
from service.engine.bounds.clip import Parts, PatchPieces, clip_parts
from service.engine.bounds.goal import Goal
from service.engine.brep.filling.corners import FaceCorners
from service.engine.brep.filling.neighbours import Neighbours
from service.engine.vectors import NEXT, cross, dot

HALVINGS = 12
"""How often pieces are divided."""

MOST = 64
"""A triangle with more pieces that are too far from the mesh is given up."""

STEP = 2.0**-53
"""A halving rounds a parameter by at most this much."""

BLOCK = 1 << 7
"""The most triangles that are measured in one step; it limits memory."""

CHUNK = 1 << 11
"""The most pieces whose nearest triangles are found in one step."""

QUARTERS = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))
"""The corners of the quarters of a triangle, among its corners and the middles of its edges."""


class _Pieces(NamedTuple):
    """Pieces of triangles: the triangle and the patch of each, and its corners (3, 2, M) there."""

    owner: Ints
    patch: Ints
    parameters: FloatArray

    def take(self, rows: Ints) -> "_Pieces":
        """Some of the pieces."""
        return _Pieces(self.owner[rows], self.patch[rows], self.parameters.take(rows, axis=2))

    def divide(self) -> "_Pieces":
        """The quarters of all pieces; 1 − t is exact for their parameters t, too."""
        middles = 1.0 - (1.0 - (self.parameters + self.parameters[NEXT]) / 2)
        six = np.concatenate([self.parameters, middles])
        parameters = np.concatenate([six[list(corners)] for corners in QUARTERS], axis=2)
        return _Pieces(
            np.concatenate((self.owner,) * 4), np.concatenate((self.patch,) * 4), parameters
        )


@dataclass(frozen=True, eq=False, slots=True)
class NearestMeasure:
    """Measures triangles of the mesh of `corners`; `limits` counts the work."""

    corners: FaceCorners
    neighbours: Neighbours
    goal: Goal
    limits: MeshLimits

    def bound(self, rows: Ints, allowed: FloatArray) -> FloatArray:
        """Bounds (m,) of triangles `rows`; infinite where none is found that is `allowed` (m,).

        Raises
        ------
        TooLarge
            `too_costly`.
        """
        bounds = np.full(len(rows), np.inf)
        for block in row_slices(len(rows), 1, BLOCK):
            bounds[block] = _Block(self, rows[block], allowed[block]).measure()
        return bounds


class _Block:
    """Measures some triangles (m,) together."""

    def __init__(self, measure: NearestMeasure, rows: Ints, allowed: FloatArray) -> None:
        self._corners, self._neighbours = measure.corners, measure.neighbours
        self._goal, self._limits = Goal(measure.goal.tolerance), measure.limits
        self._rows, self._allowed = rows, allowed
        self._starts, self._around = measure.neighbours.list_around(rows)
        self._bounds = np.zeros(len(rows))

    def measure(self) -> FloatArray:
        """The bounds (m,); infinite where pieces remain too far from the mesh."""
        own = self._neighbours.corners.take(self._rows, axis=1)
        faces, places = self._corners.faces[own[0]], self._corners.places[own]
        # A triangle without any other at its corners is flat.
        self._bounds[self._starts[1:] == self._starts[:-1]] = np.inf
        found = clip_parts(
            self._corners.surface, faces, np.ascontiguousarray(places.swapaxes(1, 2))
        )
        pieces = self._keep(_Pieces(found.part, found.patch, found.parameters))
        for halvings in range(HALVINGS + 1):
            nearest, is_far = self._find_nearest(pieces)
            self._bounds[pieces.owner[is_far]] = np.inf
            live = np.isfinite(self._bounds[pieces.owner]).nonzero()[0]
            pieces, nearest = pieces.take(live), nearest[live]
            if not len(live):
                break
            bounds = self._bound_pieces(pieces, nearest)
            fails = ~(bounds <= self._allowed[pieces.owner])
            np.maximum.at(self._bounds, pieces.owner[~fails], bounds[~fails])
            if not fails.any():
                break
            failing = np.bincount(pieces.owner[fails], minlength=len(self._bounds))
            self._bounds[failing > (MOST if halvings < HALVINGS else 0)] = np.inf
            fails &= np.isfinite(self._bounds[pieces.owner])
            pieces = pieces.take(fails.nonzero()[0]).divide()
        return self._bounds

    def _keep(self, pieces: _Pieces) -> _Pieces:
        """The pieces of triangles whose bounds may be finite."""
        return pieces.take(np.isfinite(self._bounds[pieces.owner]).nonzero()[0])

    def _find_nearest(self, pieces: _Pieces) -> tuple[Ints, Bools]:
        """The triangles (M,) nearest to the middles of pieces; whether they are not near enough."""
        count = len(pieces.owner)
        nearest, squares = np.empty(count, np.intp), np.empty(count)
        for rows in row_slices(count, 1, CHUNK):
            nearest[rows], squares[rows] = self._search(pieces.take(np.arange(count)[rows]))
        return nearest, ~(squares <= np.square(self._allowed[pieces.owner]))

    def _search(self, pieces: _Pieces) -> tuple[Ints, FloatArray]:
        """The triangles (M,) nearest to the middles of pieces; the squares of the distances."""
        nets = self._corners.surface.surfaces.nets
        middles = nets.evaluate_points(pieces.patch, *(pieces.parameters.sum(axis=0) / 3))
        first = self._starts[pieces.owner]
        run, at = expand_runs(self._starts[pieces.owner + 1] - first, first)
        triangles = self._around[at]
        points = self._neighbours.points.take(self._neighbours.corners.take(triangles, axis=1))
        corners = self._corners.positions.take(points, axis=0)
        squared = _measure_squares(
            middles.T.take(run, axis=1), np.ascontiguousarray(corners.swapaxes(1, 2))
        )
        least = np.minimum.reduceat(squared, find_begins(run))
        # The first triangle at the least distance.
        rows = (squared == least.take(run)).nonzero()[0]
        rows = rows.take(find_begins(run.take(rows)))
        return triangles[rows], least

    def _bound_pieces(self, pieces: _Pieces, nearest: Ints) -> FloatArray:
        """Bounds (M,) of the distances of pieces from these triangles and their neighbours."""
        nets = self._corners.surface.surfaces.nets
        costs = np.array([estimate_piece_cost(*group.degree) for group in nets.groups], np.float64)
        self._limits.spend(float(costs[nets.group[pieces.patch]].sum()))
        count = len(pieces.owner)
        points, across = self._neighbours.list_points(nearest)
        places = np.zeros((3, 2, count), np.intp)  # only images of pieces would need them
        parts = Parts(pieces.owner, places, points, across, np.zeros(count, bool))
        own = PatchPieces(np.arange(count), pieces.patch, pieces.parameters, places)
        bounds = np.zeros((3, count))
        measure = PieceMeasure(nets, parts, own, self._corners.positions, self._goal, None)
        measure.bound_pieces(bounds, np.arange(count))
        rounding = np.empty(count)
        for group, rows in nets.split_by_group(pieces.patch):
            lengths = group.partial_bounds.take(nets.row[pieces.patch[rows]], axis=1)
            rounding[rows] = HALVINGS * STEP * (lengths[0] + lengths[1])
        rounding += bounds[0]
        return rounding


def _measure_squares(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """Squares (n,) of the distances of points (3, n) to triangles (3, 3, n), corners first."""
    edges, to_points = triangles.take(NEXT, axis=0) - triangles, points - triangles
    squares = dot(edges, edges)
    foot = dot(to_points, edges) / np.where(squares > 0, squares, 1.0)
    foot = np.minimum(np.maximum(foot, 0.0), 1.0)
    apart = to_points - foot[:, np.newaxis] * edges
    nearest: FloatArray = dot(apart, apart).min(axis=0)
    normals = cross(edges[0], edges[1])
    sides = dot(cross(edges, to_points), normals)
    area = dot(normals, normals)
    heights = np.square(dot(to_points[0], normals)) / np.where(area > 0, area, 1.0)
    is_over = (sides >= 0).all(axis=0) & (area > 0)
    return np.where(is_over, np.minimum(heights, nearest), nearest)
