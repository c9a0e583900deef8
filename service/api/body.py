"""Reads, parses and checks a request's body, and hands it to the route as a model.

`BodyRoute` does this in place of FastAPI, and calls the route's function with the model and the
`Context` (the pattern "Custom Request and APIRoute class" of FastAPI's documentation). It parses
long bodies in a thread, responds to every error in a body with a problem document, and also reads
files of control points, whose other fields are in the query. FastAPI still finds the route, handles
errors, and reads the function's signature for the OpenAPI document.
"""

from collections.abc import Callable, Coroutine, Mapping, Sequence
from contextlib import nullcontext
from functools import partial
from typing import Any, ClassVar, NamedTuple, cast

from fastapi import Request, Response
from fastapi.routing import APIRoute

from service.api.compression import compress_response
from service.api.computation import Computation
from service.api.intake import accept_call, accept_file, prefers_async
from service.api.media_types import check_content, decoder_of_body
from service.api.negotiation import (
    Pairs,
    format_by_accept,
    format_by_name,
    parse_format_query,
    read_query,
    refuse_parameters,
)
from service.api.receiving import read_body
from service.api.record import record_of
from service.api.services import Context, Services
from service.decoders.format import Decoded, Decoder
from service.encoders.format import FileFormat
from service.interpreter import pause_collection
from service.pipeline.calls import CALLS
from service.pipeline.files import build_file_request, check_beside
from service.pipeline.reading import plan_reading
from service.schemas.document import DocumentLimits, parse_document
from service.schemas.fields import RequestModel
from service.schemas.file_fields import document_from_query
from service.schemas.validation import parse_request
from service.settings.limits import file_limits

INLINE_BYTES, INLINE_TEXT, INLINE_OBJECTS = 1 << 18, 1 << 14, 32
"""Sizes up to which the event loop parses a body itself, within some 5 ms: bytes of JSON and binary
files; bytes of other texts; and objects in JSON, each of which may be a surface."""

INLINE_CAD = 1 << 13
"""Bytes of a CAD file up to which the event loop builds its surface itself."""

ARRAY_FACTOR = 4
"""Bytes of the arrays of a surface for each byte of its CAD file."""

COLLECTED_BYTES = 1 << 14
"""Bytes of JSON up to which the garbage collector stays on while the body is parsed: a body this
short has too few lists to start it often."""


class PostedFile(NamedTuple):
    """A body that is a file.

    Attributes
    ----------
    content : bytes
    decoder : Decoder
    beside : dict
        The other fields of the document, from the query.
    """

    content: bytes
    decoder: Decoder
    beside: dict[str, Any]


