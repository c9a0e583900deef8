"""Entity tags: names of bytes, known before the bytes are (RFC 9110, section 8.8.3)."""

import re
from base64 import urlsafe_b64encode
from hashlib import sha256

from service.api.caching.codings import MADE_BY, Coding

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


def is_any(header: bytes) -> bool:
    """Whether If-None-Match stands for every answer that there is."""
    return header.strip() == b"*"
