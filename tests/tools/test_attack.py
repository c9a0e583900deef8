"""Rows of the attack table, with and without a response."""

import asyncio
from collections import Counter
from contextlib import suppress

import pytest

from tools.attack import connections
from tools.attack.__main__ import SLOWEST, Row, Seen
from tools.attack.bodies import BODIES
from tools.attack.connections import CONNECTIONS, HALF_BODIES, SLOW_BODIES, WORST
from tools.attack.heads import HEADS, SLOW_HEADS
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
def test_answers_in_short(response: bytes, text: str) -> None:
    assert summarize(response, len(response)) == text


def test_a_response_to_head_has_no_body() -> None:
    response = b"HTTP/1.1 404 x\r\nContent-Length: 3\r\n\r\n"
    assert summarize(response, len(response), has_body=False) == "404"


def test_attacks_expect_documented_codes_only() -> None:
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
            assert attack.wrong({response: 1}) == [response], attack.name
        assert attack.wrong({}), "it did nothing"


@pytest.mark.parametrize(
    ("seen", "wrong"),
    [
        ([], ["no client"]),
        ([2 * SLOWEST], ["p99"]),
        ([SLOWEST / 2, 2 * SLOWEST], ["p99"]),
        ([SLOWEST / 2], []),
    ],
)
def test_a_client_without_a_response_was_not_served(seen: list[float], wrong: list[str]) -> None:
    attack = CONNECTIONS[0]
    of_client = [Seen(0.5, "hit", seconds, "ok") for seconds in seen]
    assert Row(attack, Counter({"gone": 1}), 0, 1, 0, of_client).wrong() == wrong


def test_a_service_that_does_not_answer_has_not_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "PATIENCE", 0.05)

    async def silent(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError):
            await reader.read()
        writer.close()

    async def scenario() -> str:
        server = await asyncio.start_server(silent, "127.0.0.1", 0)
        async with server:
            port = server.sockets[0].getsockname()[1]
            return await connections._reads_slowly(port, b"GET / HTTP/1.1\r\n\r\n")

    assert asyncio.run(scenario()) == "no answer"
