"""The cache of responses stays within its bound, and drops the least recently used first.

An entry is a response in the cache; an alias is a spelling of its URL, and `has_engine` says
whether this spelling has `engine`. Each deletion of a surface begins a new generation: `put`
refuses responses whose computation began in an older one.
"""

import tracemalloc

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from service.api.caching.cache import MAX_ALIASES, SHARE, ResponseCache
from service.api.caching.cached_response import CachedResponse, Subject
from service.api.caching.codings import Coding

MAX_BYTES = 200_000


def build_entry(
    name: str, size: int = 100, surface: str = "saddle", *, is_permanent: bool = False
) -> CachedResponse:
    """A cached response with `size` bytes, under a URL that contains `name`."""
    subject = Subject(f"/v1/surfaces/{surface}/mesh.glb?{name}", surface, name, is_permanent)
    return CachedResponse(subject, bytes(size), ((b"content-type", b"model/gltf-binary"),))


def test_a_response_in_the_cache_is_returned_and_its_bytes_count() -> None:
    cache = ResponseCache(MAX_BYTES)
    entry = build_entry("a")
    assert cache.get(entry.subject.url) is None
    assert cache.put(entry, cache.generation)
    assert cache.get(entry.subject.url) is entry
    assert (len(cache), cache.bytes) == (1, entry.size)
    assert entry.size > len(entry.plain)


def test_the_least_recently_used_response_is_dropped_first() -> None:
    # The smallest cache that accepts such a response: it may take 1/SHARE with all its codings.
    cache = ResponseCache(SHARE * build_entry("0", 1000).max_size)
    entries = [build_entry(str(number), 1000) for number in range(100)]
    for each in entries[:3]:
        assert cache.put(each, cache.generation)
    cache.get(entries[0].subject.url)
    cache.alias(entries[1], "/1", b"", has_engine=False)
    next_entry = 3
    while not cache.evictions:
        assert cache.find("/1", b"") == (entries[1], False)
        cache.get(entries[0].subject.url)
        cache.put(entries[next_entry], cache.generation)
        next_entry += 1
    dropped_entries = [each for each in entries[:next_entry] if not cache.holds(each)]
    assert dropped_entries == [entries[2]]
    assert cache.evictions == 1


