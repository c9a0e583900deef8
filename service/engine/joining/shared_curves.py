"""Finds where open edges must be cut, so that equal pieces of them become one edge.

Two borders may be one curve although their edges differ: one surface has a knot where the other
surface has no knot, or two surfaces meet a third surface along one of its edges. A Bézier curve
stays the same curve after raising its degree, after inserting knots and after a linear change of
the parameter. So:

An open edge that runs back along itself is cut where it turns (`folds`). Other edges are cut at
corners:

1. A corner that lies on an open edge, and not at its ends, may cut this edge (`place_corners`).
2. Two pieces between the same two corners are one curve if they agree at 2 n + 1 parameters, where
   n is the highest degree of all edges.
3. A corner cuts an edge if a piece beside the cut is one curve with a piece of another edge.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.cache import Cache
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.clustering import find_leaders
from service.engine.connectivity.connect import may_fold
from service.engine.connectivity.incidence import hash_arrays
from service.engine.connectivity.seams import Seams
from service.engine.joining.folds import find_folds
from service.engine.joining.open_edges import (
    CHUNK,
    MAX_PAIRS,
    OpenEdges,
    evaluate_curves,
    find_corner_candidates,
    find_open_edges,
    place_corners,
)


@dataclass(frozen=True, eq=False, slots=True)
class Cuts:
    """K parameters where sides of patches must be cut; all arrays have the shape (K,).

    `patch` and `side` are the numbers of the patch and of its side (`service.surface.sides`); `at`,
    strictly between 0 and 1, is the parameter along the side. Two parameters that differ by at most
    `slack` are the same cut.
    """

    patch: Ints
    side: Ints
    at: FloatArray
    slack: FloatArray

    @property
    def nbytes(self) -> int:
        """Bytes of this value and its key."""
        return 256 + 32 * len(self.at)


_NO_NUMBERS: Ints = np.empty(0, np.intp)
NO_CUTS = Cuts(_NO_NUMBERS, _NO_NUMBERS, np.empty(0), np.empty(0))

CUTS: Cache[Cuts] = Cache(1 << 20)
"""The cached cuts of open edges."""


def find_cuts(seams: Seams, radius: float) -> Cuts:
    """Finds where open edges must be cut, and caches the cuts for equal open edges.

    Parameters
    ----------
    radius : float
        Model units. A corner at most this far from an edge lies on it. Two pieces are one curve if
        the root mean square of the distances of their samples is at most this.
    """
    connectivity, arrays = seams.connectivity, []
    # Fewer than 3 open edges are not cut at corners. In general, a corner can lie inside one of
    # them only if there are 2, and both are closed curves.
    if connectivity.open_count < 3 and not may_fold(seams):
        return NO_CUTS
    for group in seams.curves:
        rows = connectivity.open_lines[group.ids].nonzero()[0]
        arrays += [group.points.take(rows, axis=0)]
        arrays += [] if group.weights is None else [group.weights.take(rows, axis=0)]
    key = ("cuts", connectivity.key, radius, hash_arrays(*arrays))
    return CUTS.get(key, lambda: _search_cuts(seams, radius))


def _search_cuts(seams: Seams, radius: float) -> Cuts:
    """Finds the cuts of open edges without the cache."""
    edges, sides = find_open_edges(seams)
    folded, fold, fold_slack = find_folds(edges, radius)
    if len(folded):
        return _cut_sides(seams, sides[folded], fold, fold_slack)
    edge, corner = find_corner_candidates(edges, radius)
    if not len(edge) or len(edge) > MAX_PAIRS or edges.count < 3:
        return NO_CUTS
    checkpoint()
    at, slack, is_on = place_corners(edges, edge, edges.corners[corner], radius)
    edge, corner, at, slack = edge[is_on], corner[is_on], at[is_on], slack[is_on]
    if not len(edge):
        return NO_CUTS
    order = np.lexsort((at, edge))
    edge, corner, at, slack = edge[order], corner[order], at[order], slack[order]
    is_kept = _is_beside_shared_piece(edges, edge, corner, at, radius)
    return _cut_sides(seams, sides[edge[is_kept]], at[is_kept], slack[is_kept])


def _cut_sides(seams: Seams, side: Ints, at: FloatArray, slack: FloatArray) -> Cuts:
    """Cuts of sides (K,), numbers patch · 4 + side, at parameters of their edges."""
    at = np.where(seams.backward.ravel()[side], 1 - at, at)
    return Cuts(side // 4, side % 4, at, slack)


def _is_beside_shared_piece(
    edges: OpenEdges, edge: Ints, corner: Ints, at: FloatArray, radius: float
) -> Bools:
    """For each cut (K,), whether a piece beside it is also a piece of another edge."""
    # A piece begins at each cut, and at the beginning of each edge.
    edge_of_piece = np.concatenate([edge, np.arange(edges.count)])
    begin_parameter = np.concatenate([at, np.zeros(edges.count)])
    order = np.lexsort((begin_parameter, edge_of_piece))
    edge_of_ordered_piece, begin_parameter = edge_of_piece[order], begin_parameter[order]
    begin_corner = np.concatenate([corner, edges.begin])[order]
    is_last = np.append(edge_of_ordered_piece[1:] != edge_of_ordered_piece[:-1], True)
    end_parameter = np.where(is_last, 1.0, np.roll(begin_parameter, -1))
    end_corner = np.where(is_last, edges.end[edge_of_ordered_piece], np.roll(begin_corner, -1))
    degree = max(group.points.shape[1] - 1 for group in edges.curves)
    # Where on a piece it is sampled: parameters of the piece from 0 to 1.
    fractions = np.arange(1, 2 * degree + 2) / (2 * degree + 2)
    is_backward = begin_corner > end_corner
    # The samples of a piece run from the corner with the lower number to the other corner.
    parameters = np.where(
        is_backward[:, None],
        end_parameter[:, None] + (begin_parameter - end_parameter)[:, None] * fractions,
        begin_parameter[:, None] + (end_parameter - begin_parameter)[:, None] * fractions,
    )
    values = np.empty((len(edge_of_ordered_piece), len(fractions), 3))
    for group in edges.curves:
        row_of_edge = edges.find_rows(group)
        pieces = np.flatnonzero(row_of_edge[edge_of_ordered_piece] >= 0)
        for part in row_slices(len(pieces), 4 * len(fractions) * (degree + 1), CHUNK):
            piece_rows = pieces[part]
            curve = row_of_edge[edge_of_ordered_piece[piece_rows]]
            weights = None if group.weights is None else group.weights[curve]
            values[piece_rows] = evaluate_curves(
                group.points[curve], weights, parameters[piece_rows]
            )
    # Pieces between the same two corners are compared.
    low, high = np.minimum(begin_corner, end_corner), np.maximum(begin_corner, end_corner)
    _, first, pair = np.unique(
        low * len(edges.corners) + high, return_index=True, return_inverse=True
    )
    # Pieces are one curve if the root mean square of the distances of their samples is at most
    # `radius`.
    distance = radius * len(fractions) ** 0.5
    leader = find_leaders(
        first[pair.ravel()], values.reshape(len(edge_of_ordered_piece), -1), distance
    )
    is_shared_piece = np.bincount(leader, minlength=len(leader))[leader] > 1
    # The piece after each cut, and the piece before it.
    piece_number = np.empty(len(order), dtype=np.intp)
    piece_number[order] = np.arange(len(order))
    piece_after = piece_number[: len(edge)]
    return is_shared_piece[piece_after] | is_shared_piece[piece_after - 1]
