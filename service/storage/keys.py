"""Where an object lies: under its hash, never under a name that somebody chose."""

import re

SURFACES = "surfaces"
"""What the key of every surface begins with."""

_ID = re.compile(r"[0-9a-f]{64}", re.ASCII)


def is_id(name: str) -> bool:
    """Whether a name is a SHA-256 in lowercase hexadecimal digits, and nothing else."""
    return _ID.fullmatch(name) is not None


def key_of(id: str) -> str:
    """The key of a surface: `surfaces/ab/abcd…`, at most 256 folders.

    Raises
    ------
    ValueError
        The id is none. The last guard before a file system: whoever takes names from a request
        asks `is_id` first.
    """
    if not is_id(id):
        raise ValueError("an id has 64 hexadecimal digits")
    return f"{SURFACES}/{id[:2]}/{id}"