class BodyRoute(APIRoute):
    """A route whose body is a pydantic model, sent as JSON.

    Attributes
    ----------
    formats : sequence of FileFormat
        Formats of the response that `?format=` and `Accept` choose from.
    reads_accept : bool
        Whether `Accept` chooses too; otherwise only `?format=` chooses.
    decoders : sequence of Decoder
        Kinds of files that the body may be, besides JSON.
    has_surface_files : bool
        Whether such a file has the surface of the document.
    keeps_document : bool
        Whether the model has numbers as Python objects, not in arrays.
    """

    formats: ClassVar[Sequence[FileFormat]] = ()
    reads_accept: ClassVar[bool] = True
    decoders: ClassVar[Sequence[Decoder]] = ()
    has_surface_files: ClassVar[bool] = False
    keeps_document: ClassVar[bool] = False

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler: reads and parses the body, then calls the route's function."""
        assert self.body_field is not None
        return partial(self._respond, cast(type[Any], self.body_field.field_info.annotation))

    async def _respond(self, model: type[RequestModel], request: Request) -> Response:
        """The route's response to one request."""
        scope = request.scope
        headers = dict(scope["headers"])
        services: Services = scope["app"].state.services
        computation: Computation = scope["state"]["computation"]
        if services.threads.accounts.limit is not None:
            computation.check_compute_limit()  # before the body takes memory
        decoder = decoder_of_body(
            headers.get(b"content-type", b"").decode("latin-1"), self.decoders
        )
        if decoder is not None:  # errors then point into the file, or to these fields of the query
            scope["state"]["file_fields"] = decoder.fields
        name, other_fields = self._parse_query(request, decoder)
        fmt = self._choose_format(name, request)
        body = await read_body(request, headers, services, computation, decoder)
        context = Context(services, computation, request, fmt)
        if b"prefer" in headers and self._makes_job(services, headers):
            if decoder is None:
                parse_json = partial(parse_document, body, services.document_limits.max_depth)
                document = await computation.parse(parse_json, is_long=is_long_body(body, None))
                return await accept_call(context, self.path, document)
            job = await self.accept_job(model, PostedFile(body, decoder, other_fields), context)
            if job is not None:
                return job
        if decoder is None:
            parse = partial(_parse_json, model, body, services.document_limits)
            parsed = await computation.parse(parse, is_long=is_long_body(body, None))
        else:
            file = PostedFile(body, decoder, other_fields)
            parsed = await self._read_file(model, file, services, computation)
        if not self.keeps_document:
            # From here on the numbers of the body are in arrays, 8 bytes each. In JSON a number and
            # its comma take at least 2 bytes.
            computation.shrink_body(4 * len(body))
        response: Response = await self.endpoint(parsed, context)
        accepted = headers.get(b"accept-encoding")
        if accepted is None:
            return response
        return await compress_response(response, accepted, computation)

    def _makes_job(self, services: Services, headers: Mapping[bytes, bytes]) -> bool:
        """Whether the client prefers a job to waiting, and the call can be a part of one.

        A preference that does not fit is ignored, as RFC 7240 says.
        """
        return services.jobs is not None and self.path in CALLS and prefers_async(headers)

    def _parse_query(self, request: Request, decoder: Decoder | None) -> tuple[Any, dict[str, Any]]:
        """The format that the query names, or None; for a file also the document's other fields."""
        query: bytes = request.scope["query_string"]
        if decoder is None:
            if not self.formats:
                refuse_parameters(request.query_params)
            return parse_format_query(query) if query and self.formats else None, {}
        read = partial(self.read_fields, decoder=decoder)
        other_fields = read_query(read, request.query_params.multi_items())
        return other_fields.pop("format", None) if self.formats else None, other_fields

    def read_fields(self, pairs: Pairs, decoder: Decoder) -> dict[str, Any]:
        """The fields in the query of a file, in the form of a document; and `format`."""
        return document_from_query(pairs, decoder.fields)

    async def accept_job(
        self, model: type[RequestModel], file: PostedFile, context: Context
    ) -> Response | None:
        """Makes a job of a call whose body is a file; None if no job can be made of it."""
        if not self.has_surface_files:
            return None
        content, decoder, beside = file
        check_content(content, decoder)
        check_beside(model, decoder, beside, context.services.document_limits)
        return await accept_file(context, self.path, content, decoder)

    async def _read_file(
        self,
        model: type[RequestModel],
        file: PostedFile,
        services: Services,
        computation: Computation,
    ) -> RequestModel:
        """The model of a body that is a file, which has the query's fields too."""
        content, decoder, beside = file
        if decoder.is_cad:
            check_content(content, decoder)
            # A wrong option is named before a large file is read.
            check_beside(model, decoder, beside, services.document_limits)
        kind, limits = beside["surface"].get("type"), file_limits(services.settings)
        is_long = is_long_body(content, decoder)
        if decoder.child_bytes is None:
            read = partial(decoder.decode, content, kind, limits)
            parse = partial(_read_and_build, model, file, read, services.document_limits)
            return await computation.parse(parse, is_long=is_long)
        work = plan_reading(decoder, content, kind, limits, services.limits)
        decoded = await computation.run(work, "decode")
        computation.drop_work()
        computation.hold_body(ARRAY_FACTOR * len(content))
        build = partial(_build_file, model, file, decoded, services.document_limits)
        return await computation.parse(build, is_long=is_long)

    def _choose_format(self, name: str | None, request: Request) -> FileFormat | None:
        """The format with this name; without a name, the format that `Accept` chooses.

        None for a route without formats, and without a name also for a route that does not read
        `Accept`: the response is then JSON.
        """
        if name is not None:
            fmt = format_by_name(name, self.formats)
        elif self.formats and self.reads_accept:
            fmt = format_by_accept(request.headers.get("accept"), self.formats)
        else:
            return None
        record_of(request.scope).format = fmt.name
        return fmt


def is_long_body(body: bytes, decoder: Decoder | None) -> bool:
    """Whether parsing the body would block the event loop for too long."""
    if decoder is None:
        return len(body) > INLINE_BYTES or body.count(b"{") > INLINE_OBJECTS
    if decoder.is_cad:
        return len(body) > INLINE_CAD
    return len(body) > (INLINE_BYTES if decoder.is_binary else INLINE_TEXT)


def _parse_json(model: type[RequestModel], body: bytes, limits: DocumentLimits) -> RequestModel:
    """The model of a JSON body, checked; its surface or curve is built too: this may take long."""
    # JSON has no reference cycles, so the collector would search in vain.
    with pause_collection() if len(body) > COLLECTED_BYTES else nullcontext():
        parsed = parse_request(model, body, limits)
    parsed.build()
    return parsed


def _read_and_build(
    model: type[RequestModel],
    file: PostedFile,
    read: Callable[[], Decoded],
    limits: DocumentLimits,
) -> RequestModel:
    """The model of a file that `read` reads."""
    return _build_file(model, file, read(), limits)


def _build_file(
    model: type[RequestModel], file: PostedFile, decoded: Decoded, limits: DocumentLimits
) -> RequestModel:
    """The model of a file, checked; its surface is built too."""
    with pause_collection() if file.decoder.is_cad else nullcontext():
        parsed = build_file_request(model, file.decoder, decoded, file.beside, limits)
        parsed.build()
    return parsed
