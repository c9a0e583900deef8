"""Requests whose surface is a file; the other fields stand beside the file, as in a query."""

from collections.abc import Mapping
from typing import Any, TypeVar

from service.decoders.format import Decoded, Decoder
from service.schemas.document import DEFAULT_LIMITS, DocumentLimits
from service.schemas.fields import RequestModel
from service.schemas.file_fields import add_fields
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document

Request = TypeVar("Request", bound=RequestModel)

_SQUARE = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
_STAND_IN = {
    False: {"type": "bspline", "degree": 1, **_SQUARE},
    True: {"type": "brep", "faces": [{"surface": _SQUARE}]},
}
"""Small surfaces that stand for that of a file of control points, and of a CAD file."""


def build_file_request(
    model: type[Request],
    decoder: Decoder,
    decoded: Decoded,
    beside: Mapping[str, Any],
    limits: DocumentLimits,
) -> Request:
    """The request with the surface of a file.

    Parameters
    ----------
    beside : Mapping
        What stands beside the file, in the form of `document_from_query`.

    Raises
    ------
    InvalidRequest
        With pointers into the whole request.
    """
    surface = add_fields(decoded.tree, beside["surface"], is_cad=decoder.is_cad)
    request = validate_document(model, {**beside, "surface": surface}, limits)
    if isinstance(request, SurfaceRequest):
        request.keep_reading(decoded.reading)
    return request


def check_beside(
    model: type[Request],
    decoder: Decoder,
    beside: Mapping[str, Any],
    limits: DocumentLimits = DEFAULT_LIMITS,
) -> Request:
    """The request with a small surface in place of that of a file, which is not read.

    It checks what stands beside a file. For files of control points only `up` and `name` of the
    surface's fields are checked, because the others depend on the points.

    Raises
    ------
    InvalidRequest
        As `build_file_request`.
    """
    fields = beside["surface"]
    if not decoder.is_cad:
        fields = {name: fields[name] for name in ("up", "name") if name in fields}
    return validate_document(
        model, {**beside, "surface": _STAND_IN[decoder.is_cad] | fields}, limits
    )


def count_reading(reading: Mapping[str, Any]) -> str:
    """Counts of a report of reading, as a dictionary of RFC 8941: `faces=300; skipped=2`.

    They are the faces of the surface, each once however often it is placed, and the faces of the
    file that are not in it.
    """
    return f"faces={reading['faces']}; skipped={len(reading['skipped_faces'])}"
