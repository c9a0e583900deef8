"""Ids: of requests, and of traces, as W3C Trace Context has them.

Ids are random, and the only thing about an answer that is: they stand in headers and in the log,
never in a body.
"""

import os
import re
from collections.abc import Iterator
from typing import NamedTuple

SAMPLED, RANDOM = 1, 2
"""Flags: the caller records its part of the trace; the last seven bytes of its id are random."""

_PARENT = re.compile(rb"([0-9a-f]{2})-([0-9a-f]{32})-([0-9a-f]{16})-([0-9a-f]{2})(-.*)?", re.DOTALL)
_HARMLESS = re.compile(rb"[A-Za-z0-9][A-Za-z0-9._:/+=@-]{0,127}")
_NO_TRACE, _NO_SPAN = "0" * 32, "0" * 16
_AT_ONCE = 4096
"""Random bytes fetched together: a call for each id would take longer than all else here."""


class Parent(NamedTuple):
    """The span that a request comes from, as `traceparent` names it."""

    trace_id: str
    span_id: str
    flags: int


def parent_of(header: bytes) -> Parent | None:
    """The span that a `traceparent` header names; None if it is not one.

    Versions that are yet to come may add something behind; version 00 has exactly four parts.

    References
    ----------
    W3C, Trace Context Level 2, sections 3.2 (header) and 4.3 (mutating it).
    """
    found = _PARENT.fullmatch(header)
    if found is None:
        return None
    version, trace, span, flags, more = found.groups()
    if version == b"ff" or (version == b"00" and more is not None):
        return None
    trace_id, span_id = trace.decode(), span.decode()
    if trace_id == _NO_TRACE or span_id == _NO_SPAN:
        return None
    # Of the flags of a later version only these two are known to mean the same.
    return Parent(trace_id, span_id, int(flags, 16) & (SAMPLED | RANDOM))


def harmless_id(header: bytes) -> str | None:
    """The request's id as the client gives it, if that can stand in a header and in a log line."""
    return header.decode() if _HARMLESS.fullmatch(header) else None


class Ids:
    """New ids, from the system's random numbers, some hundred at a time."""

    def __init__(self) -> None:
        self._bytes = self._fetched()

    def __call__(self) -> str:
        """Sixteen hexadecimal digits, not all zero; two of them make the id of a trace."""
        return next(self._bytes)

    def _fetched(self) -> Iterator[str]:
        while True:
            digits = os.urandom(_AT_ONCE).hex()
            for start in range(0, len(digits), 16):
                id = digits[start : start + 16]
                if id != _NO_SPAN:
                    yield id
