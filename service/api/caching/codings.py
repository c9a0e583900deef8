"""Content codings: which one a client wants (RFC 9110, section 12.5.3), and how it is made.

The same bytes must come out whenever and wherever they are made, since their name in caches, the
entity tag, is made of what goes in. Compressors of different versions may differ; so the version
is part of that name.
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
"""Items of a list that are read: more than any client sends."""

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
"""In the order in which they are chosen where the client has no preference."""

ZSTD_LEVEL, GZIP_LEVEL = 6, 4
"""Beyond these a mesh takes twice the time for a tenth less. Zstandard's window stays below the
8 MB that browsers take (RFC 9659)."""

MIN_BYTES = 1400
"""Bodies that fit one packet are not compressed: no client would have them sooner."""

WORTH = 0.95
"""A coding is used where it makes a body this much of its size or less."""


@dataclass(frozen=True, slots=True)
class Accepted:
    """Codings that a client takes, the best first; `plain`: whether it takes bodies as they are."""

    order: tuple[Coding, ...]
    plain: bool


def accepted(header: bytes | None) -> Accepted:
    """What an Accept-Encoding header says; without one bodies are sent as they are."""
    if header is None:
        return _PLAIN
    return _remembered(header) if len(header) <= _USUAL else _parsed(header)


def _zstd(content: bytes) -> bytes:
    return zstd.compress(content, ZSTD_LEVEL)


def _gzip(content: bytes) -> bytes:
    """One member of a gzip file (RFC 1952), its head the same at all times and on all systems."""
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
"""What the bytes of a coding depend on, beside the content."""


def compressed(coding: Coding, content: bytes) -> bytes | None:
    """The content in a coding that is not `identity`; None where that does not pay."""
    if len(content) < MIN_BYTES:
        return None
    made = COMPRESS[coding](content)
    return made if len(made) <= WORTH * len(content) else None


_PLAIN = Accepted(("identity",), plain=True)
_USUAL = 200
"""Longer headers are read anew each time, so that nobody fills the memory with them."""


def _parsed(header: bytes) -> Accepted:
    given: dict[str, float] = {}
    for item, weight in quality_values(header.decode("latin-1")):
        name = item.removeprefix("x-")
        given[name] = max(weight, given.get(name, 0.0))
    others = given.get("*", 0.0)
    weights = {coding: given.get(coding, others) for coding in CODINGS}
    plain = given.get("identity", given.get("*", 1.0)) > 0
    # Whoever lists codings would rather have one of them than none.
    least = min((w for w in weights.values() if w > 0), default=1.0)
    if plain and "identity" not in given:
        weights["identity"] = least
    order = sorted((c for c in CODINGS if weights[c] > 0), key=lambda c: -weights[c])
    return Accepted(tuple(order), plain)


_remembered = lru_cache(maxsize=256)(_parsed)
