"""Chains: edges along the sides of faces that are divided together, as one curve."""

from dataclasses import dataclass

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


@dataclass(frozen=True, eq=False, slots=True)
class _ChainRuns:
    """K distinct chains of one length n, and the runs along them.

    `steps` (K, n) has the rows of `_Steps` along each chain, from its first edge to its last;
    `turned` (K,) marks chains that run against the sides of these rows; `side`, `first`, `chain`
    and `reversed` are those of `Chains`.
    """

    steps: Ints
    turned: Bools
    side: Ints
    first: Ints
    chain: Ints
    reversed: Bools


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
    groups: list[_ChainRuns] = []
    # Sides of several edges, by their numbers of edges.
    for length in (np.bincount(count)[2:].nonzero()[0] + 2).tolist():
        sides = (count == length).nonzero()[0]
        rows = begin[sides, None] + np.arange(length)
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
        side = steps.side[rows[is_alike, 0]]
        groups.append(
            _ChainRuns(leaders, turned[chosen], side, np.zeros_like(side), chain, turned[is_alike])
        )
    return _join_chains(steps, [_list_single_chains(steps, single), *groups])


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


def _list_single_chains(steps: _Steps, single: Bools) -> _ChainRuns:
    """Edges as separate chains, in their directions."""
    rows = single.nonzero()[0]
    first, chain = unique_values(steps.edge[rows])
    leaders, turned = rows[first], steps.backward[rows]
    return _ChainRuns(
        leaders[:, None], turned[first], steps.side[rows], steps.span[rows], chain, turned
    )


def _join_chains(steps: _Steps, groups: list[_ChainRuns]) -> Chains:
    """All chains in one list, and all runs in the order of their sides."""
    edges, backward, corners, chain = [], [], [], []
    length = np.repeat(
        [runs.steps.shape[1] for runs in groups], [len(runs.steps) for runs in groups]
    )
    count = 0
    for runs in groups:
        against = runs.turned[:, None]
        begin = np.where(against, steps.end[runs.steps], steps.begin[runs.steps])
        last = runs.steps[:, -1:]
        end = np.where(against, steps.begin[last], steps.end[last])
        edges.append(steps.edge[runs.steps].ravel())
        backward.append((steps.backward[runs.steps] ^ against).ravel())
        corners.append(np.concatenate([begin, end], axis=1).ravel())
        chain.append(runs.chain + count)
        count += len(runs.steps)
    side, first, turned = (
        np.concatenate([getattr(runs, name) for runs in groups])
        for name in ("side", "first", "reversed")
    )
    order = np.lexsort((first, side))
    return Chains(
        np.concatenate([[0], np.cumsum(length)]).astype(np.intp),
        np.concatenate(edges),
        np.concatenate(backward),
        np.concatenate(corners),
        side[order],
        first[order],
        np.concatenate(chain)[order],
        turned[order],
    )
