"""API keys: makes keys, reads the list of their hashes, and finds the name of a key.

A key is 256 random bits. The service knows only its SHA-256, so a copy of the settings or of a
backup gives no access. Passwords need a slow hash because they can be guessed; one of 2²⁵⁶ keys
cannot be guessed, even if the hash is fast. The service accepts only texts in the form of its keys:
so a password whose hash an operator puts into the settings is not accepted as a key.
"""

import logging
import os
import re
import secrets
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from hmac import compare_digest
from itertools import chain
from pathlib import Path
from typing import TypeAlias

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

ENTRY_FORM = "name:hash, as `surface key NAME` prints it"
"""Valid entries of the list of keys, in words."""


@dataclass(frozen=True, slots=True)
class KeyEntry:
    """The name and the SHA-256 of a key."""

    name: str
    digest: bytes


def make_key() -> str:
    """A new random key."""
    return PREFIX + secrets.token_hex(KEY_BYTES)


def is_key_name(text: str) -> bool:
    """Whether a text is a valid name of a key."""
    return _NAME.fullmatch(text) is not None


def format_entry(name: str, key: str) -> str:
    """The line `name:hash` of a key, for the settings."""
    return f"{name}:{sha256(key.encode()).hexdigest()}"


def parse_entries(lines: Iterable[str]) -> tuple[KeyEntry, ...]:
    """Parses lines `name:hash`. One name may have two keys, an old and a new one.

    Raises
    ------
    InvalidSettings
        Names the line by its number, and says what it must be.
    """
    keys: list[KeyEntry] = []
    for number, line in enumerate(lines, 1):
        name, _, digest = line.partition(":")
        if not is_key_name(name):
            raise InvalidSettings(
                f"key {number} has no valid name: {NAME_FORM}; needed {ENTRY_FORM}."
            )
        if not _HASH.fullmatch(digest.lower()):
            raise InvalidSettings(
                f"key {number} has no hash, 64 hexadecimal digits, after its name; needed "
                f"{ENTRY_FORM}."
            )
        keys.append(KeyEntry(name, bytes.fromhex(digest)))
    return tuple(keys)


def join_entries(*lists: tuple[KeyEntry, ...]) -> tuple[KeyEntry, ...]:
    """Joins several lists; raises `InvalidSettings` for a repeated key, or too many keys."""
    joined = tuple(chain(*lists))
    if len({entry.digest for entry in joined}) < len(joined):
        raise InvalidSettings("one key is listed twice; needed each key once.")
    if len(joined) > MAX_KEYS:
        raise InvalidSettings(f"{len(joined)} keys are too many; needed at most {MAX_KEYS}.")
    return joined


def find_name(key: bytes, entries: Sequence[KeyEntry]) -> str | None:
    """The name of a key; None if the service does not know it.

    Compares the key with all entries, in constant time, so that the response time reveals nothing.
    """
    if not _KEY.fullmatch(key):
        return None
    digest = sha256(key).digest()
    matching_name = None
    for entry in entries:
        if compare_digest(entry.digest, digest):
            matching_name = entry.name
    return matching_name


def parse_bearer(header: bytes | None) -> bytes | None:
    """The key of an Authorization header, or None (RFC 6750, section 2.1).

    The service ignores other schemes: they may be for a proxy between the client and the service.
    """
    scheme, _, credentials = (header or b"").partition(b" ")
    return credentials.strip() if scheme.lower() == b"bearer" else None


_log = logging.getLogger(__name__)

CHECK_INTERVAL = 1.0
"""Seconds between two checks whether the file of keys (`SURFACE_API_KEYS_FILE`) has changed;
requests with a key start them."""

MAX_BYTES = 1 << 20
"""The most bytes of the file of keys: 1000 keys take at most 130 kB, the rest is for comments."""

_FileState: TypeAlias = tuple[int, int, int]
"""Time of the last change, size and inode of a file."""


class KnownKeys:
    """The keys of the settings and of the file of keys, which is read again when it changes.

    If the file is invalid at the start, the service does not start. If a later version of the file
    is invalid, the service logs an error and keeps the keys that it knew: so clients keep access
    when an operator saves an incomplete file.

    Raises
    ------
    InvalidSettings
        Only the constructor raises this.
    """

    def __init__(self, setting_entries: tuple[KeyEntry, ...] = (), file: str = "") -> None:
        self._setting_entries = setting_entries
        self._file = Path(file) if file else None
        self._next_check = time.monotonic() + CHECK_INTERVAL
        self._state: _FileState | None = None
        self._entries: tuple[KeyEntry, ...] = ()
        if self._file is None:
            self._entries = join_entries(self._setting_entries)
        else:
            self._read(self._file)

    def __call__(self) -> Sequence[KeyEntry]:
        """The present keys."""
        if self._file is not None and (now := time.monotonic()) >= self._next_check:
            self._next_check = now + CHECK_INTERVAL
            try:
                if _file_state(self._file) != self._state:
                    self._read(self._file)
                    _log.info("the file of keys was read again: %d keys", len(self._entries))
            except InvalidSettings as error:
                _log.error("the file of keys is not used, the keys known before stay: %s", error)
        return self._entries

    def _read(self, file: Path) -> None:
        # Remember the state first: an invalid file is logged once, and read again when it changes.
        self._state = _file_state(file)
        try:
            with file.open("rb") as stream:
                content = stream.read(MAX_BYTES + 1)
            if len(content) > MAX_BYTES:
                raise InvalidSettings(f"it is too long; needed at most {MAX_BYTES} bytes.")
            lines = [line.strip() for line in content.decode("utf-8-sig").splitlines()]
        except OSError as error:
            raise InvalidSettings(f"it cannot be read: {error.strerror}.") from None
        except UnicodeDecodeError:
            raise InvalidSettings("it is not a text in UTF-8.") from None
        entry_lines = [line for line in lines if line and not line.startswith("#")]
        self._entries = join_entries(self._setting_entries, parse_entries(entry_lines))


def _file_state(file: Path) -> _FileState | None:
    """The state of a file, by which a change is noticed; None if the file does not exist."""
    try:
        status = os.stat(file)
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino
