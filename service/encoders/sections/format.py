"""Helpers of all formats of sections: sizes, points and the report."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.encoders.lines import LineFormat
from service.engine.bounds.mesh_deviation import round_up
from service.engine.extent import choose_origin
from service.engine.mesh.report import ENGINE
from service.engine.sections.values import Polyline, Section, Sections

FLOAT32_EPSILON = float(np.finfo(np.float32).eps)
"""The machine epsilon ε of float32. Rounding moves each coordinate x by at most ε |x| / 2, and so a
point by less than ε times the largest |x|."""


@dataclass(frozen=True, slots=True)
class SectionSize:
    """The counts that bound the file of some sections.

    `touching` counts the points where the surface only touches a plane, `coplanar` the patches that
    lie in a plane. `name_bytes` are the UTF-8 bytes of the name.
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
        all_sections = sections.sections
        return SectionSize(
            len(all_sections),
            sum(len(section.polylines) for section in all_sections),
            sections.point_count,
            sum(len(section.touching) for section in all_sections),
            sum(len(section.coplanar) for section in all_sections),
            len(sections.name.encode()),
        )


SectionFormat: TypeAlias = LineFormat[Sections, SectionSize]


def report_object(sections: Sections, rounding: float = 0.0) -> dict[str, object]:
    """The report on sections as a JSON object.

    `rounding` is the largest distance by which the format moves a point; it is part of the bound.
    """
    size = SectionSize.of(sections)
    return {
        "planes": size.planes,
        "polylines": size.polylines,
        "points": size.points,
        "deviation_bound": round_up(sections.deviation_bound + rounding),
        "engine": ENGINE,
    }


def points_of(section: Section) -> FloatArray:
    """The points of all polylines of a section, shape (k, 3).

    A closed polyline does not repeat its first point here.
    """
    return np.concatenate(
        [np.zeros((0, 3)), *(_drop_repeated_point(line) for line in section.polylines)]
    )


def point_rows_of(section: Section) -> list[Ints]:
    """For each polyline, the rows that its points have in `points_of`.

    A closed polyline repeats its first row at the end.
    """
    paths, first = [], 0
    for line in section.polylines:
        count = len(line.points) - line.closed
        paths.append(np.append(np.arange(first, first + count), [first] if line.closed else []))
        first += count
    # Appending an empty list makes floats of integers.
    return [path.astype(np.intp) for path in paths]


def find_stored_origin(sections: Sections) -> tuple[FloatArray, float]:
    """The origin of points stored in float32, and the largest distance that rounding moves one."""
    points = [points_of(section) for section in sections.sections]
    all_points = np.concatenate([np.zeros((0, 3)), *points])
    if not len(all_points):
        return np.zeros(3), 0.0
    low, high = all_points.min(axis=0), all_points.max(axis=0)
    origin = choose_origin(low, high)
    return origin, FLOAT32_EPSILON * float(np.abs(np.stack([low, high]) - origin).max())


def _drop_repeated_point(line: Polyline) -> FloatArray:
    """The points of a polyline, each once."""
    return line.points[:-1] if line.closed else line.points
