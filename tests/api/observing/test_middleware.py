"""The middleware around every request: ids on responses, and log lines without texts of clients."""

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
from service.api.observing.record import RouteLabels, record_of
from service.settings.values import Settings
from tests.api.client import Client, start_client

TRACE, SPAN = "0af7651916cd43dd8448eb211c80319c", "b7ad6b7169203331"
PARENT = f"00-{TRACE}-{SPAN}-01"
NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]
MESH = "/v1/surfaces/saddle/mesh.glb?resolution=2"
CONVERSION = {"surface": {"control_net": NET}, "operations": [{"op": "elevate", "degree": [2, 2]}]}


class Logged:
    """A client, and the log lines of its requests."""

    def __init__(self, client: Client, lines: list[str]) -> None:
        self.client, self.lines = client, lines

    def last(self) -> dict[str, Any]:
        result: dict[str, Any] = json.loads(self.lines[-1])
        return result


@pytest.fixture
def logged() -> Iterator[Logged]:
    lines: list[str] = []
    with start_client(create_app(Settings(log_format="json"), lines.append)) as client:
        yield Logged(client, lines)


def send_request(
    headers: list[tuple[bytes, bytes]],
    settings: Settings | None = None,
    path: str = "/",
    fails: Exception | None = None,
    *,
    method: str = "GET",
    begins: bool = False,
    tracing: Callable[[ASGIApp], ASGIApp] = lambda app: app,
) -> tuple[list[Message], list[str], RequestCounters]:
    """The messages, log lines and counters of an application behind the middleware; it responds
    with 204, or fails."""
    sent: list[Message] = []
    lines: list[str] = []
    counters = RequestCounters()

    async def inner(scope: Scope, _: Receive, send: Send) -> None:
        record = record_of(scope)
        record.code, record.key = "a_code" if path == "/refused" else "", "alice"
        scope["client"] = ("2001:db8::1", 1)
        if fails and not begins:
            raise fails
        await send({"type": "http.response.start", "status": 204, "headers": []})
        if fails:
            raise fails
        await send({"type": "http.response.body"})

    async def send(message: Message) -> None:
        sent.append(message)

    async def receive() -> Message:
        raise AssertionError("a body was read")

    log = AccessLog(settings or Settings(), lines.append)
    outer = RequestMiddleware(tracing(inner), RouteLabels([]), counters, log, Origins(()))
    asyncio.run(outer(build_scope(method, path, headers), receive, send))
    assert counters.registry.get_sample_value("surface_http_requests_in_flight") == 0
    return sent, lines, counters


def build_scope(method: str, path: str, headers: list[tuple[bytes, bytes]]) -> Scope:
    server = {"scheme": "http", "http_version": "1.1", "server": ("127.0.0.1", 80), "state": {}}
    return {"type": "http", "method": method, "path": path, "headers": headers, **server}


def test_every_response_has_an_id(logged: Logged) -> None:
    for url, status in ((MESH, 200), (MESH, 200), ("/nowhere", 404), ("/health/live", 200)):
        response = logged.client.get(url, headers={"X-Request-Id": "mine-1"})
        assert (response.status_code, response.headers["x-request-id"]) == (status, "mine-1")
    refused = logged.client.post("/v1/mesh", {"surface": 1}, headers={"X-Request-Id": "mine-2"})
    assert (refused.status_code, refused.headers["x-request-id"]) == (422, "mine-2")
    assert b"mine" not in refused.content


def test_the_trace_is_that_of_the_caller(logged: Logged) -> None:
    logged.client.get(MESH, headers={"traceparent": PARENT, "X-Request-Id": "mine"})
    line = logged.last()
    assert (line["trace_id"], line["request_id"]) == (TRACE, "mine")
    assert line["span_id"] != SPAN
    logged.client.get(MESH, headers={"traceparent": PARENT.upper()})
    assert logged.last()["trace_id"] != TRACE


def test_two_traceparents_count_as_missing() -> None:
    twice = [(b"traceparent", PARENT.encode())] * 2
    _, (line,), _ = send_request(twice, Settings(log_format="json"))
    assert json.loads(line)["trace_id"] != TRACE


def test_a_line_has_the_documented_fields_only(logged: Logged) -> None:
    logged.client.get(f"{MESH}&expires=1&signature=hush")
    body = {"surface": {"control_net": NET, "name": "hush"}, "resolution": 2}
    assert logged.client.post("/v1/mesh?format=glb", body).status_code == 200
    built = logged.last()
    assert built.keys() == {
        *("time", "level", "event", "request_id", "trace_id", "span_id", "method", "route"),
        *("status", "bytes", "ms", "client", "format"),
    }
    assert (built["event"], built["route"], built["status"]) == ("request", "/v1/mesh", 200)
    assert (built["method"], built["format"], built["level"]) == ("POST", "glb", "info")
    logged.client.get("/v1/surfaces/hush/mesh.glb", headers={"Authorization": "Bearer hush"})
    assert logged.last()["code"] == "unknown_surface"
    assert "hush" not in "".join(logged.lines)


