"""Coedges joined to loops in the parameters: shifted by periods, and connected at poles.

Along a closed axis a parameter curve is only known up to periods. Each coedge is moved to where the
one before ends. At a pole the parameter along the pole is free: there the loop continues along the
side of the surface, with the material on its left, by a coedge of a degenerate edge.

Proof in docs/proofs.md: "Regions of closed surfaces".
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import count_runs, expand_runs, mark_begins
from service.engine.brep.preparation.topology import ADDED, Topology
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.piecewise import make_segments

NEAR = 1e-6
"""Ends within this share of a domain of the side of a pole are at the pole, unless they meet
beside it."""

SAME = 1e-9
"""Ends that are nearer than this share of a domain are one place."""


@dataclass(frozen=True, eq=False, slots=True)
class _Joints:
    """The joints (m,) of loops: coedge `before` ends where coedge `after` begins.

    Attributes
    ----------
    before, after : ndarray of int, shape (m,)
        Coedges that have parameter curves, in the order of `after`.
    open : ndarray of int, shape (m,)
        A coedge between them that has none, or −1.
    axis, end : ndarray of int, shape (m,)
        The side with the pole at which the joint is; axis −1 if it is at none.
    """

    before: Ints
    after: Ints
    open: Ints
    axis: Ints
    end: Ints


def join_chains(
    surfaces: ClosedSurfaces, topology: Topology, tolerance: float
) -> tuple[Topology, Ints]:
    """Move parameter curves by periods, and add the coedges of poles that are missing.

    Parameters
    ----------
    tolerance : float
        Uncertainty of the edges of poles that are added. Model units.

    Returns
    -------
    topology : Topology
    turns : ndarray of int, shape (L, 2)
        How often each loop runs around along both axes: that many periods are from its start to
        its end.
    """
    ends = topology.ends
    joints = _find_joints(surfaces, topology, ends)
    gap = ends[0, joints.after] - ends[1, joints.before]
    face = topology.coedge_faces[joints.after]
    period, is_closed = surfaces.period[face], surfaces.is_closed[face]
    move = np.where(is_closed, -np.rint(gap / period), 0.0)
    # At a pole the loop goes on with the material on its left, up to a whole period.
    rows = (joints.axis >= 0).nonzero()[0]
    free = 1 - joints.axis[rows]
    forward = _find_direction(joints.axis[rows], joints.end[rows])
    along = forward * gap[rows, free] / period[rows, free]
    is_known = topology.is_given[joints.before[rows]] & topology.is_given[joints.after[rows]]
    is_known &= (along > SAME) & (along < 1.0 + SAME)
    along += forward * move[rows, free]
    turn = np.where(along < SAME, forward, 0.0)
    new_move = np.where(is_known, 0.0, move[rows, free] + turn)
    move[rows, free] = np.where(is_closed[rows, free], new_move, 0.0)
    moves = np.zeros((len(topology.coedge_edges), 2))
    moves[joints.after] = move
    # The first joint of a loop closes it; the sum of all moves is its number of turns.
    starts = topology.loop_starts
    turns = np.add.reduceat(moves, starts, axis=0) if len(starts) else np.zeros((0, 2))
    first = _find_first(topology)
    moves[first] = 0.0
    total = np.cumsum(moves, axis=0)
    total -= np.repeat(total[starts] - moves[starts], topology.loop_counts, axis=0)
    if total.any():
        shift = total * surfaces.period[topology.coedge_faces]
        pcurves = topology.pcurves.map_points(-shift, np.ones_like(shift))
        topology = replace(topology, pcurves=pcurves)
    return _add_poles(surfaces, topology, joints, tolerance), turns.astype(np.intp)


def _find_first(topology: Topology) -> Ints:
    """The first coedge of each loop that has a parameter curve."""
    number = np.where(topology.is_open, len(topology.is_open), np.arange(len(topology.is_open)))
    first = np.minimum.reduceat(number, topology.loop_starts) if len(number) else number
    return first[first < len(number)]


def _find_joints(surfaces: ClosedSurfaces, topology: Topology, ends: FloatArray) -> _Joints:
    """All joints between coedges that have parameter curves."""
    after = (~topology.is_open).nonzero()[0]
    loop = topology.coedge_loops[after]
    is_first = mark_begins(loop)
    begins = is_first.nonzero()[0]
    runs = count_runs(begins, len(after))
    before = np.empty_like(after)
    before[1:] = after[:-1]
    before[begins] = after[begins + runs - 1]
    # An open coedge just before `after`, around the loop.
    starts, counts = topology.loop_starts[loop], topology.loop_counts[loop]
    previous = starts + (after - starts - 1) % counts
    is_open = topology.is_open[previous]
    face = topology.coedge_faces[after]
    axis, end = np.full(len(after), -1), np.zeros(len(after), np.intp)
    period = surfaces.period[face]
    gap = ends[0, after] - ends[1, before]
    gap -= np.where(surfaces.is_closed[face], np.rint(gap / period), 0.0) * period
    meets = (np.abs(gap) <= SAME * period).all(axis=1) & ~is_open
    for a in range(2):
        for e, side in enumerate((surfaces.low, surfaces.surfaces.high)):
            margin = NEAR * surfaces.period[face, a]
            near = surfaces.is_pole[face, a, e]
            near = near & (np.abs(ends[0, after, a] - side[face, a]) <= margin)
            near &= np.abs(ends[1, before, a] - side[face, a]) <= margin
            beside = np.abs(ends[0, after, a] - side[face, a]) > SAME * surfaces.period[face, a]
            near &= ~(meets & beside)
            axis[near], end[near] = a, e
    return _Joints(before, after, np.where(is_open, previous, -1), axis, end)


def _find_direction(axis: Ints, end: Ints) -> FloatArray:
    """±1: the direction of the free parameter along a side, with the domain on the left.

    The side v = least runs along +u, u = greatest along +v, v = greatest along −u, and u = least
    along −v.
    """
    return np.where((axis == 1) == (end == 0), 1.0, -1.0)


def _add_poles(
    surfaces: ClosedSurfaces, topology: Topology, joints: _Joints, tolerance: float
) -> Topology:
    """Coedges along the sides that are poles, where loops leave them out."""
    ends = topology.ends
    face = topology.coedge_faces[joints.after]
    begin, end = ends[1, joints.before], ends[0, joints.after]
    apart = (np.abs(end - begin) > SAME * surfaces.period[face]).any(axis=1)
    # A loop that runs around does not end at its start.
    rows = ((joints.axis >= 0) & apart | (joints.open >= 0)).nonzero()[0]
    if not len(rows):
        return topology
    missing = rows[joints.open[rows] < 0]
    vertex = topology.coedge_vertices[0, joints.after[missing]]
    topology, new = topology.add_edges(np.stack([vertex, vertex], axis=1), None, ADDED, tolerance)
    edge = topology.coedge_edges[np.maximum(joints.open[rows], 0)]
    edge[joints.open[rows] < 0] = new
    count = len(topology.coedge_edges)
    lines = make_segments(begin[rows], end[rows], topology.edge_ranges[edge])
    topology = topology.add_coedges(edge, np.zeros(len(rows), bool), lines)
    kept = (~topology.is_open[:count]).nonzero()[0]
    # Sort keys: a pole comes just before the coedge that follows it.
    key = np.concatenate([2 * kept + 1, 2 * joints.after[rows]])
    coedges = np.concatenate([kept, count + np.arange(len(rows))])
    order = key.argsort()
    loop = topology.coedge_loops[np.concatenate([kept, joints.after[rows]])][order]
    counts = np.bincount(loop, minlength=len(topology.loop_counts))
    return topology.take_coedges(coedges[order], topology.loop_faces, counts, topology.loop_sources)


def drop_points(topology: Topology) -> Topology:
    """The topology without loops that are poles alone: a pole inside a face needs no loop."""
    if not topology.is_open.any():
        return topology
    is_point = np.logical_and.reduceat(topology.is_open, topology.loop_starts)
    kept = (~is_point).nonzero()[0]
    _, coedges = expand_runs(topology.loop_counts[kept], topology.loop_starts[kept])
    return topology.take_coedges(
        coedges, topology.loop_faces[kept], topology.loop_counts[kept], topology.loop_sources[kept]
    )
