"""Counts, coordinates and the report, which all formats of curves share."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.encoders.lines import LineFormat
from service.engine.curves.polyline import Polyline, PolylineReport


@dataclass(frozen=True, slots=True)
class CurveSize:
    """Counts from which the size of a file is predicted: points, and UTF-8 bytes of the name."""

    points: int
    name_bytes: int


CurveFormat: TypeAlias = LineFormat[Polyline, CurveSize]


def in_space(vectors: RealArray) -> RealArray:
    """Vectors (N, 2) or (N, 3) as (N, 3): z = 0 is added to two coordinates."""
    return vectors if vectors.shape[1] == 3 else np.pad(vectors, ((0, 0), (0, 1)))


def absolute_points(line: Polyline) -> FloatArray:
    """Model coordinates of the points, shape (N, 3)."""
    return in_space(line.points.astype(np.float64) + line.origin).astype(np.float64)


def report_object(report: PolylineReport) -> dict[str, object]:
    """The report as a JSON object, for all formats that store one."""
    return {
        "points": report.points,
        "pieces": report.pieces,
        "length": report.length,
        "closed": report.closed,
        "deviation_bound": report.deviation_bound,
        "bounds": {"min": report.bounds_min, "max": report.bounds_max},
        "engine": report.engine,
    }
