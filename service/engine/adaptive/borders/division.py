"""The division of chains, which depends on the chain itself and on the goal alone.

Goals with an angle are an exception: then the normals of all patches along the chain count too, and
the places depend on the models that are meshed together.

A chain of several edges is cut at the knot in the middle, and again, until each piece may be a
straight segment; single edges are halved. All arithmetic is elementwise, in coordinates about the
first point of the chain and in the direction of the chain. So a chain has the same places and
points, bit for bit, in every model.
"""

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_runs
from service.engine.adaptive.borders.chains import Chains
from service.engine.adaptive.borders.curve_shapes import find_tangents, measure_shapes
from service.engine.adaptive.borders.curves import (
    AHEAD,
    Curves,
    SideNormals,
    build_halving_tree,
    group_curves,
    halve_nets,
)
from service.engine.adaptive.borders.flatness import (
    MOST_HALVINGS_FOR_ANGLE,
    CutDecision,
    cut_at_knots,
    decide_cuts,
    refuse_hopeless,
)
from service.engine.adaptive.cutting.normal_variation import FALLING, find_chord
from service.engine.adaptive.limits import SidePieces
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal
from service.engine.connectivity.seams import Seams
from service.engine.vectors import project

CHUNK = 1 << 18
"""Coordinates of the nets in one block."""

ROUGH = 5
"""If its normals turn too far, an edge is halved this number of times even if that does not help,
so that a narrow bend does not count as a crease."""


@dataclass(frozen=True, eq=False, slots=True)
class Division:
    """The vertices of chains: `start[c] : start[c+1]` are those of chain c, its two ends included.

    Attributes
    ----------
    start : ndarray of int, shape (C+1,)
    at : ndarray of int, shape (D,)
        Places along the chain, in ascending order; an edge is SPAN units long.
    corner : ndarray of int, shape (D,)
        The corner at the vertex, or -1 inside an edge.
    points : ndarray of float64, shape (D, 3)
        Model coordinates; not valid at corners.
    """

    start: Ints
    at: Ints
    corner: Ints
    points: FloatArray


def divide_chains(
    chains: Chains,
    seams: Seams,
    goal: Goal,
    faces: int,
    most: int,
    *,
    normals: SideNormals | None,
) -> Division:
    """Divide every chain into pieces that may be straight.

    `faces` is the number of faces that have the chains as sides; for the other parameters and the
    errors see `divide_border`.
    """
    pieces = SidePieces(faces, most)
    pieces.add(chains.uses)
    length = chains.length
    all_chains = np.arange(len(length))
    # The last vertex of each chain; all other vertices are the first points of pieces.
    parts = [(all_chains, length * SPAN, np.zeros((len(all_chains), 3)))]
    parts += [
        _divide_curves(curves, goal, pieces) for curves in group_curves(chains, seams, normals)
    ]
    chain, at, points = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    order = np.lexsort((at, chain))
    chain, at = chain[order], at[order]
    # Every chain has one corner more than edges.
    knot = chains.start[chain] + chain + at // SPAN
    start = np.concatenate([[0], np.cumsum(np.bincount(chain, minlength=len(all_chains)))])
    corner = np.where(at % SPAN == 0, chains.corner[knot], -1)
    return Division(start.astype(np.intp), at, corner, points[order])


def _divide_curves(curves: Curves, goal: Goal, pieces: SidePieces) -> tuple[Ints, Ints, FloatArray]:
    """The chain, the place and the first point of each piece, in any order."""
    several = curves.start[1:] - curves.start[:-1] > 1
    row = curves.start[:-1][~several]
    cuts, forced = np.zeros_like(row), np.zeros(len(row), dtype=bool)
    straight_parts: list[tuple[Ints, Ints, FloatArray]] = []
    if several.any():
        straight, *singles = cut_at_knots(curves, several.nonzero()[0], goal, pieces)
        row, cuts, forced = map(np.concatenate, zip((row, cuts, forced), singles, strict=True))
        straight_parts.append((straight, np.zeros_like(straight), curves.nets[straight, 0]))
    straight_parts += halve_edges(curves, (row, cuts, forced), goal, pieces)
    row, at, first_points = (
        np.concatenate(columns) for columns in zip(*straight_parts, strict=True)
    )
    owner = curves.owner[row]
    points = project(first_points[:, None], -1)[:, 0] + curves.origin[owner]
    return curves.chain[owner], at + (row - curves.start[owner]) * SPAN, points


