"""Caches of values that depend on patterns alone: shared, read-only, bounded by their bytes."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from threading import Lock
from typing import Any, Generic, Protocol, TypeVar, cast

import numpy as np
import orjson
from numpy.typing import NDArray


class Sized(Protocol):
    """Anything that says how many bytes it holds, as arrays do."""

    @property
    def nbytes(self) -> int: ...  # noqa: D102


Value = TypeVar("Value", bound=Sized)
Array = TypeVar("Array", bound=NDArray[Any])
Made = TypeVar("Made")


class _Build:
    """A value that one thread builds, and for which others may wait."""

    def __init__(self) -> None:
        self.lock = Lock()
        self.value: Any = None


class Cache(Generic[Value]):
    """Least-recently-used values by key, at most `capacity` bytes of them.

    What is handed out is shared between requests and threads, hence must be read-only. A value
    larger than 1/`share` of the capacity is built and given, not kept: one absurd request must not
    empty the cache for the others. Threads that ask for the same key at once build it once.
    """

    def __init__(self, capacity: int, share: int = 8) -> None:
        self.capacity = capacity
        self._share = share
        self.hits = self.misses = 0
        self._values: OrderedDict[Hashable, Value] = OrderedDict()
        self._builds: dict[Hashable, _Build] = {}
        self._bytes = 0
        self._lock = Lock()

    @property
    def nbytes(self) -> int:
        """Bytes held now."""
        return self._bytes

    def __len__(self) -> int:
        return len(self._values)

    def get(self, key: Hashable, build: Callable[[], Value]) -> Value:
        """The value of this key, built now if it is not held. The key must determine the value."""
        with self._lock:
            held = self._values.get(key)
            if held is not None:
                self._values.move_to_end(key)
                self.hits += 1
                return held
            self.misses += 1
            under_way = self._builds.setdefault(key, _Build())
        with under_way.lock:
            if under_way.value is None:
                try:
                    under_way.value = build()
                finally:
                    with self._lock:
                        self._builds.pop(key, None)
                        self._keep(key, under_way.value)
        return cast(Value, under_way.value)

    def find(self, key: Hashable) -> Value | None:
        """The value of this key, if it is held."""
        with self._lock:
            held = self._values.get(key)
            if held is not None:
                self._values.move_to_end(key)
            return held

    def put(self, key: Hashable, value: Value) -> None:
        """Keeps a value in place of an earlier one."""
        with self._lock:
            self._keep(key, value)

    def clear(self) -> None:
        """Forgets everything."""
        with self._lock:
            self._values.clear()
            self._bytes = 0

    def _keep(self, key: Hashable, value: Value | None) -> None:
        if value is None or value.nbytes > self.capacity // self._share:
            return
        replaced = self._values.pop(key, None)
        self._bytes += value.nbytes - (0 if replaced is None else replaced.nbytes)
        self._values[key] = value
        while self._bytes > self.capacity:
            _, dropped = self._values.popitem(last=False)
            self._bytes -= dropped.nbytes


class ArrayCache(Cache[NDArray[Any]]):
    """A cache of arrays, which it makes contiguous and read-only."""

    def array(self, key: Hashable, build: Callable[[], Array]) -> Array:
        """The array of this key, built now if it is not held."""
        return cast(Array, self.get(key, partial(_read_only, build)))


def _read_only(build: Callable[[], Array]) -> NDArray[Any]:
    array = np.ascontiguousarray(build())
    array.flags.writeable = False
    return array


PLANS = ArrayCache(64 << 20)
"""Arrays that depend on degrees and samplings alone: bases, index patterns."""


@dataclass(frozen=True, eq=False, slots=True)
class _Derived:
    """What was made of arrays, which are held so that their identities stay their own."""

    sources: tuple[NDArray[Any], ...]
    value: Any

    @property
    def nbytes(self) -> int:
        """Bytes held, those of the arrays among them."""
        size = len(self.value) if isinstance(self.value, bytes) else self.value.nbytes
        return int(size) + sum(array.nbytes for array in self.sources)


def derived(sources: tuple[NDArray[Any], ...], name: Hashable, build: Callable[[], Made]) -> Made:
    """What `build` makes of read-only arrays alone: kept for these very arrays.

    It is bytes, or says how many bytes it holds. Of arrays that may still be written nothing is
    kept.
    """
    if any(array.flags.writeable for array in sources):
        return build()
    key = ("derived", name, *map(id, sources))
    found = MESH_PLANS.get(key, lambda: _Derived(sources, build()))
    assert isinstance(found, _Derived)
    return cast(Made, found.value)


MESH_PLANS: Cache[Sized] = Cache(256 << 20, share=4)
"""What depends on connectivity, resolution and options alone: layouts, welds, faces of meshes."""


LONGEST_TEXT = 1 << 16
"""Bytes of JSON up to which it is a key."""


def by_text(value: object, name: Hashable, build: Callable[[], Array]) -> Array:
    """The array that `build` makes of lists of numbers, kept for lists of the same JSON text.

    The text tells 1 from 1.0 and from true. What has none, and arrays, are built each time.
    """
    text = b""
    if isinstance(value, list) and len(value) <= LONGEST_TEXT:
        with suppress(TypeError):
            text = orjson.dumps(value)
    if not 0 < len(text) <= LONGEST_TEXT:
        return build()
    # The text is held, too: it counts.
    own = (np.frombuffer(text, np.uint8),)
    found = MESH_PLANS.get(("text", name, text), lambda: _Derived(own, _read_only(build)))
    assert isinstance(found, _Derived)
    return cast(Array, found.value)
