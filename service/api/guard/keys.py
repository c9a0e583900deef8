"""API keys: makes keys, parses the list of their hashes, and finds the entry of a key.

A key is 256 random bits. The service knows only its SHA-256, so a copy of the settings or of a
backup gives no access. Passwords need a slow hash because they can be guessed; one of 2²⁵⁶ keys
cannot be guessed, even if the hash is fast. The service accepts only texts in the form of its keys:
so a password whose hash an operator puts into the settings is not accepted as a key.
"""

import re
import secrets
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from hmac import compare_digest
from itertools import chain
from typing import Literal, TypeAlias, get_args

from service.errors import InvalidSettings

PREFIX = "sfk_"
"""The first letters of every key, so that scanners for leaked secrets find it."""

KEY_BYTES = 32
"""Random bytes of a key: 256 bits."""

MAX_KEYS = 1000
"""The most keys of a service, which compares each key that a client sends with all of them."""

_KEY = re.compile(rb"sfk_[0-9a-f]{64}")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
_HASH = re.compile(r"[0-9a-f]{64}")

NAME_FORM = "1 to 64 letters, digits, `.`, `_` or `-`, the first a letter or a digit"
"""Valid names of keys, in words."""

ENTRY_FORM = "name:hash or name:hash:scopes, as `surface key NAME` prints it"
"""Valid entries of the list of keys, in words."""

KeyScope: TypeAlias = Literal["read", "compute", "store", "delete", "admin"]
"""A kind of calls that a key may make; `service.api.guard.policy.scope_of` has the scope of each
call."""

SCOPES: tuple[KeyScope, ...] = get_args(KeyScope)
"""All scopes, in the order in which entries list them."""

DEFAULT_SCOPES: frozenset[KeyScope] = frozenset(SCOPES) - {"admin"}
"""The scopes of an entry that names none."""

SCOPES_FORM = f"one or more of {', '.join(SCOPES)}, with `+` between them"
"""Valid lists of scopes, in words."""


@dataclass(frozen=True, slots=True)
class KeyEntry:
    """The name and the SHA-256 of a key, and its scopes: what the key permits."""

    name: str
    digest: bytes
    scopes: frozenset[KeyScope] = DEFAULT_SCOPES


def make_key() -> str:
    """A new random key."""
    return PREFIX + secrets.token_hex(KEY_BYTES)


def is_key_name(text: str) -> bool:
    """Whether a text is a valid name of a key."""
    return _NAME.fullmatch(text) is not None


def parse_scopes(text: str) -> frozenset[KeyScope] | None:
    """The scopes in a text such as `read+compute`; None if a name is unknown or missing."""
    names = text.split("+")
    return frozenset(s for s in SCOPES if s in names) if set(names) <= set(SCOPES) else None


def format_entry(name: str, key: str, scopes: frozenset[KeyScope] = DEFAULT_SCOPES) -> str:
    """The line of a key, for the settings: `name:hash`, or `name:hash:scopes`.

    The default scopes are left out, so that older versions of the service read the line too.
    """
    line = f"{name}:{sha256(key.encode()).hexdigest()}"
    names = "+".join(scope for scope in SCOPES if scope in scopes)
    return line if scopes == DEFAULT_SCOPES else f"{line}:{names}"


def parse_entries(lines: Iterable[str]) -> tuple[KeyEntry, ...]:
    """Parses lines `name:hash` or `name:hash:scopes`.

    One name may have two keys, an old and a new one.

    Raises
    ------
    InvalidSettings
        Names the line by its number, and says what it must be.
    """
    keys: list[KeyEntry] = []
    for number, line in enumerate(lines, 1):
        name, _, rest = line.partition(":")
        digest, colon, scope_names = rest.partition(":")
        if not is_key_name(name):
            raise InvalidSettings(
                f"key {number} has no valid name: {NAME_FORM}; needed {ENTRY_FORM}."
            )
        if not _HASH.fullmatch(digest.lower()):
            raise InvalidSettings(
                f"key {number} has no hash, 64 hexadecimal digits, after its name; needed "
                f"{ENTRY_FORM}."
            )
        scopes = parse_scopes(scope_names) if colon else DEFAULT_SCOPES
        if scopes is None:
            raise InvalidSettings(
                f"key {number} has unknown scopes after its hash; needed {SCOPES_FORM}, or no "
                "colon after the hash."
            )
        keys.append(KeyEntry(name, bytes.fromhex(digest), scopes))
    return tuple(keys)


def join_entries(*lists: tuple[KeyEntry, ...]) -> tuple[KeyEntry, ...]:
    """Joins several lists; raises `InvalidSettings` for a repeated key, or too many keys."""
    joined = tuple(chain(*lists))
    if len({entry.digest for entry in joined}) < len(joined):
        raise InvalidSettings("one key is listed twice; needed each key once.")
    if len(joined) > MAX_KEYS:
        raise InvalidSettings(f"{len(joined)} keys are too many; needed at most {MAX_KEYS}.")
    return joined


def find_entry(key: bytes, entries: Sequence[KeyEntry]) -> KeyEntry | None:
    """The entry of a key; None if the service does not know it.

    Compares the key with all entries, in constant time, so that the response time reveals nothing.
    """
    if not _KEY.fullmatch(key):
        return None
    digest = sha256(key).digest()
    matching_entry = None
    for entry in entries:
        if compare_digest(entry.digest, digest):
            matching_entry = entry
    return matching_entry


def parse_bearer(header: bytes | None) -> bytes | None:
    """The key of an Authorization header, or None (RFC 6750, section 2.1).

    The service ignores other schemes: they may be for a proxy between the client and the service.
    """
    scheme, _, credentials = (header or b"").partition(b" ")
    return credentials.strip() if scheme.lower() == b"bearer" else None
