"""A mesh file in memory: its entity tags, its bytes in each coding, and its response heads.

The service knows the entity tag (RFC 9110, section 8.8.3) of a file before it computes the file. It
makes the heads once, and sends them many times.
"""

import math
import re
from base64 import urlsafe_b64encode
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from typing import TypeAlias, TypeVar

from starlette.types import Message

from service.api.caching.codings import CODINGS, COMPRESSOR_VERSIONS, Coding

Choice = TypeVar("Choice")

_TAG_BYTES = 16
"""Bytes of the hash in a tag: in practice different responses never have the same tag."""

_TAG = re.compile(rb'(?:W/)?("[\x21\x23-\x7e\x80-\xff]*")')


def entity_tag(content_name: str, coding: Coding) -> bytes:
    """The strong entity tag of a content in a coding, with its quotes.

    Parameters
    ----------
    content_name : str
        Different contents have different names.
    """
    name = f"{content_name}\n{COMPRESSOR_VERSIONS[coding]}".encode()
    digest = sha256(name).digest()[:_TAG_BYTES]
    return b'"' + urlsafe_b64encode(digest).rstrip(b"=") + b'"'


def parse_tags(header: bytes) -> frozenset[bytes]:
    """The entity tags in an If-None-Match header, without their `W/`.

    This header compares tags weakly (section 13.1.2).
    """
    return frozenset(_TAG.findall(header))


def find_match(
    condition: bytes | None, choices: Iterable[Choice], tag: Callable[[Choice], bytes]
) -> Choice | None:
    """The first choice whose entity tag If-None-Match lists: the client has it already; or None.

    Parameters
    ----------
    condition : bytes or None
        The If-None-Match header.
    tag : callable
        Returns the entity tag of a choice.
    """
    if condition is None:
        return None
    tags = parse_tags(condition)
    return next((choice for choice in choices if tag(choice) in tags), None)


def matches_all(header: bytes) -> bool:
    """Whether If-None-Match is `*`, which matches every response."""
    return header.strip() == b"*"


RawHeaders: TypeAlias = tuple[tuple[bytes, bytes], ...]

FOR_EVER = "public, max-age=31536000, immutable"
"""For URLs with a hash and the engine's version: they always stand for the same bytes."""

FOR_AN_HOUR = "public, max-age=3600, must-revalidate"
"""For all other URLs: the surface or the engine may change."""

HIT = b"cache;desc=hit"
"""`Server-Timing` of a cached response."""

CHECK_INTERVAL = 30.0
"""Seconds after which a cached response is checked again: its surface may have been removed by
another process that shares the store."""

ENTRY_BYTES, VARIANT_BYTES = 3000, 4500
"""Bytes of memory that Python needs for an entry and for each coding, beside the file."""


@dataclass(frozen=True, slots=True)
class Subject:
    """The mesh file that a URL names, described before it is computed.

    Attributes
    ----------
    url : str
        The canonical URL's path and query, with the path that the service is mounted at.
    surface : str
        The id in the URL.
    content_name : str
        Files of different bytes have different names.
    is_permanent : bool
        Whether the id is a hash, so that the canonical URL always stands for the same bytes.
    """

    url: str
    surface: str
    content_name: str
    is_permanent: bool

    def tag(self, coding: Coding) -> bytes:
        """The entity tag of the file in a coding."""
        return entity_tag(self.content_name, coding)

    def build_304_headers(
        self, coding: Coding, *, has_engine: bool, timing: bytes = HIT
    ) -> RawHeaders:
        """The headers of a 304; `has_engine`: whether the requested URL has `engine`."""
        cache_control = FOR_EVER if self.is_permanent and has_engine else FOR_AN_HOUR
        return (
            (b"etag", self.tag(coding)),
            (b"cache-control", cache_control.encode()),
            (b"vary", b"Accept-Encoding"),
            (b"server-timing", timing),
            (b"x-content-type-options", b"nosniff"),
        )


@dataclass(frozen=True, slots=True)
class Variant:
    """The file in one coding, with the heads of its responses as messages (ASGI).

    `heads_200` and `heads_304` are the heads of these responses: first for URLs without `engine`,
    then with it.
    """

    coding: Coding
    body: bytes
    tag: bytes
    heads_200: tuple[Message, Message]
    heads_304: tuple[Message, Message]


class CachedResponse:
    """A mesh file in memory, with its codings and ready-made heads.

    Parameters
    ----------
    common_headers : RawHeaders
        Headers that all codings of the file have.
    read_time : float
        When the surface was read from the store, by `time.monotonic`.

    Attributes
    ----------
    check_time : float
        When to ask the store whether the surface still exists; never for an example.
    """

    __slots__ = (
        *("_common_headers", "aliases", "check_time", "plain", "size", "subject", "variants"),
    )

    def __init__(
        self, subject: Subject, plain: bytes, common_headers: RawHeaders, read_time: float = 0.0
    ) -> None:
        self.subject = subject
        self.check_time = read_time + CHECK_INTERVAL if subject.is_permanent else math.inf
        self.plain = plain
        link = (b"link", f'<{subject.url}>; rel="canonical"'.encode())
        self._common_headers = (*common_headers, link)
        self.variants: dict[Coding, Variant] = {}
        self.aliases: list[tuple[str, bytes]] = []
        self.size = ENTRY_BYTES + sum(len(k) + len(v) for k, v in self._common_headers)
        self.add(self.make_variant("identity", plain), "identity")

    def make_variant(self, coding: Coding, body: bytes | None) -> Variant:
        """The file in a coding; the uncompressed file if `body` is None (`codings.compress`)."""
        if body is None:
            return self.variants["identity"]
        return Variant(
            coding,
            body,
            self.subject.tag(coding),
            _build_heads(200, partial(self.build_200_headers, coding, len(body))),
            _build_heads(304, partial(self.subject.build_304_headers, coding)),
        )

    def add(self, variant: Variant, coding: Coding) -> None:
        """Keeps the variant for clients that prefer this coding.

        It is the uncompressed variant if compression in this coding saves too little.
        """
        if variant.coding == coding:
            self.size += len(variant.body) + VARIANT_BYTES
        self.variants[coding] = variant

    @property
    def max_size(self) -> int:
        """Bytes that the response takes at most, once it has all codings."""
        return self.size + (len(CODINGS) - 1) * (len(self.plain) + VARIANT_BYTES)

    def build_200_headers(
        self, coding: Coding, length: int, *, has_engine: bool, timing: bytes = HIT
    ) -> RawHeaders:
        """The headers of a 200 response whose body has `length` bytes in this coding.

        They are those of the file and of the body, and those of a 304.
        """
        encoding = () if coding == "identity" else ((b"content-encoding", coding.encode()),)
        return (
            *self._common_headers,
            *encoding,
            (b"content-length", str(length).encode()),
            *self.subject.build_304_headers(coding, has_engine=has_engine, timing=timing),
        )


def _build_heads(status: int, build_headers: Callable[..., RawHeaders]) -> tuple[Message, Message]:
    """The heads of a response, for URLs without and with `engine`."""
    without, with_engine = (
        {
            "type": "http.response.start",
            "status": status,
            "headers": build_headers(has_engine=has_engine),
        }
        for has_engine in (False, True)
    )
    return without, with_engine
