"""A curve as one JSON object: lists of float64 with one row for each point.

Points and tangents have two coordinates if the control points have two. Lists that the options
switch off are omitted.
"""

import numpy as np

from service.encoders.curves.format import CurveSize, report_object
from service.encoders.text import FLOAT64_CHARS, json_document
from service.engine.curves.polyline import Polyline


def encode(line: Polyline) -> bytes:
    """The JSON document, UTF-8."""
    document: dict[str, object] = {"points": line.points.astype(np.float64) + line.origin}
    columns = (
        ("tangents", line.tangents),
        ("parameters", line.parameters),
        ("arc_lengths", line.arc_lengths),
    )
    document |= {name: values for name, values in columns if values is not None}
    return json_document(document | {"report": report_object(line.report)})


def byte_bound(size: CurveSize) -> int:
    """The most bytes of the document: all lists, with three coordinates."""
    # The report has 8 float64. A point has 3, its tangent 3, its parameter and arc length 1 each;
    # point and tangent have brackets.
    return 512 + 8 * FLOAT64_CHARS + size.points * (8 * (FLOAT64_CHARS + 1) + 4)
