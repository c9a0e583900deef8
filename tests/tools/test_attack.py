"""The judgements of `make test-attack`: short forms of responses, and faults of attacks."""

import asyncio
from collections import Counter
from contextlib import suppress

import pytest

from tools.attack import connections
from tools.attack.__main__ import MAX_LATENCY, ClientResult, Row
from tools.attack.bodies import BODIES
from tools.attack.connections import CONNECTIONS, HALF_BODIES, SLOW_BODIES, WORST
from tools.attack.heads import HEADS, SLOW_HEADS
from tools.attack.neighbours import MAX_FACTOR, MAX_WAIT, Result, Sample, judge_factor, judge_wait
from tools.attack.wire import summarize
from tools.attack.work import WORK

PROBLEM = b"HTTP/1.1 413 x\r\nContent-Type: application/problem+json\r\nContent-Length: 26\r\n\r\n"
CODE = b'{"code": "body_too_large"}'


@pytest.mark.parametrize(
    ("response", "text"),
    [
        (b"", "closed"),
        (b"SSH-2.0\r\n\r\n", "no HTTP"),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\nab", "200"),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 3\r\n\r\nab", "200, torn"),
        (b"HTTP/1.1 304 x\r\nContent-Length: 3\r\n\r\n", "304"),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 1\r\n\r\nab", "200, two answers"),
        (PROBLEM + CODE, "413 body_too_large"),
    ],
)
def test_short_forms_of_responses(response: bytes, text: str) -> None:
    assert summarize(response, len(response)) == text


def test_a_response_to_head_without_a_body_is_complete() -> None:
    response = b"HTTP/1.1 404 x\r\nContent-Length: 3\r\n\r\n"
    assert summarize(response, len(response), has_body=False) == "404"


def test_no_attack_expects_a_server_error_or_an_incomplete_response() -> None:
    for attack in (
        *BODIES,
        *HEADS,
        *CONNECTIONS,
        *WORK,
        SLOW_HEADS,
        SLOW_BODIES,
        HALF_BODIES,
        WORST,
    ):
        for response in ("500", "500 internal_error", "200, torn", "no answer", "smuggled"):
            assert attack.find_faults({response: 1}) == [response], attack.name
        assert attack.find_faults({}), "an attack without responses must be a fault"


@pytest.mark.parametrize(
    ("latencies", "faults"),
    [
        ([], ["no client"]),
        ([2 * MAX_LATENCY], ["p99"]),
        ([MAX_LATENCY / 2, 2 * MAX_LATENCY], ["p99"]),
        ([MAX_LATENCY / 2], []),
    ],
)
def test_a_client_without_responses_or_with_late_ones_is_a_fault(
    latencies: list[float], faults: list[str]
) -> None:
    attack = CONNECTIONS[0]  # it expects the response "gone"
    results = [ClientResult(0.5, "hit", seconds, "ok") for seconds in latencies]
    row = Row(attack, Counter({"gone": 1}), start=0, end=1, resident=0, results=results)
    assert row.find_faults() == faults


def test_a_silent_service_is_distinguished_from_a_closed_connection(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The slow reader reports "no answer" when its patience ends, not "closed"."""
    monkeypatch.setattr(connections, "PATIENCE", 0.05)

    async def read_in_silence(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError):
            await reader.read()
        writer.close()

    async def read_from_it() -> str:
        server = await asyncio.start_server(read_in_silence, "127.0.0.1", 0)
        async with server:
            port = server.sockets[0].getsockname()[1]
            return await connections.read_slowly(port, b"GET / HTTP/1.1\r\n\r\n")

    assert asyncio.run(read_from_it()) == "no answer"


def test_a_long_wait_or_a_slower_caller_beside_another_is_a_fault() -> None:
    def build_result(seconds: float, wait: float, status: str = "200") -> Result:
        together = [Sample(seconds, wait, status)] * 20
        return Result([Sample(0.1, 0.0, "200")] * 20, together, Counter({"200": 1}))

    assert judge_wait(build_result(1, 0.9 * MAX_WAIT)) == []
    assert judge_wait(build_result(1, 1.1 * MAX_WAIT)) == ["waited 1.1 s"]
    assert judge_factor(build_result(0.09 * MAX_FACTOR, 0)) == []
    assert judge_factor(build_result(0.11 * MAX_FACTOR, 0)) == ["p99 × 2.2"]
    assert build_result(1, 0).find_failures() == []
    assert build_result(1, 0, "429 busy").find_failures() == ["client: 429 busy"]
    assert Result([], [], Counter()).find_failures() == ["too few meshes"]
