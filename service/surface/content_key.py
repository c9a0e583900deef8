"""Keys that are equal for surfaces with equal content."""

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from hashlib import sha256
from typing import Any

import numpy as np

from service.surface.sizes import SurfaceKind


def content_key(value: Any, omitted: tuple[str, ...] = ()) -> Hashable:
    """A key that is equal for two values if and only if they have equal content.

    Two surfaces are compared field by field, arrays by shape, type and numbers, and mappings by
    their entries in order. The fields `omitted` of a surface are not compared.
    """
    if isinstance(value, np.ndarray):
        # Adding 0 turns −0 into 0, so that equal numbers have equal bytes.
        content = np.ascontiguousarray(value + 0)
        return value.shape, value.dtype.str, sha256(content.data).digest()
    if is_dataclass(value):
        compared = (f for f in fields(value) if f.init and f.compare)
        names = (f.name for f in compared if f.name not in omitted)
        return type(value), *(content_key(getattr(value, name)) for name in names)
    if isinstance(value, tuple):
        return tuple(content_key(part) for part in value)
    if isinstance(value, Mapping):
        return tuple((key, content_key(part)) for key, part in value.items())
    return value  # type: ignore[no-any-return]


def number_distinct(
    surfaces: Iterable[SurfaceKind], omitted: tuple[str, ...]
) -> tuple[list[SurfaceKind], list[int]]:
    """The distinct surfaces in the order of first use, and for each surface its number there.

    The fields `omitted` of surfaces are not compared. The key of one object is computed once.
    """
    number_of_object: dict[int, int] = {}
    number_of: dict[Hashable, int] = {}
    distinct: list[SurfaceKind] = []
    numbers = []
    for surface in surfaces:
        number = number_of_object.get(id(surface))
        if number is None:
            number = number_of.setdefault(content_key(surface, omitted), len(distinct))
            number_of_object[id(surface)] = number
            if number == len(distinct):
                distinct.append(surface)
        numbers.append(number)
    return distinct, numbers
