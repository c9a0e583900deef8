"""The middleware around all requests: request ids, and log lines without texts of clients."""

import asyncio
import json
from collections.abc import Callable, Iterator
from typing import Any, Literal

import pytest
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.app import create_app
from service.api.cors import Origins
from service.api.observing.metrics import RequestCounters
from service.api.observing.middleware import AccessLog, RequestMiddleware
from service.api.record import RouteLabels, record_of
from service.settings.values import Settings
from tests.server.test_logs import TIME
from tools.client import Client, start_client

TRACE, SPAN = "0af7651916cd43dd8448eb211c80319c", "b7ad6b7169203331"
PARENT = f"00-{TRACE}-{SPAN}-01"
NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]
MESH = "/v1/surfaces/saddle/mesh.glb?resolution=2"


class LoggedClient:
    """A client, and the log lines of its requests."""

    def __init__(self, client: Client, lines: list[str]) -> None:
        self.client, self.lines = client, lines

    def read_last_line(self) -> dict[str, Any]:
        """The fields of the last log line."""
        fields: dict[str, Any] = json.loads(self.lines[-1])
        return fields


@pytest.fixture
def logged() -> Iterator[LoggedClient]:
    lines: list[str] = []
    with start_client(create_app(Settings(log_format="json"), lines.append)) as client:
        yield LoggedClient(client, lines)


def send_request(
    headers: list[tuple[bytes, bytes]],
    settings: Settings | None = None,
    path: str = "/",
    error: Exception | None = None,
    *,
    method: str = "GET",
    starts_response: bool = False,
    tracing: Callable[[ASGIApp], ASGIApp] = lambda app: app,
) -> tuple[list[Message], list[str], RequestCounters]:
    """The messages, log lines and counters of a request to an application behind the middleware.

    The application responds with 204; or raises `error`, before or after the start of its response.
    As the guard does, it records the key `alice` and the address 2001:db8::1, and for the path
    /refused the code `a_code`. `tracing` wraps the application in its middleware.
    """
    messages: list[Message] = []
    lines: list[str] = []
    counters = RequestCounters()

    async def respond(scope: Scope, _: Receive, send: Send) -> None:
        record = record_of(scope)
        record.code, record.key = "a_code" if path == "/refused" else "", "alice"
        scope["client"] = ("2001:db8::1", 1)
        if error and not starts_response:
            raise error
        await send({"type": "http.response.start", "status": 204, "headers": []})
        if error:
            raise error
        await send({"type": "http.response.body"})

    async def send(message: Message) -> None:
        messages.append(message)

    async def receive() -> Message:
        raise AssertionError("a body was read")

    log = AccessLog(settings or Settings(), lines.append)
    middleware = RequestMiddleware(tracing(respond), RouteLabels([]), counters, log, Origins(()))
    asyncio.run(middleware(build_scope(method, path, headers), receive, send))
    assert counters.registry.get_sample_value("surface_http_requests_in_flight") == 0
    return messages, lines, counters


def build_scope(method: str, path: str, headers: list[tuple[bytes, bytes]]) -> Scope:
    server = {"scheme": "http", "http_version": "1.1", "server": ("127.0.0.1", 80), "state": {}}
    return {"type": "http", "method": method, "path": path, "headers": headers, **server}


def test_every_response_has_an_id_in_its_header_only(logged: LoggedClient) -> None:
    for url, status in ((MESH, 200), (MESH, 200), ("/nowhere", 404), ("/health/live", 200)):
        response = logged.client.get(url, headers={"X-Request-Id": "mine-1"})
        assert (response.status_code, response.headers["x-request-id"]) == (status, "mine-1")
    refusal = logged.client.post("/v1/mesh", {"surface": 1}, headers={"X-Request-Id": "mine-2"})
    assert (refusal.status_code, refusal.headers["x-request-id"]) == (422, "mine-2")
    assert b"mine" not in refusal.content


def test_a_request_has_the_trace_id_of_its_caller(logged: LoggedClient) -> None:
    logged.client.get(MESH, headers={"traceparent": PARENT, "X-Request-Id": "mine"})
    line = logged.read_last_line()
    assert (line["trace_id"], line["request_id"]) == (TRACE, "mine")
    assert line["span_id"] != SPAN
    # Trace Context forbids capital letters, so this header is ignored.
    logged.client.get(MESH, headers={"traceparent": PARENT.upper()})
    assert logged.read_last_line()["trace_id"] != TRACE


def test_two_traceparent_headers_are_ignored() -> None:
    headers = [(b"traceparent", PARENT.encode())] * 2
    _, (line,), _ = send_request(headers, Settings(log_format="json"))
    assert json.loads(line)["trace_id"] != TRACE


def test_a_log_line_has_only_the_documented_fields(logged: LoggedClient) -> None:
    logged.client.get(f"{MESH}&expires=1&signature=hush")
    body = {"surface": {"control_net": NET, "name": "hush"}, "resolution": 2}
    assert logged.client.post("/v1/mesh?format=glb", body).status_code == 200
    line = logged.read_last_line()
    assert line.keys() == {
        *("time", "level", "event", "request_id", "trace_id", "span_id", "method", "route"),
        *("status", "bytes", "ms", "client", "format"),
    }
    assert (line["event"], line["route"], line["status"]) == ("request", "/v1/mesh", 200)
    assert (line["method"], line["format"], line["level"]) == ("POST", "glb", "info")
    logged.client.get("/v1/surfaces/hush/mesh.glb", headers={"Authorization": "Bearer hush"})
    assert logged.read_last_line()["code"] == "unknown_surface"
    assert "hush" not in "".join(logged.lines)