def test_hits_and_misses_are_distinguished(logged: Logged) -> None:
    for expected in ("miss", "hit", "hit"):
        response = logged.client.raw(MESH)
        line = logged.last()
        assert (line["cache"], line["surface"], line["format"]) == (expected, "saddle", "glb")
        assert line["bytes"] == len(response.content)
    logged.client.request("HEAD", MESH)
    assert logged.last()["bytes"] == 0


def test_every_line_is_one_line_of_json(logged: Logged) -> None:
    hostile = "%0a%0dINFO:%20forged%1b%5b31m%e2%80%a8%c2%85%00"
    for path in ("/", f"/{hostile}", f"/v1/surfaces/{hostile}", f"/v1/surfaces/{hostile}/mesh.a"):
        logged.client.get(path, headers={"X-Request-Id": "\x1b[31m"})
    assert len(logged.lines) == 4
    for line in logged.lines:
        assert line.endswith("\n")
        assert "forged" not in line
        assert line[:-1].isprintable()


def test_keys_and_addresses_are_those_the_guard_found() -> None:
    _, (line,), _ = send_request([], Settings(log_format="json"))
    assert (json.loads(line)["key"], json.loads(line)["client"]) == ("alice", "2001:db8::1")


def test_the_text_form_has_one_short_line() -> None:
    _, (line,), _ = send_request([(b"x-request-id", b"mine")], path="/refused")
    head, _, tail = line.partition(" ms")
    assert head.startswith('INFO:     2001:db8::1 - "GET (no such path)" 204, 0 bytes, ')
    assert tail == " (a_code, key alice, id mine)\n"


@pytest.mark.parametrize(
    ("level", "path", "fails", "is_logged"),
    [
        ("info", "/", False, True),
        ("warning", "/", False, False),
        ("error", "/", True, True),
        ("debug", "/", False, True),
    ],
)
def test_levels(
    level: Literal["debug", "info", "warning", "error"], path: str, fails: bool, is_logged: bool
) -> None:
    settings = Settings(log_level=level)
    _, lines, _ = send_request([], settings, path, ZeroDivisionError("hush") if fails else None)
    assert bool(lines) == is_logged
    assert "hush" not in "".join(lines)
    assert send_request([], Settings(log_level=level, access_log=False), path)[1] == []


@pytest.mark.parametrize("path", ["/health/live", "/health/ready", "/metrics"])
def test_requests_of_monitoring_are_logged_for_debugging_only(path: str) -> None:
    lines: list[str] = []
    for level, count in (("info", 0), ("debug", 1)):
        app = create_app(Settings.model_validate({"log_level": level}), lines.append)
        with start_client(app) as client:
            client.get(path)
        assert len(lines) == count


def test_a_failure_is_a_problem_and_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    (start, *body), (line,), counters = send_request([], fails=ZeroDivisionError("hush"))
    assert start["status"] == 500
    content = b"".join(message.get("body", b"") for message in body)
    assert b"internal_error" in content
    assert b"hush" not in content
    assert line.startswith("ERROR:    ")
    assert counters.refusals == {"internal_error": 1}
    (logged,) = caplog.records
    assert logged.exc_info is not None
    assert logged.exc_info[0] is ZeroDivisionError


def test_a_failure_after_the_head_leaves_the_response_incomplete() -> None:
    sent, (line,), _ = send_request([], fails=ZeroDivisionError("hush"), begins=True)
    assert [message["type"] for message in sent] == ["http.response.start"]
    assert '" 204, 0 bytes' in line


def test_methods_that_http_does_not_define_have_one_name() -> None:
    _, (line,), counters = send_request([], Settings(log_format="json"), method="BREW\n")
    assert json.loads(line)["method"] == "other"
    labels = {"route": "unmatched", "method": "other", "status": "2xx"}
    name = "surface_http_request_duration_seconds_count"
    assert counters.registry.get_sample_value(name, labels) == 1


def test_every_computation_has_a_server_timing_header(client: Client) -> None:
    calls = {"/v1/surfaces/saddle": ("surface definition", client.get("/v1/surfaces/saddle"))}
    for path, item in client.get("/openapi.json").json()["paths"].items():
        if "post" in item:
            examples = item["post"]["requestBody"]["content"]["application/json"]["examples"]
            body = next(iter(examples.values()))["value"]
            step = "content store" if path == "/v1/surfaces" else path.removeprefix("/v1/")
            calls[path] = (f"read parse {step}", client.post(path, body))
    for path, (steps, response) in calls.items():
        assert response.status_code in (200, 201), response.text
        parts = [part.partition(";dur=") for part in response.headers["server-timing"].split(", ")]
        names = [name for name, _, _ in parts]
        assert [name for name in names if name not in ("wait", "plan")] == steps.split(), path
        assert all(float(seconds) >= 0 for _, _, seconds in parts)
