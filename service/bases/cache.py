"""Caches of read-only values, bounded by their bytes; and the two that several modules share."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from threading import Lock
from typing import Any, Generic, Protocol, TypeVar, cast

import numpy as np
import orjson

from service.bases.arrays import AnyArray
from service.cancellation import checkpoint


class Sized(Protocol):
    """A value with a size in bytes, `nbytes`, as arrays have."""

    @property
    def nbytes(self) -> int: ...  # noqa: D102


Value = TypeVar("Value", bound=Sized)
Array = TypeVar("Array", bound=AnyArray)
Result = TypeVar("Result")

WAITING_SECONDS = 0.05
"""A thread that waits for another one looks this often whether its own work is cancelled."""


class _PendingValue:
    """A value that one thread builds while other threads wait for it."""

    def __init__(self) -> None:
        self.lock = Lock()
        self.value: Any = None


class Cache(Generic[Value]):
    """A cache of at most `capacity` bytes, which drops the least recently used values.

    Requests and threads share the values, which must therefore be read-only. A value larger than
    1/`share` of the capacity is returned but not kept, because one unusual request must not remove
    the values of all others. If several threads need the same key at once, one thread builds the
    value and the others wait for it.
    """

    def __init__(self, capacity: int, share: int = 8) -> None:
        self.capacity = capacity
        self._share = share
        self.hits = self.misses = 0
        self._values: OrderedDict[Hashable, Value] = OrderedDict()
        self._builds: dict[Hashable, _PendingValue] = {}
        self._bytes = 0
        self._lock = Lock()

    @property
    def nbytes(self) -> int:
        """Bytes of all values in the cache."""
        return self._bytes

    def __len__(self) -> int:
        return len(self._values)

    def get(self, key: Hashable, build: Callable[[], Value]) -> Value:
        """The value of this key; if it is not cached, `build` builds it.

        Values with the same key must be equal.

        Raises
        ------
        Cancelled, OutOfTime
            The work ends while another thread builds the value; or an error of `build`.
        """
        with self._lock:
            value = self._values.get(key)
            if value is not None:
                self._values.move_to_end(key)
                self.hits += 1
                return value
            self.misses += 1
            pending_value = self._builds.setdefault(key, _PendingValue())
        # The event loop may wait here, for a value that takes a thread seconds.
        while not pending_value.lock.acquire(timeout=WAITING_SECONDS):
            checkpoint()
        try:
            if pending_value.value is None:
                try:
                    pending_value.value = build()
                finally:  # if `build` fails, the next of the waiting threads builds
                    with self._lock:
                        self._builds.pop(key, None)
                        self._keep(key, pending_value.value)
        finally:
            pending_value.lock.release()
        return cast(Value, pending_value.value)

    def find(self, key: Hashable) -> Value | None:
        """The value of this key, or None if no value is cached."""
        with self._lock:
            value = self._values.get(key)
            if value is not None:
                self._values.move_to_end(key)
            return value

    def put(self, key: Hashable, value: Value) -> None:
        """Store a value, in place of an earlier one of this key."""
        with self._lock:
            self._keep(key, value)

    def clear(self) -> None:
        """Remove all values."""
        with self._lock:
            self._values.clear()
            self._bytes = 0

    def _keep(self, key: Hashable, value: Value | None) -> None:
        if value is None or value.nbytes > self.capacity // self._share:
            return
        old_value = self._values.pop(key, None)
        self._bytes += value.nbytes - (0 if old_value is None else old_value.nbytes)
        self._values[key] = value
        while self._bytes > self.capacity:
            _, oldest_value = self._values.popitem(last=False)
            self._bytes -= oldest_value.nbytes


class ArrayCache(Cache[AnyArray]):
    """A cache of arrays, which it makes contiguous and read-only."""

    def array(self, key: Hashable, build: Callable[[], Array]) -> Array:
        """The array of this key, read-only; if it is not cached, `build` builds it."""
        return cast(Array, self.get(key, partial(_build_read_only, build)))


def _build_read_only(build: Callable[[], Array]) -> AnyArray:
    array = np.ascontiguousarray(build())
    array.flags.writeable = False
    return array


BASES = ArrayCache(64 << 20)
"""Arrays that depend on degrees and samplings alone: bases, index patterns."""


@dataclass(frozen=True, eq=False, slots=True)
class _DerivedValue:
    """A value derived from arrays, and references to these arrays.

    The cache identifies the arrays by `id`. The references keep them alive, so that no other array
    can get the same id.
    """

    sources: tuple[AnyArray, ...]
    value: Any

    @property
    def nbytes(self) -> int:
        """Bytes of the value and of its source arrays."""
        size = len(self.value) if isinstance(self.value, bytes) else self.value.nbytes
        return int(size) + sum(array.nbytes for array in self.sources)


def derive_once(
    sources: tuple[AnyArray, ...], name: Hashable, build: Callable[[], Result]
) -> Result:
    """The result of `build`, which must depend on the source arrays alone.

    The cache finds the result by the identity of these arrays (the same objects) and by `name`. The
    result must be bytes or have the attribute `nbytes`. If a source array is writeable, nothing is
    cached.
    """
    if any(array.flags.writeable for array in sources):
        return build()
    key = ("derived", name, *map(id, sources))
    derived = cast(_DerivedValue, MESH_PLANS.get(key, lambda: _DerivedValue(sources, build())))
    return cast(Result, derived.value)


MESH_PLANS: Cache[Sized] = Cache(256 << 20, share=4)
"""Data that depend on connectivity, resolution, options, knots or indices alone, such as faces; and
breps that are prepared for meshes and questions (`service.bases.kept`).

The service sets the capacity at its start (`service.settings.runtime`). A quarter of 256 MiB is a
plan of about 3,000,000 vertices.
"""


LONGEST_TEXT = 1 << 16
"""Longest JSON text that serves as a key, in bytes."""


def build_by_text(value: object, name: Hashable, build: Callable[[], Array]) -> Array:
    """The array that `build` makes from `value`, cached by the JSON text of `value`.

    The text distinguishes 1, 1.0 and true. The result is cached only if `value` is a list that can
    be written as at most `LONGEST_TEXT` bytes of JSON. The array may be read-only.
    """
    text = b""
    # The text has a byte for each element at least, so longer lists need not be written.
    if isinstance(value, list) and len(value) <= LONGEST_TEXT:
        with suppress(TypeError):
            text = orjson.dumps(value)
    if not 0 < len(text) <= LONGEST_TEXT:
        return build()
    # The cache keeps the text too, so its bytes count.
    key_bytes = (np.frombuffer(text, np.uint8),)
    derived = MESH_PLANS.get(
        ("text", name, text), lambda: _DerivedValue(key_bytes, _build_read_only(build))
    )
    return cast(Array, cast(_DerivedValue, derived).value)
