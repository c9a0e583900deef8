"""Finds sides of patches that are one edge, by their control points alone.

Two sides are one edge if their control points are equal, in equal or opposite order, and their
weights are equal up to a common factor. Two sides of different degrees are one edge if this is true
after the lower degree is raised to the higher degree
(`service.engine.connectivity.degree_matching`); the edge then has the lower degree. Each distinct
edge is sampled once (`service.engine.connectivity.edges`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import find_first_rows, unique_rows
from service.cancellation import checkpoint
from service.engine.clustering import find_leaders
from service.engine.connectivity.degree_matching import find_lowest_degree_edges
from service.engine.connectivity.edges import EdgeCurves, join_curves, orient_edges
from service.engine.connectivity.incidence import SAME_WEIGHT, Connectivity
from service.surface.batches import Patches


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
    def sides_per_edge(self) -> Ints:
        """How many sides lie on each edge, shape (E,)."""
        return self.connectivity.sides_per_edge

    @property
    def edge_count(self) -> int:
        """The number E of distinct edges."""
        return len(self.connectivity.sides_per_edge)

    def orient(self) -> "Seams":
        """The seams of polynomial patches with each edge in the direction of `orient_edges`.

        So the direction of an edge does not depend on the patches that have it.
        """
        is_turned, curves = np.zeros(self.edge_count, dtype=bool), []
        for group in self.curves:
            points, _, is_turned[group.ids] = orient_edges(group.points.copy(), None)
            curves.append(EdgeCurves(group.ids, points, None))
        backward = self.backward ^ is_turned[self.edge]
        return Seams(
            replace(self.connectivity, backward=backward), self.corner_points, tuple(curves)
        )

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
        edge = new_edge[connectivity.edge]
        renumbered = replace(
            connectivity,
            edge=edge,
            backward=connectivity.backward ^ is_backward[connectivity.edge],
            corner=new_corner.reshape(-1, 4),
            sides_per_edge=np.bincount(edge.ravel()),
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
    for sides in _list_sides(batches):
        checkpoint()
        side_numbers, weights = sides.ids, sides.weights
        if weights is not None:  # a common factor of weights does not change a curve
            weights = weights / weights.max(axis=1, keepdims=True)
        points, weights, is_reversed = orient_edges(sides.points, weights)
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
    connectivity = Connectivity.of_patches(
        batches,
        edge=edge,
        backward=backward,
        collapsed=collapsed,
        corner=number,
        corner_count=len(distinct),
    )
    seams = Seams(connectivity, corners[distinct], tuple(curves))
    # Sides of degree 0 are points, so only two higher degrees can have a common edge.
    has_degrees = np.count_nonzero([group.points.shape[1] > 1 for group in curves]) > 1
    return _join_degrees(seams) if has_degrees else seams


def _join_degrees(seams: Seams) -> Seams:
    """Joins edges that are the same curve in several degrees."""
    connectivity = seams.connectivity
    leader, is_reversed = find_lowest_degree_edges(seams.curves, connectivity)
    is_kept = leader == np.arange(len(leader))
    new_edge = np.cumsum(is_kept) - 1
    edge = new_edge[leader[connectivity.edge]]
    joined = replace(
        connectivity,
        edge=edge,
        backward=connectivity.backward ^ is_reversed[connectivity.edge],
        sides_per_edge=np.bincount(edge.ravel()),
    )
    kept_curves = (group.take(is_kept) for group in seams.curves)
    curves = tuple(replace(group, ids=new_edge[group.ids]) for group in kept_curves)
    return Seams(joined, seams.corner_points, curves)


def _list_sides(batches: Sequence[Patches]) -> list[EdgeCurves]:
    """The sides of all patches, numbered patch · 4 + side: one value for each degree, ascending."""
    groups: dict[int, list[EdgeCurves]] = {}
    first = 0
    for batch in batches:
        patches = 4 * (first + np.arange(batch.count))
        first += batch.count
        for side, degree in enumerate(batch.side_degrees):
            groups.setdefault(degree, []).append(EdgeCurves(patches + side, *batch.side(side)))
    return [join_curves(groups[degree]) for degree in sorted(groups)]
