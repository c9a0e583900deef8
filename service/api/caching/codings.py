"""Content codings: which one a client prefers (RFC 9110, section 12.5.3), and compressing to it.

The entity tag is known before the bytes, so the same content must always give the same bytes.
Compressors of different versions may differ; so the version is part of the tag.
"""

import re
import struct
import sys
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Literal, TypeAlias

MAX_ITEMS = 100
"""Most items of a list that the service reads: more than any client sends."""

_QUALITY = re.compile(r"(?:0(?:\.\d{0,3})?|1(?:\.0{0,3})?)", re.ASCII)


def quality_values(header: str) -> Iterator[tuple[str, float]]:
    """The items of a list in lower case with their quality values (RFC 9110, section 12.4.2).

    A quality value is from 0 to 1, and 0 where it is malformed.
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


if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

Coding: TypeAlias = Literal["zstd", "gzip", "identity"]

CODINGS: tuple[Coding, ...] = ("zstd", "gzip", "identity")
"""All codings, in the order in which the service prefers them if the client has no preference."""

ZSTD_LEVEL, GZIP_LEVEL = 6, 4
"""Higher levels take twice the time and save 1/10 of the bytes. Zstandard's window stays below the
8 MB that browsers accept (RFC 9659)."""

MIN_BYTES = 1400
"""Bodies that fit into one packet are not compressed: they would not arrive sooner."""

WORTH = 0.95
"""A coding is used if it shrinks a body to this part of its size or less."""


@dataclass(frozen=True, slots=True)
class AcceptedCodings:
    """Codings that a client accepts, best first; `plain`: whether it accepts plain bodies."""

    order: tuple[Coding, ...]
    plain: bool


def parse_accepted_codings(header: bytes | None) -> AcceptedCodings:
    """The codings that an Accept-Encoding header allows; without a header, no compression."""
    if header is None:
        return _PLAIN
    return _parse_usual(header) if len(header) <= _USUAL else _parse_codings(header)


def _zstd(content: bytes) -> bytes:
    return zstd.compress(content, ZSTD_LEVEL)


def _gzip(content: bytes) -> bytes:
    """One member of a gzip file (RFC 1952), with a head that depends on no time or system."""
    packer = zlib.compressobj(GZIP_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    tail = struct.pack("<II", zlib.crc32(content), len(content) & 0xFFFFFFFF)
    return b"".join((_GZIP_HEAD, packer.compress(content), packer.flush(), tail))


_GZIP_HEAD = b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\xff"
"""Deflate, no flags, no time, no hint, unknown system."""

COMPRESS: Mapping[Coding, Callable[[bytes], bytes]] = MappingProxyType(
    {"zstd": _zstd, "gzip": _gzip}
)

MADE_BY: Mapping[Coding, str] = MappingProxyType(
    {
        "zstd": f"zstd {'.'.join(map(str, zstd.zstd_version_info))}, level {ZSTD_LEVEL}",
        "gzip": f"zlib {zlib.ZLIB_RUNTIME_VERSION}, level {GZIP_LEVEL}",
        "identity": "nothing",
    }
)
"""Compressor, version and level of each coding: its bytes depend on these and the content."""


def compress(coding: Coding, content: bytes) -> bytes | None:
    """The compressed content; None where compressing does not pay."""
    if len(content) < MIN_BYTES:
        return None
    body = COMPRESS[coding](content)
    return body if len(body) <= WORTH * len(content) else None


_PLAIN = AcceptedCodings(("identity",), plain=True)
_USUAL = 200
"""Longer headers are parsed each time, so that no client fills the memory with them."""


def _parse_codings(header: bytes) -> AcceptedCodings:
    by_name: dict[str, float] = {}
    for item, weight in quality_values(header.decode("latin-1")):
        name = item.removeprefix("x-")
        by_name[name] = max(weight, by_name.get(name, 0.0))
    others = by_name.get("*", 0.0)
    weights = {coding: by_name.get(coding, others) for coding in CODINGS}
    plain = by_name.get("identity", by_name.get("*", 1.0)) > 0
    # A client that lists codings prefers each of them to an uncompressed body.
    least = min((w for w in weights.values() if w > 0), default=1.0)
    if plain and "identity" not in by_name:
        weights["identity"] = least
    order = sorted((c for c in CODINGS if weights[c] > 0), key=lambda c: -weights[c])
    return AcceptedCodings(tuple(order), plain)


_parse_usual = lru_cache(maxsize=256)(_parse_codings)
