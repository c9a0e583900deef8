"""Chains of several edges, cut at the knot in the middle until each piece may be straight."""

from dataclasses import replace
from math import inf

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.adaptive.borders.curve_shapes import find_tangents, measure_shapes
from service.engine.adaptive.borders.curves import AHEAD, Curves, halve_runs
from service.engine.adaptive.borders.flatness import (
    CutDecision,
    decide_cuts,
    refuse_hopeless,
)
from service.engine.adaptive.cutting.normal_variation import find_chord
from service.engine.adaptive.limits import SidePieces
from service.engine.bounds.chords import project_nets
from service.engine.bounds.goal import Goal


def cut_at_knots(
    curves: Curves, chains: Ints, goal: Goal, pieces: SidePieces
) -> tuple[Ints, Ints, Ints, Bools]:
    """Chains of several edges cut at the knot in the middle until they may be straight.

    Returns
    -------
    straight : ndarray of int
        Edges at which straight pieces of several begin.
    row, cuts, again : ndarrays of int, int and bool
        Single edges that remain to be halved, the cuts that led to them, and whether they must be
        cut in any case.
    """
    first, last = curves.start[chains], curves.start[chains + 1]
    cuts, again = np.zeros_like(first), np.zeros(len(first), dtype=bool)
    rounds: list[tuple[Ints, Ints, Ints, Bools]] = []
    while len(first):
        tree, first, last, cuts = halve_runs(first, last, cuts, AHEAD // curves.nets[0].size)
        several = last - first > 1
        cut, closed = np.zeros((2, len(several)), dtype=bool)
        decision, slack = _judge_runs(curves, first[several], last[several], cuts[several], goal)
        cut[several], closed[several] = decision.cut, decision.closed
        real, cut, must = tree.walk(cut, closed, again)
        refuse_hopeless(decision, real[several], slack, goal)
        straight, single = (real & several & ~cut).nonzero()[0], (real & ~several).nonzero()[0]
        rounds.append((first[straight], first[single], cuts[single], must[single]))
        cut &= several
        pieces.add(curves.uses[curves.owner[first[cut]]])
        end = tree.level[-1]
        rest = end.start + cut[end].nonzero()[0]
        middle = (first[rest] + last[rest]) // 2
        first, last = np.append(first[rest], middle), np.append(middle, last[rest])
        cuts, again = np.tile(cuts[rest] + 1, 2), np.tile(closed[rest], 2)
    straight, row, cuts, again = (np.concatenate(parts) for parts in zip(*rounds, strict=True))
    return straight, row, cuts, again


def _judge_runs(
    curves: Curves, first: Ints, last: Ints, cuts: Ints, goal: Goal
) -> tuple[CutDecision, FloatArray]:
    """Whether runs of edges may be straight: the nets of all edges of a run against one chord.

    Also returns bounds of the rounding of the nets of each run.
    """
    count = last - first
    begin = np.cumsum(count) - count
    run, rows = expand_runs(count, first)
    owner = curves.owner[first]
    slack = curves.slack[owner]
    ends = np.stack([curves.nets[first, 0], curves.nets[last - 1, -1]], axis=1)
    tangents = None
    if goal.angle < inf:
        into, _ = find_tangents(curves.nets[first], slack)
        _, out = find_tangents(curves.nets[last - 1], slack)
        tangents = into[run], out[run]
    chords = project_nets(ends, 3)
    shares = None
    if goal.two_sided:
        # Spans are of one length: to each its share of the chord.
        step = (chords[:, 1] - chords[:, 0]) / count[:, None]
        number = (np.arange(len(run)) - begin[run])[:, None]
        low = chords[run, 0] + number * step[run]
        shares = np.stack([low, low + step[run]], axis=1)
    shapes = measure_shapes(curves.nets[rows], chords[run], shares=shares, tangents=tangents)
    decision = decide_cuts(
        shapes.combine_runs(begin), goal, cuts, origin=curves.origin[owner], slack=slack
    )
    turns = curves.measure_turns(rows, np.zeros(len(rows)), np.ones(len(rows)))
    if turns is not None:
        far = np.add.reduceat(turns[1], begin) > find_chord(goal.angle)
        decision = replace(decision, cut=decision.cut | far)
    return decision, slack
