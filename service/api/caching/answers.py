"""The answers that are kept in memory: the least recently used go first, by bytes."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

from service.api.caching.codings import Coding
from service.api.caching.entries import VARIANT_BYTES, Entry, Variant

SHARE = 2
"""An entry may take one part of so many, once it is there in all codings: no single one drives out
all others."""

ALIASES = 8
"""Spellings of its address by which an entry is found without being understood anew."""

ALIAS_LETTERS = 1000
"""Longer addresses are understood anew each time."""

ALIAS_BYTES = 400
"""What Python needs for a spelling beside its letters."""


@dataclass(slots=True)
class Counts:
    """What the cache has done so far."""

    hits: int = 0
    misses: int = 0
    evictions: int = 0


class AnswerCache:
    """Entries by their canonical addresses, and by other spellings of them.

    Everything counts against the bound: bytes, heads, and the spellings. What is being sent to a
    slow client is not dropped: it would go on taking memory of which nobody knows.

    Attributes
    ----------
    allowed : int
        The bound as it is right now, where others need some of the memory.
    freed : Callable
        Called when something is given up that could not be before.
    """

    def __init__(self, max_bytes: int) -> None:
        self.max_bytes = max_bytes
        self.allowed = max_bytes
        self.bytes = 0
        self.freed: Callable[[], None] = lambda: None
        self.counts = Counts()
        self.age = 0
        """How often something was forgotten: what was begun before is not kept after it."""
        self._entries: OrderedDict[str, Entry] = OrderedDict()
        self._known: dict[tuple[str, bytes], tuple[Entry, bool]] = {}
        self._of_surface: dict[str, set[str]] = {}
        self._read: dict[Entry, int] = {}

    def __len__(self) -> int:
        return len(self._entries)

    def find(self, path: str, query: bytes) -> tuple[Entry, bool] | None:
        """The entry at an address as it was written, and whether that names the engine."""
        found = self._known.get((path, query))
        if found is not None:
            self._entries.move_to_end(found[0].subject.address)
        return found

    def get(self, address: str) -> Entry | None:
        """The entry at a canonical address."""
        entry = self._entries.get(address)
        if entry is not None:
            self._entries.move_to_end(address)
        return entry

    def holds(self, entry: Entry) -> bool:
        """Whether it is this very entry that is kept."""
        return self._entries.get(entry.subject.address) is entry

    def put(self, entry: Entry, age: int) -> bool:
        """Keeps an entry if there is room for all its codings; `age` is that of its beginning."""
        if age != self.age or entry.largest > self.max_bytes // SHARE:
            return False
        subject = entry.subject
        if subject.address in self._entries:
            self._drop(subject.address)
        if not self._has_room(entry.size):
            return False
        self._entries[subject.address] = entry
        self._of_surface.setdefault(subject.surface, set()).add(subject.address)
        self.bytes += entry.size
        return True

    def add(self, entry: Entry, coding: Coding, body: bytes | None) -> Variant:
        """The entry in one more coding; it counts if the entry is kept."""
        variant = entry.coded(coding, body)
        growth = 0 if body is None else len(body) + VARIANT_BYTES
        if not self.holds(entry):
            entry.add(variant, coding)
        elif self._has_room(growth, entry):
            entry.add(variant, coding)
            self.bytes += growth
        return variant

    def alias(self, entry: Entry, path: str, query: bytes, *, pinned: bool) -> None:
        """Remembers a spelling of the address of an entry, if that is kept."""
        spelling = (path, query)
        letters = len(path) + len(query)
        if letters > ALIAS_LETTERS or spelling in self._known or not self.holds(entry):
            return
        if len(entry.aliases) == ALIASES:
            self._unlearn(entry, 0)
        if not self._has_room(letters + ALIAS_BYTES, entry):
            return
        entry.aliases.append(spelling)
        self._known[spelling] = (entry, pinned)
        entry.size += letters + ALIAS_BYTES
        self.bytes += letters + ALIAS_BYTES

    def forget(self, surface: str) -> None:
        """Drops everything that was made of a surface, and what is being made right now."""
        self.age += 1
        for address in self._of_surface.get(surface, set()).copy():
            self._drop(address)

    @property
    def fixed(self) -> int:
        """Bytes of entries that are being sent: the cache cannot give them up right now."""
        return sum(entry.size for entry in self._read) if self._read else 0

    def resize(self, room: int) -> None:
        """Keeps at most `room` bytes from now on, or the bound if that is less; `fixed` aside."""
        self.allowed = min(self.max_bytes, room)
        if self._entries or self._read:
            self._has_room(0)

    def begin(self, entry: Entry) -> None:
        """Begins to send an entry that is kept: it stays until `end`."""
        self._read[entry] = self._read.get(entry, 0) + 1

    def end(self, entry: Entry) -> None:
        """One client has it, or has gone."""
        left = self._read.pop(entry) - 1
        if left:
            self._read[entry] = left
        else:
            if self.bytes > self.allowed:
                self._has_room(0)
            self.freed()

    def _has_room(self, size: int, but: Entry | None = None) -> bool:
        """Makes room for so much by giving up others than this one; whether that succeeds."""
        if size and self.fixed + size > self.allowed:
            return False
        gone = sum(e.size for e in self._read if not self.holds(e)) if self._read else 0
        while self.bytes + gone + size > self.allowed:
            unread = (e for e in self._entries.values() if e not in self._read and e is not but)
            first = next(unread, None)
            if first is None:
                return False
            self.counts.evictions += 1
            self._drop(first.subject.address)
        return True

    def _drop(self, address: str) -> None:
        entry = self._entries.pop(address)
        while entry.aliases:
            self._unlearn(entry, -1)
        self.bytes -= entry.size
        addresses = self._of_surface[entry.subject.surface]
        addresses.remove(address)
        if not addresses:
            del self._of_surface[entry.subject.surface]

    def _unlearn(self, entry: Entry, index: int) -> None:
        path, query = spelling = entry.aliases.pop(index)
        del self._known[spelling]
        size = len(path) + len(query) + ALIAS_BYTES
        entry.size -= size
        self.bytes -= size
