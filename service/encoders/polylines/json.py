"""A curve, or sections, as one JSON object.

A curve has lists of float64 with one row for each point. Points and tangents have two coordinates
if the control points have two. Lists that the options switch off are omitted. Sections have the
planes with their polylines.
"""

import numpy as np

from service.encoders.content import SKIPPED_FACE_CHARS
from service.encoders.polylines.format import PolylineSize, report_curve, report_sections
from service.encoders.text import FLOAT64_CHARS, json_document
from service.engine.curves.polyline import SampledCurve
from service.engine.sections.values import Sections


def encode_curve(curve: SampledCurve) -> bytes:
    """The JSON document of a curve, UTF-8."""
    document: dict[str, object] = {"points": curve.points.astype(np.float64) + curve.origin}
    columns = (
        ("tangents", curve.tangents),
        ("parameters", curve.parameters),
        ("arc_lengths", curve.arc_lengths),
    )
    document |= {name: values for name, values in columns if values is not None}
    document |= curve.derivatives
    return json_document(document | {"report": report_curve(curve.report)})


def encode_sections(sections: Sections) -> bytes:
    """The JSON document of sections, UTF-8."""
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
    return json_document({"sections": objects, "report": report_sections(sections)})


def curve_bound(size: PolylineSize) -> int:
    """The most bytes of the document of a curve: all lists, with three coordinates."""
    # The report has 8 float64. A point has 3, its tangent 3, its parameter and arc length 1 each;
    # point and tangent have brackets. An order of derivatives has 3 in brackets, and 1 or a bool.
    row_bytes = (8 + 4 * size.order) * (FLOAT64_CHARS + 1) + 4 + 2 * size.order
    return 512 + 32 * size.order + 8 * FLOAT64_CHARS + size.points * row_bytes


def sections_bound(size: PolylineSize) -> int:
    """The most bytes of the document of sections."""
    plane = 200 + 10 * (FLOAT64_CHARS + 1)
    points = (size.points + size.touching) * (3 * (FLOAT64_CHARS + 1) + 3)
    faces = size.coplanar * 20 + size.skipped * SKIPPED_FACE_CHARS
    return 512 + size.planes * plane + size.polylines * 40 + points + faces
