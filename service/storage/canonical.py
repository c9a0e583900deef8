"""The canonical content of a surface: the same bytes for every way to write the surface.

    content = header, line feed, numbers (a frame: `service.framing`)
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

from collections.abc import Mapping
from hashlib import sha256
from typing import Any

import numpy as np
import orjson
from pydantic import BaseModel

from service.errors import DamagedObject
from service.framing import UNREADABLE, mark_nulls, read_frame, write_frame
from service.pipeline.cost import Work, definition_cost
from service.schemas.budget import bound_memory
from service.schemas.document import DocumentLimits
from service.schemas.fields import IGNORED, RequestModel
from service.schemas.request import SurfaceRequest
from service.schemas.surfaces import definition
from service.schemas.validation import validate_document
from service.surface.kinds import Surface
from service.surface.sizes import SurfaceKind

VERSION = 1


def canonical_content(surface: Surface) -> bytes:
    """The canonical content of a surface; `restore_surface` reads it."""
    tree = mark_nulls(definition(surface, flat=True))
    return write_frame("surface", tree, canonical=VERSION)


def canonical_request(request: RequestModel) -> bytes:
    """The canonical content of a whole request: the surface in this form, and every other field.

    It has the values after their checks, so two requests with equal contents have equal results.
    """
    shape = request.build()
    names = [name for name in type(request).model_fields if name not in IGNORED]
    if not isinstance(shape, SurfaceKind):
        fields = {name: tree_of(getattr(request, name)) for name in names}
        return write_frame("request", fields, canonical=VERSION)
    others = {name: tree_of(getattr(request, name)) for name in names if name != "surface"}
    fields = {"surface": definition(shape, flat=True), **others}
    return write_frame("request", fields, canonical=VERSION)


def tree_of(value: Any) -> Any:
    """A value of a model as numbers, texts, lists, dicts and arrays; −0 becomes 0.

    The SHA-256 of a file stands for its bytes.
    """
    if isinstance(value, BaseModel):
        return {name: tree_of(getattr(value, name)) for name in type(value).model_fields}
    if isinstance(value, Mapping):
        return {key: tree_of(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [tree_of(item) for item in value]
    if isinstance(value, np.ndarray | float):
        return value + 0.0
    if isinstance(value, bytes):
        return sha256(value).hexdigest()
    return value


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
    except UNREADABLE:
        raise DamagedObject from None
    return validate_document(SurfaceRequest, {"surface": tree}, limits).to_surface()


def read_name(content: bytes) -> str:
    """The name of the surface with this canonical content; reads no numbers.

    Raises
    ------
    DamagedObject
        `content` is not the content of a surface.
    """
    try:
        return str(orjson.loads(content[: content.index(b"\n")])["surface"]["name"])
    except UNREADABLE:
        raise DamagedObject from None


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

    return Work(definition_cost(surface.written_size()), run)


def _read_definition(content: bytes) -> Any:
    """The surface's definition, as in a request; its arrays are views of `content`."""
    header = read_frame("surface", content)
    if header["canonical"] != VERSION:
        raise ValueError("another form of content")
    return header["surface"]
