"""The header of a PLY file: its elements, with the types of their properties."""

from dataclasses import dataclass, field

import numpy as np

from service.decoders.format import build_malformed_error
from service.errors import SurfaceError

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
"""The types of numbers, by their names in the file; of NumPy, without the order of bytes."""

_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
"""The order of bytes of each form; none for text."""

MAX_BYTES = 1 << 16
"""The most bytes of a header."""

MAX_DIGITS = 10
"""The most digits of the number of elements."""


@dataclass(frozen=True, slots=True)
class Property:
    """A number, or a list of numbers after their count, of each element.

    Attributes
    ----------
    name : str
    number : str
        The type of its numbers in NumPy, with the order of bytes.
    count : str
        The type of the number of a list's items; empty for a single number.
    """

    name: str
    number: str
    count: str = ""


@dataclass(frozen=True, slots=True)
class Element:
    """Some things of one kind, such as vertices, which follow each other in the file."""

    name: str
    length: int
    properties: list[Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        """Whether the elements have lists, so that they may differ in size."""
        return any(each.count for each in self.properties)

    @property
    def dtype(self) -> np.dtype[np.void]:
        """The type of an element without lists."""
        return np.dtype([(each.name, each.number) for each in self.properties])


@dataclass(frozen=True, slots=True)
class Header:
    """The elements in the order of the file, and the place after the header.

    Attributes
    ----------
    form : str
        `ascii`, or one of two binary forms.
    elements : tuple of Element
    end : int
    """

    form: str
    elements: tuple[Element, ...]
    end: int


def parse_header(content: bytes) -> Header:
    """The header of a file.

    Raises
    ------
    MalformedBody
    """
    start, form, elements = 0, "", list[Element]()
    while (end := content.find(b"\n", start, MAX_BYTES)) >= 0:
        words = content[start:end].decode("latin-1").split()
        if (start == 0) != (words == ["ply"]):
            raise _error("The file is not PLY.", "another beginning", "ply, in a line")
        start = end + 1
        match words:
            case ["ply"] | ["comment" | "obj_info", *_] | []:
                pass
            case ["format", ("ascii" | "binary_little_endian" | "binary_big_endian") as form, _]:
                pass
            case ["element", name, length] if length.isdecimal() and len(length) <= MAX_DIGITS:
                elements.append(Element(name, int(length)))
            case ["property", "list", count, number, name] if elements:
                properties = elements[-1].properties
                properties.append(Property(name, _type(number, form), _type(count, form)))
            case ["property", number, name] if elements:
                elements[-1].properties.append(Property(name, _type(number, form)))
            case ["end_header"] if form:
                return Header(form, tuple(elements), start)
            case _:
                needed = "format, element, property or end_header"
                raise _error("The header of the file has another line.", "something else", needed)
    raise _error(
        "The header of the file has no end.", "no line end_header", "end_header, in a line"
    )


def _type(name: str, form: str) -> str:
    """The type of numbers in NumPy."""
    if name not in _TYPES or form not in _ORDERS:
        needed = "char, uchar, short, ushort, int, uint, float or double"
        raise _error("A property of the file has no such type.", "another type", needed)
    return _ORDERS[form] + _TYPES[name]


def _error(message: str, got: str, needed: str) -> SurfaceError:
    return build_malformed_error(message, got, needed)
