"""The pieces of cells of several knot spans, one for each span, and their nets and points."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.adaptive.cutting.cells import (
    FaceCells,
    Task,
    evaluate_nine_points,
    restrict_to_cells,
)
from service.engine.bounds.faces import SPAN

BLOCK = 1 << 14
"""Approximate number of spans in one block; it limits the memory of their nets."""


@dataclass(frozen=True, eq=False, slots=True)
class SpanPieces:
    """N pieces of m cells: the intersections of cells with their spans.

    Pieces are sorted by cells, then by spans; the span along v varies fastest.

    Attributes
    ----------
    as_cells : FaceCells
        The N pieces as cells of one span.
    cell : ndarray of int, shape (N,)
        The cell of each piece.
    start, end, width : ndarray of int, shape (m,)
        The first and the last piece of each cell, and its number of pieces along v.
    """

    as_cells: FaceCells
    cell: Ints
    start: Ints
    end: Ints
    width: Ints

    def find_largest(self, values: FloatArray) -> FloatArray:
        """The largest of the values (…, N) of pieces in every cell, (…, m)."""
        return np.maximum.reduceat(values, self.start, axis=-1)

    def find_line_ends(self) -> tuple[tuple[Ints, Ints], tuple[Ints, Ints]]:
        """The first and the last piece (N,) of the line of pieces through each piece.

        The first pair is for lines along u, the second pair for lines along v.
        """
        # Piece `number` of a cell is at `across` in its line along v, which `first` begins.
        number = np.arange(len(self.cell)) - self.start[self.cell]
        width = self.width[self.cell]
        across = number % width
        first = self.start[self.cell] + number - across
        return (
            (self.start[self.cell] + across, (self.end - self.width + 1)[self.cell] + across),
            (first, first + width - 1),
        )


def count_spans(cells: FaceCells) -> Ints:
    """Number of spans that cells intersect, shape (m,)."""
    along_u, along_v = _count_along(cells)
    counts: Ints = along_u * along_v
    return counts


def _count_along(cells: FaceCells) -> Ints:
    """Number of spans that cells intersect along u and along v: shape (2, m)."""
    # The rows of a box are u0, u1, v0, v1. The first term is the end, rounded up.
    return -(-cells.rectangle[1::2] // SPAN) - cells.rectangle[::2] // SPAN


def split_cells(cells: FaceCells) -> SpanPieces:
    """The pieces of cells."""
    along_u, along_v = _count_along(cells)
    count = along_u * along_v
    end = np.cumsum(count)
    start = end - count
    cell, number = expand_runs(count)
    width = along_v[cell]
    box = cells.rectangle.take(cell, axis=1)
    low, high = box[::2], box[1::2]
    begin = (low // SPAN + np.array([number // width, number % width])) * SPAN
    boxes = np.empty_like(box)
    np.maximum(low, begin, out=boxes[::2])
    np.minimum(high, begin + SPAN, out=boxes[1::2])
    return SpanPieces(FaceCells(boxes, cells.face[cell]), cell, start, end - 1, along_v)


def build_nets(task: Task, cells: FaceCells, rows: Ints) -> Iterator[tuple[FloatArray, Ints]]:
    """Nets of the pieces in these rows, in blocks, with the rows of each block."""
    patch = task.find_patches(cells)
    for nets, selected in task.patch_nets.split_by_group(patch[rows]):
        # `BLOCK` is for nets of 16 numbers; blocks of larger nets have fewer pieces.
        block = max(16, BLOCK * 16 // nets.values[..., 0].size)
        for k in range(0, len(selected), block):
            chunk = rows[selected[k : k + block]]
            net = restrict_to_cells(nets, task.patch_nets.row[patch[chunk]], cells.take(chunk))
            task.limits.spend(net.size)
            yield net, chunk


class NinePoints:
    """Points of pieces at u, v ∈ {0, ½, 1} of each piece; the points of whole spans are cached."""

    def __init__(self, task: Task) -> None:
        self.task = task
        # The column of each patch in `points`, or −1.
        self.column = np.full(len(task.patch_nets.sizes), -1)
        self.points = np.empty((3, 3, 3, 0))

    def evaluate(self, cells: FaceCells, patch: Ints) -> FloatArray:
        """Nine points (3, 3, 3, N) of pieces in these patches, as in `evaluate_nine_points`.

        Coordinates are relative to the middles of the patches.
        """
        is_span = (cells.extents == SPAN).all(axis=0)
        fresh = (is_span & (self.column[patch] < 0)).nonzero()[0]
        if len(fresh):
            # Pieces of many cells may be the same span.
            fresh = fresh[np.unique(patch[fresh], return_index=True)[1]]
            # Columns are counted from 0 first, then shifted behind the cached points.
            added = np.empty((3, 3, 3, len(fresh)))
            self.column[patch[fresh]] = np.arange(len(fresh))
            for net, rows in build_nets(self.task, cells, fresh):
                added[..., self.column[patch[rows]]] = evaluate_nine_points(net)
            self.column[patch[fresh]] += self.points.shape[3]
            self.points = np.concatenate([self.points, added], axis=3)
        if is_span.all():
            return self.points.take(self.column[patch], axis=3)
        points = np.empty((3, 3, 3, len(patch)))
        points[..., is_span] = self.points.take(self.column[patch[is_span]], axis=3)
        for net, rows in build_nets(self.task, cells, (~is_span).nonzero()[0]):
            points[..., rows] = evaluate_nine_points(net)
        return points
