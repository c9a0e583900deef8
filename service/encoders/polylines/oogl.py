"""Curves and sections as an OOGL VECT: polylines of one colour.

A negative count means a closed polyline, which does not repeat its first point.

References
----------
Geomview manual, "OOGL File Formats": VECT.
"""

from collections.abc import Sequence

from service.encoders.polylines.format import PolylineSize, join_points, to_polyline
from service.encoders.text import FLOAT64_CHARS, digits, rows
from service.engine.curves.polyline import Polyline, SampledCurve
from service.engine.sections.values import Sections

POINT_CHARS = 3 * (FLOAT64_CHARS + 1)
"""The most characters of the line of a point."""


def encode_curve(curve: SampledCurve) -> bytes:
    """The OOGL file of a curve, ASCII."""
    return _write_polylines([to_polyline(curve)])


def encode_sections(sections: Sections) -> bytes:
    """The OOGL file of sections, ASCII."""
    return _write_polylines(sections.polylines)


def curve_bound(size: PolylineSize) -> int:
    """The most bytes of the file of a curve."""
    return 32 + 2 * digits(size.points) + size.points * POINT_CHARS


def sections_bound(size: PolylineSize) -> int:
    """The most bytes of the file of sections."""
    return 64 + size.points * (POINT_CHARS + 1) + size.polylines * (digits(size.points) + 5)


def _write_polylines(polylines: Sequence[Polyline]) -> bytes:
    """The text of one VECT."""
    points = join_points(polylines)
    counts = [len(line.distinct_points) * (-1 if line.closed else 1) for line in polylines]
    head = f"VECT\n{len(counts)} {len(points)} {min(len(counts), 1)}\n"
    head += "\n".join(map(str, counts)) + "\n"
    # The first polyline has 1 colour; the others have 0, which means the colour before.
    head += "\n".join(["1"] * bool(counts) + ["0"] * (len(counts) - 1)) + "\n"
    return head.encode() + (rows(points) + b"1 1 1 1\n" if counts else b"")
