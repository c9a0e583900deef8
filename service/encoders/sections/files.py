"""Encodes sections as JSON, as Wavefront OBJ and as OOGL.

References
----------
Geomview manual, "OOGL File Formats": VECT.
"""

import numpy as np

from service.encoders.obj import identifier
from service.encoders.sections.format import SectionSize, point_rows_of, points_of, report_object
from service.encoders.text import FLOAT64_CHARS, digits, json_document, rows
from service.engine.sections.values import Sections

POINT_CHARS = 3 * (FLOAT64_CHARS + 1)
"""The most characters of a point: three numbers, each with a separator."""


def encode_json(sections: Sections) -> bytes:
    """One JSON object: the planes with their polylines, and the report."""
    planes = sections.planes
    axes = planes.axes
    objects = [
        {
            "normal": planes.normals[k],
            "offset": planes.offsets[k],
            "x_axis": axes[0][k],
            "y_axis": axes[1][k],
            "polylines": [
                {"closed": line.closed, "points": line.points} for line in section.polylines
            ],
            "touching": section.touching.tolist(),
            "coplanar": section.coplanar.tolist(),
        }
        for k, section in enumerate(sections.sections)
    ]
    return json_document({"sections": objects, "report": report_object(sections)})


def json_bound(size: SectionSize) -> int:
    """The most bytes of the JSON object."""
    plane = 200 + 10 * (FLOAT64_CHARS + 1)
    points = (size.points + size.touching) * (POINT_CHARS + 3)
    return 512 + size.planes * plane + size.polylines * 40 + points + size.coplanar * 20


def encode_obj(sections: Sections) -> bytes:
    """The OBJ file, UTF-8, with an object for each plane.

    The line of a closed polyline ends with the index of its first point.
    """
    name, first, parts = identifier(sections.name), 1, []
    for k, section in enumerate(sections.sections):
        points = points_of(section)
        parts.append(b"o %s-%d\n" % (name, k) + (rows(points, b"v ") if len(points) else b""))
        parts += [
            rows(point_rows[np.newaxis] + first, b"l ") for point_rows in point_rows_of(section)
        ]
        first += len(points)
    return b"".join(parts)


def obj_bound(size: SectionSize) -> int:
    """The most bytes of the OBJ file."""
    # An index and a blank, with room for the `l ` of a line.
    index = 4 + digits(size.points)
    objects = size.planes * (8 + size.name_bytes + digits(size.planes))
    points = size.points * (len("v ") + POINT_CHARS + index)
    return objects + points + size.polylines * 2 * index


def encode_oogl(sections: Sections) -> bytes:
    """The OOGL file, ASCII: one VECT of one colour. A negative count means a closed polyline."""
    lines = [line for section in sections.sections for line in section.polylines]
    points = [points_of(section) for section in sections.sections]
    all_points = np.concatenate([np.zeros((0, 3)), *points])
    counts = [-(len(line.points) - 1) if line.closed else len(line.points) for line in lines]
    head = f"VECT\n{len(lines)} {len(all_points)} {min(len(lines), 1)}\n"
    head += "\n".join(map(str, counts)) + "\n"
    # The first polyline has 1 colour; the others have 0, which means the colour before.
    head += "\n".join(["1"] * bool(lines) + ["0"] * (len(lines) - 1)) + "\n"
    return head.encode() + (rows(all_points) + b"1 1 1 1\n" if lines else b"")


def oogl_bound(size: SectionSize) -> int:
    """The most bytes of the OOGL file."""
    return 64 + size.points * (POINT_CHARS + 1) + size.polylines * (digits(size.points) + 5)
