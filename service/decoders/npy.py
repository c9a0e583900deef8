"""Reads control nets from NumPy's .npy files: the array is a view of the bytes, without a copy.

A file is 6 magic bytes, the version (2 bytes), the length of the header (2 bytes, or 4 bytes from
version 2 on), the header, and the numbers. The header is the text of a Python dictionary,

    {'descr': '<f8', 'fortran_order': False, 'shape': (100, 100, 3), }

which regular expressions read, without `eval`. Before any other work, the module checks that the
array has floating-point numbers, and that the number of bytes matches the shape.

References
----------
NumPy reference, `numpy.lib.format`; NEP 1.
"""

import re
from dataclasses import dataclass
from math import prod
from types import MappingProxyType
from typing import Any

import numpy as np

from service.bases.arrays import AnyArray
from service.decoders.format import Tree, build_malformed_error, check_count, check_kind
from service.errors import InvalidRequest, Issue

KINDS = ("bezier", "bspline", "patches")
"""The kinds of surface that an array may become: the first two have one net, the last has one net
for each patch."""

MAGIC = b"\x93NUMPY"
"""The first bytes of a file."""

MAX_HEADER = 4096
"""The most bytes of a header. For arrays that the service accepts, NumPy writes 118 bytes."""

_LENGTH_BYTES = MappingProxyType({b"\1\0": 2, b"\2\0": 4, b"\3\0": 4})
"""For each version, the number of bytes of the field with the header's length."""

_TYPES = frozenset({"<f4", "<f8", ">f4", ">f8"})
"""The types of numbers that the service accepts."""

# A key, and a text, a truth value, a list (of the fields of structures) or a tuple of whole numbers
# below 10^18.
_ENTRY = re.compile(
    r"\s*'(?P<key>descr|fortran_order|shape)'\s*:\s*"
    r"(?P<value>'[^']*'|True|False|\[.*\]|\(\s*(?:(?:0|[1-9]\d{0,17})\s*(?:,\s*|(?=\))))*\))"
    r"\s*(?:,|(?=\}))",
    re.ASCII,
)
_KEYS = frozenset({"descr", "fortran_order", "shape"})
_NEEDED = "a file as numpy.save writes it"


@dataclass(frozen=True, slots=True)
class _Header:
    """The fields of a header, and the index of the first byte of the numbers."""

    dtype: np.dtype[Any]
    is_fortran_order: bool
    shape: tuple[int, ...]
    start: int


def decode(content: bytes, kind: str | None, max_points: int) -> Tree:
    """Decode the array of a file as the control points of a surface.

    An array (p+1, q+1, 3) is one net: of a Bézier patch, or of a B-spline if `kind` is `bspline`.
    An array (P, p+1, q+1, 3) is P Bézier patches, each with vertices of its own. If points have 4
    numbers, the last is the weight; the other three are not multiplied by the weight.

    Raises
    ------
    MalformedBody
        The file is not a complete .npy file.
    InvalidRequest
        The array does not have the shape of a control net, or has more than `max_points` control
        points.
    """
    header = _read_header(content)
    _check_shape(header.shape)
    is_one_net = len(header.shape) == 3
    check_kind(kind, KINDS[:2] if is_one_net else KINDS[2:])
    field = "control_net" if is_one_net else "vertices"
    check_count(prod(header.shape[:-1]), max_points, f"/surface/{field}")
    array = _view_array(content, header)
    if is_one_net:
        tree = {"type": kind or KINDS[0], field: array[..., :3]}
        return tree | ({"weights": array[..., 3]} if array.shape[-1] == 4 else {})
    count, rows, columns, width = array.shape
    points = array.reshape(-1, width)
    indices = np.arange(len(points)).reshape(count, rows, columns)
    tree = {"type": "patches", field: points[:, :3], "patches": indices}
    return tree | ({"weights": points[:, 3]} if width == 4 else {})


def read_array(content: bytes) -> AnyArray:
    """Read the array of a file, of any shape, as a view of the bytes.

    Raises
    ------
    MalformedBody, InvalidRequest
        The file is not a complete .npy file, or has numbers of another type.
    """
    return _view_array(content, _read_header(content))


def _read_header(content: bytes) -> _Header:
    """Read and check the header; the number of bytes after the header is checked, too."""
    length_bytes = _LENGTH_BYTES.get(content[6:8])
    if not content.startswith(MAGIC):
        raise build_malformed_error("The file is not a .npy file.", "other first bytes", _NEEDED)
    if length_bytes is None:
        raise build_malformed_error(
            "The .npy file has an unknown version.",
            "another version",
            "version 1.0, 2.0 or 3.0",
        )
    header_start = 8 + length_bytes
    length = int.from_bytes(content[8:header_start], "little")
    if length > MAX_HEADER:
        raise build_malformed_error(
            "The header of the .npy file is too long.", f"{length} bytes", f"at most {MAX_HEADER}"
        )
    numbers_start = header_start + length
    if len(content) < numbers_start:
        raise build_malformed_error(
            "The .npy file ends within its header.", f"{len(content)} bytes", "a whole header"
        )
    entries = _parse_entries(content[header_start:numbers_start].decode("latin-1"))
    header = _Header(
        _parse_type(entries["descr"]),
        entries["fortran_order"] == "True",
        tuple(map(int, re.findall(r"\d+", entries["shape"]))),
        numbers_start,
    )
    needed, got = prod(header.shape) * header.dtype.itemsize, len(content) - numbers_start
    if got != needed:
        raise build_malformed_error(
            "The number of bytes after the header is not that of the array's shape.",
            f"{got} bytes",
            f"{needed} bytes",
        )
    return header


def _parse_entries(text: str) -> dict[str, str]:
    """The texts of the header's three entries, by key."""
    text = text.strip(" \n")
    entries: dict[str, str] = {}
    position = 1  # behind the brace
    while text.startswith("{") and (match := _ENTRY.match(text, position)):
        if match["key"] in entries:
            break
        entries[match["key"]] = match["value"]
        position = match.end()
    if text[position:].strip() != "}" or entries.keys() != _KEYS:
        raise build_malformed_error(
            "The header of the .npy file cannot be read.",
            "another text",
            "descr, fortran_order and shape, each once",
        )
    if entries["fortran_order"] not in ("True", "False") or not entries["shape"].startswith("("):
        raise build_malformed_error(
            "The header of the .npy file cannot be read.",
            "values of other types",
            "fortran_order True or False, shape a tuple",
        )
    return entries


def _parse_type(text: str) -> np.dtype[Any]:
    """The type of the numbers, from the entry `descr`; only float32 and float64 are allowed."""
    name = text.strip("'")
    if name not in _TYPES:
        got = "numbers of another type"
        if text.startswith("["):
            got = "structures"
        elif name.endswith("O"):
            got = "Python objects"
        raise InvalidRequest(
            Issue(
                "wrong_type",
                "The array must hold floating-point numbers.",
                "",
                got,
                "float32 or float64",
            )
        )
    return np.dtype(name)


def _check_shape(shape: tuple[int, ...]) -> None:
    """Refuse an array that has the shape neither of one control net nor of several."""
    if 0 in shape:
        raise InvalidRequest(
            Issue("empty_list", "The array is empty.", "", "an axis of length 0", "control points")
        )
    if len(shape) not in (3, 4) or shape[-1] not in (3, 4):
        raise InvalidRequest(
            Issue(
                "wrong_dimension",
                "The shape of the array is not that of a control net.",
                "",
                f"{len(shape)} axes" + (f", {shape[-1]} numbers in the last" if shape else ""),
                "axes (p+1, q+1, 3) or (P, p+1, q+1, 3); 4 numbers where points have weights",
            )
        )


def _view_array(content: bytes, header: _Header) -> AnyArray:
    """The array of a file as a view of its bytes."""
    flat = np.frombuffer(content, header.dtype, offset=header.start)
    return flat.reshape(header.shape, order="F" if header.is_fortran_order else "C")
