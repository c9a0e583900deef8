"""Bodies of requests: read within limits, parsed, checked, and handed to the route as a model.

FastAPI calls `Request.body()` and `Request.json()` of a route before its dependencies. `BodyRoute`
reads and parses the body before FastAPI does, in a thread if it is long, and gives FastAPI a
request whose body is the model already (the pattern "Custom Request and APIRoute class" of
FastAPI's documentation). So errors in a body are ours, and a file of control points comes through
the same door as JSON: what JSON would say beside the points stands in the query.
"""

import re
from asyncio import timeout
from collections.abc import Callable, Coroutine, Sequence
from functools import partial
from typing import Any, ClassVar, cast

from fastapi import Request, Response
from fastapi.routing import APIRoute

from service.api.negotiation import by_accept, by_name, no_parameters, only_format
from service.api.observing.record import record_of
from service.api.problems import BodyTooLarge, BodyTooSlow, InvalidQuery, UnsupportedMediaType
from service.api.services import Services
from service.api.workers import Job
from service.decoders.format import Decoder
from service.encoders.format import FileFormat
from service.errors import InvalidRequest, Issue
from service.schemas.document import Budget
from service.schemas.fields import RequestModel
from service.schemas.surface_query import document_from_query, with_fields
from service.schemas.validation import parse_request, validate_document
from service.settings.values import Settings

INLINE_BYTES, INLINE_TEXT, INLINE_OBJECTS = 1 << 18, 1 << 14, 32
"""Bodies up to these sizes are parsed within some 5 ms: JSON and binary files; other texts; and
objects in JSON, of which each may be a surface."""


class ParsedRequest(Request):
    """A request whose body is a model."""

    model: RequestModel

    async def body(self) -> Any:
        """The model: FastAPI takes it for the bytes of a file."""
        return self.model

    async def json(self) -> Any:
        """The model."""
        return self.model


class BodyRoute(APIRoute):
    """A route whose body is a pydantic model, sent as JSON.

    Attributes
    ----------
    formats : sequence of FileFormat
        Formats among which `?format=` and `Accept` choose that of the answer.
    accepts_any : bool
        Whether `Accept` chooses, too; else only `?format=`.
    decoders : sequence of Decoder
        Files that the body may be.
    """

    formats: ClassVar[Sequence[FileFormat]] = ()
    accepts_any: ClassVar[bool] = True
    decoders: ClassVar[Sequence[Decoder]] = ()

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """FastAPI's handler, behind the one that reads and parses the body."""
        handler = super().get_route_handler()
        assert self.body_field is not None
        model = cast(type[RequestModel], self.body_field.field_info.annotation)

        async def handle(request: Request) -> Response:
            parsed = ParsedRequest(request.scope, request.receive)
            parsed.model = await self._read(request, model)
            return await handler(parsed)

        return handle

    async def _read(self, request: Request, model: type[RequestModel]) -> RequestModel:
        """The body as a model, with the format of the answer in `request.state.format`."""
        services: Services = request.app.state.services
        job: Job = request.state.job
        headers = request.headers
        decoder = body_type(headers.get("content-type"), self.decoders)
        request.state.posts_file = decoder is not None  # errors then point into file and query
        beside = self._query(request, decoder)
        fmt = None
        if "format" in beside and self.formats:
            fmt = by_name(str(beside.pop("format")), self.formats)
        elif self.formats and self.accepts_any:
            fmt = by_accept(headers.get("accept"), self.formats)
        request.state.format = fmt
        if fmt is not None:
            record_of(request.scope).format = fmt.name
        with job.timing.step("read"):
            body = await _read_bytes(request, services, job, decoder)
        parse = partial(_parse, model, body, decoder, beside, services)
        result = await job.parse(parse, is_long=is_long_body(body, decoder))
        job.shrink_body(4 * len(body))  # a number has at least 2 letters, and 8 bytes in an array
        return result

    def _query(self, request: Request, decoder: Decoder | None) -> dict[str, Any]:
        """What the query says: beside a file all but the control points, else only a format."""
        if decoder is None and not request.scope["query_string"]:
            return {}
        query = request.query_params.multi_items()
        if decoder is None:
            if not self.formats:
                no_parameters(request.query_params)
                return {}
            named = only_format(query)
            return {} if named is None else {"format": named}
        try:
            return document_from_query(query)
        except InvalidRequest as error:
            raise InvalidQuery(*error.issues) from None


def is_long_body(body: bytes, decoder: Decoder | None) -> bool:
    """Whether the event loop has no time to parse a body."""
    if decoder is None:
        return len(body) > INLINE_BYTES or body.count(b"{") > INLINE_OBJECTS
    return len(body) > (INLINE_BYTES if decoder.binary else INLINE_TEXT)


