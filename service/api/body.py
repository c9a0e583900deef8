"""Bodies of requests: read within limits, parsed, checked, and handed to the route as a model.

`BodyRoute` reads and parses the body in place of FastAPI, in a thread if it is long, and calls the
function of the route with the model and the `Context` (the pattern "Custom Request and APIRoute
class" of FastAPI's documentation). So errors in a body are ours, and a file of control points comes
the same way as JSON: what JSON would say beside the points stands in the query. FastAPI finds the
route, handles errors, and reads the function's signature for the OpenAPI document.
"""

import re
from asyncio import timeout
from collections.abc import Callable, Coroutine, Mapping, Sequence
from contextlib import nullcontext
from functools import partial
from typing import Any, ClassVar, cast

from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.requests import ClientDisconnect

from service.api.negotiation import by_accept, by_name, no_parameters, only_format
from service.api.observing.record import record_of
from service.api.problems import BodyTooLarge, BodyTooSlow, InvalidQuery, UnsupportedMediaType
from service.api.services import Context, Services
from service.api.workers import Job
from service.decoders.format import Decoder
from service.encoders.format import FileFormat
from service.errors import InvalidRequest, Issue
from service.schemas.document import Budget
from service.schemas.fields import RequestModel
from service.schemas.surface_query import document_from_query, with_fields
from service.schemas.validation import parse_request, validate_document
from service.settings.runtime import pause_collection
from service.settings.values import Settings

INLINE_BYTES, INLINE_TEXT, INLINE_OBJECTS = 1 << 18, 1 << 14, 32
"""Bodies up to these sizes are parsed within some 5 ms: JSON and binary files; other texts; and
objects in JSON, of which each may be a surface."""


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
        """The handler that reads and parses the body, and calls the route's function."""
        assert self.body_field is not None
        return partial(self._answer, cast(type[Any], self.body_field.field_info.annotation))

    async def _answer(self, model: type[RequestModel], request: Request) -> Response:
        """The answer of the route's function to a request with a body of this model."""
        scope = request.scope
        headers = dict(scope["headers"])
        services: Services = scope["app"].state.services
        job: Job = scope["state"]["job"]
        decoder = body_type(headers.get(b"content-type", b"").decode("latin-1"), self.decoders)
        scope["state"]["posts_file"] = decoder is not None  # errors then point into file and query
        name, beside = self._query(request, decoder)
        fmt = self._format(name, request)
        body = await _read_body(request, headers, services, job, decoder)
        parse = partial(_parse, model, body, decoder, beside, services)
        wanted = await job.parse(parse, is_long=is_long_body(body, decoder))
        job.shrink_body(4 * len(body))  # a number has at least 2 letters, and 8 bytes in an array
        response: Response = await self.endpoint(wanted, Context(services, job, request, fmt))
        return response

    def _query(self, request: Request, decoder: Decoder | None) -> tuple[Any, dict[str, Any]]:
        """What the query says: a format; and beside a file, all but the control points."""
        query: bytes = request.scope["query_string"]
        if decoder is None:
            if not self.formats:
                no_parameters(request.query_params)
            return only_format(query) if query and self.formats else None, {}
        try:
            beside = document_from_query(request.query_params.multi_items())
        except InvalidRequest as error:
            raise InvalidQuery(*error.issues) from None
        return str(beside.pop("format")) if self.formats and "format" in beside else None, beside

    def _format(self, name: str | None, request: Request) -> FileFormat | None:
        """The format of the answer: the one of this name, else one that `Accept` chooses."""
        if name is not None:
            fmt = by_name(name, self.formats)
        elif self.formats and self.accepts_any:
            fmt = by_accept(request.headers.get("accept"), self.formats)
        else:
            return None
        record_of(request.scope).format = fmt.name
        return fmt


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
        with pause_collection() if len(body) > INLINE_TEXT else nullcontext():
            parsed = parse_request(model, body, limits)
    else:
        fields = beside["surface"]
        net = decoder.decode(body, fields.get("type"), limits.max_control_points)
        document = {**beside, "surface": with_fields(net, fields)}
        parsed = validate_document(model, document, limits)
    parsed.build()
    return parsed


async def _read_body(
    request: Request,
    headers: Mapping[bytes, bytes],
    services: Services,
    job: Job,
    decoder: Decoder | None,
) -> bytes:
    """The whole body; its memory is claimed as it arrives.

    Raises
    ------
    UnsupportedMediaType, BodyTooLarge, BodyTooSlow, InvalidRequest, TooLarge, Busy
    """
    settings = services.settings
    if headers.get(b"content-encoding", b"identity").lower() != b"identity":
        message, needed = "Bodies are taken uncompressed.", "no encoding, or identity"
        issue = Issue("unsupported_encoding", message, "/Content-Encoding", "an encoding", needed)
        raise UnsupportedMediaType(issue)
    largest = largest_body(settings, is_json=decoder is None)
    declared = headers.get(b"content-length", b"")
    # The server has checked that it is a number; twenty digits are enough to see that it is large.
    if declared.isdigit() and int(declared[:20]) > largest:
        raise body_too_large(settings, is_json=decoder is None)
    count = Budget(services.documents)
    chunks: list[bytes] = []
    received, is_complete = 0, False
    try:
        with job.timing.step("read"):
            async with timeout(settings.body_timeout):
                while not is_complete:
                    event = await request.receive()
                    if event["type"] == "http.disconnect":
                        raise ClientDisconnect
                    chunk = event.get("body", b"")
                    is_complete = not event.get("more_body", False)
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


def body_type(content_type: str, decoders: Sequence[Decoder] = ()) -> Decoder | None:
    """The decoder of a body of this Content-Type; None for JSON in UTF-8.

    Raises
    ------
    UnsupportedMediaType
        For any other body.
    """
    if content_type == "application/json":  # most often
        return None
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


def _media_type(content_type: str) -> tuple[str, str]:
    """Media type and charset of a header, in lower case (RFC 9110, section 8.3.1)."""
    media_type, semicolon, rest = content_type.partition(";")
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
