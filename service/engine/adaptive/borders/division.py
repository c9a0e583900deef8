"""Where chains are divided, by a rule that knows nothing but the chain itself and the goal.

Only where a goal bounds angles, the normals of all patches along the chain count, too: then the
places depend on what is meshed together.

A chain of several edges is tried as one straight segment, then cut at the knot in the middle, and
so on; an edge is halved. All is done in coordinates about the chain's first point and in its own
direction, number by number: hence the same places and the same points, bit for bit, wherever the
chain turns up, whatever else is divided with it.
"""

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_runs as runs_of
from service.engine.adaptive.borders.chains import Chains
from service.engine.adaptive.borders.curves import (
    Curves,
    build_halving_tree,
    group_curves,
    halve_nets,
    halve_runs,
)
from service.engine.adaptive.borders.flatness import (
    CORNERS,
    CutDecision,
    Place,
    decide_cuts,
    find_tangents,
    measure_shapes,
    refuse_hopeless,
)
from service.engine.adaptive.borders.side_normals import SideNormals
from service.engine.adaptive.cutting.normal_variation import FALLING, find_chord
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.chords import project
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal
from service.engine.mesh.seams import Seams

CHUNK = 1 << 18
"""Coordinates of nets that are worked on at a time."""

ROUGH = 5
"""An edge may be halved this often for its normals, whether that helps or not: nothing that is only
narrow is taken for a crease."""

AHEAD = 1 << 11
"""Coordinates of nets up to which pieces, their halves, halves of these … are judged at once."""


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


class _PieceCounter:
    """Counts pieces, each for every side it lies on, and refuses too many triangles.

    A face of k pieces has at least k − 2 triangles.
    """

    def __init__(self, faces: int, most: int) -> None:
        self.triangles, self.limits = -2 * faces, MeshLimits(most)

    def add(self, uses: Ints) -> None:
        """So many pieces more."""
        self.triangles += int(uses.sum())
        self.limits.count(self.triangles)