def _parse(
    model: type[RequestModel],
    body: bytes,
    decoder: Decoder | None,
    beside: dict[str, Any],
    services: Services,
) -> RequestModel:
    """The checked model with its surface or curve built."""
    limits = services.documents
    if decoder is None:
        parsed = parse_request(model, body, limits)
    else:
        fields = beside["surface"]
        net = decoder.decode(body, fields.get("type"), limits.max_control_points)
        document = {**beside, "surface": with_fields(net, fields)}
        parsed = validate_document(model, document, limits)
    parsed.build()
    return parsed


async def _read_bytes(
    request: Request, services: Services, job: Job, decoder: Decoder | None
) -> bytes:
    """The whole body; its memory is claimed as it arrives.

    Raises
    ------
    UnsupportedMediaType, BodyTooLarge, BodyTooSlow, InvalidRequest, TooLarge, Busy
    """
    settings, limits = services.settings, services.documents
    if request.headers.get("content-encoding", "identity").lower() != "identity":
        message, needed = "Bodies are taken uncompressed.", "no encoding, or identity"
        issue = Issue("unsupported_encoding", message, "/Content-Encoding", "an encoding", needed)
        raise UnsupportedMediaType(issue)
    largest = largest_body(settings, is_json=decoder is None)
    declared = request.headers.get("content-length", "")
    # The server has checked that it is a number; twenty digits are enough to see that it is large.
    if declared.isdecimal() and int(declared[:20]) > largest:
        raise body_too_large(settings, is_json=decoder is None)
    count = Budget(limits)
    chunks: list[bytes] = []
    received = 0
    try:
        async with timeout(settings.body_timeout):
            async for chunk in request.stream():
                received += len(chunk)
                if received > largest:
                    raise body_too_large(settings, is_json=decoder is None)
                if decoder is None:
                    count.take(chunk)
                job.hold_body(decoder.memory(received) if decoder else count.memory)
                chunks.append(chunk)
    except TimeoutError:
        raise body_too_slow(received, settings) from None
    return b"".join(chunks)


def body_type(content_type: str | None, decoders: Sequence[Decoder] = ()) -> Decoder | None:
    """The decoder of a body of this Content-Type; None for JSON in UTF-8.

    Raises
    ------
    UnsupportedMediaType
        For any other body.
    """
    media_type, charset = _media_type(content_type)
    is_utf8 = charset in ("utf-8", "utf8", "us-ascii")
    for decoder in decoders:
        if decoder.media_type == media_type and (is_utf8 or decoder.binary):
            return decoder
    is_json = media_type == "application/json" or (
        media_type.startswith("application/") and media_type.endswith("+json")
    )
    if is_json and is_utf8:
        return None
    names = ", ".join(("application/json", *(decoder.media_type for decoder in decoders)))
    message = "The header does not say that the body is of a type that is taken here."
    got, needed = "another type" if content_type else "no type", f"{names}; texts in UTF-8"
    raise UnsupportedMediaType(
        Issue("unsupported_media_type", message, "/Content-Type", got, needed)
    )


_PARAMETER = re.compile(r';\s*([^\s=;"]+)=(?:"((?:[^"\\]|\\.)*)"|([^\s;"]*))')


def _media_type(content_type: str | None) -> tuple[str, str]:
    """Media type and charset of a header, in lower case (RFC 9110, section 8.3.1)."""
    media_type, semicolon, rest = (content_type or "").partition(";")
    for name, quoted, plain in _PARAMETER.findall(semicolon + rest):
        if name.lower() == "charset":
            return media_type.strip().lower(), (quoted or plain).lower()
    return media_type.strip().lower(), "utf-8"


def largest_body(settings: Settings, *, is_json: bool) -> int:
    """Bytes of the longest body that is read."""
    most = settings.max_body_bytes
    return min(most, settings.max_json_bytes) if is_json else most


def body_too_large(settings: Settings, *, is_json: bool) -> BodyTooLarge:
    """The refusal of a body that is too long."""
    most = largest_body(settings, is_json=is_json)
    needed = f"at most {most} bytes"
    if most < settings.max_body_bytes:
        needed += "; a larger net can be sent as a .npy file"
    got = f"more than {most} bytes"
    return BodyTooLarge(
        Issue("body_too_large", "The body is larger than this service reads.", "", got, needed)
    )


def body_too_slow(received: int, settings: Settings) -> BodyTooSlow:
    """The refusal of a body that does not come to its end."""
    got, needed = f"{received} bytes", f"all of it within {settings.body_timeout:g} s"
    return BodyTooSlow(Issue("body_too_slow", "The body did not arrive in time.", "", got, needed))
