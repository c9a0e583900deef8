"""What a format of curves is: like one of meshes, with a function from a polyline to bytes."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.encoders.format import FileFormat
from service.engine.curves.polyline import Polyline, PolylineReport


@dataclass(frozen=True, slots=True)
class CurveSize:
    """What is known of a polyline before it is computed: points, and UTF-8 bytes of its name."""

    points: int
    name_bytes: int


@dataclass(frozen=True, slots=True)
class CurveFormat(FileFormat):
    """One way of writing a curve; `byte_bound` bounds the bytes that `encode` gives."""

    encode: Callable[[Polyline], bytes]
    byte_bound: Callable[[CurveSize], int]


def in_space(vectors: RealArray) -> RealArray:
    """Vectors (N, 2) or (N, 3) with three coordinates: z = 0 where there are two."""
    return vectors if vectors.shape[1] == 3 else np.pad(vectors, ((0, 0), (0, 1)))


def absolute_points(line: Polyline) -> FloatArray:
    """Model coordinates of the points, shape (N, 3)."""
    return in_space(line.points.astype(np.float64) + line.origin).astype(np.float64)


def report_object(report: PolylineReport) -> dict[str, object]:
    """The report as the JSON object that every format with a place for it carries."""
    return {
        "points": report.points,
        "pieces": report.pieces,
        "length": report.length,
        "closed": report.closed,
        "deviation_bound": report.deviation_bound,
        "bounds": {"min": report.bounds_min, "max": report.bounds_max},
        "engine": report.engine,
    }
