"""Curves of space for parameter curves that a file gives alone, with proved distances.

S(c(t)) is composed exactly where its degree is low. Otherwise it is interpolated by pieces of a
moderate degree; `service.engine.trims.gaps` then proves how far the curve is from S(c(t)) at equal
parameters.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.splines import project_points
from service.engine.trims.closure import find_closure
from service.engine.trims.composition import compose_curves
from service.engine.trims.gaps import bound_gaps
from service.engine.trims.spline_shapes import measure_polygons
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import CurveTable, SurfaceTable

MOST = 9
"""Compositions of a higher degree are interpolated."""

SHARE = 0.1
"""Interpolation aims at this share of the goal, because the proved bound is larger."""


@dataclass(frozen=True, eq=False, slots=True)
class Fit:
    """A curve of space near S(c(t)).

    Attributes
    ----------
    curve : Curve or None
        Over the domain of the pcurve; None if the pcurve runs along a pole, so that all of
        S(c(t)) is one point.
    error : float
        No point S(c(t)) is further than this from the curve's point at t. Usually it is below the
        goal; where the surface has a kink inside a span of the pcurve it may be larger.
    """

    curve: Curve | None
    error: float


def fit_pcurves(surface: Surface, pcurves: Sequence[Curve], goal: float) -> list[Fit]:
    """Curves of space for parameter curves on a surface.

    Parameters
    ----------
    pcurves : sequence of Curve
        D = 2. Along a closed axis they may leave the domain of the surface.
    goal : float
        The distance that is aimed at, in the unit of the surface; also that below which the sides
        of a surface are one, or one point.
    """
    if not pcurves:
        return []
    surfaces = find_closure(FaceSurfaces.of(_list_surface(surface)), goal)
    splines = Splines.of(_list_curves(pcurves))
    face, edge = np.zeros(len(pcurves), np.intp), np.arange(len(pcurves))
    curves = compose_curves(surfaces, face, splines, SHARE * goal, MOST)
    curves = curves.move_ranges(splines.start, splines.end)
    bounds = bound_gaps(surfaces, face, curves, edge, splines, enough=SHARE * goal).bound
    is_point = measure_polygons(curves) <= goal
    return [
        Fit(None if point else curve, bound)
        for curve, point, bound in zip(
            _list_splines(curves), is_point.tolist(), bounds.tolist(), strict=True
        )
    ]


def _list_surface(surface: Surface) -> SurfaceTable:
    """The table of one surface."""
    weights = surface.points[..., 3]
    is_rational = np.array([bool((weights != weights[0, 0]).any())])
    return SurfaceTable(
        np.array([surface.degrees]),
        np.array([weights.shape]),
        project_points(surface.points).reshape(-1, 3),
        weights.ravel() if is_rational[0] else np.ones(weights.size),
        is_rational,
        np.concatenate(surface.knots),
    )


def _list_curves(curves: Sequence[Curve]) -> CurveTable:
    """The table of curves."""
    weights = [curve.points[:, -1] for curve in curves]
    is_rational = np.array([bool((each != each[0]).any()) for each in weights])
    factors = [
        each if rational else np.ones(len(each))
        for each, rational in zip(weights, is_rational.tolist(), strict=True)
    ]
    return CurveTable(
        np.array([curve.degree for curve in curves]),
        np.array([len(curve.points) for curve in curves]),
        np.concatenate([project_points(curve.points) for curve in curves]),
        np.concatenate(factors),
        is_rational,
        np.concatenate([curve.knots for curve in curves]),
    )


def _list_splines(splines: Splines) -> list[Curve]:
    """The curves of Bézier spans, with knots of the multiplicity p between spans."""
    spans = splines.list_spans()
    nets: list[FloatArray] = [np.empty(0)] * len(spans.curve)
    for rows, values in splines.restrict(spans):
        for row, net in zip(rows.tolist(), values, strict=True):
            nets[row] = net
    curves, first = [], 0
    for number, count in enumerate(splines.span_count.tolist()):
        own = nets[first : first + count]
        breaks = splines.breaks[splines.first_break[number] :][: count + 1]
        first += count
        degree = len(own[0]) - 1
        is_rational = own[0].shape[1] > splines.dimension
        points = [own[0]]
        for net in own[1:]:
            factor = points[-1][-1, -1] / net[0, -1] if is_rational else 1.0
            points.append(factor * net[1:])
        net = np.concatenate(points)
        if not is_rational:
            net = np.concatenate([net, np.ones((len(net), 1))], axis=1)
        knots = np.concatenate([breaks[:1], np.repeat(breaks, degree), breaks[-1:]])
        curves.append(Curve(degree, knots, net))
    return curves
