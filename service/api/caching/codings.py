"""Content codings: finds the coding that a client prefers (RFC 9110, section 12.5.3); compresses.

The service computes an entity tag before the bytes, so one tag must always mean the same bytes. As
another version of a compressor may write other bytes, the version is part of the tag.
"""

import re
import struct
import sys
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Literal, TypeAlias

from service.encoders.format import Content, SplitContent, pack

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

MAX_CACHED = 200
"""Most characters of a header or a query whose parsed form is cached: clients cannot fill the
memory with longer texts."""

MAX_ITEMS = 100
"""Most items of an `Accept` or `Accept-Encoding` list that the service reads."""

_QUALITY = re.compile(r"(?:0(?:\.\d{0,3})?|1(?:\.0{0,3})?)", re.ASCII)


def parse_quality_values(header: str) -> Iterator[tuple[str, float]]:
    """The items of a list in lower case with their quality values (RFC 9110, section 12.4.2).

    Quality values are from 0 to 1; a malformed one counts as 0.
    """
    for item in header.lower().split(",")[:MAX_ITEMS]:
        name, *parameters = (part.strip() for part in item.split(";"))
        quality = 1.0
        for parameter in parameters:
            key, _, value = parameter.partition("=")
            if key.strip() == "q":
                text = value.strip()
                quality = float(text) if _QUALITY.fullmatch(text) else 0.0
        yield name, quality


Coding: TypeAlias = Literal["zstd", "gzip", "identity"]
Codings: TypeAlias = tuple[Coding, ...]

CODINGS: Codings = ("zstd", "gzip", "identity")
"""All codings, in the order in which the service prefers them if the client has no preference."""

ZSTD_LEVEL, GZIP_LEVEL = 6, 4
"""Levels of compression: higher levels take twice the time and save 1/10 of the bytes. The window
of Zstandard stays below the 8 MB that browsers accept (RFC 9659)."""

FAST_LEVEL = 1
"""Level of both codings for responses that are compressed once and sent once. On two cores, of the
teapot at 13 divisions as GLB (quantized and by meshopt: 61 kB) it leaves 0.49 in 0.1 ms by
Zstandard and 0.48 in 0.7 to 1.3 ms by gzip; plain (203 kB) 0.61 in 0.5 ms and 0.53 in 4 ms; as JSON
at 16 divisions (1.3 MB) 0.20 in 3.5 ms and 0.29 in 12 ms. So Zstandard saves time up to 1 Gbit/s,
and gzip up to 180 Mbit/s; the levels of files that the cache keeps do so up to 200 and 150."""

MIN_BYTES = 1400
"""Shorter bodies fit into one packet; they are not compressed, as they would not arrive sooner."""

MAX_RATIO = 0.95
"""A compressed body is used if it has at most this fraction of the bytes of the plain body."""


def parse_accepted_codings(header: bytes | None) -> Codings:
    """The codings that an Accept-Encoding header allows, the preferred one first.

    Only `identity` without a header.
    """
    if header is None:
        return ("identity",)
    return _parse_cached(header) if len(header) <= MAX_CACHED else _parse_codings(header)


def _gzip(content: bytes) -> bytes:
    """One member of a gzip file (RFC 1952), with a head that depends on no time or system."""
    compressor = zlib.compressobj(GZIP_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    trailer = struct.pack("<II", zlib.crc32(content), len(content) & 0xFFFFFFFF)
    return b"".join((_GZIP_HEAD, compressor.compress(content), compressor.flush(), trailer))


_GZIP_HEAD = b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\xff"
"""Deflate, no flags, no time, no hint, unknown system."""

COMPRESS_FUNCTIONS: Mapping[Coding, Callable[[bytes], bytes]] = MappingProxyType(
    {"zstd": partial(zstd.compress, level=ZSTD_LEVEL), "gzip": _gzip}
)

COMPRESSOR_VERSIONS: Mapping[Coding, str] = MappingProxyType(
    {
        "zstd": f"zstd {'.'.join(map(str, zstd.zstd_version_info))}, level {ZSTD_LEVEL}",
        "gzip": f"zlib {zlib.ZLIB_RUNTIME_VERSION}, level {GZIP_LEVEL}",
        "identity": "nothing",
    }
)
"""Compressor, version and level of each coding: its bytes depend on these and the content."""


def compress(coding: Coding, content: bytes) -> bytes | None:
    """The compressed content; None if it is hardly smaller (`MAX_RATIO`, `MIN_BYTES`)."""
    if len(content) < MIN_BYTES:
        return None
    body = COMPRESS_FUNCTIONS[coding](content)
    return body if len(body) <= MAX_RATIO * len(content) else None


def compress_fast(coding: Coding, content: Content) -> Content | None:
    """The content, compressed at `FAST_LEVEL`; None if it is hardly smaller (`MAX_RATIO`).

    Gives up early if a piece from the middle of the content is hardly smaller.
    """
    buffers = content.buffers if isinstance(content, SplitContent) else (content,)
    longest = memoryview(max(buffers, key=len)).cast("B")
    if len(longest) > 2 * _SAMPLE_BYTES:
        sample = longest[len(longest) // 2 :][:_SAMPLE_BYTES]
        if sum(map(len, _compress_buffers(coding, (sample,)))) > MAX_RATIO * len(sample):
            return None
    body = pack(tuple(_compress_buffers(coding, buffers)))
    return body if len(body) <= MAX_RATIO * len(content) else None


_SAMPLE_BYTES = 1 << 16


def _compress_buffers(
    coding: Coding, buffers: Iterable[bytes | memoryview]
) -> Iterator[bytes | memoryview]:
    """The buffers as one compressed body, without joining them."""
    if coding == "zstd":
        zstd_compressor = zstd.ZstdCompressor(level=FAST_LEVEL)
        yield from map(zstd_compressor.compress, buffers)
        yield zstd_compressor.flush()
        return
    # With these bits, zlib writes the head and the end of a gzip file.
    compressor = zlib.compressobj(FAST_LEVEL, zlib.DEFLATED, zlib.MAX_WBITS + 16)
    yield from map(compressor.compress, buffers)
    yield compressor.flush()


def _parse_codings(header: bytes) -> Codings:
    by_name: dict[str, float] = {}
    for item, quality in parse_quality_values(header.decode("latin-1")):
        name = item.removeprefix("x-")  # x-gzip is gzip (section 8.4.1.3)
        by_name[name] = max(quality, by_name.get(name, 0.0))
    default_quality = by_name.get("*", 0.0)
    qualities = {coding: by_name.get(coding, default_quality) for coding in CODINGS}
    accepts_plain = by_name.get("identity", by_name.get("*", 1.0)) > 0
    # A client that lists codings prefers each of them to an uncompressed body: with equal quality,
    # `identity` comes last.
    min_quality = min((quality for quality in qualities.values() if quality > 0), default=1.0)
    if accepts_plain and "identity" not in by_name:
        qualities["identity"] = min_quality
    return tuple(sorted((c for c in CODINGS if qualities[c] > 0), key=lambda c: -qualities[c]))


_parse_cached = lru_cache(maxsize=256)(_parse_codings)
