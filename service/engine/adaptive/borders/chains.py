"""Chains: edges along the sides of faces that are divided together, as one curve."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, Ints
from service.bases.row_batches import expand_runs, unique_rows, unique_values
from service.engine.bounds.faces import Faces
from service.engine.connectivity.seams import Seams
from service.surface.sides import BEGINS, ENDS


@dataclass(frozen=True, eq=False, slots=True)
class Chains:
    """C distinct chains, and the sides along which they run; no chain is a point.

    Chain c has the edges `edge[start[c] : start[c+1]]`, in order. The direction of a chain depends
    on the control points of its edges alone, not on their numbers in a model.

    Attributes
    ----------
    start : ndarray of int, shape (C+1,)
    edge, backward : ndarray of int and of bool, shape (N,)
        Number of the edge, and whether the chain runs against the direction of the edge.
    corner : ndarray of int, shape (N+C,)
        Corners between the edges and at both ends: those of chain c begin at `start[c] + c`.
    side, first : ndarray of int, shape (R,)
        Runs: the side of a face (4 f + s), in order, and the span of it at which the run begins.
    chain, reversed : ndarray of int and of bool, shape (R,)
        The chain of each run, and whether the run begins at the end of the chain.
    """

    start: Ints
    edge: Ints
    backward: Bools
    corner: Ints
    side: Ints
    first: Ints
    chain: Ints
    reversed: Bools

    @property
    def length(self) -> Ints:
        """Number of edges of every chain, shape (C,)."""
        return self.start[1:] - self.start[:-1]

    @property
    def uses(self) -> Ints:
        """Number of runs along every chain, shape (C,)."""
        return np.bincount(self.chain, minlength=len(self.start) - 1)


@dataclass(frozen=True, eq=False, slots=True)
class _Steps:
    """The edges along the sides of faces, without sides that are points; all of shape (N,).

    `side` is 4 f + s, in ascending order; `span` counts the edges along a side; `begin` and `end`
    are the corners at both ends of an edge.
    """

    side: Ints
    span: Ints
    edge: Ints
    backward: Bools
    begin: Ints
    end: Ints


def find_chains(faces: Faces, seams: Seams) -> Chains:
    """The chains of the sides of all faces.

    A side is one chain if its edges have one degree, and if every side with one of these edges has
    all of them, in this order or in the opposite order. Otherwise each of its edges is a separate
    chain, because the division of a shared edge must not depend on edges that are not shared.
    """
    steps = _list_steps(faces, seams)
    count = np.bincount(steps.side, minlength=4 * len(faces.first))
    begin = np.cumsum(count) - count
    uses = np.bincount(steps.edge, minlength=seams.edge_count)
    degree = np.empty(len(uses), dtype=np.intp)
    for group in seams.curves:
        degree[group.ids] = group.points.shape[1] - 1
    along, against = _number_steps(steps, seams, count[steps.side] > 1)
    single = np.ones(len(steps.edge), dtype=bool)
    groups: list[_ChainGroup] = []
    # Sides of several edges, by their numbers of edges.
    for length in (np.bincount(count)[2:].nonzero()[0] + 2).tolist():
        rows = begin[(count == length).nonzero()[0], None] + np.arange(length)
        forth, back = along[rows], against[rows[:, ::-1]]
        turned = _is_before(back, forth)
        codes = np.where(turned[:, None], back, forth)
        first, number = unique_rows(codes.astype(np.float64))
        # An edge must have as many uses as its chain. This is true of all sides with these codes,
        # or of none, so the first of them decides for the chain.
        is_alike = (uses[steps.edge[rows]] == np.bincount(number)[number, None]).all(axis=1)
        is_alike &= (degree[steps.edge[rows]] == degree[steps.edge[rows[:, :1]]]).all(axis=1)
        single[rows[is_alike]] = False
        is_chain = is_alike[first]
        chosen = first[is_chain]
        leaders = np.where(turned[chosen, None], rows[chosen, ::-1], rows[chosen])
        chain = (np.cumsum(is_chain) - 1)[number[is_alike]]
        groups.append((leaders, turned[chosen], rows[is_alike, 0], chain, turned[is_alike]))
    # All other edges, each a chain of its own, in its own direction.
    rows = single.nonzero()[0]
    first, chain = unique_values(steps.edge[rows])
    turned = steps.backward[rows]
    return _join_chains(steps, [(rows[first, None], turned[first], rows, chain, turned), *groups])


def _list_steps(faces: Faces, seams: Seams) -> _Steps:
    """The edges along the sides of all faces."""
    begin, step, spans = faces.list_sides()
    count = np.where(seams.collapsed[begin, np.arange(4)], 0, spans).ravel()
    side, span = expand_runs(count)
    patch, which = begin.ravel()[side] + span * step.ravel()[side], side % 4
    return _Steps(
        side,
        span,
        seams.edge[patch, which],
        seams.backward[patch, which],
        seams.corner[patch, BEGINS[which]],
        seams.corner[patch, ENDS[which]],
    )


def _number_steps(steps: _Steps, seams: Seams, selected: Bools) -> tuple[Ints, Ints]:
    """Two numbers for each selected step: one for its direction, one for the opposite direction.

    Numbers are in the order of degrees and control points of the edges. The direction of an edge
    has a lower number than the opposite direction. So the order does not depend on the model.
    """
    used = np.zeros(seams.edge_count, dtype=bool)
    used[steps.edge[selected]] = True
    rank = np.zeros(len(used), dtype=np.intp)
    symmetric = np.zeros(len(used), dtype=bool)
    ranked = 0
    for group in seams.curves:
        rows = used[group.ids].nonzero()[0]
        ids, points = group.ids[rows], group.points[rows]
        if not len(rows):
            continue
        same = (points == points[:, ::-1]).all(axis=(1, 2))
        columns = points.reshape(len(rows), -1)
        if group.weights is not None:
            weights = group.weights[rows]
            same &= (weights == weights[:, ::-1]).all(axis=1)
            columns = np.concatenate([columns, weights], axis=1)
        rank[ids[np.lexsort(columns.T[::-1])]] = ranked + np.arange(len(rows))
        symmetric[ids] = same
        ranked += len(rows)
    # An edge that is equal to its reverse has one number for both directions.
    backward = steps.backward & ~symmetric[steps.edge]
    along = 2 * rank[steps.edge] + backward
    return along, np.where(symmetric[steps.edge], along, along ^ 1)


def _is_before(rows: Ints, others: Ints) -> Bools:
    """Which rows come before the rows of `others` in dictionary order; equal rows do not."""
    differs = rows != others
    at = np.arange(len(rows)), differs.argmax(axis=1)
    before: Bools = rows[at] < others[at]
    return before


_ChainGroup: TypeAlias = tuple[Ints, Bools, Ints, Ints, Bools]
"""K chains of n edges, and their runs, by rows of `_Steps`: the rows (K, n) along each chain, from
its first edge to its last; whether a chain runs against the sides of these rows; and for each run
the row at which it begins on its side, its chain, and whether it begins at the end of the chain."""


def _join_chains(steps: _Steps, groups: list[_ChainGroup]) -> Chains:
    """All chains in one list, and all runs in the order of their sides."""
    leaders, turned, rows, chains, is_reversed = zip(*groups, strict=True)
    counts = [len(group) for group in leaders]
    length = np.repeat([group.shape[1] for group in leaders], counts)
    start = np.concatenate([[0], np.cumsum(length)]).astype(np.intp)
    step = np.concatenate([group.ravel() for group in leaders])
    against = np.concatenate(turned).repeat(length)
    # The corners at which the edges begin, with the end of each chain after its last edge.
    begin = np.where(against, steps.end[step], steps.begin[step])
    end = np.where(against, steps.begin[step], steps.end[step])
    corner = np.insert(begin, start[1:], end[start[1:] - 1])
    chain = np.concatenate(chains)
    chain += np.repeat(np.cumsum(counts) - counts, [len(group) for group in chains])
    row = np.concatenate(rows)  # steps are in the order of their sides
    order = row.argsort()
    return Chains(
        start,
        steps.edge[step],
        steps.backward[step] ^ against,
        corner,
        steps.side[row[order]],
        steps.span[row[order]],
        chain[order],
        np.concatenate(is_reversed)[order],
    )
