"""Keys that are equal for surfaces with equal content."""

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from functools import lru_cache
from hashlib import sha256
from typing import Any, Protocol

import numpy as np

from service.surface.sizes import SurfaceKind


class _Digest(Protocol):
    def update(self, data: memoryview, /) -> None: ...


def content_key(value: Any, omitted: tuple[str, ...] = ()) -> Hashable:
    """A key that is equal for two values if and only if they have equal content.

    Two surfaces are compared field by field, arrays by shape, type and numbers, and mappings by
    their entries in order. The fields `omitted` of a surface are not compared.
    """
    # One digest of the numbers of all arrays: their shapes say where each of them ends.
    digest = sha256()
    return _describe(value, omitted, digest), digest.digest()


def number_equal(keys: Iterable[Hashable]) -> list[int]:
    """For each key its number among the distinct keys, in the order of first use."""
    number_of: dict[Hashable, int] = {}
    return [number_of.setdefault(key, len(number_of)) for key in keys]


def find_keys(surfaces: Iterable[SurfaceKind], omitted: tuple[str, ...]) -> list[Hashable]:
    """The keys of surfaces without some of their fields; that of one object is computed once."""
    key_of: dict[int, Hashable] = {}
    keys: list[Hashable] = []
    for surface in surfaces:
        key = key_of.get(id(surface))
        if key is None:
            key = key_of[id(surface)] = content_key(surface, omitted)
        keys.append(key)
    return keys


def _describe(value: Any, omitted: tuple[str, ...], digest: _Digest) -> Hashable:
    """The content of a value without the numbers of its arrays, which are added to the digest."""
    if isinstance(value, np.ndarray):
        # Adding 0 turns −0 into 0, so that equal numbers have equal bytes.
        content = value + 0.0 if value.dtype.kind == "f" else value
        digest.update(np.ascontiguousarray(content).data)
        return value.shape, value.dtype.str
    if isinstance(value, tuple):
        return tuple(_describe(part, (), digest) for part in value)
    if isinstance(value, Mapping):
        return tuple((key, _describe(part, (), digest)) for key, part in value.items())
    if is_dataclass(value):
        kind: type = type(value)
        names = _list_names(kind, omitted)
        return kind, *(_describe(getattr(value, name), (), digest) for name in names)
    plain: Hashable = value
    return plain


@lru_cache(64)
def _list_names(kind: type, omitted: tuple[str, ...]) -> tuple[str, ...]:
    """The names of the fields of a class that are compared."""
    compared = (each for each in fields(kind) if each.init and each.compare)
    return tuple(each.name for each in compared if each.name not in omitted)
