"""Counts, points and the report, which all formats of sections share."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.encoders.lines import LineFormat
from service.engine.bounds.mesh_deviation import round_up
from service.engine.extent import choose_origin
from service.engine.mesh.report import ENGINE
from service.engine.sections.values import Polyline, Section, Sections

SINGLE = float(np.finfo(np.float32).eps)


@dataclass(frozen=True, slots=True)
class SectionSize:
    """Counts of sections, and the UTF-8 bytes of the name.

    `touching` are points where the surface touches a plane, `coplanar` patches in planes.
    """

    planes: int
    polylines: int
    points: int
    touching: int
    coplanar: int
    name_bytes: int

    @staticmethod
    def of(sections: Sections) -> "SectionSize":
        """The counts of some sections."""
        each = sections.sections
        return SectionSize(
            len(each),
            sum(len(section.polylines) for section in each),
            sections.point_count,
            sum(len(section.touching) for section in each),
            sum(len(section.coplanar) for section in each),
            len(sections.name.encode()),
        )


SectionFormat: TypeAlias = LineFormat[Sections, SectionSize]


def report_object(sections: Sections, rounding: float = 0.0) -> dict[str, object]:
    """The report as a JSON object; `rounding` is the largest rounding error of a written point."""
    size = SectionSize.of(sections)
    return {
        "planes": size.planes,
        "polylines": size.polylines,
        "points": size.points,
        "deviation_bound": round_up(sections.deviation_bound + rounding),
        "engine": ENGINE,
    }


def points_of(section: Section) -> FloatArray:
    """The points of all polylines (k, 3); the first point of a closed polyline occurs once."""
    return np.concatenate([np.zeros((0, 3)), *(_once(line) for line in section.polylines)])


def numbers_of(section: Section) -> list[Ints]:
    """For each polyline the rows of `points_of`; a closed polyline repeats its first row."""
    paths, first = [], 0
    for line in section.polylines:
        count = len(line.points) - line.closed
        paths.append(np.append(np.arange(first, first + count), [first] if line.closed else []))
        first += count
    return [numbers.astype(np.intp) for numbers in paths]


def find_stored_origin(sections: Sections) -> tuple[FloatArray, float]:
    """The origin of points in float32, (3,), and the largest error of their rounding."""
    points = [points_of(section) for section in sections.sections]
    every = np.concatenate([np.zeros((0, 3)), *points])
    if not len(every):
        return np.zeros(3), 0.0
    low, high = every.min(axis=0), every.max(axis=0)
    origin = choose_origin(low, high)
    return origin, SINGLE * float(np.abs(np.stack([low, high]) - origin).max())


def _once(line: Polyline) -> FloatArray:
    return line.points[:-1] if line.closed else line.points
