"""A curve as an OOGL VECT: one polyline of one colour. A negative count means a closed polyline.

References
----------
Geomview manual, "OOGL File Formats": VECT.
"""

from service.encoders.curves.format import CurveSize, absolute_points
from service.encoders.text import FLOAT64_CHARS, digits, rows
from service.engine.curves.polyline import Polyline


def encode(line: Polyline) -> bytes:
    """The OOGL file, ASCII. A closed curve does not repeat its first point."""
    points = absolute_points(line)
    count = len(points)
    if line.report.closed:
        points, count = points[:-1], -(count - 1)
    head = f"VECT\n1 {len(points)} 1\n{count}\n1\n"
    return head.encode() + rows(points) + b"1 1 1 1\n"


def byte_bound(size: CurveSize) -> int:
    """The most bytes of the file."""
    return 32 + 2 * digits(size.points) + size.points * 3 * (FLOAT64_CHARS + 1)
