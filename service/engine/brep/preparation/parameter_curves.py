"""The parameter curve of every coedge: the given one where it is used, else foot points.

A given parameter curve is used if it is proved to be nowhere further from its edge than the
uncertainty of the brep, and stays in the domain of the surface. Otherwise it is made anew, from the
foot points of the edge's curve on the surface, once and for all: it depends on no tolerance.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.preparation.domains import find_beyond
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.foot_curves import fit_feet, project_to_planes
from service.engine.trims.foot_tables import make_guesses
from service.engine.trims.gaps import ENOUGH, bound_gaps
from service.engine.trims.piecewise import make_segments
from service.engine.trims.splines import Splines
from service.engine.vectors import length
from service.surface.brep_model import BrepModel

SAMPLES = 9
"""Parameters at which a given parameter curve is compared with its edge before the proof."""

NEAR = 1e-2
"""A given parameter curve that is nearer than this share of the diagonal is a good first guess."""

GOAL = 1e-9
"""Interpolated foot points may add this share of the diagonal to a gap."""

FINE = 8.0
"""Nodes for each degree, in the proof of gaps that are close to the uncertainty."""


@dataclass(frozen=True, eq=False, slots=True)
class ParameterCurves:
    """The parameter curves of C coedges, and their gaps.

    Attributes
    ----------
    pcurves : Splines
        In parameters of the surfaces, over the ranges of the edges.
    is_replaced, is_open : ndarray of bool, shape (C,)
        Whether a given curve was made anew; whether there is none yet, because the edge is a pole.
    is_guided : ndarray of bool, shape (C,)
        Whether a given curve is used, or was the first guess of the new one.
    gaps : ndarray of float64, shape (C,)
        Proved gaps; NaN where they are not known.
    seen : ndarray of float64, shape (C,)
        The largest gaps at some parameters; 0 without a curve of space.
    """

    pcurves: Splines
    is_replaced: Bools
    is_open: Bools
    is_guided: Bools
    gaps: FloatArray
    seen: FloatArray


def find_parameter_curves(
    model: BrepModel, surfaces: ClosedSurfaces, curves: Splines, diagonal: float
) -> ParameterCurves:
    """Parameter curves of all coedges of a model.

    Parameters
    ----------
    curves : Splines
        The curves of the edges.
    diagonal : float
        Of the part, in model units.
    """
    count = len(model.coedge_edges)
    face, edge, number = model.coedge_faces, model.coedge_edges, model.coedge_pcurves
    curve = np.append(model.edge_curves, -1)[edge]  # an edge −1 has no curve
    has_curve, is_given = curve >= 0, number >= 0
    given = Splines.of(model.pcurves)
    gaps, seen = np.full(count, np.nan), np.zeros(count)
    is_used, is_outside = is_given & ~has_curve, np.zeros(count, bool)
    compared = (has_curve & is_given).nonzero()[0]
    own = given.take(number[compared])
    own = own.move_ranges(curves.start[curve[compared]], curves.end[curve[compared]])
    if len(compared):
        owner = curve[compared]
        seen[compared] = measure_gaps(surfaces, face[compared], curves, owner, own)
        limits = model.uncertainty, ENOUGH * diagonal
        rows, gaps[compared] = _prove(
            surfaces, (face[compared], owner, seen[compared]), curves, own, limits
        )
        is_used[compared[rows]] = True
        outside, _ = find_beyond(surfaces, face[compared], own)
        is_outside[compared[outside]] = True
        is_used &= ~is_outside
    free = (is_given & ~has_curve).nonzero()[0]
    is_open = ~is_given & ~has_curve
    unknown = is_open.nonzero()[0]
    nowhere = np.zeros((len(unknown), 2))
    parts = [
        (compared, own),
        (free, given.take(number[free])),
        (unknown, make_segments(nowhere, nowhere, nowhere + np.array([0.0, 1.0]))),
    ]
    is_replaced, is_guided = np.zeros(count, bool), is_given.copy()
    made = (has_curve & ~is_used).nonzero()[0]
    if len(made):
        guess = np.full(count, -1)
        guess[compared] = np.arange(len(compared))
        guess[seen > NEAR * diagonal] = -1
        coedges = face[made], guess[made]
        fresh = make_pcurves(surfaces, coedges, curves.take(curve[made]), own, diagonal)
        fresh_seen = measure_gaps(surfaces, face[made], curves, curve[made], fresh)
        is_better = ~is_given[made] | is_outside[made] | (fresh_seen < seen[made])
        better = made[is_better]
        is_replaced[better] = is_given[better]
        is_guided[better] &= guess[better] >= 0
        gaps[better], seen[better] = np.nan, fresh_seen[is_better]
        parts.append((better, fresh.take(is_better.nonzero()[0])))
    # Of two curves of a coedge the last one counts.
    which = np.zeros(count, np.intp)
    which[np.concatenate([rows for rows, _ in parts])] = np.arange(sum(len(x) for _, x in parts))
    pcurves = Splines.join([part for _, part in parts if len(part)] or [given]).take(which)
    return ParameterCurves(pcurves, is_replaced, is_open, is_guided, gaps, seen)


def measure_gaps(
    surfaces: ClosedSurfaces, face: Ints, curves: Splines, edge: Ints, pcurves: Splines
) -> FloatArray:
    """The largest distances (n,) between edges and parameter curves at some parameters."""
    run = np.repeat(np.arange(len(face)), SAMPLES)
    share = np.arange(SAMPLES) / (SAMPLES - 1)
    t = pcurves.start[:, np.newaxis] + (pcurves.end - pcurves.start)[:, np.newaxis] * share
    t[:, -1] = pcurves.end
    image = surfaces.evaluate(face[run], pcurves.evaluate(run, t.ravel()))
    apart = length(image - curves.evaluate(edge[run], t.ravel()), -1)
    return np.asarray(apart.reshape(-1, SAMPLES).max(axis=1))


def _prove(
    surfaces: ClosedSurfaces,
    coedges: tuple[Ints, Ints, FloatArray],
    curves: Splines,
    pcurves: Splines,
    limits: tuple[float, float],
) -> tuple[Ints, FloatArray]:
    """The given curves that are used, by number, and the proved gaps of all, NaN where unknown.

    `coedges` are faces, numbers of curves, and gaps that were seen; `limits` are the uncertainty,
    and a gap below which no close bound is needed.
    """
    uncertainty, enough = limits
    face, curve, seen = coedges
    gaps = np.full(len(face), np.nan)
    rows = (seen <= uncertainty).nonzero()[0]
    for nodes in (2.0, FINE):
        if not len(rows):
            break
        proof = bound_gaps(
            surfaces,
            face[rows],
            curves,
            curve[rows],
            pcurves.take(rows),
            enough=enough,
            nodes=nodes,
        )
        gaps[rows] = proof.bound
        # Those that may be within the uncertainty, although this is not proved yet.
        rows = rows[(proof.bound > uncertainty) & (proof.seen <= uncertainty)]
    return (gaps <= uncertainty).nonzero()[0], gaps


def make_pcurves(
    surfaces: ClosedSurfaces,
    coedges: tuple[Ints, Ints],
    curves: Splines,
    given: Splines,
    diagonal: float,
) -> Splines:
    """Parameter curves of foot points of n curves; `coedges` are faces, and guesses in `given`."""
    face, guess = coedges
    is_planar = surfaces.surfaces.is_planar[face]
    planar, curved = is_planar.nonzero()[0], (~is_planar).nonzero()[0]
    parts = []
    if len(planar):
        parts.append(project_to_planes(surfaces, face[planar], curves.take(planar)))
    if len(curved):
        face, guess, curves = face[curved], guess[curved], curves.take(curved)
        goal = GOAL * diagonal
        guesses = make_guesses(surfaces, face, curves, (given, guess), goal)
        parts.append(fit_feet(surfaces, face, curves, guesses, goal))
    which = np.empty(len(is_planar), np.intp)
    which[np.concatenate([planar, curved])] = np.arange(len(is_planar))
    return Splines.join(parts).take(which)
