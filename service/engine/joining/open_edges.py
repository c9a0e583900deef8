"""The open edges of models, each on one patch only: their curves and their ends."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.connectivity.edges import EdgeCurves
from service.engine.connectivity.seams import Seams
from service.surface.sides import BEGINS, ENDS


@dataclass(frozen=True, eq=False, slots=True)
class OpenEdges:
    """The E open edges of a model that are lines, not points.

    Attributes
    ----------
    curves : tuple of EdgeCurves
        All edges of the model, one value for each degree.
    number : ndarray of int
        For each distinct edge of the model, its number among the open edges, or −1.
    side : ndarray of int, shape (E,)
        The only side (patch · 4 + side) of each edge.
    begin, end : ndarrays of int, shape (E,)
        The numbers of the ends of each edge among the `corners`.
    corners : ndarray of float64, shape (C, 3)
    """

    curves: tuple[EdgeCurves, ...]
    number: Ints
    side: Ints
    begin: Ints
    end: Ints
    corners: FloatArray


def find_open_edges(seams: Seams) -> OpenEdges:
    """The open edges of a model that are lines, not points."""
    connectivity = seams.connectivity
    sides = np.flatnonzero(
        connectivity.open_lines[connectivity.edge.ravel()] & ~connectivity.collapsed.ravel()
    )
    edge = connectivity.edge.ravel()[sides]
    number = np.full(len(connectivity.users), -1)
    number[edge] = np.arange(len(edge))
    ends = [connectivity.corner[:, corners].ravel()[sides] for corners in (BEGINS, ENDS)]
    is_backward = connectivity.backward.ravel()[sides]
    begin, end = np.where(is_backward, ends[1], ends[0]), np.where(is_backward, ends[0], ends[1])
    return OpenEdges(seams.curves, number, sides, begin, end, seams.corner_points)


@dataclass(frozen=True, eq=False, slots=True)
class OpenBorder:
    """The K open edges of a model or of a placed model.

    The ids of `curves` are the numbers 0 … K − 1; `begin` and `end` (K,) are the numbers of the
    ends of each edge among the `corners` (C, 3).
    """

    curves: tuple[EdgeCurves, ...]
    begin: Ints
    end: Ints
    corners: FloatArray

    def move(self, place: Callable[[FloatArray], FloatArray]) -> "OpenBorder":
        """The border with all its points moved by `place`, a function of points (N, 3)."""
        # Adding 0.0 turns -0.0 into 0.0, so that equal points have equal bits.
        curves = (
            replace(c, points=(place(c.points.reshape(-1, 3)) + 0.0).reshape(c.points.shape))
            for c in self.curves
        )
        return replace(self, curves=tuple(curves), corners=place(self.corners) + 0.0)


def find_open_border(seams: Seams) -> OpenBorder:
    """The open edges of a model without its other edges and corners."""
    edges = find_open_edges(seams)
    curves = (
        EdgeCurves(number, g.points[rows], None if g.weights is None else g.weights[rows])
        for g, rows, number in iterate_degrees(edges)
    )
    used, ends = np.unique(np.concatenate([edges.begin, edges.end]), return_inverse=True)
    begin, end = ends.reshape(2, -1)
    return OpenBorder(tuple(curves), begin, end, edges.corners[used])


def iterate_degrees(edges: OpenEdges) -> Iterator[tuple[EdgeCurves, Ints, Ints]]:
    """For each degree, yields the curves, which rows of them are open edges, and their numbers."""
    for group in edges.curves:
        number = edges.number[group.ids]
        rows = np.flatnonzero(number >= 0)
        if len(rows):
            yield group, rows, number[rows]
