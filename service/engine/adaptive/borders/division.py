"""Where chains are divided, by a rule that knows nothing but the chain itself and the goal.

Only where a goal bounds angles, the normals of all patches along the chain count, too: then the
places depend on what is meshed together.

A chain of several edges is tried as one straight segment, then cut at the knot in the middle, and
so on; an edge is halved. All is done in coordinates about the chain's first point and in its own
direction, number by number: hence the same places and the same points, bit for bit, wherever the
chain turns up, whatever else is divided with it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.chunks import runs as runs_of
from service.bases.homogeneous import homogeneous
from service.engine.adaptive.borders.chains import Chains
from service.engine.adaptive.borders.side_normals import SideNormals
from service.engine.adaptive.borders.straightness import (
    CORNERS,
    Place,
    Verdict,
    judged,
    refuse,
    rounding,
    shapes,
    tangents_of,
)
from service.engine.adaptive.cutting.turning import FALLING, chord_of
from service.engine.adaptive.limits import Budget
from service.engine.bounds.chords import halves, projected
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal
from service.engine.mesh.seams import Seams

CHUNK = 1 << 18
"""Coordinates of nets that are worked on at a time."""

ROUGH = 5
"""An edge may be halved this often for its normals, whether that helps or not: nothing that is only
narrow is taken for a crease."""

AHEAD, LEVELS = 1 << 11, 4
"""Up to 2^11 coordinates of nets, 4 levels of halves are judged in one call."""


@dataclass(frozen=True, eq=False, slots=True)
class Division:
    """The vertices of chains: of chain c `start[c]` to `start[c+1]`, both ends among them.

    Attributes
    ----------
    start : ndarray of int, shape (C+1,)
    at : ndarray of int, shape (D,)
        Places along the chain, rising; an edge is SPAN units long.
    corner : ndarray of int, shape (D,)
        The corner that the vertex is, or -1 inside an edge.
    points : ndarray of float64, shape (D, 3)
        Model coordinates; of no use at corners.
    """

    start: Ints
    at: Ints
    corner: Ints
    points: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class _Curves:
    """Chains of edges of one degree: nets about the first point of the chain, in its direction.

    Attributes
    ----------
    chain, uses : ndarray of int, shape (C,)
        Their numbers among all chains, and how many sides run along each.
    start : ndarray of int, shape (C+1,)
        Chain c is the edges (rows of `nets`) `start[c]` to `start[c+1]`.
    owner : ndarray of int, shape (N,)
        Which of the chains each edge belongs to.
    nets : ndarray of float64, shape (N, n+1, 3), or (N, n+1, 4) if homogeneous
    origin, slack : ndarray of float64, shapes (C, 3) and (C,)
        The first points, and what rounding may do to the nets.
    edge, backward : ndarray of int and of bool, shape (N,)
        The number of each edge, and whether the chain runs against it.
    normals : SideNormals or None
        Those of the patches on both sides, where they count.
    """

    chain: Ints
    uses: Ints
    start: Ints
    owner: Ints
    nets: FloatArray
    origin: FloatArray
    slack: FloatArray
    edge: Ints
    backward: Bools
    normals: SideNormals | None

    def turns(
        self, rows: Ints, begin: FloatArray, end: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """How far normals turn along parts of edges (`SideNormals.turns`); None without angle."""
        if self.normals is None:
            return None
        return self.normals.turns(self.edge[rows], self.backward[rows], begin, end)


@dataclass(frozen=True, eq=False, slots=True)
class _Runs:
    """Edges `first` to `last`, the one not included, that `cuts` led to.

    `again` says that they must be cut, whatever they are.
    """

    first: Ints
    last: Ints
    cuts: Ints
    again: Bools

    def where(self, mask: Bools) -> "_Runs":
        """Some of them."""
        return _Runs(self.first[mask], self.last[mask], self.cuts[mask], self.again[mask])

    def halves(self, closed: Bools) -> "_Runs":
        """All first halves and all second ones, cut at the knot in the middle."""
        middle = (self.first + self.last) // 2
        return _Runs(
            np.concatenate([self.first, middle]),
            np.concatenate([middle, self.last]),
            np.tile(self.cuts + 1, 2),
            np.tile(closed, 2),
        )


@dataclass(frozen=True, eq=False, slots=True)
class _Parts:
    """Parts of edges (rows) that begin at `at`, all halved `depth` times, with their nets."""

    row: Ints
    at: Ints
    cuts: Ints
    again: Bools
    depth: int
    nets: FloatArray

    def take(self, index: Ints) -> "_Parts":
        """Some of them."""
        return _Parts(
            self.row[index],
            self.at[index],
            self.cuts[index],
            self.again[index],
            self.depth,
            self.nets[index],
        )

    def halves(self, closed: Bools | None = None) -> "_Parts":
        """All first halves and all second ones."""
        again = np.zeros(2 * len(self.row), dtype=bool) if closed is None else np.tile(closed, 2)
        return _Parts(
            np.tile(self.row, 2),
            np.concatenate([self.at, self.at + (SPAN >> (self.depth + 1))]),
            np.tile(self.cuts + 1, 2),
            again,
            self.depth + 1,
            np.concatenate(halves(self.nets)),
        )


class _Pieces:
    """Counts pieces, each for every side it lies on, and refuses too many triangles.

    A face of k pieces has at least k − 2 triangles.
    """

    def __init__(self, faces: int, most: int) -> None:
        self.triangles, self.budget = -2 * faces, Budget(most)

    def add(self, uses: Ints) -> None:
        """So many pieces more."""
        self.triangles += int(uses.sum())
        self.budget.count(self.triangles)


def divide(
    chains: Chains,
    seams: Seams,
    goal: Goal,
    faces: int,
    most: int,
    *,
    normals: SideNormals | None,
) -> Division:
    """Divides every chain into pieces that may be straight.

    Parameters
    ----------
    faces : int
        How many faces the chains are sides of.
    most : int
        Triangles that are allowed.
    normals : SideNormals or None
        Normals that are to turn no further than the angle of the goal between two vertices.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small`.
    TooLarge
        `too_many_triangles`, as soon as the sides alone need more.
    """
    pieces = _Pieces(faces, most)
    pieces.add(chains.uses)
    length = chains.length
    every = np.arange(len(length))
    parts = [(every, length * SPAN, np.zeros((len(every), 3)))]
    parts += [_divided(curves, goal, pieces) for curves in _curves(chains, seams, normals)]
    chain, at, points = (np.concatenate(found) for found in zip(*parts, strict=True))
    order = np.lexsort((at, chain))
    chain, at = chain[order], at[order]
    knot = chains.start[chain] + chain + at // SPAN
    start = np.concatenate([[0], np.cumsum(np.bincount(chain, minlength=len(every)))])
    corner = np.where(at % SPAN == 0, chains.corner[knot], -1)
    return Division(start.astype(np.intp), at, corner, points[order])


def _divided(curves: _Curves, goal: Goal, pieces: _Pieces) -> tuple[Ints, Ints, FloatArray]:
    """Chains, places and points of all pieces, in any order."""
    rows, single = _cut_at_knots(curves, goal, pieces)
    found = [(rows, np.zeros_like(rows), curves.nets[rows, 0])]
    found += _halved(curves, single, goal, pieces)
    row, at, nets = (np.concatenate(parts) for parts in zip(*found, strict=True))
    owner = curves.owner[row]
    points = projected(nets[:, None], 3)[:, 0] + curves.origin[owner]
    return curves.chain[owner], at + (row - curves.start[owner]) * SPAN, points


def _cut_at_knots(curves: _Curves, goal: Goal, pieces: _Pieces) -> tuple[Ints, _Runs]:
    """Chains cut at knots until they may be straight or are single edges.

    Returns
    -------
    rows : ndarray of int
        Edges at which straight pieces of several begin.
    single : _Runs
        Single edges that are still to be judged.
    """
    zero = np.zeros(len(curves.chain), dtype=np.intp)
    runs = _Runs(curves.start[:-1], curves.start[1:], zero, zero > 0)
    straight, single = [], []
    while True:
        several = runs.last - runs.first > 1
        single.append(runs.where(~several))
        runs = runs.where(several)
        if not len(runs.first):
            break
        verdict = _judged_runs(curves, runs, goal)
        cut = verdict.cut | runs.again
        straight.append(runs.first[~cut])
        runs = runs.where(cut)
        pieces.add(curves.uses[curves.owner[runs.first]])
        runs = runs.halves(verdict.closed[cut])
    return (
        np.concatenate([zero[:0], *straight]),
        _Runs(
            np.concatenate([run.first for run in single]),
            np.concatenate([run.last for run in single]),
            np.concatenate([run.cuts for run in single]),
            np.concatenate([run.again for run in single]),
        ),
    )


def _judged_runs(curves: _Curves, runs: _Runs, goal: Goal) -> Verdict:
    """Whether runs of edges may be straight: the nets of all their edges against the one chord."""
    count = runs.last - runs.first
    begin = np.cumsum(count) - count
    run = np.repeat(np.arange(len(count)), count)
    rows = np.arange(len(run)) + (runs.first - begin)[run]
    owner = curves.owner[runs.first]
    slack = curves.slack[owner]
    ends = np.stack([curves.nets[runs.first, 0], curves.nets[runs.last - 1, -1]], axis=1)
    tangents = None
    if goal.angle < inf:
        first, _ = tangents_of(curves.nets[runs.first], slack)
        _, last = tangents_of(curves.nets[runs.last - 1], slack)
        tangents = first[run], last[run]
    chords = projected(ends, 3)
    shares = None
    if goal.two_sided:
        # Spans are of one length: to each its share of the chord.
        step = (chords[:, 1] - chords[:, 0]) / count[:, None]
        number = (np.arange(len(run)) - begin[run])[:, None]
        first = chords[run, 0] + number * step[run]
        shares = np.stack([first, first + step[run]], axis=1)
    found = shapes(curves.nets[rows], chords[run], shares=shares, tangents=tangents)
    found = found.together(begin)
    verdict = judged(found, goal, Place(curves.origin[owner], slack), runs.cuts)
    refuse(verdict, slack, goal)
    turns = curves.turns(rows, np.zeros(len(rows)), np.ones(len(rows)))
    if turns is None:
        return verdict
    far = np.add.reduceat(turns[1], begin) > chord_of(goal.angle)
    return replace(verdict, cut=verdict.cut | far)


def _halved(
    curves: _Curves, single: _Runs, goal: Goal, pieces: _Pieces
) -> list[tuple[Ints, Ints, FloatArray]]:
    """Single edges halved until the parts may be straight: rows, places and first points of these.

    One block of parts after the other, the last ones first, so that few wait at a time.
    """
    block = max(1, CHUNK // curves.nets[0].size) if len(curves.nets) else 1
    found: list[tuple[Ints, Ints, FloatArray]] = []
    waiting = []
    for begin, end in runs_of(len(single.first), block):
        row = single.first[begin:end]
        cuts, again = single.cuts[begin:end], single.again[begin:end]
        waiting.append(_Parts(row, np.zeros_like(row), cuts, again, 0, curves.nets[row]))
    while waiting:
        levels = [waiting.pop()]
        while len(levels) < LEVELS and 2 * levels[-1].nets.size <= AHEAD:
            levels.append(levels[-1].halves())
        verdict = _judged_parts(curves, levels, goal)
        # Of every level those are real whose wholes were cut.
        real, closed, begin = np.ones(len(levels[0].row), dtype=bool), np.zeros(1, dtype=bool), 0
        for parts in levels:
            rows = slice(begin, begin + len(parts.row))
            begin = rows.stop
            own = verdict.take(rows, real)
            refuse(own, curves.slack[curves.owner[parts.row]], goal)
            cut = (own.cut | parts.again | closed) & real
            done = (real & ~cut).nonzero()[0]
            found.append((parts.row[done], parts.at[done], parts.nets[done, 0]))
            pieces.add(curves.uses[curves.owner[parts.row[cut]]])
            last = parts, cut, own.closed
            real, closed = np.tile(cut, 2), np.tile(own.closed, 2)
        parts, cut, closed = last
        left = cut.nonzero()[0]
        for first, end in runs_of(len(left), max(1, block // 2)):
            some = left[first:end]
            waiting.append(parts.take(some).halves(closed[some]))
    return found


def _judged_parts(curves: _Curves, levels: list[_Parts], goal: Goal) -> Verdict:
    """Whether parts of edges, of several levels, may be straight."""
    if len(levels) == 1:
        nets, row, cuts = levels[0].nets, levels[0].row, levels[0].cuts
    else:
        columns = [(parts.nets, parts.row, parts.cuts) for parts in levels]
        nets, row, cuts = (np.concatenate(column) for column in zip(*columns, strict=True))
    depth = np.repeat([parts.depth for parts in levels], [len(parts.row) for parts in levels])
    owner = curves.owner[row]
    slack = curves.slack[owner]
    ends = projected(nets[:, [0, -1]], 3)
    tangents = tangents_of(nets, slack) if goal.angle < inf else None
    found = shapes(nets, ends, shares=ends if goal.two_sided else None, tangents=tangents)
    verdict = judged(found, goal, Place(curves.origin[owner], slack), cuts, depth)
    first = np.concatenate([parts.at for parts in levels]) / SPAN
    turns = curves.turns(row, first, first + 0.5**depth)
    if turns is None:
        return verdict
    half, whole = turns
    far = (whole > chord_of(goal.angle)) & ((depth < ROUGH) | (half <= FALLING * whole))
    return replace(verdict, cut=verdict.cut | (far & (depth < CORNERS)))


def _curves(chains: Chains, seams: Seams, normals: SideNormals | None) -> Iterator[_Curves]:
    """All chains, those of one degree together."""
    kind, place = (np.empty(len(seams.users), dtype=np.intp) for _ in range(2))
    for number, group in enumerate(seams.curves):
        kind[group.ids], place[group.ids] = number, np.arange(len(group.ids))
    kinds = kind[chains.edge]
    uses, length = chains.uses, chains.length
    for number, group in enumerate(seams.curves):
        rows = (kinds == number).nonzero()[0]
        chain = (kinds[chains.start[:-1]] == number).nonzero()[0]
        owner = np.repeat(np.arange(len(chain)), length[chain])
        origin = seams.corner_points[chains.corner[chains.start[chain] + chain]]
        chosen, turned = place[chains.edge[rows]], chains.backward[rows]
        points = group.points[chosen]
        points[turned] = points[turned, ::-1]
        points -= origin[owner, None]
        weights = None
        if group.weights is not None:
            weights = group.weights[chosen]
            weights[turned] = weights[turned, ::-1]
        size = np.zeros(len(chain))
        np.maximum.at(size, owner, np.abs(points).max(axis=(1, 2)))
        far = np.abs(origin).max(axis=1) + size
        yield _Curves(
            chain,
            uses[chain],
            np.concatenate([[0], np.cumsum(length[chain])]).astype(np.intp),
            owner,
            homogeneous(points, weights),
            origin,
            rounding(size, far, points.shape[1] - 1),
            chains.edge[rows],
            chains.backward[rows],
            normals,
        )