@dataclass(frozen=True, eq=False, slots=True)
class _EdgeParts:
    """M parts of edges (`row`) that begin at the places `at`, and their nets.

    All are results of `depth` halvings of their edges. `cuts` (M,) is the number of cuts, at knots
    too, that led to each part; parts marked in `forced` must be cut, because each is a half of a
    closed piece.
    """

    row: Ints
    at: Ints
    cuts: Ints
    forced: Bools
    depth: int
    nets: FloatArray


def halve_edges(
    curves: Curves, single: tuple[Ints, Ints, Bools], goal: Goal, pieces: SidePieces
) -> list[tuple[Ints, Ints, FloatArray]]:
    """Halve single edges until their parts may be straight.

    Blocks of parts are halved one after the other, the last ones first, so that few parts wait.
    `single` has the last three results of `cut_at_knots`. The result is a list of (edges, places,
    first control points) of straight parts.
    """
    block = max(1, CHUNK // curves.nets[0].size)
    straight_parts: list[tuple[Ints, Ints, FloatArray]] = []
    waiting: list[_EdgeParts] = []
    for begin, end in row_runs(len(single[0]), block):
        row, cuts, forced = single[0][begin:end], single[1][begin:end], single[2][begin:end]
        waiting.append(_EdgeParts(row, np.zeros_like(row), cuts, forced, 0, curves.nets[row]))
    while waiting:
        parts = waiting.pop()
        # L levels have 2^L − 1 times the coordinates of the first: the most that `AHEAD` allows.
        tree = build_halving_tree(len(parts.row), (AHEAD // parts.nets.size + 1).bit_length() - 1)
        at, nets = halve_nets(tree, parts.at, parts.depth, parts.nets)
        # The part of the first level that contains each part; all levels have the same order.
        root = np.arange(len(at)) % len(parts.row)
        row, cuts = parts.row[root], parts.cuts[root] + tree.depth
        decision, slack = _judge_parts(
            curves, row, at, nets, goal, cuts=cuts, depth=parts.depth + tree.depth
        )
        exists, cut = tree.walk(decision.cut, decision.closed, parts.forced)
        refuse_hopeless(decision, exists, slack)
        pieces.add(curves.uses[curves.owner[row[cut]]])
        done = (exists & ~cut).nonzero()[0]
        straight_parts.append((row[done], at[done], nets[done, 0]))
        # The halves of the parts of the last level that must be cut are judged later.
        last = tree.level[-1]
        open_ = last.start + cut[last].nonzero()[0]
        depth = parts.depth + len(tree.level)
        for begin, end in row_runs(len(open_), max(1, block // 2)):
            rows = open_[begin:end]
            at_both, both = halve_nets(
                build_halving_tree(len(rows), 2), at[rows], depth - 1, nets[rows]
            )
            halves = slice(len(rows), None)  # the second level; the first is the parts themselves
            half_row, half_cuts = np.tile(row[rows], 2), np.tile(cuts[rows] + 1, 2)
            forced = np.tile(decision.closed[rows], 2)  # both halves of a closed part must be cut
            waiting.append(
                _EdgeParts(half_row, at_both[halves], half_cuts, forced, depth, both[halves])
            )
    return straight_parts


def _judge_parts(
    curves: Curves,
    row: Ints,
    at: Ints,
    nets: FloatArray,
    goal: Goal,
    *,
    cuts: Ints,
    depth: Ints,
) -> tuple[CutDecision, FloatArray]:
    """Which parts of edges must be cut, and bounds (M,) of the rounding of their nets.

    `row`, `at`, `nets` and `cuts` are as in `_EdgeParts`; `depth` (M,) is the number of halvings
    that led from the edge to each part.
    """
    owner = curves.owner[row]
    slack = curves.slack[owner]
    ends = project(nets[:, [0, -1]], -1)
    tangents = find_tangents(nets, slack) if goal.angle < inf else None
    shapes = measure_shapes(
        nets, ends, chord_parts=ends if goal.two_sided else None, tangents=tangents
    )
    decision = decide_cuts(shapes, goal, cuts, depth, origin=curves.origin[owner], slack=slack)
    begin = at / SPAN
    if curves.normals is None:
        return decision, slack
    # Where normals turn too far, short parts are cut only if halving reduces the turn (`FALLING`).
    half, total = curves.normals.measure_turns(
        curves.edge[row], curves.backward[row], begin, begin + 0.5**depth
    )
    far = (total > find_chord(goal.angle)) & ((depth < ROUGH) | (half <= FALLING * total))
    return replace(decision, cut=decision.cut | (far & (depth < MOST_HALVINGS_FOR_ANGLE))), slack
