"""Sections as SVG, in the coordinates of their planes: one path for each polyline.

A point p has the coordinates (p · x, −p · y) in model units, where x and y are the axes of the
plane; the sign is negative because the y axis of SVG points downwards. The path of a closed
polyline ends with Z. Each plane is a group; the groups of several planes overlap. The file contains
no text from the request, so no script: browsers run the scripts of an SVG.

References
----------
W3C, Scalable Vector Graphics (SVG) 2, chapter 9: paths.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.encoders.polylines.format import PolylineSize
from service.encoders.text import FLOAT64_CHARS, digits, rows
from service.engine.sections.values import Sections

MARGIN = 0.02
"""The margin around the lines, in units of the longer side of their box."""


def encode_sections(sections: Sections) -> bytes:
    """The SVG document, ASCII."""
    axes = sections.planes.axes
    groups, boxes = [], []
    for k, section in enumerate(sections.sections):
        projection = np.stack([axes[0][k], -axes[1][k]], axis=1)
        paths = []
        for line in section.polylines:
            points = line.distinct_points @ projection
            points += 0.0  # turns -0.0 into 0.0
            boxes.append(np.stack([points.min(axis=0), points.max(axis=0)]))
            end = b"Z" if line.closed else b""
            paths.append(b'<path d="M' + rows(points).rstrip() + end + b'"/>\n')
        groups.append(b'<g id="section-%d">\n' % k + b"".join(paths) + b"</g>\n")
    x, y, width, height = _view_box(boxes)
    head = (
        '<svg xmlns="http://www.w3.org/2000/svg" '
        f'viewBox="{x!r} {y!r} {width!r} {height!r}" fill="none" stroke="black">\n'
        "<style>path{vector-effect:non-scaling-stroke}</style>\n"
    )
    return head.encode() + b"".join(groups) + b"</svg>\n"


def sections_bound(size: PolylineSize) -> int:
    """The most bytes of the SVG document."""
    group = 32 + digits(size.planes)
    point = 2 * (FLOAT64_CHARS + 1)
    return 512 + size.planes * group + size.polylines * 24 + size.points * point


def _view_box(boxes: list[FloatArray]) -> tuple[float, float, float, float]:
    """The visible rectangle: x and y of its corner, its width and its height."""
    if not boxes:
        return 0.0, 0.0, 1.0, 1.0
    low, high = np.min(boxes, axis=(0, 1)), np.max(boxes, axis=(0, 1))
    margin = MARGIN * float((high - low).max()) or 1.0  # 1 about a single point
    (x, y), (width, height) = (low - margin).tolist(), (high - low + 2 * margin).tolist()
    return x, y, width, height
