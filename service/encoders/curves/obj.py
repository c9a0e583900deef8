"""A curve as Wavefront OBJ: points, and one line element through all of them."""

import numpy as np

from service.encoders.curves.format import CurveSize, absolute_points
from service.encoders.obj import identifier
from service.encoders.text import FLOAT64_CHARS, digits, rows
from service.engine.curves.polyline import Polyline


def encode(line: Polyline) -> bytes:
    """The OBJ file, UTF-8; the line of a closed curve ends with the index of its first point."""
    points = absolute_points(line)
    numbers = np.arange(1, len(points) + 1)
    if line.report.closed:
        points, numbers[-1] = points[:-1], 1
    head = b"o " + identifier(line.name) + b"\n"
    return head + rows(points, b"v ") + rows(numbers[np.newaxis], b"l ")


def byte_bound(size: CurveSize) -> int:
    """The most bytes of the file."""
    point = 2 + 3 * (FLOAT64_CHARS + 1)
    return 8 + size.name_bytes + size.points * (point + digits(size.points) + 1)
