"""The keys that are known now: those of the settings, and those of a file that may change."""

import logging
import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

from service.api.guard.keys import InvalidKeys, KeyEntry, entries, together

_log = logging.getLogger(__name__)

SECONDS_BETWEEN = 1.0
"""The file is looked at so often at most, and only when somebody sends a key."""

MAX_BYTES = 1 << 20

_Mark: TypeAlias = tuple[int, int, int]


class KnownKeys:
    """The keys that are known.

    Whatever is wrong with the file at the start stops the start. Later, what was known stays known:
    an operator who saves half a file locks nobody out.

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
