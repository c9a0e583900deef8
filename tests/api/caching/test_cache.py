"""The cache of responses: always within its bound, drops the least recently used first."""

import tracemalloc

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from service.api.caching.cache import ALIASES, SHARE, ResponseCache
from service.api.caching.cached_response import CachedResponse, Subject
from service.api.caching.codings import Coding

ROOM = 200_000


def build_entry(
    name: str, size: int = 100, surface: str = "saddle", *, for_ever: bool = False
) -> CachedResponse:
    subject = Subject(f"/v1/surfaces/{surface}/mesh.glb?{name}", surface, name, for_ever)
    content = size.to_bytes(4) * (size // 4) + b"x" * (size % 4)
    return CachedResponse(subject, content, ((b"content-type", b"model/gltf-binary"),))


def test_entries_are_found_and_counted() -> None:
    cache = ResponseCache(ROOM)
    built = build_entry("a")
    assert cache.get(built.subject.url) is None
    assert cache.put(built, cache.generation)
    assert cache.get(built.subject.url) is built
    assert (len(cache), cache.bytes) == (1, built.size)
    assert built.size > len(built.plain)


def test_the_least_recently_used_goes_first() -> None:
    cache = ResponseCache(SHARE * build_entry("0", 1000).largest)
    entries = [build_entry(str(number), 1000) for number in range(100)]
    for each in entries[:3]:
        assert cache.put(each, cache.generation)
    cache.get(entries[0].subject.url)
    cache.alias(entries[1], "/1", b"", pinned=False)
    last = 3
    while not cache.counts.evictions:
        assert cache.find("/1", b"") == (entries[1], False)
        cache.get(entries[0].subject.url)
        cache.put(entries[last], cache.generation)
        last += 1
    gone = [each for each in entries[:last] if not cache.holds(each)]
    assert gone == [entries[2]]
    assert cache.counts.evictions == 1


def test_entries_that_are_too_large_are_not_kept() -> None:
    cache = ResponseCache(ROOM)
    small = build_entry("a", 30)
    assert cache.put(small, cache.generation)
    # With all three codings an entry may become three times as large.
    assert not cache.put(build_entry("b", ROOM // SHARE // 2), cache.generation)
    assert cache.holds(small)
    assert not ResponseCache(0).put(build_entry("c", 0), 0)


def test_an_entry_of_the_same_address_takes_the_place_of_the_other() -> None:
    cache = ResponseCache(ROOM)
    one, other = build_entry("a", 50), build_entry("a", 60)
    cache.put(one, cache.generation)
    cache.alias(one, "/a", b"", pinned=True)
    cache.put(other, cache.generation)
    assert cache.find("/a", b"") is None
    assert (len(cache), cache.bytes) == (1, other.size)


def test_codings_count_and_those_that_do_not_pay_do_not() -> None:
    cache = ResponseCache(ROOM)
    built = build_entry("a", 5000)
    cache.put(built, cache.generation)
    before = cache.bytes
    assert cache.add(built, "zstd", None).coding == "identity"
    assert cache.bytes == before
    variant = cache.add(built, "gzip", b"x" * 400)
    assert (variant.coding, variant.body) == ("gzip", b"x" * 400)
    assert before + 400 < cache.bytes == built.size
    gone = build_entry("b", 5000)
    cache.add(gone, "gzip", b"x" * 400)
    assert cache.bytes == built.size


def test_the_number_of_cached_spellings_is_limited() -> None:
    cache = ResponseCache(ROOM)
    built = build_entry("a")
    cache.put(built, cache.generation)
    for number in range(3 * ALIASES):
        cache.alias(built, "/a", str(number).encode(), pinned=number % 2 == 0)
    result = [cache.find("/a", str(number).encode()) for number in range(3 * ALIASES)]
    assert result[: 2 * ALIASES] == [None] * 2 * ALIASES
    assert result[2 * ALIASES :] == [(built, number % 2 == 0) for number in range(ALIASES)]
    cache.alias(built, "/a", b"x" * 10_000, pinned=False)
    assert cache.find("/a", b"x" * 10_000) is None
    cache.alias(build_entry("b"), "/b", b"", pinned=False)
    assert cache.find("/b", b"") is None, "an entry that is not kept"
    assert cache.bytes == built.size


def test_a_deleted_surface_leaves_the_cache_with_its_meshes() -> None:
    cache = ResponseCache(ROOM)
    built = [build_entry("a", 10, "one"), build_entry("b", 10, "one"), build_entry("c", 10, "two")]
    generation = cache.generation
    for each in built:
        cache.put(each, generation)
    cache.alias(built[0], "/a", b"", pinned=False)
    cache.forget("one")
    assert [cache.holds(each) for each in built] == [False, False, True]
    assert cache.find("/a", b"") is None
    assert not cache.put(built[0], generation), "begun before it was forgotten"
    assert cache.put(built[0], cache.generation)
    cache.forget("nothing")
    assert cache.bytes == built[0].size + built[2].size


def test_how_long_a_response_may_be_cached() -> None:
    for for_ever in (False, True):
        variant = build_entry("a", for_ever=for_ever).variants["identity"]
        for pinned in (False, True):
            for message in (variant.full[pinned], variant.unchanged[pinned]):
                lasting = dict(message["headers"])[b"cache-control"]
                assert (b"immutable" in lasting) == (for_ever and pinned)
                assert (b"max-age=3600, must-revalidate" in lasting) != (for_ever and pinned)


@pytest.mark.parametrize("size", [10, 5000])
def test_counted_bytes_are_at_least_the_memory_taken(size: int) -> None:
    cache = ResponseCache(1 << 30)
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        for number in range(100):
            built = build_entry(f"resolution={number}&engine=3", size, f"{number:064x}")
            cache.put(built, cache.generation)
            cache.add(built, "zstd", bytes(size // 2))
            cache.add(built, "gzip", bytes(size // 2 + 1))
            for spelling in range(ALIASES):
                query = f"engine=3&resolution={number}&uvs=false{spelling}".encode()
                cache.alias(built, f"/v1/surfaces/{number:064x}/mesh.glb", query, pinned=True)
        used = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert 0.4 * cache.bytes < used < cache.bytes


class Memory(RuleBasedStateMachine):
    """Any sequence of calls keeps the cache within its bound and its counts right."""

    def __init__(self) -> None:
        super().__init__()
        self.cache = ResponseCache(60_000)
        self.made: list[CachedResponse] = []

    @rule(
        name=st.sampled_from("abcdefghijklm"),
        size=st.integers(0, 6000),
        surface=st.sampled_from(["one", "two"]),
        late=st.booleans(),
    )
    def put(self, name: str, size: int, surface: str, late: bool) -> None:
        built = build_entry(name, size, surface)
        kept = self.cache.put(built, self.cache.generation - late)
        assert kept == self.cache.holds(built)
        assert not (late and kept)
        self.made.append(built)

    @precondition(lambda self: self.made)
    @rule(data=st.data(), coding=st.sampled_from(["zstd", "gzip"]), size=st.integers(0, 6000))
    def code(self, data: st.DataObject, coding: Coding, size: int) -> None:
        built = data.draw(st.sampled_from(self.made))
        if coding not in built.variants and size <= len(built.plain):
            self.cache.add(built, coding, bytes(size) if size % 3 else None)

    @precondition(lambda self: self.made)
    @rule(data=st.data(), query=st.binary(max_size=1200), pinned=st.booleans())
    def alias(self, data: st.DataObject, query: bytes, pinned: bool) -> None:
        built = data.draw(st.sampled_from(self.made))
        self.cache.alias(built, built.subject.surface, query, pinned=pinned)
        result = self.cache.find(built.subject.surface, query)
        assert result is None or self.cache.holds(result[0])

    @rule(surface=st.sampled_from(["one", "two"]))
    def forget(self, surface: str) -> None:
        self.cache.forget(surface)
        gone = [built for built in self.made if built.subject.surface == surface]
        assert not any(map(self.cache.holds, gone))

    @invariant()
    def bounded_and_counted(self) -> None:
        held = [built for built in self.made if self.cache.holds(built)]
        assert len(held) == len(self.cache)
        assert self.cache.bytes == sum(built.size for built in held) <= self.cache.max_bytes
        for built in self.made:
            assert bool(built.aliases) <= self.cache.holds(built)
            codings = {id(v): len(v.body) for v in built.variants.values()}
            assert built.size >= sum(codings.values())


Memory.TestCase.settings = settings(max_examples=25, stateful_step_count=30)
TestMemory = Memory.TestCase
