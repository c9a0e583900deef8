"""Finds where open edges that are the same curve in pieces must be cut to become equal edges.

Two borders may be one curve although their edges differ: one surface has a knot where the other has
none, or two surfaces meet a third along one of its edges. A Bézier curve over an interval is
determined by the interval, and stays the same after raising its degree, after inserting knots and
after a linear change of the parameter. So:

1. A corner that lies on an open edge, and not at its ends, may cut it (`corners_on_edges`).
2. Pieces between the same two corners are one curve if they agree at 2 n + 1 parameters, n the
   highest degree of all.
3. A cut is made if a piece beside it is one curve with a piece of another edge.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.cache import Cache
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.clustering import find_leaders
from service.engine.joining.corners_on_edges import (
    CHUNK,
    MAX_PAIRS,
    find_corner_candidates,
    place_corners,
    points_at,
)
from service.engine.joining.open_edges import OpenEdges, find_open_edges, iterate_degrees
from service.engine.mesh.connectivity import hash_arrays
from service.engine.mesh.seams import Seams


@dataclass(frozen=True, eq=False, slots=True)
class Cuts:
    """Parameters where sides of patches must be cut: all of shape (K,).

    `patch` and `side` (`service.surface.sides`) name the side; `at`, strictly between 0 and 1, is
    the parameter along the side. Parameters of the patch that differ by at most `slack` are the
    same cut.
    """

    patch: Ints
    side: Ints
    at: FloatArray
    slack: FloatArray

    @property
    def nbytes(self) -> int:
        """Bytes of this value and its key."""
        return 256 + 32 * len(self.at)


_NONE: Ints = np.empty(0, np.intp)
NOWHERE = Cuts(_NONE, _NONE, np.empty(0), np.empty(0))
"""No cuts."""

CUTS: Cache[Cuts] = Cache(1 << 20)
"""The cached cuts of open edges."""


def find_cuts(seams: Seams, reach: float) -> Cuts:
    """Where open edges must be cut to become equal to others, cached for the same open edges.

    Parameters
    ----------
    reach : float
        Model units. Points at most this far apart count as equal.
    """
    connectivity, arrays = seams.connectivity, []
    if connectivity.open_count < 3:
        return NOWHERE
    for group in seams.curves:
        rows = connectivity.open_lines[group.ids].nonzero()[0]
        arrays += [group.points.take(rows, axis=0)]
        arrays += [] if group.weights is None else [group.weights.take(rows, axis=0)]
    key = ("cuts", connectivity.key, reach, hash_arrays(*arrays))
    return CUTS.get(key, lambda: _cuts(seams, reach))


def _cuts(seams: Seams, reach: float) -> Cuts:
    edges = find_open_edges(seams)
    edge, corner = find_corner_candidates(edges, reach)
    if not len(edge) or len(edge) > MAX_PAIRS:
        return NOWHERE
    checkpoint()
    at, slack, is_on = place_corners(edges, edge, edges.corners[corner], reach)
    edge, corner, at, slack = edge[is_on], corner[is_on], at[is_on], slack[is_on]
    if not len(edge):
        return NOWHERE
    order = np.lexsort((at, edge))
    edge, corner, at, slack = edge[order], corner[order], at[order], slack[order]
    is_kept = _beside_shared(edges, edge, corner, at, reach)
    side = edges.side[edge[is_kept]]
    is_reversed = seams.backward.ravel()[side]
    at = np.where(is_reversed, 1 - at[is_kept], at[is_kept])
    return Cuts(side // 4, side % 4, at, slack[is_kept])


def _beside_shared(
    edges: OpenEdges, edge: Ints, corner: Ints, at: FloatArray, reach: float
) -> Bools:
    """Whether beside each cut (K,) lies a piece that two edges share."""
    cut = np.concatenate([edge, np.arange(len(edges.side))])
    order = np.lexsort((np.concatenate([at, np.zeros(len(edges.side))]), cut))
    owner = cut[order]
    # A piece begins at every cut, and at every beginning of an edge.
    start = np.concatenate([at, np.zeros(len(edges.side))])[order]
    begin = np.concatenate([corner, edges.begin])[order]
    ends = np.append(owner[1:] != owner[:-1], True)
    stop = np.where(ends, 1.0, np.roll(start, -1))
    end = np.where(ends, edges.end[owner], np.roll(begin, -1))
    degree = max(group.points.shape[1] - 1 for group, _, _ in iterate_degrees(edges))
    shares = np.arange(1, 2 * degree + 2) / (2 * degree + 2)
    back = begin > end
    places = np.where(
        back[:, None],
        stop[:, None] + (start - stop)[:, None] * shares,
        start[:, None] + (stop - start)[:, None] * shares,
    )
    values = np.empty((len(owner), len(shares), 3))
    for group, rows, number in iterate_degrees(edges):
        row_of_edge = np.full(len(edges.side), -1)
        row_of_edge[number] = rows
        piece_after = np.flatnonzero(row_of_edge[owner] >= 0)
        for part in row_slices(len(piece_after), 4 * len(shares) * (degree + 1), CHUNK):
            part_rows = piece_after[part]
            curve = row_of_edge[owner[part_rows]]
            weights = None if group.weights is None else group.weights[curve]
            values[part_rows] = points_at(group.points[curve], weights, places[part_rows])
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    _, first, pair = np.unique(
        low * len(edges.corners) + high, return_index=True, return_inverse=True
    )
    far = reach * len(shares) ** 0.5
    leader = find_leaders(first[pair.ravel()], values.reshape(len(owner), -1), far)
    shared = np.bincount(leader, minlength=len(leader))[leader] > 1
    # The pieces before and after each cut.
    place = np.empty(len(order), dtype=np.intp)
    place[order] = np.arange(len(order))
    piece_after = place[: len(edge)]
    is_shared: Bools = shared[piece_after] | shared[piece_after - 1]
    return is_shared
