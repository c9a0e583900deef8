"""Helpers of all formats of curves: sizes, coordinates and the report."""

from dataclasses import dataclass
from typing import TypeAlias, TypeVar

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.encoders.lines import LineFormat
from service.engine.curves.polyline import Polyline, PolylineReport


@dataclass(frozen=True, slots=True)
class CurveSize:
    """The number of points of a curve, and the UTF-8 bytes of its name: they bound its file."""

    points: int
    name_bytes: int


CurveFormat: TypeAlias = LineFormat[Polyline, CurveSize]

Vectors = TypeVar("Vectors", FloatArray, RealArray)


def in_space(vectors: Vectors) -> Vectors:
    """Vectors (N, 2) or (N, 3) as vectors (N, 3); vectors of two coordinates get z = 0."""
    return vectors if vectors.shape[1] == 3 else np.pad(vectors, ((0, 0), (0, 1)))


def absolute_points(line: Polyline) -> FloatArray:
    """The points in model coordinates, float64, shape (N, 3)."""
    return in_space(line.points.astype(np.float64) + line.origin)


def report_object(report: PolylineReport) -> dict[str, object]:
    """The report on a curve as a JSON object, for the formats that store a report."""
    return {
        "points": report.points,
        "pieces": report.pieces,
        "length": report.length,
        "closed": report.closed,
        "deviation_bound": report.deviation_bound,
        "bounds": {"min": report.bounds_min, "max": report.bounds_max},
        "engine": report.engine,
    }