def test_log_lines_say_whether_the_response_was_cached(logged: LoggedClient) -> None:
    for expected in ("miss", "hit", "hit"):
        response = logged.client.get_raw(MESH)
        line = logged.read_last_line()
        assert (line["cache"], line["surface"], line["format"]) == (expected, "saddle", "glb")
        assert line["bytes"] == len(response.content)
    logged.client.request("HEAD", MESH)
    assert logged.read_last_line()["bytes"] == 0


def test_hostile_texts_do_not_break_or_enter_log_lines(logged: LoggedClient) -> None:
    hostile = "%0a%0dINFO:%20forged%1b%5b31m%e2%80%a8%c2%85%00"
    for path in ("/", f"/{hostile}", f"/v1/surfaces/{hostile}", f"/v1/surfaces/{hostile}/mesh.a"):
        logged.client.get(path, headers={"X-Request-Id": "\x1b[31m"})
    assert len(logged.lines) == 4
    for line in logged.lines:
        assert line.endswith("\n")
        assert "forged" not in line
        assert line[:-1].isprintable()


def test_log_lines_have_the_key_and_the_address_that_the_guard_recorded() -> None:
    _, (line,), _ = send_request([], Settings(log_format="json"))
    assert (json.loads(line)["key"], json.loads(line)["client"]) == ("alice", "2001:db8::1")


def test_text_lines_have_the_code_the_key_and_the_request_id_in_brackets() -> None:
    _, (line,), _ = send_request([(b"x-request-id", b"mine")], path="/refused")
    head, _, tail = line.partition(" ms")
    time, head = head.split(" ", 1)
    assert TIME.fullmatch(time)
    assert head.startswith('INFO:     2001:db8::1 - "GET (no such path)" 204, 0 bytes, ')
    assert tail == " (a_code, key alice, id mine)\n"


@pytest.mark.parametrize(
    ("level", "fails", "is_logged"),
    [
        ("info", False, True),
        ("warning", False, False),
        ("error", True, True),
        ("debug", False, True),
    ],
)
def test_the_log_level_selects_the_lines(
    level: Literal["debug", "info", "warning", "error"], fails: bool, is_logged: bool
) -> None:
    settings = Settings(log_level=level)
    error = ZeroDivisionError("hush") if fails else None
    _, lines, _ = send_request([], settings, error=error)
    assert bool(lines) == is_logged
    assert "hush" not in "".join(lines)
    assert send_request([], Settings(log_level=level, access_log=False))[1] == []


@pytest.mark.parametrize("path", ["/health/live", "/health/ready", "/metrics"])
def test_requests_of_monitoring_are_logged_only_at_level_debug(path: str) -> None:
    lines: list[str] = []
    for level, count in (("info", 0), ("debug", 1)):
        app = create_app(Settings.model_validate({"log_level": level}), lines.append)
        with start_client(app) as client:
            client.get(path)
        assert len(lines) == count


def test_an_internal_error_gives_a_problem_and_a_traceback_in_the_log(
    caplog: pytest.LogCaptureFixture,
) -> None:
    (start, *body), (line,), counters = send_request([], error=ZeroDivisionError("hush"))
    assert start["status"] == 500
    content = b"".join(message.get("body", b"") for message in body)
    assert b"internal_error" in content
    assert b"hush" not in content
    assert line.split(" ", 1)[1].startswith("ERROR:    ")
    assert counters.refusals == {"internal_error": 1}
    (record,) = caplog.records
    assert record.exc_info is not None
    assert record.exc_info[0] is ZeroDivisionError


def test_an_error_after_the_start_of_a_response_leaves_it_incomplete() -> None:
    messages, (line,), _ = send_request([], error=ZeroDivisionError("hush"), starts_response=True)
    assert [message["type"] for message in messages] == ["http.response.start"]
    assert '" 204, 0 bytes' in line


def test_methods_that_http_does_not_define_are_logged_as_other() -> None:
    _, (line,), counters = send_request([], Settings(log_format="json"), method="BREW\n")
    assert json.loads(line)["method"] == "other"
    labels = {"route": "unmatched", "method": "other", "status": "2xx"}
    name = "surface_http_request_duration_seconds_count"
    assert counters.registry.get_sample_value(name, labels) == 1


def test_every_computation_has_a_server_timing_header(client: Client) -> None:
    # By path: the names of the expected steps, separated by spaces, and the response.
    calls = {"/v1/surfaces/saddle": ("surface definition", client.get("/v1/surfaces/saddle"))}
    for path, item in client.get("/openapi.json").json()["paths"].items():
        content = item.get("post", {}).get("requestBody", {}).get("content", {})
        if "application/json" in content:
            examples = content["application/json"]["examples"]
            body = next(iter(examples.values()))["value"]
            named = {"/v1/surfaces": "content store", "/v1/jobs": "check store"}
            step = named.get(path, path.removeprefix("/v1/"))
            plain = {"Accept-Encoding": "identity"}
            calls[path] = (f"read parse {step}", client.post(path, body, plain))
    for path, (steps, response) in calls.items():
        assert response.status_code in (200, 201, 202), response.text
        parts = [part.partition(";dur=") for part in response.headers["server-timing"].split(", ")]
        names = [name for name, _, _ in parts]
        # Only work in a thread waits.
        message = f"{path}: `computation.run(work, name)` names the work after the path"
        assert [name for name in names if name != "wait"] == steps.split(), message
        assert all(float(milliseconds) >= 0 for _, _, milliseconds in parts)
