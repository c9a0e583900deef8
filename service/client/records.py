"""JSON objects with their fields as attributes, and columns of numbers as arrays."""

import json
from collections.abc import Callable, Mapping
from functools import cache, partial
from types import UnionType
from typing import TYPE_CHECKING, Any, Self, TypeAlias, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
"""A column of numbers; NaN stands for the null of JSON."""
Ints: TypeAlias = NDArray[np.int64]
Bools: TypeAlias = NDArray[np.bool_]


class Answer:
    """A JSON object of the service.

    The annotations of a subclass are the fields that the answer of a call may have; a field that
    this answer does not have is None. `to_dict` returns the object as the service wrote it.
    """

    def __init__(self, fields: Mapping[str, Any]) -> None:
        self._fields = fields

    @classmethod
    def read(cls, content: bytes) -> Self:
        """The answer in the text of a JSON object."""
        return cls(json.loads(content))

    def to_dict(self) -> dict[str, Any]:
        """The object as JSON has it."""
        return dict(self._fields)

    if not TYPE_CHECKING:  # so that a type checker knows the fields of the annotations only

        def __getattr__(self, name: str) -> Any:
            """The value of a field, converted when it is read first."""
            converters = _find_converters(type(self))
            if name.startswith("_") or (name not in converters and name not in self._fields):
                raise AttributeError(f"{type(self).__name__} has no field {name!r}")
            value = self._fields.get(name)
            if value is not None:
                value = converters.get(name, _convert)(value)
            self.__dict__[name] = value
            return value

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._fields]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self._fields)})"


class Record(Answer):
    """A JSON object inside an answer, such as a report: any of its fields is an attribute."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...


@cache
def _find_converters(kind: type[Answer]) -> dict[str, Callable[[Any], Any]]:
    """For each annotated field of a class, the function that converts its value of JSON."""
    return {name: _choose_converter(hint) for name, hint in get_type_hints(kind).items()}


def _choose_converter(hint: Any) -> Callable[[Any], Any]:
    """The function that converts a value of JSON to a type: an array, a record, records."""
    if get_origin(hint) is UnionType:  # of a type and None
        hint = get_args(hint)[0]
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is np.ndarray:
        return partial(np.array, dtype=get_args(arguments[1])[0])  # null becomes NaN
    if origin is tuple:
        return partial(_convert_all, _choose_converter(arguments[0]))
    if origin is dict:
        return dict  # a document, to be sent again
    return hint if isinstance(hint, type) and issubclass(hint, Answer) else _convert


def _convert_all(convert: Callable[[Any], Any], values: list[Any]) -> tuple[Any, ...]:
    return tuple(map(convert, values))


def _convert(value: Any) -> Any:
    """A value of JSON whose type is not annotated: objects become records."""
    if isinstance(value, dict):
        return Record(value)
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return tuple(map(Record, value))
    return value
