"""Ids of requests, and traceparent, as W3C's own test-suite tries it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.api.observing.traces import Ids, Parent, harmless_id, parent_of

TRACE, SPAN = "0af7651916cd43dd8448eb211c80319c", "b7ad6b7169203331"


@pytest.mark.parametrize(
    ("header", "flags"),
    [
        (f"00-{TRACE}-{SPAN}-01", 1),
        (f"00-{TRACE}-{SPAN}-00", 0),
        (f"00-{TRACE}-{SPAN}-03", 3),
        (f"00-{TRACE}-{SPAN}-ff", 3),
        (f"cc-{TRACE}-{SPAN}-01", 1),
        (f"cc-{TRACE}-{SPAN}-01-what-the-future-will-be-like", 1),
        (f"cc-{TRACE}-{SPAN}-01-", 1),
    ],
)
def test_a_parent_is_taken(header: str, flags: int) -> None:
    assert parent_of(header.encode()) == Parent(TRACE, SPAN, flags)


@pytest.mark.parametrize(
    "header",
    [
        "",
        f"00-{TRACE}-{SPAN}",
        f"00-{TRACE}-{SPAN}-01-more",
        f"00-{TRACE}-{SPAN}-01-",
        f"00-{TRACE}-{SPAN}-01\n",
        f" 00-{TRACE}-{SPAN}-01",
        f"00-{TRACE}-{SPAN}-01.",
        f"cc-{TRACE}-{SPAN}-01.what-the-future-will-not-be-like",
        f"ff-{TRACE}-{SPAN}-01",
        f"0-{TRACE}-{SPAN}-01",
        f"00-{TRACE.upper()}-{SPAN}-01",
        f"00-{TRACE[1:]}-{SPAN}-01",
        f"00-{TRACE}-{SPAN[1:]}-01",
        f"00-{TRACE}-{SPAN}-1",
        f"00-{'0' * 32}-{SPAN}-01",
        f"00-{TRACE}-{'0' * 16}-01",
        f"0x-{TRACE}-{SPAN}-01",
        f"00-{TRACE}-{SPAN[:-1]}.-01",
    ],
)
def test_garbage_is_no_parent(header: str) -> None:
    assert parent_of(header.encode()) is None


@given(st.binary(max_size=80))
def test_whatever_comes_is_a_parent_or_not(header: bytes) -> None:
    found = parent_of(header)
    assert found is None or header[3:35] == found.trace_id.encode()


@pytest.mark.parametrize("id", ["a", "0", "4bf92f35-77b3", "edge/req:1+a=@b_c.d", "x" * 128])
def test_harmless_ids_are_taken(id: str) -> None:
    assert harmless_id(id.encode()) == id


@pytest.mark.parametrize(
    "id",
    [b"", b"x" * 129, b"a b", b"a\nb", b"\x1b[31m", b'a"b', b"-a", b"\xc3\xa4", b"a\x00", b"<a>"],
)
def test_others_are_not(id: bytes) -> None:
    assert harmless_id(id) is None


def test_new_ids_differ() -> None:
    new = Ids()
    ids = [new() for _ in range(3000)]
    assert len(set(ids)) == len(ids)
    assert all(len(id) == 16 and int(id, 16) for id in ids)