def test_responses_that_are_too_large_are_not_cached() -> None:
    cache = ResponseCache(MAX_BYTES)
    small_entry = build_entry("a", 30)
    assert cache.put(small_entry, cache.generation)
    # With all its codings, this response might become larger than the cache allows.
    assert not cache.put(build_entry("b", MAX_BYTES // SHARE // 2), cache.generation)
    assert cache.holds(small_entry)
    assert not ResponseCache(0).put(build_entry("c", 0), 0)


def test_a_new_response_of_the_same_url_replaces_the_old_one() -> None:
    cache = ResponseCache(MAX_BYTES)
    old_entry, new_entry = build_entry("a", 50), build_entry("a", 60)
    cache.put(old_entry, cache.generation)
    cache.alias(old_entry, "/a", b"", has_engine=True)
    cache.put(new_entry, cache.generation)
    assert cache.find("/a", b"") is None
    assert (len(cache), cache.bytes) == (1, new_entry.size)


def test_a_compressed_body_counts_unless_compression_was_useless() -> None:
    cache = ResponseCache(MAX_BYTES)
    entry = build_entry("a", 5000)
    cache.put(entry, cache.generation)
    bytes_before = cache.bytes
    assert cache.add(entry, "zstd", None).coding == "identity"
    assert cache.bytes == bytes_before
    variant = cache.add(entry, "gzip", b"x" * 400)
    assert (variant.coding, variant.body) == ("gzip", b"x" * 400)
    assert bytes_before + 400 < cache.bytes == entry.size
    uncached_entry = build_entry("b", 5000)
    cache.add(uncached_entry, "gzip", b"x" * 400)
    assert cache.bytes == entry.size, "a response that is not in the cache does not count"


def test_the_number_of_cached_spellings_is_limited() -> None:
    cache = ResponseCache(MAX_BYTES)
    entry = build_entry("a")
    cache.put(entry, cache.generation)
    for number in range(3 * MAX_ALIASES):
        cache.alias(entry, "/a", str(number).encode(), has_engine=number % 2 == 0)
    entries = [cache.find("/a", str(number).encode()) for number in range(3 * MAX_ALIASES)]
    assert entries[: 2 * MAX_ALIASES] == [None] * 2 * MAX_ALIASES
    assert entries[2 * MAX_ALIASES :] == [(entry, number % 2 == 0) for number in range(MAX_ALIASES)]
    cache.alias(entry, "/a", b"x" * 10_000, has_engine=False)
    assert cache.find("/a", b"x" * 10_000) is None
    cache.alias(build_entry("b"), "/b", b"", has_engine=False)
    assert cache.find("/b", b"") is None, "this response is not in the cache"
    assert cache.bytes == entry.size


def test_meshes_of_a_deleted_surface_are_dropped() -> None:
    cache = ResponseCache(MAX_BYTES)
    entries = [
        build_entry("a", 10, "one"),
        build_entry("b", 10, "one"),
        build_entry("c", 10, "two"),
    ]
    generation = cache.generation
    for each in entries:
        cache.put(each, generation)
    cache.alias(entries[0], "/a", b"", has_engine=False)
    cache.forget("one")
    assert [cache.holds(each) for each in entries] == [False, False, True]
    assert cache.find("/a", b"") is None
    assert not cache.put(entries[0], generation), "its computation began before the deletion"
    assert cache.put(entries[0], cache.generation)
    cache.forget("nothing")
    assert cache.bytes == entries[0].size + entries[2].size


def test_only_stored_surfaces_with_an_engine_may_be_cached_for_ever() -> None:
    for is_permanent in (False, True):
        variant = build_entry("a", is_permanent=is_permanent).variants["identity"]
        for has_engine in (False, True):
            # Each pair of heads: for URLs without `engine`, and with it.
            for message in (variant.heads_200[has_engine], variant.heads_304[has_engine]):
                cache_control = dict(message["headers"])[b"cache-control"]
                assert (b"immutable" in cache_control) == (is_permanent and has_engine)
                assert (b"max-age=3600, must-revalidate" in cache_control) != (
                    is_permanent and has_engine
                )


@pytest.mark.parametrize("size", [10, 5000])
def test_counted_bytes_are_at_least_the_memory_used(size: int) -> None:
    cache = ResponseCache(1 << 30)
    tracemalloc.start()
    try:
        bytes_before, _ = tracemalloc.get_traced_memory()
        for number in range(100):
            entry = build_entry(f"resolution={number}&engine=4", size, f"{number:064x}")
            cache.put(entry, cache.generation)
            cache.add(entry, "zstd", bytes(size // 2))
            cache.add(entry, "gzip", bytes(size // 2 + 1))
            for spelling in range(MAX_ALIASES):
                query = f"engine=4&resolution={number}&uvs=false{spelling}".encode()
                cache.alias(entry, f"/v1/surfaces/{number:064x}/mesh.glb", query, has_engine=True)
        bytes_used = tracemalloc.get_traced_memory()[0] - bytes_before
    finally:
        tracemalloc.stop()
    assert 0.4 * cache.bytes < bytes_used < cache.bytes


class CacheMachine(RuleBasedStateMachine):
    """After any sequence of calls the cache is within its bound, and its counts are right."""

    def __init__(self) -> None:
        super().__init__()
        self.cache = ResponseCache(60_000)
        self.entries: list[CachedResponse] = []

    @rule(
        name=st.sampled_from("abcdefghijklm"),
        size=st.integers(0, 6000),
        surface=st.sampled_from(["one", "two"]),
        is_late=st.booleans(),
    )
    def put(self, name: str, size: int, surface: str, is_late: bool) -> None:
        entry = build_entry(name, size, surface)
        # A late response was computed before the last deletion, and must not be cached.
        is_cached = self.cache.put(entry, self.cache.generation - is_late)
        assert is_cached == self.cache.holds(entry)
        assert not (is_late and is_cached)
        self.entries.append(entry)

    @precondition(lambda self: self.entries)
    @rule(data=st.data(), coding=st.sampled_from(["zstd", "gzip"]), size=st.integers(0, 6000))
    def add_coding(self, data: st.DataObject, coding: Coding, size: int) -> None:
        entry = data.draw(st.sampled_from(self.entries))
        if coding not in entry.variants and size <= len(entry.plain):
            # None: compression was useless.
            self.cache.add(entry, coding, bytes(size) if size % 3 else None)

    @precondition(lambda self: self.entries)
    @rule(data=st.data(), query=st.binary(max_size=1200), has_engine=st.booleans())
    def add_alias(self, data: st.DataObject, query: bytes, has_engine: bool) -> None:
        entry = data.draw(st.sampled_from(self.entries))
        path = f"/v1/surfaces/{entry.subject.surface}/mesh.glb"
        self.cache.alias(entry, path, query, has_engine=has_engine)
        result = self.cache.find(path, query)
        assert result is None or self.cache.holds(result[0])

    @rule(surface=st.sampled_from(["one", "two"]))
    def forget(self, surface: str) -> None:
        self.cache.forget(surface)
        entries_of_surface = [entry for entry in self.entries if entry.subject.surface == surface]
        assert not any(map(self.cache.holds, entries_of_surface))

    @invariant()
    def check_bound_and_counts(self) -> None:
        cached_entries = [entry for entry in self.entries if self.cache.holds(entry)]
        assert len(cached_entries) == len(self.cache)
        assert (
            self.cache.bytes == sum(entry.size for entry in cached_entries) <= self.cache.max_bytes
        )
        for entry in self.entries:
            assert self.cache.holds(entry) or not entry.aliases
            # A coding in which compression was useless has the plain variant, which counts once.
            lengths = {id(variant): len(variant.body) for variant in entry.variants.values()}
            assert entry.size >= sum(lengths.values())


CacheMachine.TestCase.settings = settings(max_examples=25, stateful_step_count=30)
TestCache = CacheMachine.TestCase
