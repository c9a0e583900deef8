"""Keys of stored objects, made from their hashes and never from names that a client chose."""

import re

SURFACES = "surfaces"
"""The prefix of every surface's key."""

_ID = re.compile(r"[0-9a-f]{64}", re.ASCII)


def is_id(name: str) -> bool:
    """Whether a name is a SHA-256 in 64 lowercase hexadecimal digits."""
    return _ID.fullmatch(name) is not None


def find_id(key: str) -> str | None:
    """The id of the surface that is stored under a key; None if it is the key of no surface."""
    id = key.rpartition("/")[2]
    return id if is_id(id) and key == key_of(id) else None


def key_of(id: str) -> str:
    """The key of a surface: `surfaces/ab/abcd…`, at most 256 folders.

    Raises
    ------
    ValueError
        `id` is not a SHA-256. This is the last check before a file is opened; callers that get ids
        from a request must call `is_id` first.
    """
    if not is_id(id):
        raise ValueError("an id has 64 hexadecimal digits")
    return f"{SURFACES}/{id[:2]}/{id}"
