"""The type of all formats of curves and sections, and their sizes, points and reports."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeAlias, TypeVar

import numpy as np

from service.bases.arrays import FloatArray, Ints, RealArray
from service.encoders.content import list_skipped_faces
from service.encoders.format import FileFormat
from service.engine.bounds.mesh_deviation import round_up
from service.engine.curves.polyline import CurveReport, Polyline, SampledCurve
from service.engine.mesh.mesh import ENGINE
from service.engine.sections.values import Sections

Lines = TypeVar("Lines")
Vectors = TypeVar("Vectors", FloatArray, RealArray)


@dataclass(frozen=True, slots=True)
class PolylineSize:
    """The counts that bound the file of a curve, which is one polyline, or of sections.

    `name_bytes` are the UTF-8 bytes of the name. Of sections, `touching` counts the points where
    the surface only touches a plane, `coplanar` the patches that lie in a plane, and `skipped` the
    faces of breps that were left out. Of a curve, `order` is the order of its derivatives.
    """

    points: int
    name_bytes: int
    polylines: int = 1
    planes: int = 0
    touching: int = 0
    coplanar: int = 0
    skipped: int = 0
    order: int = 0


@dataclass(frozen=True, slots=True)
class PolylineFormat(FileFormat, Generic[Lines]):
    """A format of curves, or of sections.

    `byte_bound` bounds the number of bytes of `encode`. `has_columns` says whether the format
    stores derivatives, and points that are no polyline.
    """

    encode: Callable[[Lines], bytes]
    byte_bound: Callable[[PolylineSize], int]
    has_columns: bool = False


CurveFormat: TypeAlias = PolylineFormat[SampledCurve]
SectionFormat: TypeAlias = PolylineFormat[Sections]


def count_sections(sections: Sections) -> PolylineSize:
    """The counts of some sections."""
    return PolylineSize(
        points=sections.point_count,
        name_bytes=len(sections.name.encode()),
        polylines=sum(len(section.polylines) for section in sections.sections),
        planes=len(sections.sections),
        touching=sum(len(section.touching) for section in sections.sections),
        coplanar=sum(len(section.coplanar) for section in sections.sections),
        skipped=len(sections.skipped_faces),
    )


def in_space(vectors: Vectors) -> Vectors:
    """Vectors (N, 2) or (N, 3) as vectors (N, 3); vectors of two coordinates get z = 0."""
    return vectors if vectors.shape[1] == 3 else np.pad(vectors, ((0, 0), (0, 1)))


def to_polyline(curve: SampledCurve) -> Polyline:
    """The polyline through the samples of a curve, in model coordinates."""
    return Polyline(in_space(curve.points.astype(np.float64) + curve.origin), curve.report.closed)


def join_points(polylines: Sequence[Polyline]) -> FloatArray:
    """The points of polylines, shape (k, 3); closed polylines do not repeat their first point."""
    return np.concatenate([np.zeros((0, 3)), *(line.distinct_points for line in polylines)])


def number_points(polylines: Sequence[Polyline]) -> list[Ints]:
    """For each polyline, the rows that its points have in `join_points`.

    A closed polyline repeats its first row at the end.
    """
    paths, first = [], 0
    for line in polylines:
        count = len(line.distinct_points)
        paths.append(first + np.arange(len(line.points)) % count)
        first += count
    return paths


def report_curve(report: CurveReport) -> dict[str, object]:
    """The report on a curve as a JSON object, for the formats that store a report."""
    facts = {
        "points": report.points,
        "pieces": report.pieces,
        "length": report.length,
        "closed": report.closed,
        "deviation_bound": report.deviation_bound,
        "bounds": {"min": report.bounds_min, "max": report.bounds_max},
        "engine": report.engine,
    }
    return {name: value for name, value in facts.items() if value is not None}


def report_sections(sections: Sections, rounding: float = 0.0) -> dict[str, object]:
    """The report on sections as a JSON object.

    `rounding` is the largest distance by which the format moves a point; it is part of the bound.
    """
    size = count_sections(sections)
    report: dict[str, object] = {
        "planes": size.planes,
        "polylines": size.polylines,
        "points": size.points,
        "deviation_bound": round_up(sections.deviation_bound + rounding),
    }
    if sections.skipped_faces:
        report["skipped_faces"] = list_skipped_faces(sections.skipped_faces, "patch")
    return report | {"engine": ENGINE}
