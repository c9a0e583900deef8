"""Entity tags: names of bytes, known before the bytes are (RFC 9110, section 8.8.3)."""

import re
from base64 import urlsafe_b64encode
from collections.abc import Callable, Iterable
from hashlib import sha256
from typing import TypeVar

from service.api.caching.codings import MADE_BY, Coding

Choice = TypeVar("Choice")

_TAG_BYTES = 16
"""A hash of so many bytes names more answers than will ever be given."""

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
