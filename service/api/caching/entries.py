"""One file under one address, as it is sent: its tags, its bytes in each coding, and its heads.

An entity tag is a name of bytes, known before the bytes are (RFC 9110, section 8.8.3). Heads are
made once, before they are sent.
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
"""Bytes of the hash in a tag: different answers never get the same one in practice."""

_LISTED = re.compile(rb'(?:W/)?("[\x21\x23-\x7e\x80-\xff]*")')


def entity_tag(content: str, coding: Coding) -> bytes:
    """The strong tag, in its quotes, of some content in a coding.

    Parameters
    ----------
    content : str
        A name of the content: other bytes have another.
    """
    name = f"{content}\n{MADE_BY[coding]}".encode()
    digest = sha256(name).digest()[:_TAG_BYTES]
    return b'"' + urlsafe_b64encode(digest).rstrip(b"=") + b'"'


def listed(header: bytes) -> frozenset[bytes]:
    """The tags that an If-None-Match header lists.

    They are compared weakly there (section 13.1.2), so a `W/` before one is not looked at.
    """
    return frozenset(_LISTED.findall(header))


def held(
    condition: bytes | None, choices: Iterable[Choice], tag: Callable[[Choice], bytes]
) -> Choice | None:
    """The first of these choices whose tag If-None-Match lists: the client has it already."""
    if condition is None:
        return None
    tags = listed(condition)
    return next((choice for choice in choices if tag(choice) in tags), None)


def is_any(header: bytes) -> bool:
    """Whether If-None-Match stands for every answer that there is."""
    return header.strip() == b"*"


RawHeaders: TypeAlias = tuple[tuple[bytes, bytes], ...]

FOR_EVER = "public, max-age=31536000, immutable"
"""Of addresses that will never stand for anything else: a hash, and the version of the numbers."""

FOR_AN_HOUR = "public, max-age=3600, must-revalidate"

HIT = b"cache;desc=hit"
"""The Server-Timing of what was not computed for this request."""

ENTRY_BYTES, VARIANT_BYTES = 3000, 4500
"""What Python needs for an entry and for each of its codings, beside the bytes themselves."""


@dataclass(frozen=True, slots=True)
class Subject:
    """What an address stands for, known before anything is computed.

    Attributes
    ----------
    address : str
        The canonical address, the path that the service is mounted at included.
    surface : str
        The id in it.
    content : str
        A name of the bytes: other bytes have another.
    for_ever : bool
        Whether the id is a hash, so that the canonical address never stands for other bytes.
    """

    address: str
    surface: str
    content: str
    for_ever: bool

    def tag(self, coding: Coding) -> bytes:
        """The entity tag of the bytes in a coding."""
        return entity_tag(self.content, coding)

    def unchanged(self, coding: Coding, *, pinned: bool, timing: bytes = HIT) -> RawHeaders:
        """The headers of a 304; `pinned` where the address that was asked for names the engine."""
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
    """The bytes in one coding, to be sent as the `whole` body or as a `piece` of it.

    [False] of a pair is for addresses that do not name the engine.
    """

    coding: Coding
    body: bytes
    tag: bytes
    whole: Message
    piece: Message
    full: tuple[Message, Message]
    unchanged: tuple[Message, Message]


class Entry:
    """The file, and how it was sent so far.

    Parameters
    ----------
    described : RawHeaders
        Headers of the file, whatever its coding.
    """

    __slots__ = ("_described", "aliases", "plain", "size", "subject", "variants")

    def __init__(self, subject: Subject, plain: bytes, described: RawHeaders) -> None:
        self.subject = subject
        self.plain = plain
        self._described = (*described, (b"link", f'<{subject.address}>; rel="canonical"'.encode()))
        self.variants: dict[Coding, Variant] = {}
        self.aliases: list[tuple[str, bytes]] = []
        self.size = ENTRY_BYTES + sum(len(k) + len(v) for k, v in self._described)
        self.add(self.coded("identity", plain), "identity")

    def headers(self, variant: Variant, *, pinned: bool, timing: bytes) -> RawHeaders:
        """The headers of the answer that brings the bytes."""
        return self._full(variant.coding, len(variant.body), pinned, timing)

    def coded(self, coding: Coding, body: bytes | None) -> Variant:
        """The bytes in a coding; None if it does not pay, and they go as they are."""
        if body is None:
            return self.variants["identity"]
        return Variant(
            coding,
            body,
            self.subject.tag(coding),
            {"type": "http.response.body", "body": body},
            {"type": "http.response.body", "body": body, "more_body": True},
            self._messages(200, [self._full(coding, len(body), p, HIT) for p in _PINNED]),
            self._messages(304, [self.subject.unchanged(coding, pinned=p) for p in _PINNED]),
        )

    def add(self, variant: Variant, coding: Coding) -> None:
        """Keeps what is sent where a client would like this coding best."""
        if variant.coding == coding:
            self.size += len(variant.body) + VARIANT_BYTES
        self.variants[coding] = variant

    @property
    def largest(self) -> int:
        """What the entry takes at most, once it is there in all codings."""
        return self.size + (len(CODINGS) - 1) * (len(self.plain) + VARIANT_BYTES)

    def _full(self, coding: Coding, length: int, pinned: bool, timing: bytes) -> RawHeaders:
        coded = () if coding == "identity" else ((b"content-encoding", coding.encode()),)
        return (
            *self._described,
            *coded,
            (b"content-length", str(length).encode()),
            *self.subject.unchanged(coding, pinned=pinned, timing=timing),
        )

    def _messages(self, status: int, headers: list[RawHeaders]) -> tuple[Message, Message]:
        plain, pinned = (
            {"type": "http.response.start", "status": status, "headers": own} for own in headers
        )
        return plain, pinned


_PINNED = (False, True)
