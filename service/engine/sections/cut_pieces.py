"""Bounds of parts of pieces of sections, that is, of graphs in cells that are cut at their ends.

The part of a graph of v over u between u₀ and u₁ lies below a level v₁ if f(u, v₁) has the sign of
larger v for all u from u₀ to u₁: that is so if all its Bernstein coefficients have this sign. So
the rectangle about a part reaches up to the lowest of some levels for which this is true.

Proof in docs/proofs.md: "Flat pieces of a section".
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.row_batches import row_slices
from service.engine.nets.blossoms import restrict
from service.engine.nets.query_nets import QueryNets
from service.engine.sections.borders import ONE
from service.engine.sections.cells import (
    EDGE_ERROR,
    OVER_U,
    EndedCells,
    LocalPlanes,
    OpenCells,
    build_cells,
)
from service.engine.sections.flatness import Pieces, bound_pieces
from service.engine.sections.search import MAX_NUMBERS, build_pieces

LEVELS = (1 / 2, 1 / 4, 1 / 8, 1 / 16, 1 / 32, 1 / 64, 0.0)
"""Levels beyond the ends of a part that are tried, in heights of the cell."""


def bound_parts(
    nets: QueryNets, planes: LocalPlanes, cells: EndedCells, begin: FloatArray, end: FloatArray
) -> FloatArray:
    """Bounds (m,) of the distances of parts of graphs from their chords.

    Parameters
    ----------
    cells : EndedCells
        The cell of each part; of kind `OVER_U` or `OVER_V`.
    begin, end : ndarray of float64, shape (2, m)
        The parameters of both ends of the parts, in their nets.
    """
    bounds = np.empty(len(cells))
    for group, rows in nets.split(cells.net):
        for chunk in row_slices(len(rows), group.values[..., 0].size, MAX_NUMBERS):
            own = rows[chunk]
            part = cells.take(own)
            opened = _open(build_cells(group, planes, part.plane, part.net), part)
            for axis in range(2):  # the kinds `OVER_U` and `OVER_V` are 0 and 1
                chosen = (part.kind == axis).nonzero()[0]
                if not len(chosen):
                    continue
                ends = begin[:, own[chosen]], end[:, own[chosen]]
                is_back = ends[0][axis] > ends[1][axis]
                low, high = np.where(is_back, ends[::-1], ends)
                pieces = build_pieces(opened, axis, part.is_monotone, chosen, (low, high))
                _tighten(pieces, opened.take(chosen), part.sense[chosen], axis)
                found = bound_pieces(group, planes, pieces, tries_both=True)
                bounds[own[chosen]] = found.sum(axis=0)
    return bounds


def _open(whole: OpenCells, cells: EndedCells) -> OpenCells:
    """The cells with their coefficients of f, from those of whole nets."""
    corners = cells.rectangle.reshape(2, 2, -1).swapaxes(0, 1) / ONE
    coefficients = restrict(whole.nets.transpose(2, 0, 1)[:, np.newaxis], corners)
    return OpenCells(
        cells.rectangle,
        np.ascontiguousarray(coefficients[:, 0].transpose(1, 2, 0)),
        whole.pair,
        whole.plane,
        whole.net,
        whole.threshold,
        whole.is_coplanar,
    )


def _tighten(pieces: Pieces, cells: OpenCells, sense: FloatArray, axis: int) -> None:
    """Make the rectangles of pieces smaller; piece k is in cell k."""
    across = 1 - axis
    box = cells.rectangle / ONE
    low, width = box[::2], box[1::2] - box[::2]
    ends = np.stack([pieces.begin, pieces.end])
    along = np.clip((ends[:, axis] - low[axis]) / width[axis], 0.0, 1.0)
    values = np.sort(np.clip((ends[:, across] - low[across]) / width[across], 0.0, 1.0), axis=0)
    # Whether f increases along the other parameter.
    sign = np.where(axis == OVER_U, sense, -sense)
    nets = cells.nets.transpose(2, 0, 1)[:, np.newaxis]
    for side in range(2):
        row = pieces.rectangle[2 * across + side]
        for share in LEVELS:
            level = values[0] - share if side == 0 else values[1] + share
            is_inside = (level >= 0.0) & (level <= 1.0)
            corners = np.empty((2, 2, len(level)))
            corners[:, axis] = 1.0 - (1.0 - along)
            corners[:, across] = 1.0 - (1.0 - np.clip(level, 0.0, 1.0))
            heights = restrict(nets, corners).reshape(len(level), -1)
            signed = heights * (sign if side else -sign)[:, np.newaxis]
            is_beyond = is_inside & (signed.min(axis=1) >= -EDGE_ERROR)
            place = low[across] + level * width[across]
            np.copyto(
                row,
                np.maximum(row, place) if side == 0 else np.minimum(row, place),
                where=is_beyond,
            )
