"""Reads surfaces from the JSON files of geomdl (NURBS-Python), which `exchange.export_json` writes.

    {"shape": {"type": "surface", "count": 1, "data": [
        {"degree_u": 2, "degree_v": 1, "size_u": 3, "size_v": 2,
         "knotvector_u": […], "knotvector_v": […],
         "control_points": {"points": [[x, y, z], …], "weights": [w, …]}}]}}

Points are in one list, in which v varies fastest, and are not multiplied by their weights. Rows
that geomdl calls `ctrlpts2d` are accepted in place of this list; where their points have four
numbers, as geomdl's own have, they are (wx, wy, wz, w). Fields for sampling (`delta`,
`sample_size`) and the sense of a surface (`reversed`) change no point, and are ignored.

References
----------
geomdl 5.4, `exchange.export_json`; documentation, "Supported File Formats".
"""

from typing import Any

import orjson

from service.decoders.format import (
    Decoded,
    FileLimits,
    Tree,
    build_malformed_error,
    check_kind,
    check_parts,
)
from service.errors import InvalidRequest, Issue, MalformedBody, count_nouns

KINDS = ()
"""No kind can be requested: a surface is a `bspline`, and several are a `group`."""

MAX_NAME = 100
"""The most characters of a name; a surface with a longer name is read without it."""

_NEEDED = "a file as geomdl.exchange.export_json writes it"

_ADVICE = {
    "curve": "a surface; POST /v1/curve takes a curve in JSON, as `control_points`, `degree`, "
    "`knots` and `weights`",
    "volume": "surfaces, such as those of geomdl.construct.extract_surfaces",
}
"""The files to send in place of those whose shapes are no surfaces."""


def decode(content: bytes, kind: str | None, limits: FileLimits) -> Decoded:
    """Decode the surfaces of a file: one `bspline`, or a `group` of several.

    The lists of numbers stay lists, and are checked and counted later as those of a request.

    Raises
    ------
    MalformedBody
        The text is not JSON, or has other fields than geomdl writes; the message names the place.
    InvalidRequest
        The shapes are curves or volumes, or surfaces are trimmed.
    TooLarge
        There are too many surfaces.
    """
    check_kind(kind, KINDS)
    shapes = _read_shapes(content)
    check_parts(len(shapes), "surfaces", limits.max_definitions)
    surfaces = [_read_surface(shape, f"shape.data[{n}].") for n, shape in enumerate(shapes)]
    if len(surfaces) == 1:
        return Decoded(surfaces[0])
    members = [{"surface": surface} for surface in surfaces]
    return Decoded({"type": "group", "members": members})


def _read_shapes(content: bytes) -> list[Any]:
    """The list of shapes of a file, which are surfaces."""
    try:
        document = orjson.loads(content)
    except orjson.JSONDecodeError as error:
        message = f"The file is not JSON (line {error.lineno}, column {error.colno})."
        raise build_malformed_error(message, "another text", _NEEDED) from None
    shape = _field(document, "shape", dict, "")
    kind, shapes = _field(shape, "type", str, "shape."), _field(shape, "data", list, "shape.")
    if kind in _ADVICE:
        message = f"The file has a {kind}; the service reads the surfaces of such files."
        raise InvalidRequest(Issue("wrong_value", message, "", f"a {kind}", _ADVICE[kind]))
    if kind != "surface":
        raise _build_error("shape.type", "another value", "surface")
    if not shapes:
        raise _build_error("shape.data", "an empty list", "at least one surface")
    return list(shapes)


def _read_surface(shape: Any, where: str) -> Tree:
    """The document of one surface; `where` is its place in the file, with a full stop."""
    if _field(shape, "trims", dict, where, {}).get("data"):
        message = f"The service does not read trimming curves of geomdl ({where}trims)."
        needed = "the surface without `trims`; or a `brep`, with its trimming curves as `pcurves`"
        raise InvalidRequest(Issue("wrong_value", message, "", "trimming curves", needed))
    tree: Tree = {
        "type": "bspline",
        "degree": [_field(shape, f"degree_{direction}", int, where) for direction in "uv"],
        "knots": [_field(shape, f"knotvector_{direction}", list, where) for direction in "uv"],
        **_read_points(shape, where),
    }
    name = shape.get("name")
    if isinstance(name, str) and name.isprintable() and 0 < len(name) <= MAX_NAME:
        tree["name"] = name
    return tree


def _read_points(shape: Any, where: str) -> Tree:
    """The control net of a surface, and its weights if it has some."""
    if "ctrlpts2d" in shape:
        return _name_rows(_field(shape, "ctrlpts2d", list, where))
    points = _field(shape, "control_points", dict, where)
    where_points = f"{where}control_points."
    sizes = [_field(shape, f"size_{direction}", int, where) for direction in "uv"]
    fields = {"control_net": "points"} | ({"weights": "weights"} if "weights" in points else {})
    return {
        field: _split(_field(points, name, list, where_points), sizes, where_points + name)
        for field, name in fields.items()
    }


def _split(items: list[Any], sizes: list[int], where: str) -> list[Any]:
    """A list in which v varies fastest, as rows along u."""
    rows, columns = sizes
    if rows < 1 or columns < 1 or len(items) != rows * columns:
        raise _build_error(where, count_nouns(len(items), "items"), "size_u · size_v items")
    return [items[start : start + columns] for start in range(0, len(items), columns)]


def _name_rows(rows: list[Any]) -> Tree:
    """The control net of rows of points (x, y, z), or (wx, wy, wz, w) if they have 4 numbers."""
    row = rows[0] if rows else None
    point = row[0] if isinstance(row, list) and row else None
    is_homogeneous = isinstance(point, list) and len(point) == 4
    return {"control_net": rows} | ({"homogeneous": True} if is_homogeneous else {})


_NOUNS = {dict: "an object", list: "a list", int: "a whole number", str: "a string"}


def _field(value: Any, name: str, kind: type, where: str, default: Any = None) -> Any:
    """A field of an object, of this type; `where` is the place of the object, with a full stop."""
    if not isinstance(value, dict):
        raise _build_error(where[:-1] or "the whole", "something else", "an object")
    field = value.get(name, default)
    if type(field) is not kind:
        got = "nothing" if field is None else "a value of another type"
        raise _build_error(where + name, got, _NOUNS[kind])
    return field


def _build_error(where: str, got: str, needed: str) -> MalformedBody:
    """The error for a file without what geomdl writes at a place."""
    return build_malformed_error(f"This is not a file of geomdl ({where}).", got, needed)
