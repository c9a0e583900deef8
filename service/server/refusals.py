"""Answers of the server's own, to what never becomes a request that the application sees.

They are problems like all others. Each is the last answer of its connection.
"""

from collections.abc import Iterable

import orjson

from service.api.problems import (
    DRAINING,
    HEAD_TOO_LARGE,
    HEAD_TOO_SLOW,
    INTERNAL_ERROR,
    MALFORMED_REQUEST,
    MEDIA_TYPE,
    PROBLEM_HEADERS,
    TOO_MANY_CONNECTIONS,
    Problem,
    problem_document,
)
from service.errors import Issue

RETRY_AFTER = 1
"""Seconds after which somebody who was refused for want of room may ask again."""


class Refusal(Exception):
    """A problem, and the one thing that is wrong."""

    def __init__(self, problem: Problem, issue: Issue | None = None) -> None:
        super().__init__(problem.code)
        self.problem = problem
        self.issues = () if issue is None else (issue,)

    def answer(self, default_headers: Iterable[tuple[bytes, bytes]]) -> bytes:
        """The whole answer, after the headers that every answer has: the date."""
        body = orjson.dumps(problem_document(self.problem, self.issues))
        status = self.problem.status
        headers = PROBLEM_HEADERS | {
            "Content-Type": MEDIA_TYPE,
            "Content-Length": str(len(body)),
            "Connection": "close",
        }
        if status == TOO_MANY_CONNECTIONS.status:
            headers["Retry-After"] = str(RETRY_AFTER)
        lines = [f"HTTP/1.1 {status} {self.problem.title}".encode()]
        lines += [name + b": " + value for name, value in default_headers]
        lines += [f"{name.lower()}: {value}".encode() for name, value in headers.items()]
        return b"\r\n".join((*lines, b"", body))


def malformed(needed: str = "") -> Refusal:
    """Of what is no request, or might be read as two."""
    return Refusal(
        MALFORMED_REQUEST,
        Issue("malformed_request", "This is no HTTP/1.1 as RFC 9112 has it.", "", needed=needed),
    )


def head_too_large(most: int) -> Refusal:
    """Of an address and headers that are too long."""
    return Refusal(
        HEAD_TOO_LARGE,
        Issue(
            "head_too_large",
            "The address and the headers are longer than this service reads.",
            got=f"more than {most} bytes",
            needed=f"at most {most} bytes",
        ),
    )


def head_too_slow(seconds: float) -> Refusal:
    """Of a head that does not come to its end."""
    return Refusal(
        HEAD_TOO_SLOW,
        Issue(
            "head_too_slow",
            "The head of the request did not arrive in time.",
            got="a part of it",
            needed=f"all of it within {seconds:g} s",
        ),
    )


def too_many_connections(most: int) -> Refusal:
    """Of a connection more than there may be."""
    return Refusal(
        TOO_MANY_CONNECTIONS,
        Issue(
            "too_many_connections",
            "Others have all the connections that there may be.",
            got="one more",
            needed=f"at most {most}",
        ),
    )


def draining() -> Refusal:
    """Of a request that the end of the process leaves without its answer."""
    return Refusal(
        DRAINING,
        Issue("draining", "The service ends, and the request was not done in time."),
    )


def broken() -> Refusal:
    """Of a request on which the application failed in a way that it did not answer itself."""
    return Refusal(INTERNAL_ERROR)
