"""The answers that are kept in memory: the least recently used go first, by bytes."""

from collections import OrderedDict
from dataclasses import dataclass

from service.api.caching.codings import Coding
from service.api.caching.entries import Entry, Variant

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

    Everything counts against the bound: bytes, heads, and the spellings.
    """

    def __init__(self, max_bytes: int) -> None:
        self.max_bytes = max_bytes
        self.bytes = 0
        self.counts = Counts()
        self.age = 0
        """How often something was forgotten: what was begun before is not kept after it."""
        self._entries: OrderedDict[str, Entry] = OrderedDict()
        self._known: dict[tuple[str, bytes], tuple[Entry, bool]] = {}
        self._of_surface: dict[str, set[str]] = {}

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
        self._entries[subject.address] = entry
        self._of_surface.setdefault(subject.surface, set()).add(subject.address)
        self._grown(entry.size)
        return True

    def add(self, entry: Entry, coding: Coding, body: bytes | None) -> Variant:
        """The entry in one more coding; it counts if the entry is kept."""
        before = entry.size
        variant = entry.add(coding, body)
        if self.holds(entry):
            self._grown(entry.size - before)
        return variant

    def alias(self, entry: Entry, path: str, query: bytes, *, pinned: bool) -> None:
        """Remembers a spelling of the address of an entry, if that is kept."""
        spelling = (path, query)
        letters = len(path) + len(query)
        if letters > ALIAS_LETTERS or spelling in self._known or not self.holds(entry):
            return
        if len(entry.aliases) == ALIASES:
            self._unlearn(entry, 0)
        entry.aliases.append(spelling)
        self._known[spelling] = (entry, pinned)
        entry.size += letters + ALIAS_BYTES
        self._grown(letters + ALIAS_BYTES)

    def forget(self, surface: str) -> None:
        """Drops everything that was made of a surface, and what is being made right now."""
        self.age += 1
        for address in self._of_surface.get(surface, set()).copy():
            self._drop(address)

    def _grown(self, size: int) -> None:
        self.bytes += size
        while self.bytes > self.max_bytes:
            self.counts.evictions += 1
            self._drop(next(iter(self._entries)))

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
