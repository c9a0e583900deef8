"""Targets of fuzzing: functions that call each parser as the service does, with arbitrary bytes.

A target may return, or raise a `SurfaceError`, with which the service refuses a request. Any other
exception is a finding.
"""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Any
from urllib.parse import parse_qsl

from pydantic import SecretStr
from starlette.types import Message, Receive, Scope, Send
from uvicorn.server import ServerState

from service.api.app import create_app
from service.api.caching.cached_response import matches_all, parse_tags
from service.api.guard.keys import (
    find_entry,
    format_entry,
    join_entries,
    parse_bearer,
    parse_entries,
)
from service.api.guard.proxies import Proxies
from service.api.guard.signatures import Signer
from service.api.media_types import decoder_of_body
from service.api.negotiation import codings_by_header, format_by_accept, format_by_name
from service.api.record import caller_trace_id
from service.decoders.format import FileLimits
from service.decoders.registry import BY_NAME as DECODERS
from service.decoders.registry import DECODERS as ALL_DECODERS
from service.encoders.registry import FORMATS
from service.errors import InvalidSettings, SurfaceError
from service.schemas.budget import DocumentBudget
from service.schemas.convert import ConvertRequest
from service.schemas.curves import CurveRequest
from service.schemas.document import DocumentLimits
from service.schemas.file_fields import FIELDS, add_fields, document_from_query
from service.schemas.intersect import IntersectRequest
from service.schemas.queries import MeasureRequest, PointsRequest, ProjectRequest
from service.schemas.query import canonical_query, parse_mesh_query
from service.schemas.request import MeshRequest, SignRequest, SurfaceRequest
from service.schemas.validation import parse_request, validate_document
from service.server.run import make_server
from service.settings.values import Settings
from service.storage.canonical import canonical_content, restore_surface
from tools.wire import Wire

KEY = "sfk_" + "0123456789abcdef" * 4
SECRET = "0123456789abcdef" * 2
"""The key and the signing secret of the fuzzed requests, which no service uses."""

LIMITS = DocumentLimits(max_control_points=20_000)
SETTINGS = Settings(
    cors_origins=("http://x",),
    max_body_bytes=1 << 20,
    max_vertices=2_000,
    max_points=2_000,
    max_control_points=2_000,
    memory_bytes=1 << 26,
    store_quota=1 << 22,
    trusted_proxies=("127.0.0.1",),
    api_keys=(format_entry("fuzzer", KEY),),
    signing_keys=(SecretStr(SECRET),),
    rate_limit=1_000_000,
    log_level="error",
)


def parse_json(content: bytes) -> None:
    """Parses a body as JSON for each kind of request."""
    DocumentBudget(LIMITS).take(content)  # refuses too many values
    calls: tuple[Callable[[], object], ...] = (
        lambda: _check_restored(parse_request(SurfaceRequest, content, LIMITS).to_surface()),
        lambda: parse_request(MeshRequest, content, LIMITS).to_surface(),
        lambda: parse_request(PointsRequest, content, LIMITS).to_query(),
        lambda: parse_request(ProjectRequest, content, LIMITS).to_query(),
        lambda: _parse_intersection(content),
        lambda: parse_request(MeasureRequest, content, LIMITS).to_query(),
        lambda: parse_request(ConvertRequest, content, LIMITS).to_operations(),
        lambda: parse_request(CurveRequest, content, LIMITS),
        lambda: parse_request(SignRequest, content, LIMITS),
    )
    for call in calls:
        with suppress(SurfaceError):
            call()


def _parse_intersection(content: bytes) -> object:
    """The rays or the planes of a request."""
    request = parse_request(IntersectRequest, content, LIMITS)
    return request.to_query() if request.planes is None else request.to_sections()


def _check_restored(surface: Any) -> None:
    """Raises if a surface that is restored from its stored content has other content."""
    content = canonical_content(surface)
    if canonical_content(restore_surface(content, LIMITS)) != content:
        raise AssertionError("a stored surface differs after it is restored")


def _build_file_target(name: str) -> Callable[[bytes], None]:
    """A target that decodes a file of this format."""

    def decode_file(content: bytes) -> None:
        kind = None  # the file decides
        surface = DECODERS[name].decode(content, kind, FileLimits()).tree
        if "homogeneous" in DECODERS[name].fields:
            homogeneous = add_fields(surface, {"homogeneous": True})
            with suppress(SurfaceError):
                _check_restored(
                    validate_document(SurfaceRequest, {"surface": homogeneous}, LIMITS).to_surface()
                )
        validate_document(SurfaceRequest, {"surface": surface}, LIMITS).to_surface()

    return decode_file


def parse_query(content: bytes) -> None:
    """Parses the query of the URL of a mesh, and the query of a request with a file."""
    pairs = parse_qsl(content.decode("latin-1"), keep_blank_values=True)
    try:
        options = parse_mesh_query(pairs)
    except SurfaceError:
        pass
    else:
        query = canonical_query(options)
        if canonical_query(parse_mesh_query(parse_qsl(query))) != query:
            raise AssertionError("parsing the canonical query gives another query")
    document = document_from_query(pairs, tuple(FIELDS))
    format_by_name(str(document.get("format")), FORMATS)


