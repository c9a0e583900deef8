"""The points of a query as one JSON object of lists; each list has one row for every point."""

from service.encoders.text import FLOAT64_CHARS, json_document
from service.engine.points.evaluate import COLUMNS, Columns


def encode(columns: Columns) -> bytes:
    """The JSON document, UTF-8.

    Numbers have the fewest digits that read back as the same number. Infinite and undefined numbers
    become null, because JSON cannot store them.
    """
    return json_document(columns)


def byte_bound(count: int, order: int) -> int:
    """The most bytes of `count` points with derivatives up to the order `order`."""
    widths = [width for names in COLUMNS[: order + 1] for _, width in names]
    # Columns of the width 0 are booleans.
    row_bytes = sum(width * (FLOAT64_CHARS + 1) + 2 if width else len("false,") for width in widths)
    # Each column has its name and the brackets of its list.
    return count * row_bytes + 32 * len(widths)
