"""Answers that are not for everybody: what caches are told of them."""

from collections.abc import Iterable

from service.api.caching.entries import RawHeaders

HOUR = 3600

_REVALIDATED = b"private, no-cache"
"""For whoever has a key: a browser keeps it, and asks each time whether it still may."""


def private_headers(headers: Iterable[tuple[bytes, bytes]], left: int | None) -> RawHeaders:
    """The headers of an answer, as those of an answer that caches of many people must not keep.

    Parameters
    ----------
    left : int or None
        Seconds for which the signature of the address is still good; None where a key was sent.
    """
    changed = [
        (name, _control(value, left)) if name.lower() == b"cache-control" else (name, value)
        for name, value in headers
    ]
    if not any(name.lower() == b"cache-control" for name, _ in changed):
        changed.append((b"cache-control", _REVALIDATED))
    return (*changed, (b"vary", b"Authorization"))


def _control(public: bytes, left: int | None) -> bytes:
    if b"no-store" in public:
        return public
    if left is None:
        return _REVALIDATED
    age = left if b"immutable" in public else min(left, HOUR)
    return b"private, max-age=%d" % age