def divide_chains(
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
    pieces = _PieceCounter(faces, most)
    pieces.add(chains.uses)
    length = chains.length
    every = np.arange(len(length))
    parts = [(every, length * SPAN, np.zeros((len(every), 3)))]
    parts += [
        _divide_curves(curves, goal, pieces) for curves in group_curves(chains, seams, normals)
    ]
    chain, at, points = (np.concatenate(found) for found in zip(*parts, strict=True))
    order = np.lexsort((at, chain))
    chain, at = chain[order], at[order]
    knot = chains.start[chain] + chain + at // SPAN
    start = np.concatenate([[0], np.cumsum(np.bincount(chain, minlength=len(every)))])
    corner = np.where(at % SPAN == 0, chains.corner[knot], -1)
    return Division(start.astype(np.intp), at, corner, points[order])


def _divide_curves(
    curves: Curves, goal: Goal, pieces: _PieceCounter
) -> tuple[Ints, Ints, FloatArray]:
    """Chains, places and points of all pieces, in any order."""
    several = curves.start[1:] - curves.start[:-1] > 1
    row = curves.start[:-1][~several]
    cuts, again = np.zeros_like(row), np.zeros(len(row), dtype=bool)
    found: list[tuple[Ints, Ints, FloatArray]] = []
    if several.any():
        straight, *more = _cut_at_knots(curves, several.nonzero()[0], goal, pieces)
        row, cuts, again = map(np.concatenate, zip((row, cuts, again), more, strict=True))
        found.append((straight, np.zeros_like(straight), curves.nets[straight, 0]))
    found += _halve_edges(curves, (row, cuts, again), goal, pieces)
    row, at, nets = (np.concatenate(columns) for columns in zip(*found, strict=True))
    owner = curves.owner[row]
    points = project(nets[:, None], 3)[:, 0] + curves.origin[owner]
    return curves.chain[owner], at + (row - curves.start[owner]) * SPAN, points


def _cut_at_knots(
    curves: Curves, chains: Ints, goal: Goal, pieces: _PieceCounter
) -> tuple[Ints, Ints, Ints, Bools]:
    """Chains of several edges cut at the knot in the middle until they may be straight.

    Returns
    -------
    straight : ndarray of int
        Edges at which straight pieces of several begin.
    row, cuts, again : ndarrays of int, int and bool
        Single edges that are still to be judged, the cuts that led to them, and whether they must
        be cut, whatever they are.
    """
    first, last = curves.start[chains], curves.start[chains + 1]
    cuts, again = np.zeros_like(first), np.zeros(len(first), dtype=bool)
    found: list[tuple[Ints, Ints, Ints, Bools]] = []
    while len(first):
        tree, first, last, cuts = halve_runs(first, last, cuts, AHEAD // curves.nets[0].size)
        several = last - first > 1
        cut, closed = np.zeros((2, len(several)), dtype=bool)
        verdict, slack = _judge_runs(curves, first[several], last[several], cuts[several], goal)
        cut[several], closed[several] = verdict.cut, verdict.closed
        real, cut, must = tree.walk(cut, closed, again)
        refuse_hopeless(verdict, real[several], slack, goal)
        straight, single = (real & several & ~cut).nonzero()[0], (real & ~several).nonzero()[0]
        found.append((first[straight], first[single], cuts[single], must[single]))
        cut &= several
        pieces.add(curves.uses[curves.owner[first[cut]]])
        end = tree.level[-1]
        rest = end.start + cut[end].nonzero()[0]
        middle = (first[rest] + last[rest]) // 2
        first, last = np.append(first[rest], middle), np.append(middle, last[rest])
        cuts, again = np.tile(cuts[rest] + 1, 2), np.tile(closed[rest], 2)
    straight, row, cuts, again = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return straight, row, cuts, again


def _judge_runs(
    curves: Curves, first: Ints, last: Ints, cuts: Ints, goal: Goal
) -> tuple[CutDecision, FloatArray]:
    """Whether runs of edges may be straight: the nets of all their edges against the one chord.

    And what rounding may have done to them.
    """
    count = last - first
    begin = np.cumsum(count) - count
    run = np.repeat(np.arange(len(count)), count)
    rows = np.arange(len(run)) + (first - begin)[run]
    owner = curves.owner[first]
    slack = curves.slack[owner]
    ends = np.stack([curves.nets[first, 0], curves.nets[last - 1, -1]], axis=1)
    tangents = None
    if goal.angle < inf:
        into, _ = find_tangents(curves.nets[first], slack)
        _, out = find_tangents(curves.nets[last - 1], slack)
        tangents = into[run], out[run]
    chords = project(ends, 3)
    shares = None
    if goal.two_sided:
        # Spans are of one length: to each its share of the chord.
        step = (chords[:, 1] - chords[:, 0]) / count[:, None]
        number = (np.arange(len(run)) - begin[run])[:, None]
        low = chords[run, 0] + number * step[run]
        shares = np.stack([low, low + step[run]], axis=1)
    found = measure_shapes(curves.nets[rows], chords[run], shares=shares, tangents=tangents)
    verdict = decide_cuts(found.combine_runs(begin), goal, Place(curves.origin[owner], slack), cuts)
    turns = curves.measure_turns(rows, np.zeros(len(rows)), np.ones(len(rows)))
    if turns is not None:
        far = np.add.reduceat(turns[1], begin) > find_chord(goal.angle)
        verdict = replace(verdict, cut=verdict.cut | far)
    return verdict, slack


@dataclass(frozen=True, eq=False, slots=True)
class _Parts:
    """Parts of edges (rows) that begin at `at`, all halved `depth` times, with their nets.

    `cuts` led to each, and those must be cut that are to be cut `again`; all (M,).
    """

    row: Ints
    at: Ints
    cuts: Ints
    again: Bools
    depth: int
    nets: FloatArray


def _halve_edges(
    curves: Curves, single: tuple[Ints, Ints, Bools], goal: Goal, pieces: _PieceCounter
) -> list[tuple[Ints, Ints, FloatArray]]:
    """Single edges halved until the parts may be straight: rows, places and first points of these.

    One block of parts after the other, the last ones first, so that few wait at a time. Given are
    rows, the cuts that led to them, and whether they must be cut, whatever they are.
    """
    block = max(1, CHUNK // curves.nets[0].size)
    found: list[tuple[Ints, Ints, FloatArray]] = []
    waiting: list[_Parts] = []
    for begin, end in runs_of(len(single[0]), block):
        row, cuts, again = single[0][begin:end], single[1][begin:end], single[2][begin:end]
        waiting.append(_Parts(row, np.zeros_like(row), cuts, again, 0, curves.nets[row]))
    while waiting:
        parts = waiting.pop()
        tree = build_halving_tree(len(parts.row), (AHEAD // parts.nets.size + 1).bit_length() - 1)
        at, nets = halve_nets(tree, parts.at, parts.depth, parts.nets)
        number = np.arange(len(at)) % len(parts.row)
        row, cuts = parts.row[number], parts.cuts[number] + tree.depth
        own = _Parts(row, at, cuts, parts.again, parts.depth, nets)
        verdict, slack = _judge_parts(curves, own, tree.depth, goal)
        real, cut, _ = tree.walk(verdict.cut, verdict.closed, parts.again)
        refuse_hopeless(verdict, real, slack, goal)
        pieces.add(curves.uses[curves.owner[row[cut]]])
        done = (real & ~cut).nonzero()[0]
        found.append((row[done], at[done], nets[done, 0]))
        last = tree.level[-1]
        left = last.start + cut[last].nonzero()[0]
        depth = parts.depth + len(tree.level)
        for begin, end in runs_of(len(left), max(1, block // 2)):
            some = left[begin:end]
            at_both, both = halve_nets(
                build_halving_tree(len(some), 2), at[some], depth - 1, nets[some]
            )
            half = slice(len(some), None)
            twice = (np.tile(column[some], 2) for column in (row, cuts + 1, verdict.closed))
            again_row, again_cuts, again = twice
            waiting.append(_Parts(again_row, at_both[half], again_cuts, again, depth, both[half]))
    return found


def _judge_parts(
    curves: Curves, parts: _Parts, further: Ints, goal: Goal
) -> tuple[CutDecision, FloatArray]:
    """Whether parts of edges, that were halved some times more, may be straight.

    And what rounding may have done to them.
    """
    owner, nets, depth = curves.owner[parts.row], parts.nets, parts.depth + further
    slack = curves.slack[owner]
    ends = project(nets[:, [0, -1]], 3)
    tangents = find_tangents(nets, slack) if goal.angle < inf else None
    found = measure_shapes(nets, ends, shares=ends if goal.two_sided else None, tangents=tangents)
    verdict = decide_cuts(found, goal, Place(curves.origin[owner], slack), parts.cuts, depth)
    begin = parts.at / SPAN
    turns = curves.measure_turns(parts.row, begin, begin + 0.5**depth)
    if turns is None:
        return verdict, slack
    half, whole = turns
    far = (whole > find_chord(goal.angle)) & ((depth < ROUGH) | (half <= FALLING * whole))
    return replace(verdict, cut=verdict.cut | (far & (depth < CORNERS))), slack
