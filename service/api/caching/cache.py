"""The cache of responses in memory: bounded in bytes, drops the least recently used first."""

from collections import OrderedDict
from collections.abc import Callable

from service.api.caching.cached_response import VARIANT_BYTES, CachedResponse, Variant
from service.api.caching.codings import Coding

SHARE = 2
"""An entry with all its codings may take at most 1/SHARE of the cache, which leaves room for other
entries."""

MAX_ALIASES = 8
"""Most spellings of its URL that an entry has. By a spelling, the cache finds the entry without
parsing the URL."""

MAX_ALIAS_LETTERS = 1000
"""Most characters of a spelling: longer URLs are parsed each time."""

ALIAS_BYTES = 400
"""Bytes of memory that Python needs for a spelling, beside its characters."""


class ResponseCache:
    """Entries by their canonical URLs, and by other spellings of these URLs.

    Bodies, heads and spellings all count against the bound. To make room, the cache does not drop a
    response that is being sent to a slow client: that would free no memory.

    Attributes
    ----------
    allowed : int
        The present bound in bytes: below `max_bytes` while requests need the memory.
    on_sent : Callable
        Called when an entry is no longer being sent, so that the cache can drop it.
    hits, misses, evictions : int
        Responses sent from the cache, computed for it, and dropped to make room, since the start.
    """

    def __init__(self, max_bytes: int) -> None:
        self.max_bytes = max_bytes
        self.allowed = max_bytes
        self.bytes = 0
        self.on_sent: Callable[[], None] = lambda: None
        self.hits = self.misses = self.evictions = 0
        self.generation = 0
        """Number of calls of `forget`. The cache does not keep a response whose computation began
        before the last call."""
        self._entries: OrderedDict[str, CachedResponse] = OrderedDict()
        self._by_spelling: dict[tuple[str, bytes], tuple[CachedResponse, bool]] = {}
        self._urls_by_surface: dict[str, set[str]] = {}
        self._being_sent: dict[CachedResponse, int] = {}

    def __len__(self) -> int:
        return len(self._entries)

    def find(self, path: str, query: bytes) -> tuple[CachedResponse, bool] | None:
        """The entry of a URL as the client wrote it, and whether the URL has `engine`; or None."""
        match = self._by_spelling.get((path, query))
        if match is not None:
            entry, _ = match
            self._entries.move_to_end(entry.subject.url)
        return match

    def get(self, url: str) -> CachedResponse | None:
        """The entry of a canonical URL, or None."""
        entry = self._entries.get(url)
        if entry is not None:
            self._entries.move_to_end(url)
        return entry

    def holds(self, entry: CachedResponse) -> bool:
        """Whether the cache keeps this entry (not another with the same URL)."""
        return self._entries.get(entry.subject.url) is entry

    def put(self, entry: CachedResponse, generation: int) -> bool:
        """Keeps an entry if it fits and nothing was forgotten since `generation`; else False."""
        if generation != self.generation or entry.max_size > self.max_bytes // SHARE:
            return False
        subject = entry.subject
        if subject.url in self._entries:
            self._drop(subject.url)
        if not self._make_room(entry.size):
            return False
        self._entries[subject.url] = entry
        self._urls_by_surface.setdefault(subject.surface, set()).add(subject.url)
        self.bytes += entry.size
        return True

    def add(self, entry: CachedResponse, coding: Coding, body: bytes | None) -> Variant:
        """Adds a body in a coding to the entry, if it fits; returns it as a variant.

        If `body` is None, the variant is the uncompressed one. The bytes of the body count against
        the bound if the cache keeps the entry.
        """
        variant = entry.make_variant(coding, body)
        growth = 0 if body is None else len(body) + VARIANT_BYTES
        if not self.holds(entry):
            entry.add(variant, coding)
        elif self._make_room(growth, entry):
            entry.add(variant, coding)
            self.bytes += growth
        return variant

    def alias(self, entry: CachedResponse, path: str, query: bytes, *, has_engine: bool) -> None:
        """Remembers a URL spelling of an entry that the cache keeps."""
        spelling = (path, query)
        letters = len(path) + len(query)
        if letters > MAX_ALIAS_LETTERS or spelling in self._by_spelling or not self.holds(entry):
            return
        if len(entry.aliases) == MAX_ALIASES:
            self._drop_alias(entry, 0)
        if not self._make_room(letters + ALIAS_BYTES, entry):
            return
        entry.aliases.append(spelling)
        self._by_spelling[spelling] = (entry, has_engine)
        entry.size += letters + ALIAS_BYTES
        self.bytes += letters + ALIAS_BYTES

    def forget(self, surface: str) -> None:
        """Drops all responses made from a surface; does not keep responses now being computed."""
        self.generation += 1
        for url in self._urls_by_surface.get(surface, set()).copy():
            self._drop(url)

    @property
    def bytes_being_sent(self) -> int:
        """Bytes of the entries that are being sent, which the cache cannot drop now."""
        return sum(entry.size for entry in self._being_sent) if self._being_sent else 0

    def resize(self, room: int) -> None:
        """Sets the bound to `room` bytes, at most `max_bytes`, and drops entries beyond it."""
        self.allowed = min(self.max_bytes, room)
        if self._entries or self._being_sent:
            self._make_room(0)

    def begin(self, entry: CachedResponse) -> None:
        """Begins to send an entry: it stays in memory until `end`."""
        self._being_sent[entry] = self._being_sent.get(entry, 0) + 1

    def end(self, entry: CachedResponse) -> None:
        """Ends sending an entry to one client."""
        client_count = self._being_sent.pop(entry) - 1
        if client_count:
            self._being_sent[entry] = client_count
        else:
            if self.bytes > self.allowed:
                self._make_room(0)
            self.on_sent()

    def _make_room(self, size: int, keep: CachedResponse | None = None) -> bool:
        """Drops the oldest entries until `size` bytes are free; returns whether they are free.

        Drops neither `keep` nor entries that are being sent.
        """
        if size and self.bytes_being_sent + size > self.allowed:
            return False  # without dropping any: there would not be room even without the others
        # The bytes of entries that are still being sent but no longer in the cache: `self.bytes`
        # does not include them.
        unlisted_bytes = sum(e.size for e in self._being_sent if not self.holds(e))
        while self.bytes + unlisted_bytes + size > self.allowed:
            droppable = (
                e for e in self._entries.values() if e not in self._being_sent and e is not keep
            )
            oldest = next(droppable, None)
            if oldest is None:
                return False
            self.evictions += 1
            self._drop(oldest.subject.url)
        return True

    def _drop(self, url: str) -> None:
        entry = self._entries.pop(url)
        while entry.aliases:
            self._drop_alias(entry, -1)
        self.bytes -= entry.size
        urls = self._urls_by_surface[entry.subject.surface]
        urls.remove(url)
        if not urls:
            del self._urls_by_surface[entry.subject.surface]

    def _drop_alias(self, entry: CachedResponse, index: int) -> None:
        path, query = spelling = entry.aliases.pop(index)
        del self._by_spelling[spelling]
        size = len(path) + len(query) + ALIAS_BYTES
        entry.size -= size
        self.bytes -= size
