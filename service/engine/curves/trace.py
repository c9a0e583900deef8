"""Converts a curve to samples, with derivatives and lengths, and a bound of the deviation.

1. Choose the samples: R divisions of each piece, or halving until all chords are within the
   tolerance, or chosen parameters.
2. Evaluate points, tangents and derivatives.
3. Measure the length of the curve, and bound its distance from the polyline through the stored,
   rounded points. Points at chosen parameters are no polyline.
"""

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.engine.curves.arc_length import arc_lengths, find_lengths
from service.engine.curves.chords import certify_chords, halve_chords
from service.engine.curves.derivatives import evaluate_derivatives
from service.engine.curves.evaluation import CurveSamples, evaluate_positions, evaluate_tangents
from service.engine.curves.polyline import CurveOptions, CurveReport, SampledCurve
from service.engine.extent import choose_origin, find_extent
from service.surface.curve_model import CurvePieces


def choose_samples(
    pieces: CurvePieces, options: CurveOptions, max_samples: int, *, is_float32: bool = False
) -> CurveSamples:
    """The parameters at which the curve is sampled.

    Raises
    ------
    InvalidRequest, TooLarge
        If the tolerance is too small for the precision of numbers, or needs more than `max_samples`
        samples; or if a parameter is outside the curve.
    """
    if options.parameters is not None:
        return CurveSamples.locate(options.parameters, pieces.breaks)
    if options.tolerance is None:
        return CurveSamples.uniform(pieces.count, options.resolution)
    origin = _origin(pieces, is_float32)
    return halve_chords(
        pieces, options.tolerance, max_samples, is_float32=is_float32, origin=origin
    )


def trace_curve(
    pieces: CurvePieces, samples: CurveSamples, options: CurveOptions, *, is_float32: bool = False
) -> SampledCurve:
    """The polyline through these samples, or the points at chosen parameters.

    Parameters
    ----------
    is_float32 : bool
        Whether positions are float32 about a local origin, else float64 in model coordinates.
    """
    origin = _origin(pieces, is_float32)
    points = _store(evaluate_positions(pieces, samples), origin, is_float32)
    is_polyline = options.parameters is None
    lengths = arc_lengths(pieces, samples) if is_polyline else find_lengths(pieces, samples)
    low, high = find_extent(points)
    return SampledCurve(
        name=pieces.name,
        points=points,
        tangents=evaluate_tangents(pieces, samples) if options.tangents else None,
        parameters=samples.parameters(pieces.breaks),
        arc_lengths=lengths[: len(samples)] if options.arc_lengths else None,
        derivatives=evaluate_derivatives(pieces, samples, options.order),
        origin=origin,
        up=pieces.up,
        report=CurveReport(
            points=len(samples),
            pieces=pieces.count,
            length=float(lengths[-1]),
            closed=pieces.closed,
            deviation_bound=(
                certify_chords(pieces, samples, points, origin) if is_polyline else None
            ),
            bounds_min=_bound_in_model(low, origin),
            bounds_max=_bound_in_model(high, origin),
        ),
    )


def _origin(pieces: CurvePieces, is_float32: bool) -> FloatArray:
    return choose_origin(*pieces.bounds) if is_float32 else np.zeros(pieces.dimension)


def _store(points: FloatArray, origin: FloatArray, is_float32: bool) -> RealArray:
    return (points - origin).astype(np.float32) if is_float32 else points


def _bound_in_model(bound: RealArray, origin: FloatArray) -> tuple[float, ...]:
    return tuple((bound.astype(np.float64) + origin).tolist())