def restore_content(content: bytes) -> None:
    """Restores a surface from its stored content."""
    _check_restored(restore_surface(content, LIMITS))


def parse_headers(content: bytes) -> None:
    """Parses the bytes as the value of each of these headers.

    If-None-Match, traceparent, Authorization, X-Forwarded-For, Accept, Accept-Encoding and
    Content-Type.
    """
    text = content.decode("latin-1")
    matches_all(content)
    parse_tags(content)
    caller_trace_id(content)
    if find_entry(parse_bearer(content) or b"", _KEYS) and content.count(KEY.encode()) != 1:
        raise AssertionError("another text is accepted as the key")
    scope = {"client": ("10.0.0.1", 1), "headers": [(b"x-forwarded-for", content)]}
    _PROXIES.set_client(scope)
    calls: tuple[Callable[[], object], ...] = (
        lambda: format_by_accept(text, FORMATS),
        lambda: codings_by_header(content),
        lambda: decoder_of_body(text, ALL_DECODERS),
    )
    for call in calls:
        try:
            call()
        except SurfaceError:
            continue


_KEYS = parse_entries([format_entry("fuzzer", KEY)])
_PROXIES = Proxies(["10.0.0.0/8", "fd00::/8"])


def parse_keys(content: bytes) -> None:
    """Parses a file of API keys."""
    with suppress(InvalidSettings):
        join_entries(parse_entries(content.decode("utf-8", "replace").splitlines()), _KEYS)


_SIGNER = Signer([SECRET, SECRET[::-1]])  # two different secrets, as during a rotation
_PATH = "/v1/surfaces/saddle/mesh.glb"
_NOW, _EXPIRES = 1_900_000_000, 2_000_000_000
"""The Unix times of the requests, and of the expiry of signatures."""


def check_signature(content: bytes) -> None:
    """Checks signatures: the query is refused as it is, and accepted after the target signed it."""
    try:
        text = _SIGNER.sign(_PATH, content.decode("latin-1"), _EXPIRES)
    except ValueError:
        pass  # signed already, or not a query
    else:
        if text.isascii():
            _SIGNER.verify(_PATH, text.encode(), _NOW)
    # Must raise a `SurfaceError`.
    _SIGNER.verify(_PATH, content, _NOW)
    raise AssertionError("the service accepted an invalid signature")


class Connection(Wire):
    """The transport that the protocol of the server writes to.

    Unlike a `Wire`, it has addresses, and may be written to after it is closed.
    """

    def __init__(self) -> None:
        super().__init__()
        self._extra = {"peername": ("127.0.0.1", 1), "sockname": ("127.0.0.1", 2)}

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.sent_bytes += data


class _RunningService:
    """The application and the HTTP protocol of the server on an event loop, and their failures."""

    def __init__(self) -> None:
        self.loop = asyncio.new_event_loop()
        asyncio.set_event_loop(self.loop)
        self.loop.set_exception_handler(self._add_failure)
        self.failures: list[BaseException] = []
        self.app = create_app(SETTINGS)
        self.config = make_server(self._call_app, SETTINGS, interface="asgi3").config
        self.config.load()

    def receive(self, content: bytes) -> None:
        """Receives these bytes from a client, which then disconnects; raises the first failure."""
        self.failures.clear()
        self.loop.run_until_complete(self._receive(content))
        if self.failures:
            raise self.failures[0]

    async def _receive(self, content: bytes) -> None:
        state, wire = ServerState(), Connection()
        protocol_class: Callable[..., asyncio.Protocol] = self.config.http_protocol_class
        protocol = protocol_class(config=self.config, server_state=state, app_state={})
        protocol.connection_made(wire)
        # Two halves, so that a part of a request arrives alone.
        middle = len(content) // 2
        for chunk in (content[:middle], content[middle:]):
            if not wire.is_closed:
                protocol.data_received(chunk)
                await asyncio.sleep(0)
        for _ in range(3):
            await asyncio.sleep(0)
        protocol.connection_lost(None)
        if state.tasks:
            await asyncio.wait(state.tasks)
        if b"HTTP/1.1 500" in wire.sent_bytes:
            self.failures.append(AssertionError("the server itself failed"))

    async def _call_app(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_checked(message: Message) -> None:
            if message["type"] == "http.response.start" and message["status"] >= 500:
                self.failures.append(AssertionError(f"the status is {message['status']}"))
            await send(message)

        try:
            await self.app(scope, receive, send_checked)
        except BaseException as error:
            self.failures.insert(0, error)
            raise

    def _add_failure(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        self.failures.append(context.get("exception") or AssertionError(context["message"]))


_service: list[_RunningService] = []


def receive_connection(content: bytes) -> None:
    """Sends bytes on a connection to the server and the application."""
    if not _service:
        _service.append(_RunningService())
    _service[0].receive(content)


TARGETS: dict[str, Callable[[bytes], None]] = {
    "json": parse_json,
    "npy": _build_file_target("npy"),
    "oogl": _build_file_target("oogl"),
    "teapot": _build_file_target("teapot"),
    "obj": _build_file_target("obj"),
    "geomdl": _build_file_target("geomdl"),
    "query": parse_query,
    "content": restore_content,
    "header": parse_headers,
    "keys": parse_keys,
    "signed": check_signature,
    "protocol": receive_connection,
}
"""The targets by their names on the command line."""
