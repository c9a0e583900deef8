"""Edges that run through a pole of a surface, split there.

At a pole the parameter along the pole jumps, so an edge through it has no continuous parameter
curve. Its two parts have, each with an end at the pole, and the loop runs along the side of the
pole between them. All faces of the edge get the same two edges.
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.brep.preparation.arcs import CutLoops
from service.engine.brep.preparation.cut_topology import finish_cuts
from service.engine.brep.preparation.parameter_curves import make_pcurves
from service.engine.brep.preparation.topology import Topology
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.splines import Splines
from service.engine.vectors import dot, length

SAMPLES = 32
"""Points of a curve between which the nearest to a pole is looked for."""

STEPS = 20
"""Steps of Newton's method towards it."""

LAST_STEP = 2.0**-26
"""A step of at most this share of the distance of samples is the last one."""

REACH = 4.0
"""A pole is looked for near a sample if it is at most this many chords to the next sample away."""

END = 1e-4
"""A pole this close to an end of an edge, as a share of its range, is at the end."""


def split_at_poles(
    surfaces: ClosedSurfaces, topology: Topology, tolerance: float, diagonal: float
) -> Topology:
    """Split the edges that run through poles of faces for which their parameter curves are made.

    Parameters
    ----------
    tolerance : float
        Edges that come nearer to a pole run through it. Model units.
    diagonal : float
        Of the part.
    """
    is_made = ~topology.is_given | topology.is_replaced
    curve = np.where(is_made, topology.edge_curves[topology.coedge_edges], -1)
    coedges, t = find_passes(surfaces, topology.coedge_faces, topology.curves, curve, tolerance)
    if not len(coedges):
        return topology
    gaps = topology.gaps.copy()
    gaps[coedges] = np.inf  # the parts of these coedges get new curves
    work = CutLoops(surfaces, topology)
    for coedge, at in zip(coedges.tolist(), t.tolist(), strict=True):
        work.split(coedge, at)
    work.topology = replace(topology, gaps=gaps)
    return _remake(surfaces, finish_cuts(work, tolerance), diagonal)


def find_passes(
    surfaces: ClosedSurfaces, face: Ints, curves: Splines, curve: Ints, tolerance: float
) -> tuple[Ints, FloatArray]:
    """Where curves run through poles of the surfaces of faces, not at their ends.

    Parameters
    ----------
    face, curve : ndarray of int, shape (n,)
        Pairs of a face and a curve; −1 for no curve.
    tolerance : float
        The greatest distance. Model units.

    Returns
    -------
    pairs, t : ndarray of int and of float64, shape (k,)
        Numbers of pairs, and parameters of their curves.
    """
    rows = (curve >= 0).nonzero()[0]
    rows = rows[surfaces.is_pole[face[rows]].any(axis=(1, 2))]
    pairs, parameters = [rows[:0]], [np.zeros(0)]
    if not len(rows):
        return pairs[0], parameters[0]
    for axis, end in ((0, 0), (0, 1), (1, 0), (1, 1)):
        chosen = rows[surfaces.is_pole[face[rows], axis, end]]
        poles = surfaces.pole_points[face[chosen], axis, end]
        where, t = _find_near(curves, curve[chosen], poles, tolerance)
        pairs.append(chosen[where])
        parameters.append(t)
    return np.concatenate(pairs), np.concatenate(parameters)


def _find_near(
    curves: Splines, curve: Ints, poles: FloatArray, tolerance: float
) -> tuple[Ints, FloatArray]:
    """Which curves (k,) run through their pole (k, 3), not at an end, and where."""
    if not len(curve):
        return np.zeros(0, np.intp), np.zeros(0)
    count = SAMPLES * int(curves.span_count[curve].max())
    start, end = curves.start[curve], curves.end[curve]
    t = start[:, np.newaxis] + (end - start)[:, np.newaxis] * np.linspace(0, 1, count + 1)
    run = np.repeat(np.arange(len(curve)), count + 1)
    points = curves.evaluate(curve[run], t.ravel())
    apart = length(points - poles[run], -1).reshape(len(curve), -1)
    # Samples that are nearer than both neighbours, and not much further than these are from them.
    is_least = (apart[:, 1:-1] <= apart[:, :-2]) & (apart[:, 1:-1] < apart[:, 2:])
    chords = length(np.diff(points.reshape(len(curve), -1, 3), axis=1), -1)
    is_least &= apart[:, 1:-1] <= REACH * np.maximum(chords[:, 1:], chords[:, :-1]) + tolerance
    row, column = is_least.nonzero()
    if not len(row):
        return np.zeros(0, np.intp), np.zeros(0)
    at = t[row, column + 1]
    step = ((end - start) / count)[row]
    low, high = at - step, at + step
    for _ in range(STEPS):
        c, first, second = curves.evaluate_derivatives(curve[row], at, 2)
        rest = c - poles[row]
        slope = dot(rest, first, -1)
        bend = dot(first, first, -1) + dot(rest, second, -1)
        before = at
        at = np.minimum(np.maximum(at - slope / np.where(bend > 0, bend, 1.0), low), high)
        if (np.abs(at - before) <= LAST_STEP * step).all():
            break
    reached = length(curves.evaluate(curve[row], at) - poles[row], -1)
    margin = END * (end - start)[row]
    inside = (at > start[row] + margin) & (at < end[row] - margin)
    passes = (reached <= tolerance) & inside
    return row[passes], at[passes]


def _remake(surfaces: ClosedSurfaces, topology: Topology, diagonal: float) -> Topology:
    """New parameter curves for the parts of edges whose gaps are infinite."""
    rows = np.isinf(topology.gaps).nonzero()[0]
    face = topology.coedge_faces[rows]
    curves = topology.curves.take(topology.edge_curves[topology.coedge_edges[rows]])
    unknown = np.full(len(rows), -1)
    fresh = make_pcurves(surfaces, (face, unknown), curves, topology.pcurves, diagonal)
    which = np.arange(len(topology.gaps))
    which[rows] = len(which) + np.arange(len(rows))
    gaps, is_given = topology.gaps.copy(), topology.is_given.copy()
    gaps[rows], is_given[rows] = np.nan, False
    pcurves = Splines.join([topology.pcurves, fresh]).take(which)
    return replace(topology, pcurves=pcurves, gaps=gaps, is_given=is_given)
