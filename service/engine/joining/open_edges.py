"""The open edges of models, each on one patch only: their curves and their ends."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.connectivity.edges import EdgeCurves, join_curves
from service.engine.connectivity.seams import Seams


@dataclass(frozen=True, eq=False, slots=True)
class OpenEdges:
    """The K open edges of one or more models that are lines, not points.

    Attributes
    ----------
    curves : tuple of EdgeCurves
        Their ids are the numbers 0 … K − 1 of the open edges.
    begin, end : ndarrays of int, shape (K,)
        The numbers of the ends of each edge among the `corners`.
    corners : ndarray of float64, shape (C, 3)
        The ends of all edges.
    """

    curves: tuple[EdgeCurves, ...]
    begin: Ints
    end: Ints
    corners: FloatArray

    @property
    def count(self) -> int:
        """The number K of edges."""
        return len(self.begin)

    def find_rows(self, group: EdgeCurves) -> Ints:
        """For each edge its row in `group`, one of the `curves`; −1 for edges of other groups."""
        rows = np.full(self.count, -1)
        rows[group.ids] = np.arange(len(group.ids))
        return rows

    def move(self, place: Callable[[FloatArray], FloatArray]) -> "OpenEdges":
        """The edges with all points moved by `place`, a function of points (…, 3)."""
        # Adding 0.0 turns -0.0 into 0.0, so that equal points have equal bits.
        curves = (replace(c, points=place(c.points) + 0.0) for c in self.curves)
        return replace(self, curves=tuple(curves), corners=place(self.corners) + 0.0)


def find_open_edges(seams: Seams) -> tuple[OpenEdges, Ints]:
    """The open edges of a model, and the only side (patch · 4 + side) of each, (K,)."""
    connectivity = seams.connectivity
    sides = np.flatnonzero(connectivity.open_lines[connectivity.edge.ravel()])
    edge = connectivity.edge.ravel()[sides]
    number = np.empty(seams.edge_count, np.intp)
    number[edge] = np.arange(len(edge))
    chosen_curves = (group.take(connectivity.open_lines) for group in seams.curves)
    curves = tuple(replace(c, ids=number[c.ids]) for c in chosen_curves if len(c.ids))
    ends = np.concatenate([corners[edge] for corners in connectivity.ends])
    used, ends = np.unique(ends, return_inverse=True)
    begin, end = ends.reshape(2, -1)
    return OpenEdges(curves, begin, end, seams.corner_points[used]), sides


def join_open_edges(borders: Sequence[OpenEdges]) -> tuple[OpenEdges, Ints, Ints]:
    """The open edges of several models; edges and corners are numbered one model after another.

    The other results are the number of the model of each edge, (K,), and of each corner, (C,).
    """
    edge_counts = [border.count for border in borders]
    corner_counts = [len(border.corners) for border in borders]
    first_edges, first_corners = (np.cumsum([0, *n[:-1]]) for n in (edge_counts, corner_counts))
    curves_by_form: dict[tuple[int, bool], list[EdgeCurves]] = {}
    for border, first in zip(borders, first_edges, strict=True):
        for curve in border.curves:
            form = curve.points.shape[1], curve.weights is None
            curves_by_form.setdefault(form, []).append(replace(curve, ids=curve.ids + first))
    edges = OpenEdges(
        curves=tuple(map(join_curves, curves_by_form.values())),
        begin=np.concatenate([b.begin + k for b, k in zip(borders, first_corners, strict=True)]),
        end=np.concatenate([b.end + k for b, k in zip(borders, first_corners, strict=True)]),
        corners=np.concatenate([border.corners for border in borders]),
    )
    numbers = np.arange(len(borders))
    return edges, np.repeat(numbers, edge_counts), np.repeat(numbers, corner_counts)
