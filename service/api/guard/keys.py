"""API keys: how they are made, what the service knows of them, and whose one is.

A key is 256 random bits. The service is told only its SHA-256, so that neither its settings nor
their backups let anybody in. Passwords need a slow hash because they can be guessed; of 2²⁵⁶ keys
none can, however fast the hash. So only texts of the form that keys are made in are ever looked
at: whoever configures the hash of a password does not make it a key.
"""

import logging
import os
import re
import secrets
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from hmac import compare_digest
from itertools import chain
from pathlib import Path
from typing import TypeAlias

PREFIX = "sfk_"
"""What keys begin with, so that those who look for leaked secrets find them."""

KEY_BYTES = 32

MOST = 1000
"""Keys at the same time: all are compared with each one that is sent."""

_KEY = re.compile(rb"sfk_[0-9a-f]{64}")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
_HASH = re.compile(r"[0-9a-f]{64}")

NAMES = "1 to 64 letters, digits, `.`, `_` or `-`, the first a letter or a digit"
"""What keys may be called."""

FORM = "name:hash, as `surface key NAME` prints it"


class InvalidKeys(ValueError):
    """What should be a list of keys is none; the text repeats nothing of it."""


@dataclass(frozen=True, slots=True)
class KeyEntry:
    """What is known of a key: whose it is, and its hash."""

    name: str
    digest: bytes


def new_key() -> str:
    """A key that nobody has yet."""
    return PREFIX + secrets.token_hex(KEY_BYTES)


def is_name(text: str) -> bool:
    """Whether a key may be called so."""
    return _NAME.fullmatch(text) is not None


def entry_line(name: str, key: str) -> str:
    """What the service is told of a key."""
    return f"{name}:{sha256(key.encode()).hexdigest()}"


def entries(lines: Iterable[str]) -> tuple[KeyEntry, ...]:
    """The keys that a list tells of. Two of one name are welcome: an old and a new one.

    Raises
    ------
    InvalidKeys
        Saying which one is wrong by its number, and what it must be.
    """
    found: list[KeyEntry] = []
    for number, line in enumerate(lines, 1):
        name, _, digest = line.partition(":")
        if not is_name(name):
            raise InvalidKeys(f"key {number} has no name, or none of {NAMES}; needed {FORM}.")
        if not _HASH.fullmatch(digest.lower()):
            raise InvalidKeys(
                f"key {number} has no hash, 64 hexadecimal digits, after its name; needed {FORM}."
            )
        found.append(KeyEntry(name, bytes.fromhex(digest)))
    return tuple(found)


def together(*lists: tuple[KeyEntry, ...]) -> tuple[KeyEntry, ...]:
    """Several lists as one; raises `InvalidKeys` if a key is there twice, or if they are many."""
    all_of_them = tuple(chain(*lists))
    if len({entry.digest for entry in all_of_them}) < len(all_of_them):
        raise InvalidKeys("one key is there twice; needed each one once.")
    if len(all_of_them) > MOST:
        raise InvalidKeys(f"{len(all_of_them)} keys are too many; needed at most {MOST}.")
    return all_of_them


def owner(key: bytes, known: Sequence[KeyEntry]) -> str | None:
    """The name of a key, if it is one of those that are known.

    It is compared with all of them, in a time that tells nothing of where they differ.
    """
    if not _KEY.fullmatch(key):
        return None
    digest = sha256(key).digest()
    found = None
    for entry in known:
        if compare_digest(entry.digest, digest):
            found = entry.name
    return found


def bearer(header: bytes | None) -> bytes | None:
    """What an Authorization header brings, if it is a key (RFC 6750, section 2.1).

    Other schemes are those of somebody in between, and say nothing to us.
    """
    scheme, _, rest = (header or b"").partition(b" ")
    return rest.strip() if scheme.lower() == b"bearer" else None


_log = logging.getLogger(__name__)

SECONDS_BETWEEN = 1.0
"""Seconds between two looks at the file, which only a request with a key causes."""

MAX_BYTES = 1 << 20

_Mark: TypeAlias = tuple[int, int, int]


class KnownKeys:
    """The keys that are known.

    Whatever is wrong with the file at the start stops the start. Later, what was known stays known:
    an operator who saves half a file locks no client out.

    Raises
    ------
    InvalidKeys
        At the start.
    """

    def __init__(
        self,
        listed: tuple[KeyEntry, ...] = (),
        file: str = "",
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._listed = listed
        self._file = Path(file) if file else None
        self._clock = clock
        self._next = clock() + SECONDS_BETWEEN
        self._seen: _Mark | None = None
        self._known: tuple[KeyEntry, ...] = ()
        if self._file is None:
            self._known = together(self._listed)
        else:
            self._read(self._file)

    def __call__(self) -> Sequence[KeyEntry]:
        """All keys as of now."""
        if self._file is not None and (now := self._clock()) >= self._next:
            self._next = now + SECONDS_BETWEEN
            try:
                if _mark(self._file) != self._seen:
                    self._read(self._file)
                    _log.info("the file of keys was read again: %d keys", len(self._known))
            except InvalidKeys as error:
                _log.error("the file of keys is not used, the keys known before stay: %s", error)
        return self._known

    def _read(self, file: Path) -> None:
        # Marked as seen first: what cannot be read is told of once, and tried when it changes.
        self._seen = _mark(file)
        try:
            with file.open("rb") as opened:
                content = opened.read(MAX_BYTES + 1)
            if len(content) > MAX_BYTES:
                raise InvalidKeys(f"it is too long; needed at most {MAX_BYTES} bytes.")
            lines = [line.strip() for line in content.decode("utf-8-sig").splitlines()]
        except OSError as error:
            raise InvalidKeys(f"it cannot be read: {error.strerror}.") from None
        except UnicodeDecodeError:
            raise InvalidKeys("it is not a text in UTF-8.") from None
        of_file = [line for line in lines if line and not line.startswith("#")]
        self._known = together(self._listed, entries(of_file))


def _mark(file: Path) -> _Mark | None:
    """What is different when the file is another; None where there is none."""
    try:
        found = os.stat(file)
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
