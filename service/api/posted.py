"""Surfaces that are posted: as JSON, which carries the whole request, or as a file of a net.

A file holds control points alone. What a JSON body would say beside them stands in the query: the
fields of the surface, and the options. So there is one document for both, and one way to check it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from pydantic import BaseModel
from starlette.requests import Request

from service.api.body import body_type, read_body, read_file
from service.api.negotiation import AnyFormat, by_name
from service.api.parameters import no_parameters, only_format
from service.api.problems import InvalidQuery
from service.api.work import INLINE_BYTES, long_to_read
from service.decoders.format import Decoder
from service.decoders.registry import DECODERS
from service.errors import InvalidRequest
from service.schemas.document import DocumentLimits
from service.schemas.surface_query import document_from_query, with_fields
from service.schemas.validation import parse_request, validate_document
from service.settings.values import Settings

Model = TypeVar("Model", bound=BaseModel)

INLINE_TEXT = 1 << 14
"""Texts up to this size are read in some 5 ms, even if they are a list of single patches."""


@dataclass(frozen=True, slots=True)
class Posting(Generic[AnyFormat]):
    """What the headers and the query of a request say of its body.

    Attributes
    ----------
    decoder : Decoder or None
        What reads the body; None for JSON.
    format : file format or None
        The one that the query names.
    beside : mapping
        What the query says beside that, as a document would hold it; nothing where that is JSON.
    """

    decoder: Decoder | None
    format: AnyFormat | None
    beside: Mapping[str, Any] = field(default_factory=dict)

    async def read(self, request: Request, settings: Settings) -> bytes:
        """The whole body; raises as `service.api.body.read_body` does."""
        if self.decoder is None:
            return await read_body(request, settings)
        return await read_file(request, settings, self.decoder)

    def is_long(self, body: bytes) -> bool:
        """Whether the event loop cannot spare the time to parse and check it."""
        if self.decoder is None:
            return long_to_read(body)
        return len(body) > (INLINE_BYTES if self.decoder.binary else INLINE_TEXT)

    def request(self, model: type[Model], body: bytes, limits: DocumentLimits) -> Model:
        """The whole request, parsed and validated.

        Raises
        ------
        MalformedJson, MalformedBody, InvalidRequest
        """
        if self.decoder is None:
            return parse_request(model, body, limits)
        fields = self.beside["surface"]
        net = self.decoder.decode(body, fields.get("type"), limits.max_control_points)
        document = {**self.beside, "surface": with_fields(net, fields)}
        return validate_document(model, document, limits)


def posting(request: Request, formats: Sequence[AnyFormat] = ()) -> Posting[AnyFormat]:
    """What a request that posts a surface says before its body is read.

    Parameters
    ----------
    formats : sequence
        What the answer may be written in; the query has no `format` where there is no choice.

    Raises
    ------
    UnsupportedMediaType, InvalidQuery
    """
    decoder = body_type(request.headers.get("content-type"), DECODERS)
    query = request.query_params.multi_items()
    request.state.posts_file = decoder is not None  # tells what its errors point into
    if decoder is None:
        if not formats:
            no_parameters(request.query_params)
        return Posting(None, only_format(query, formats) if formats else None)
    try:
        beside = document_from_query(query)
    except InvalidRequest as error:
        raise InvalidQuery(*error.issues) from None
    named = by_name(str(beside.pop("format")), formats) if formats and "format" in beside else None
    return Posting(decoder, named, beside)
