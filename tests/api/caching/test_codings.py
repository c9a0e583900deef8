"""Content codings: the client's order of preference; compressed bytes are always the same."""

import random
import time

import pytest

from service.api.caching.codings import (
    COMPRESS_FUNCTIONS,
    MIN_BYTES,
    Coding,
    compress,
    parse_accepted_codings,
)
from tests.decompression import decompress_gzip, decompress_zstd

TEXT = b"v 0.25 0.5 1\n" * 1000


@pytest.mark.parametrize(
    ("header", "order"),
    [
        (None, ["identity"]),
        (b"", ["identity"]),
        (b"gzip", ["gzip", "identity"]),
        (b"gzip, deflate, br, zstd", ["zstd", "gzip", "identity"]),
        (b"GZIP ; Q=0.5", ["gzip", "identity"]),
        (b"x-gzip", ["gzip", "identity"]),
        (b"zstd;q=0.5, gzip", ["gzip", "zstd", "identity"]),
        (b"zstd;q=0, gzip", ["gzip", "identity"]),
        (b"identity, gzip;q=0.5", ["identity", "gzip"]),
        (b"identity;q=0.2, gzip;q=0.5", ["gzip", "identity"]),
        (b"*", ["zstd", "gzip", "identity"]),
        (b"*;q=0.5, gzip", ["gzip", "zstd", "identity"]),
        (b"gzip;q=0.1, *;q=0", ["gzip"]),
        (b"gzip, identity;q=0", ["gzip"]),
        (b"br, identity;q=0", []),
        (b"*;q=0", []),
        (b"identity;q=0, *", ["zstd", "gzip"]),
        (b"*;q=0, identity", ["identity"]),
        (b"br", ["identity"]),
        # A malformed quality value counts as 0.
        (b"gzip;q=2", ["identity"]),
        (b"gzip;q=", ["identity"]),
        (b"gzip;q=0, gzip;q=0.3", ["gzip", "identity"]),
        (b"gzip;level=9;q=0.5", ["gzip", "identity"]),
        (b"\xff\xfe,,;;q", ["identity"]),
        (b"br," * 300 + b"gzip", ["identity"]),  # the service reads only the first 100 items
    ],
)
def test_codings_are_in_the_order_that_the_client_prefers(
    header: bytes | None, order: list[Coding]
) -> None:
    for _ in range(2):  # the second result may come from the cache of parsed headers
        accepted_codings = parse_accepted_codings(header)
        assert list(accepted_codings) == order


@pytest.mark.parametrize("coding", COMPRESS_FUNCTIONS)
def test_compressed_bytes_do_not_depend_on_the_time(
    coding: Coding, monkeypatch: pytest.MonkeyPatch
) -> None:
    compressed_text = compress(coding, TEXT)
    monkeypatch.setattr(time, "time", lambda: 1e9)
    assert compressed_text is not None
    assert compress(coding, TEXT) == compressed_text
    assert len(compressed_text) < len(TEXT) / 10


def test_compressed_bytes_are_valid_in_their_formats() -> None:
    for content in (b"", b"x", TEXT):
        assert decompress_gzip(COMPRESS_FUNCTIONS["gzip"](content)) == content
        assert decompress_zstd(COMPRESS_FUNCTIONS["zstd"](content)) == content


@pytest.mark.parametrize("coding", COMPRESS_FUNCTIONS)
def test_bodies_that_hardly_shrink_are_not_compressed(coding: Coding) -> None:
    assert compress(coding, b" " * (MIN_BYTES - 1)) is None
    assert compress(coding, b" " * MIN_BYTES) is not None
    assert compress(coding, random.Random(1).randbytes(5000)) is None
