"""Finds sides of patches that are one edge, by their control points alone.

Two sides are one edge if their control points are equal, in equal or opposite order, and their
weights are equal up to a common factor. Two sides of different degrees are one edge if this is true
after the lower degree is raised to the higher degree
(`service.engine.connectivity.degree_matching`); the edge then has the lower degree. Each distinct
edge is sampled once (`service.engine.connectivity.edges`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.unique_rows import find_first_rows, unique_rows
from service.cancellation import checkpoint
from service.engine.clustering import find_leaders
from service.engine.connectivity.connectivity import SAME_WEIGHT, Connectivity, triangular_patches
from service.engine.connectivity.degree_matching import find_lowest_degree_edges
from service.engine.connectivity.edges import EdgeCurves
from service.surface.batches import Patches
from service.surface.sides import BEGINS, ENDS


@dataclass(frozen=True, eq=False, slots=True)
class Seams:
    """The edges and corners of a model: a connectivity and coordinates.

    Attributes
    ----------
    connectivity : Connectivity
    corner_points : ndarray of float64, shape (C, 3)
        The distinct points at corners.
    curves : tuple of EdgeCurves
        The distinct edges, one value for each degree.
    """

    connectivity: Connectivity
    corner_points: FloatArray
    curves: tuple[EdgeCurves, ...]

    @property
    def edge(self) -> Ints:
        """Number of the distinct edge of each side, shape (P, 4)."""
        return self.connectivity.edge

    @property
    def backward(self) -> Bools:
        """Whether each side runs against the direction of its edge, shape (P, 4)."""
        return self.connectivity.backward

    @property
    def collapsed(self) -> Bools:
        """Whether each side is one point, shape (P, 4)."""
        return self.connectivity.collapsed

    @property
    def corner(self) -> Ints:
        """Number of the distinct point at each corner, shape (P, 4)."""
        return self.connectivity.corner

    @property
    def users(self) -> Ints:
        """The number of sides of each edge, shape (E,)."""
        return self.connectivity.users

    def renumber(self) -> "Seams":
        """The seams with edges and corners numbered in the order in which patches first have them.

        All edges of one degree come before those of the next degree. Each edge has the direction
        of the first of its sides.
        """
        connectivity = self.connectivity
        _, first_side = np.unique(connectivity.edge, return_index=True)
        is_backward = connectivity.backward.ravel()[first_side]
        curves, first = [], 0
        new_edge = np.empty(len(first_side), np.intp)
        for group in self.curves:
            order = np.argsort(first_side[group.ids])
            old_ids, new_ids = group.ids[order], np.arange(first, first + len(order))
            new_edge[old_ids] = new_ids
            points, is_reversed = group.points[order], is_backward[old_ids]
            points[is_reversed] = points[is_reversed, ::-1]
            weights = None if group.weights is None else group.weights[order]
            if weights is not None:
                weights[is_reversed] = weights[is_reversed, ::-1]
            curves.append(EdgeCurves(new_ids, points, weights))
            first += len(order)
        # A row of one number for each corner of each patch.
        first_row, new_corner = find_first_rows(
            connectivity.corner.reshape(-1, 1).astype(np.float64)
        )
        renumbered = Connectivity(
            counts=connectivity.counts,
            is_triangle=connectivity.is_triangle,
            edge=new_edge[connectivity.edge],
            backward=connectivity.backward ^ is_backward[connectivity.edge],
            collapsed=connectivity.collapsed,
            corner=new_corner.reshape(-1, 4),
            users=np.bincount(new_edge[connectivity.edge].ravel()),
            corner_count=connectivity.corner_count,
        )
        return Seams(
            renumbered,
            self.corner_points[connectivity.corner.ravel()[first_row]],
            tuple(curves),
        )


def find_seams(batches: Sequence[Patches]) -> Seams:
    """Distinct edges and corners of all patches of a model."""
    total = sum(batch.count for batch in batches)
    edge = np.empty(total * 4, dtype=np.intp)
    backward = np.empty(total * 4, dtype=bool)
    curves: list[EdgeCurves] = []
    edge_count = 0
    for sides in _sides_by_degree(batches):
        checkpoint()
        points, weights, is_reversed = _direct_sides(sides)
        side_numbers = sides.numbers
        if weights is not None:
            # If the weights of an edge differ by rounding, the edge gets the least of them, so that
            # the order of the patches does not matter.
            order = np.lexsort(weights.T)
            side_numbers, is_reversed = side_numbers[order], is_reversed[order]
            points, weights = points[order], weights[order]
        # `distinct` has one row of `points` for each edge; `number` has the edge of each row.
        distinct, number = unique_rows(points.reshape(len(points), -1))
        if weights is not None:
            # Of the sides with equal points, those with the same weights are one edge.
            leader = find_leaders(distinct[number], weights, SAME_WEIGHT)
            distinct, number = np.unique(leader, return_inverse=True)
        edge[side_numbers] = number + edge_count
        backward[side_numbers] = is_reversed
        ids = np.arange(edge_count, edge_count + len(distinct))
        curves.append(
            EdgeCurves(ids, points[distinct], None if weights is None else weights[distinct])
        )
        edge_count += len(distinct)
    checkpoint()
    corners = np.concatenate([batch.corners for batch in batches]).reshape(-1, 3)
    distinct, number = unique_rows(corners)
    collapsed = np.concatenate([batch.collapsed for batch in batches])
    corner = number.reshape(-1, 4)
    # Sides of degree 0 are points, so only two higher degrees can have a common edge.
    if np.count_nonzero([group.points.shape[1] > 1 for group in curves]) > 1:
        edge, backward, curves = _join_degrees(edge, backward, curves, collapsed, corner)
    connectivity = Connectivity(
        counts=tuple(batch.count for batch in batches),
        is_triangle=triangular_patches(batches),
        edge=edge.reshape(-1, 4),
        backward=backward.reshape(-1, 4),
        collapsed=collapsed,
        corner=corner,
        users=np.bincount(edge),
        corner_count=len(distinct),
    )
    return Seams(connectivity, corners[distinct], tuple(curves))


def _join_degrees(
    edge: Ints, backward: Bools, curves: list[EdgeCurves], collapsed: Bools, corner: Ints
) -> tuple[Ints, Bools, list[EdgeCurves]]:
    """Joins edges that are the same curve in several degrees.

    Returns the new `edge` and `backward` of all sides, (P · 4,) each, and the new curves.
    """
    # For each edge: its first side, and the corners at which the edge begins and ends.
    _, first_side = np.unique(edge, return_index=True)
    is_backward = backward[first_side]
    begin, end = (corner[:, corners].ravel()[first_side] for corners in (BEGINS, ENDS))
    begin, end = np.where(is_backward, end, begin), np.where(is_backward, begin, end)
    is_line = ~collapsed.ravel()[first_side]
    leader, is_reversed = find_lowest_degree_edges(curves, is_line, begin, end)
    is_kept = leader == np.arange(len(leader))
    new_edge = np.cumsum(is_kept) - 1
    new_curves = []
    for group in curves:
        rows = is_kept[group.ids]
        weights = None if group.weights is None else group.weights[rows]
        new_curves.append(EdgeCurves(new_edge[group.ids[rows]], group.points[rows], weights))
    return new_edge[leader[edge]], backward ^ is_reversed[edge], new_curves


@dataclass(frozen=True, eq=False, slots=True)
class _Sides:
    """All sides of one degree: their numbers (patch · 4 + side) and their control points."""

    numbers: Ints
    points: FloatArray
    weights: FloatArray | None


def _sides_by_degree(batches: Sequence[Patches]) -> list[_Sides]:
    """The sides of all patches, one value for each degree, in ascending order."""
    groups: dict[int, list[_Sides]] = {}
    first = 0
    for batch in batches:
        patches = 4 * (first + np.arange(batch.count))
        first += batch.count
        for side, degree in enumerate(batch.side_degrees):
            groups.setdefault(degree, []).append(_Sides(patches + side, *batch.side(side)))
    return [_join_sides(groups[degree]) for degree in sorted(groups)]


def _join_sides(parts: list[_Sides]) -> _Sides:
    """One value with the sides of all parts, which have one degree."""
    points = np.concatenate([part.points for part in parts])
    weights = None
    if any(part.weights is not None for part in parts):
        weights = np.concatenate(
            [np.ones(p.points.shape[:2]) if p.weights is None else p.weights for p in parts]
        )
        # A common factor of weights does not change a curve.
        weights = weights / weights.max(axis=1, keepdims=True)
    return _Sides(np.concatenate([part.numbers for part in parts]), points, weights)


def _direct_sides(sides: _Sides) -> tuple[FloatArray, FloatArray | None, Bools]:
    """Points and weights of each side, in the direction whose numbers come first in lexical order.

    The third result says which sides were reversed.
    """
    rows = sides.points.reshape(len(sides.points), -1)
    reversed_rows = sides.points[:, ::-1].reshape(rows.shape)
    if sides.weights is not None:
        rows = np.concatenate([rows, sides.weights], axis=1)
        reversed_rows = np.concatenate([reversed_rows, sides.weights[:, ::-1]], axis=1)
    # In each row, the first number that differs decides.
    differs = rows != reversed_rows
    first_difference = np.arange(len(rows)), differs.argmax(axis=1)
    is_reversed = rows[first_difference] > reversed_rows[first_difference]
    points = np.where(is_reversed[:, None, None], sides.points[:, ::-1], sides.points)
    if sides.weights is None:
        return points, None, is_reversed
    return (
        points,
        np.where(is_reversed[:, None], sides.weights[:, ::-1], sides.weights),
        is_reversed,
    )
