"""Paths along edges, as points: of links that have a length, and of edges that lie in planes.

And distances from such paths.
"""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs, row_slices
from service.cancellation import checkpoint
from service.engine.parts.sections.borders import Borders
from service.engine.parts.sections.links import Links
from service.engine.vectors import length

MOST = 256
"""The most samples of a piece of a curve."""

NUMBERS = 1 << 18
"""How many pairs of a point and a line have their distances computed at once."""


def list_portions(borders: Borders, links: Links) -> tuple[Ints, Ints, FloatArray, FloatArray]:
    """The coedges along links, in order: the link, the coedge, and the parameters from and to.

    A link goes from its first place forward along the loop.
    """
    loop = borders.coedge_loops[links.coedges[0]]
    first = np.searchsorted(borders.coedge_loops, loop)
    size = np.searchsorted(borders.coedge_loops, loop, side="right") - first
    begin, end = links.coedges - first
    turn = np.where(borders.coedge_reversed[links.coedges[0]], -1.0, 1.0)
    steps = (end - begin) % size
    is_round = (steps == 0) & (turn * links.t[1] < turn * links.t[0])
    steps = np.where(is_round, size, steps)
    link, step = expand_runs(steps + 1)
    coedge = first[link] + (begin[link] + step) % size[link]
    low, high = borders.edge_ranges[borders.coedge_edges[coedge]].T
    back = borders.coedge_reversed[coedge]
    start, stop = np.where(back, high, low), np.where(back, low, high)
    is_first, is_last = step == 0, step == steps[link]
    start[is_first] = links.t[0, link[is_first]]
    stop[is_last] = links.t[1, link[is_last]]
    return link, coedge, start, stop


def sample_edges(
    borders: Borders, edge: Ints, start: FloatArray, stop: FloatArray, tolerance: float
) -> tuple[Ints, FloatArray]:
    """Points along edges (m,) from `start` (m,) to `stop` (m,), with both, so that chords are near.

    Returns
    -------
    row : ndarray of int, shape (k,)
        The row of each point, ascending; edges that are points have none.
    points : ndarray of float64, shape (k, 3)
    """
    edges = borders.edges
    first = np.searchsorted(edges.curve, edge)
    last = np.searchsorted(edges.curve, edge, side="right")
    row, piece = expand_runs(last - first, first)
    low, high = np.minimum(start, stop)[row], np.maximum(start, stop)[row]
    begin, end = np.maximum(low, edges.low[piece]), np.minimum(high, edges.high[piece])
    kept = (begin < end) | ((begin == end) & (low == high))
    row, piece, begin, end = row[kept], piece[kept], begin[kept], end[kept]
    width = edges.high[piece] - edges.low[piece]
    bend = np.zeros(len(piece))
    for rows, values in edges.split(piece):
        points = values[:, :3] / values[:, 3:]
        degree = len(points) - 1
        if degree > 1:
            second = points[2:] - 2 * points[1:-1] + points[:-2]
            longest = np.sqrt((second * second).sum(axis=1)).max(axis=0)
            spread = values[:, 3].max(axis=0) / values[:, 3].min(axis=0)
            bend[rows] = degree * (degree - 1) * longest * spread**2
    share = (end - begin) / np.where(width > 0, width, 1.0)
    count = np.ceil(np.sqrt(bend * share**2 / (8 * tolerance))).astype(np.intp)
    count = np.clip(count, 1, MOST)
    # Samples of each part, without its end; then the ends of rows.
    part, number = expand_runs(count)
    t = begin[part] + (end - begin)[part] * (number / count[part])
    is_last = np.ones(len(row), bool)
    is_last[:-1] = row[1:] != row[:-1]
    row_all = np.concatenate([row[part], row[is_last]])
    piece_all = np.concatenate([piece[part], piece[is_last]])
    t_all = np.concatenate([t, end[is_last]])
    is_back = (start > stop)[row_all]
    order = np.lexsort((np.where(is_back, -t_all, t_all), row_all))
    row_all, piece_all, t_all = row_all[order], piece_all[order], t_all[order]
    width = edges.high[piece_all] - edges.low[piece_all]
    share = (t_all - edges.low[piece_all]) / np.where(width > 0, width, 1.0)
    return row_all, edges.evaluate(piece_all, np.clip(share, 0.0, 1.0))


def measure_to_lines(points: FloatArray, lines: Sequence[FloatArray]) -> FloatArray:
    """The distances (m,) of points (m, 3) from the nearest of some polylines (k, 3)."""
    nearest = np.full(len(points), np.inf)
    for line in lines:
        begin = line[:-1] if len(line) > 1 else line
        way = line[1:] - line[:-1] if len(line) > 1 else np.zeros_like(line)
        square = (way * way).sum(axis=1)
        for rows in row_slices(len(points), max(1, len(begin)), NUMBERS):
            checkpoint()
            offset = points[rows, np.newaxis] - begin
            share = (offset * way).sum(axis=2) / np.where(square > 0, square, 1.0)
            away = offset - np.clip(share, 0.0, 1.0)[..., np.newaxis] * way
            distance = length(away, -1).min(axis=1, initial=np.inf)
            nearest[rows] = np.minimum(nearest[rows], distance)
    return nearest
