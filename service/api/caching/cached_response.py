"""A mesh file in memory: its entity tags, its bytes in each coding, and its response heads.

An entity tag names the bytes before they are computed (RFC 9110, section 8.8.3). Heads are made
once and sent many times.
"""

import re
from base64 import urlsafe_b64encode
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from hashlib import sha256
from typing import TypeAlias, TypeVar

from starlette.types import Message

from service.api.caching.codings import CODINGS, MADE_BY, Coding

Choice = TypeVar("Choice")

_TAG_BYTES = 16
"""Bytes of the hash in a tag: in practice different responses never share one."""

_LISTED = re.compile(rb'(?:W/)?("[\x21\x23-\x7e\x80-\xff]*")')


def entity_tag(content: str, coding: Coding) -> bytes:
    """The strong entity tag of a content in a coding, with its quotes.

    Parameters
    ----------
    content : str
        A name of the content: different bytes have different names.
    """
    name = f"{content}\n{MADE_BY[coding]}".encode()
    digest = sha256(name).digest()[:_TAG_BYTES]
    return b'"' + urlsafe_b64encode(digest).rstrip(b"=") + b'"'


def parse_tags(header: bytes) -> frozenset[bytes]:
    """The entity tags in an If-None-Match header, without their `W/`.

    This header compares tags weakly (section 13.1.2).
    """
    return frozenset(_LISTED.findall(header))


def find_held(
    condition: bytes | None, choices: Iterable[Choice], tag: Callable[[Choice], bytes]
) -> Choice | None:
    """The first choice whose entity tag If-None-Match lists: the client has it already."""
    if condition is None:
        return None
    tags = parse_tags(condition)
    return next((choice for choice in choices if tag(choice) in tags), None)


def is_any(header: bytes) -> bool:
    """Whether If-None-Match is `*`, which matches every response."""
    return header.strip() == b"*"


RawHeaders: TypeAlias = tuple[tuple[bytes, bytes], ...]

FOR_EVER = "public, max-age=31536000, immutable"
"""For URLs that always stand for the same bytes: they name a hash and the engine's version."""

FOR_AN_HOUR = "public, max-age=3600, must-revalidate"

HIT = b"cache;desc=hit"
"""`Server-Timing` of a cached response."""

ENTRY_BYTES, VARIANT_BYTES = 3000, 4500
"""Memory that Python needs for an entry and for each coding, beside the file's bytes."""


@dataclass(frozen=True, slots=True)
class Subject:
    """The meaning of a URL, known before anything is computed.

    Attributes
    ----------
    url : str
        The canonical URL's path and query, with the path that the service is mounted at.
    surface : str
        The id in the URL.
    content : str
        A name of the bytes: different bytes have different names.
    for_ever : bool
        Whether the id is a hash, so that the canonical URL always stands for the same bytes.
    """

    url: str
    surface: str
    content: str
    for_ever: bool

    def tag(self, coding: Coding) -> bytes:
        """The entity tag of the file in a coding."""
        return entity_tag(self.content, coding)

    def build_304_headers(self, coding: Coding, *, pinned: bool, timing: bytes = HIT) -> RawHeaders:
        """The headers of a 304; `pinned`: the requested URL names the engine."""
        lasting = FOR_EVER if self.for_ever and pinned else FOR_AN_HOUR
        return (
            (b"etag", self.tag(coding)),
            (b"cache-control", lasting.encode()),
            (b"vary", b"Accept-Encoding"),
            (b"server-timing", timing),
            (b"x-content-type-options", b"nosniff"),
        )


@dataclass(frozen=True, slots=True)
class Variant:
    """The file in one coding, with the messages that send it (ASGI).

    `whole` sends the body as the only message, `piece` as one of several. `full` is the head of a
    200, `unchanged` that of a 304: each first for URLs without `engine=`, then for URLs with it.
    """

    coding: Coding
    body: bytes
    tag: bytes
    whole: Message
    piece: Message
    full: tuple[Message, Message]
    unchanged: tuple[Message, Message]


class CachedResponse:
    """A mesh file in memory, with its codings and ready-made heads.

    Parameters
    ----------
    described : RawHeaders
        Headers that all codings of the file have.
    """

    __slots__ = ("_described", "aliases", "plain", "size", "subject", "variants")

    def __init__(self, subject: Subject, plain: bytes, described: RawHeaders) -> None:
        self.subject = subject
        self.plain = plain
        self._described = (*described, (b"link", f'<{subject.url}>; rel="canonical"'.encode()))
        self.variants: dict[Coding, Variant] = {}
        self.aliases: list[tuple[str, bytes]] = []
        self.size = ENTRY_BYTES + sum(len(k) + len(v) for k, v in self._described)
        self.add(self.make_variant("identity", plain), "identity")

    def headers(self, variant: Variant, *, pinned: bool, timing: bytes) -> RawHeaders:
        """The headers of a 200 response with this variant."""
        return self._full(variant.coding, len(variant.body), pinned, timing)

    def make_variant(self, coding: Coding, body: bytes | None) -> Variant:
        """The file in a coding; if `body` is None, as compressing does not pay, the plain file."""
        if body is None:
            return self.variants["identity"]
        return Variant(
            coding,
            body,
            self.subject.tag(coding),
            {"type": "http.response.body", "body": body},
            {"type": "http.response.body", "body": body, "more_body": True},
            self._messages(200, [self._full(coding, len(body), p, HIT) for p in _PINNED]),
            self._messages(
                304, [self.subject.build_304_headers(coding, pinned=p) for p in _PINNED]
            ),
        )

    def add(self, variant: Variant, coding: Coding) -> None:
        """Keeps the variant for clients that prefer this coding."""
        if variant.coding == coding:
            self.size += len(variant.body) + VARIANT_BYTES
        self.variants[coding] = variant

    @property
    def largest(self) -> int:
        """Bytes that the response takes at most, once it has all codings."""
        return self.size + (len(CODINGS) - 1) * (len(self.plain) + VARIANT_BYTES)

    def _full(self, coding: Coding, length: int, pinned: bool, timing: bytes) -> RawHeaders:
        coded = () if coding == "identity" else ((b"content-encoding", coding.encode()),)
        return (
            *self._described,
            *coded,
            (b"content-length", str(length).encode()),
            *self.subject.build_304_headers(coding, pinned=pinned, timing=timing),
        )

    def _messages(self, status: int, headers: list[RawHeaders]) -> tuple[Message, Message]:
        plain, pinned = (
            {"type": "http.response.start", "status": status, "headers": header_list}
            for header_list in headers
        )
        return plain, pinned


_PINNED = (False, True)
