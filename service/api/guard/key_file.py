"""The keys that the service knows: those of the settings, and those of the file of keys."""

import logging
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

from service.api.guard.keys import KeyEntry, join_entries, parse_entries
from service.errors import InvalidSettings

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

    Attributes
    ----------
    is_file_valid : bool or None
        Whether the last version of the file that was read is valid; None without a file.

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
        self.is_file_valid: bool | None = None
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
                self.is_file_valid = False
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
        self.is_file_valid = True


def _file_state(file: Path) -> _FileState | None:
    """The state of a file, by which a change is noticed; None if the file does not exist."""
    try:
        status = os.stat(file)
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino
