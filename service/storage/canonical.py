"""The canonical content of a surface: the same bytes for every way to write the surface.

    content = header, line feed, numbers
    id      = SHA-256 of the content, in hexadecimal

The header is one line of JSON, in ASCII, with sorted keys and without spaces:

    {"arrays":[["float64",[2,2,3]]],"canonical":1,"surface":{"control_net":null,…}}

`surface` is the definition as in a request, with null in place of each array. `arrays` has the
types and shapes of these arrays, in the same order. Their numbers follow the line feed, one array
after another, little-endian, 8 bytes each, the last axis fastest. The net of a triangle of degree n
is one axis of (n+1)(n+2)/2 points. A null of the definition itself, which stands for a pcurve that
is not given, counts as an array with the type `null` and the shape [0].

The content has the values that a surface has after its checks: −0 is 0, a number that a request
gives for both u and v is there twice, keys of JSON objects are sorted, and defaults are written
out. Two contents are equal if and only if these values are equal; then all meshes are equal too. A
difference in one bit of one number gives another content, except for weights outside of 2^-64 to
2^64, which the checks multiply by a common power of two. Names are compared character by character:
composed and decomposed Unicode characters are different.

Ids are permanent. If you add a field to a kind of surface, every stored surface must keep its id:
so the present fields of the header stay there, in this form; `definition` leaves the new field out
if it has its default; and this default never changes. Another form of the content would be
`"canonical": 2`, and the service would still read this form.
"""

import json
from collections.abc import Iterator, Mapping
from hashlib import sha256
from math import prod
from typing import Any, TypeAlias

import numpy as np
from pydantic import BaseModel

from service.bases.arrays import AnyArray
from service.errors import DamagedObject
from service.pipeline.cost import Work, definition_cost
from service.schemas.budget import bound_memory
from service.schemas.document import DocumentLimits
from service.schemas.fields import RequestModel
from service.schemas.request import SurfaceRequest
from service.schemas.surfaces import definition
from service.schemas.validation import validate_document
from service.surface.kinds import Surface
from service.surface.sizes import SurfaceKind

VERSION = 1

_TYPES = {"float64": np.dtype("<f8"), "int64": np.dtype("<i8")}

Arrays: TypeAlias = list[AnyArray]

_NULL: AnyArray = np.empty(0, "V1")
"""This array stands for a null among the arrays of a definition."""

_NULL_TYPE = ["null", [0]]


def canonical_content(surface: Surface) -> bytes:
    """The canonical content of a surface; `restore_surface` reads it."""
    return _write_content("surface", _mark_nulls(definition(surface, flat=True)))


def canonical_request(request: RequestModel) -> bytes:
    """The canonical content of a whole request: the surface in this form, and every other field.

    It has the values after their checks, so two requests with equal contents have equal results.
    """
    shape, names = request.build(), type(request).model_fields
    if not isinstance(shape, SurfaceKind):
        return _write_content("request", {name: _tree_of(getattr(request, name)) for name in names})
    others = {name: _tree_of(getattr(request, name)) for name in names if name != "surface"}
    return _write_content("request", {"surface": definition(shape, flat=True), **others})


def _tree_of(value: Any) -> Any:
    """A value of a model as numbers, texts, lists, dicts and arrays; −0 becomes 0."""
    if isinstance(value, BaseModel):
        return {name: _tree_of(getattr(value, name)) for name in type(value).model_fields}
    if isinstance(value, Mapping):
        return {key: _tree_of(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_tree_of(item) for item in value]
    if isinstance(value, np.ndarray | float):
        return value + 0.0
    return value


def _write_content(name: str, tree: Any) -> bytes:
    """A tree in the canonical form; in its header it has this name."""
    arrays: Arrays = []
    tree = _take_arrays(tree, arrays)
    types_and_shapes = [
        _NULL_TYPE if array is _NULL else [array.dtype.name, array.shape] for array in arrays
    ]
    header = json.dumps(
        {"arrays": types_and_shapes, "canonical": VERSION, name: tree},
        sort_keys=True,
        separators=(",", ":"),
        allow_nan=False,
    )
    numbers = (
        np.ascontiguousarray(array, dtype=_TYPES[array.dtype.name]).data
        for array in arrays
        if array is not _NULL
    )
    return b"".join([header.encode("ascii"), b"\n", *numbers])


def surface_id(content: bytes) -> str:
    """The id of a surface: SHA-256 of its content, 64 hexadecimal digits."""
    return sha256(content).hexdigest()


def restore_surface(content: bytes, limits: DocumentLimits) -> Surface:
    """The surface with this canonical content, checked like a posted surface.

    Raises
    ------
    InvalidRequest
        The surface exceeds the limits, which may have been larger when it was stored. Pointers
        begin with `/surface`.
    DamagedObject
        `content` is not the content of a surface.
    """
    try:
        tree = _read_definition(content)
    except (ValueError, LookupError, TypeError, ArithmeticError, StopIteration, RecursionError):
        raise DamagedObject from None
    return validate_document(SurfaceRequest, {"surface": tree}, limits).to_surface()


def estimate_restore_memory(content: bytes) -> int:
    """Bytes that `restore_surface` needs at most, `content` included."""
    header = content[: content.find(b"\n")]
    objects, values = header.count(b"{"), header.count(b",") + header.count(b"[")
    # 4: the content, the arrays of the surface, and temporary arrays of the checks take 3 times the
    # length of the content, as measured; 1 is a margin.
    return 4 * len(content) + bound_memory(values, 0, objects)


def plan_content(surface: Surface) -> Work[tuple[str, bytes]]:
    """The work of writing a surface's canonical content, which returns its id and the content.

    The predicted cost is that of the JSON of the surface, which is longer.
    """

    def run() -> tuple[str, bytes]:
        content = canonical_content(surface)
        return surface_id(content), content

    return Work(definition_cost(surface.size()), run)


def _mark_nulls(value: Any) -> Any:
    """The value with `_NULL` in place of each None."""
    if isinstance(value, dict):
        return {key: _mark_nulls(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_mark_nulls(item) for item in value]
    return _NULL if value is None else value


def _take_arrays(value: Any, arrays: Arrays) -> Any:
    """The value with None in place of each array; appends the arrays to `arrays`, in this order."""
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return None
    if isinstance(value, Mapping):
        return {key: _take_arrays(value[key], arrays) for key in sorted(value)}
    if isinstance(value, list | tuple):
        return [_take_arrays(item, arrays) for item in value]
    return value


def _insert_arrays(tree: Any, arrays: Iterator[AnyArray]) -> Any:
    """The tree with the next array in place of each None; `_NULL` gives None."""
    if tree is None:
        array = next(arrays)
        return None if array is _NULL else array
    if isinstance(tree, dict):
        return {key: _insert_arrays(item, arrays) for key, item in tree.items()}
    if isinstance(tree, list):
        return [_insert_arrays(item, arrays) for item in tree]
    return tree


def _read_definition(content: bytes) -> Any:
    """The surface's definition, as in a request; its arrays are views of `content`."""
    end = content.index(b"\n")
    header = json.loads(content[:end])
    if header["canonical"] != VERSION:
        raise ValueError("another form of content")
    arrays: Arrays = []
    start = end + 1
    for name, shape in header["arrays"]:
        if min(shape, default=0) < 0:
            raise ValueError("an axis of negative length")
        if [name, shape] == _NULL_TYPE:
            arrays.append(_NULL)
            continue
        flat = np.frombuffer(content, _TYPES[name], prod(shape), start)
        arrays.append(flat.reshape(shape))
        start += flat.nbytes
    remaining_arrays = iter(arrays)
    tree = _insert_arrays(header["surface"], remaining_arrays)
    if start != len(content) or next(remaining_arrays, None) is not None:
        raise ValueError("more numbers than the header names")
    return tree
