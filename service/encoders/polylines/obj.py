"""Curves and sections as Wavefront OBJ: points, and a line element for each polyline.

The line of a closed polyline ends with the index of its first point.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from service.encoders.obj import identifier
from service.encoders.polylines.format import (
    PolylineSize,
    join_points,
    number_points,
    to_polyline,
)
from service.encoders.text import FLOAT64_CHARS, digits, rows
from service.engine.curves.polyline import Polyline, SampledCurve
from service.engine.sections.values import Sections

POINT_CHARS = len("v ") + 3 * (FLOAT64_CHARS + 1)
"""The most characters of the line of a point."""


def encode_curve(curve: SampledCurve) -> bytes:
    """The OBJ file of a curve, UTF-8."""
    return _write_objects([(identifier(curve.name), [to_polyline(curve)])])


def encode_sections(sections: Sections) -> bytes:
    """The OBJ file of sections, UTF-8, with an object for each plane."""
    name = identifier(sections.name)
    return _write_objects(
        (b"%s-%d" % (name, k), section.polylines) for k, section in enumerate(sections.sections)
    )


def curve_bound(size: PolylineSize) -> int:
    """The most bytes of the file of a curve."""
    return 8 + size.name_bytes + size.points * (POINT_CHARS + digits(size.points) + 1)


def sections_bound(size: PolylineSize) -> int:
    """The most bytes of the file of sections."""
    # An index and a blank, with room for the `l ` of a line.
    index = 4 + digits(size.points)
    objects = size.planes * (8 + size.name_bytes + digits(size.planes))
    return objects + size.points * (POINT_CHARS + index) + size.polylines * 2 * index


def _write_objects(objects: Iterable[tuple[bytes, Sequence[Polyline]]]) -> bytes:
    """The text of objects: for each its name, its points and its lines."""
    first, parts = 1, []
    for name, polylines in objects:
        points = join_points(polylines)
        parts += [b"o " + name + b"\n", rows(points, b"v ")]
        parts += [rows(path[np.newaxis] + first, b"l ") for path in number_points(polylines)]
        first += len(points)
    return b"".join(parts)
