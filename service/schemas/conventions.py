"""Recognises the fields of other programs in a refused request, and says which fields are meant.

The names are those of geomdl, splinepy, G+Smo, Rhino, USD (UsdGeomNurbsPatch), Open CASCADE,
Blender, verb and three.js. No such field is accepted: programs order and weight their points
differently, so a name alone does not say what the numbers are. The refusal has the request to send,
if it is short and `service.schemas.translation` can compute it from the fields, or else its form.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import orjson

from service.errors import Issue, pointer
from service.schemas.program_fields import ROLES, find_program, fold_name
from service.schemas.translation import (
    find_sizes,
    is_flat_list,
    translate_curve,
    translate_surface,
)

MAX_REQUEST = 2000
"""The most characters of a request in an error."""

MAX_MEMBERS = 64
"""How many surfaces of a group or multipatch are searched for such fields."""

_NEEDED: Mapping[str, str] = MappingProxyType(
    {
        "points": "`control_net`: a list of rows, which follow each other along u, of points "
        "[x, y, z] along v",
        "homogeneous": "`control_net`, rows along u of points [w x, w y, w z, w], and "
        "`homogeneous`: true",
        "weights": "`weights`: rows of numbers, in the order of `control_net`",
        "degree": "`degree`: [p, q], or one number for both",
        "order": "`degree`: [p, q], each the order less one",
        "knots": "`knots`: [[…], […]], along u and along v",
        "multiplicities": "`knots`, in which each knot stands as often as its multiplicity",
        "size": "no size: it is that of the rows of `control_net`",
        "closed": "`knots`: `periodic` in a direction in which the surface closes",
        "sampling": "`resolution` or `tolerance`, beside the surface",
        "trims": "a `brep`, whose face has the surface, and a loop of `pcurves` for each curve",
        "dimension": "nothing: the points and the `weights` say it",
        "wrapper": "its fields, as those of `surface`",
    }
)
"""The fields that are meant, by the role of a field of a surface."""

_NEEDED_OF_CURVE: Mapping[str, str] = MappingProxyType(
    {
        **_NEEDED,
        "points": "`control_points`: a list of points [x, y] or [x, y, z]",
        "homogeneous": "`control_points` [w x, w y, w z, w], and `homogeneous`: true",
        "weights": "`weights`: a list of numbers",
        "degree": "`degree`: one number",
        "order": "`degree`: the order less one",
        "knots": "`knots`: a list of numbers",
        "size": "no size: it is the length of `control_points`",
        "closed": "`knots`: `periodic`, if the curve closes",
        "sampling": "`resolution` or `tolerance`, beside the curve",
        "wrapper": "its fields, as those of `curve`",
    }
)
"""The fields that are meant, by the role of a field of a curve."""

_FORM = (
    '{"surface": {"type": "bspline", "degree": [p, q], "knots": [[…], […]], '
    '"control_net": [[[x, y, z], …], …], "weights": [[w, …], …]}}'
)
_CURVE_FORM = (
    '{"curve": {"type": "bspline", "degree": p, "knots": […], '
    '"control_points": [[x, y, z], …], "weights": [w, …]}}'
)

_ELSEWHERE: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "format": (
            "The format of the response is not a field of the body.",
            "`format` in the query, as in /v1/mesh?format=glb, or the header `Accept`",
        ),
        "shape": (
            "This is a file of geomdl, not a request.",
            "the file as it is, with `Content-Type: application/vnd.geomdl+json`",
        ),
        "SplineList": (
            "This is a file of splinepy, not a request.",
            "the same splines as IGES (.igs), which splinepy writes too, with `Content-Type: "
            "model/iges`; or one spline as `surface`",
        ),
    }
)
"""Message and need of fields of a document that belong to another place of the request."""

KIND_NAMES: Mapping[str, str] = MappingProxyType(
    {
        "nurbs": "bspline",
        "nurbssurface": "bspline",
        "nurbspatch": "bspline",
        "bsplinesurface": "bspline",
        "spline": "bspline",
        "tensorbspline2": "bspline",
        "tensornurbs2": "bspline",
        "beziersurface": "bezier",
        "bezierpatch": "bezier",
        "rationalbezier": "bezier",
        "beziertriangle": "triangle",
        "compound": "group",
        "solid": "brep",
    }
)
"""Kinds of surfaces, by names that other programs have for them, without case and marks."""


_ROWS: Mapping[str, str] = MappingProxyType(
    {
        "control_net": "a list of rows along u, [[[x, y, z], …], …]",
        "weights": "a list of rows along u, [[w, …], …]",
    }
)
"""The nested lists that are needed in place of flat ones."""

_OWN: Mapping[str, str] = MappingProxyType(
    {
        **dict.fromkeys(
            ("control_net", "vertices", "patches", "surfaces", "members", "faces"), "surface"
        ),
        "control_points": "curve",
    }
)
"""Fields that stand inside a surface or a curve, not beside it."""

_NO_NAME = "No field has this name."

_SPLINE = "`type`: `bspline`, which has this field"

_UNKNOWN = ("unknown_field", "unknown_type")
"""Codes of the issues that may be those of another program's fields."""


def explain(
    document: object, issues: tuple[Issue, ...], is_valid: Callable[[dict[str, Any]], bool]
) -> tuple[Issue, ...]:
    """The issues of a refused document; those of fields of other programs come first and say more.

    Parameters
    ----------
    document : object
        The whole document.
    issues : tuple of Issue
        With pointers into the document.
    is_valid : callable
        Whether a request is valid: only such a request is shown.
    """
    if not isinstance(document, dict):
        return issues
    objects = [*_find_objects(document)]
    for where, fields, is_curve in objects:
        if not is_curve:
            issues = _explain_flat_lists(where, fields, issues)
    if not {"surface", "curve"} & document.keys():
        issues = tuple(map(_explain_own_field, issues))
    unknown = {issue.pointer for issue in issues if issue.code in _UNKNOWN}
    if not unknown:
        return issues
    better = {
        f"/{name}": Issue("unknown_field", message, f"/{name}", "", needed)
        for name, (message, needed) in _ELSEWHERE.items()
    }
    for where, fields, is_curve in objects:
        better |= _explain_object(where, fields, unknown, is_valid, is_curve=is_curve)
    explained = [
        replace(better[issue.pointer], got=issue.got)
        for issue in issues
        if issue.pointer in better and issue.pointer in unknown
    ]
    return (*explained, *(i for i in issues if not (i.pointer in better and i.pointer in unknown)))


def _explain_own_field(issue: Issue) -> Issue:
    """The issue of a field of a surface or curve that stands in their place; others unchanged."""
    container = _OWN.get(issue.pointer[1:]) if issue.code == "unknown_field" else None
    return issue if container is None else replace(issue, needed=f"`{container}`, with it inside")


def _explain_flat_lists(
    where: str, fields: dict[str, Any], issues: tuple[Issue, ...]
) -> tuple[Issue, ...]:
    """The issues, with one for each flat list of points or weights, not one for each item."""
    for name, form in _ROWS.items():
        place = f"{where}/{name}/"
        inside = [each for each in issues if each.pointer.startswith(place)]
        if {each.code for each in inside} != {"wrong_type"}:
            continue
        if not is_flat_list(fields.get(name), 2 if name == "control_net" else 1):
            continue
        first = replace(inside[0], needed=form + _describe_split(fields))
        issues = tuple(first if i is inside[0] else i for i in issues if i not in inside[1:])
    return issues


def _describe_split(fields: dict[str, Any]) -> str:
    """How a flat list is split into rows, if the sizes of the net are known."""
    sizes = find_sizes(fields)
    if sizes is None:
        return ""
    rows, columns = sizes
    by_rows = f": {rows} rows of {columns}, if v varies fastest in the list"
    return f"{by_rows}; if u does, item j of row i is number i + {rows} j"


def _find_objects(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any], bool]]:
    """The pointers and the fields of surfaces and curves of a document; whether it is a curve."""
    surface, curve = document.get("surface"), document.get("curve")
    if "surface" not in document and "curve" not in document:
        yield "", document, False
    if isinstance(curve, dict):
        yield "/curve", curve, True
    if not isinstance(surface, dict):
        return
    yield "/surface", surface, False
    for name in ("surfaces", "definitions", "members"):
        items = surface.get(name)
        for number, item in enumerate(items[:MAX_MEMBERS] if isinstance(items, list) else ()):
            inner = item.get("surface") if isinstance(item, dict) and name == "members" else item
            if isinstance(inner, dict):
                ending = "/surface" if name == "members" else ""
                yield f"/surface/{name}/{number}{ending}", inner, False


def _explain_object(
    where: str,
    fields: dict[str, Any],
    unknown: Collection[str],
    is_valid: Callable[[dict[str, Any]], bool],
    *,
    is_curve: bool,
) -> dict[str, Issue]:
    """Better issues for the unknown fields and kind of a surface or curve, by their pointers."""
    texts = _NEEDED_OF_CURVE if is_curve else _NEEDED
    needs = {}
    kind = fields.get("type")
    if isinstance(kind, str) and f"{where}/type" in unknown:
        known = KIND_NAMES.get(fold_name(kind), "")
        needs = {"type": f"`{known}`"} if known else {}
    needs |= {
        name: texts[ROLES[fold_name(name)]]
        for name in fields
        if where + pointer([name]) in unknown and fold_name(name) in ROLES
    }
    if kind is None:  # of a Bézier patch, because the kind is left out
        needs |= {name: _SPLINE for name in ("degree", "knots") if name in needs}
    if not needs:
        return {}
    program = find_program(fields)
    message = f"{_NO_NAME[:-1]}; {program.program} has one." if program else _NO_NAME
    request = _write_request(where, fields, is_valid, is_curve=is_curve)
    needs[next(iter(needs))] += f"; send {request}"
    return {
        where + pointer([name]): Issue(
            "unknown_type" if name == "type" else "unknown_field",
            "No kind of surface has this name." if name == "type" else message,
            where + pointer([name]),
            "",
            needed,
        )
        for name, needed in needs.items()
    }


def _write_request(
    where: str,
    fields: dict[str, Any],
    is_valid: Callable[[dict[str, Any]], bool],
    *,
    is_curve: bool,
) -> str:
    """The request that is meant, or its form if it cannot be computed or is too long."""
    if is_curve:
        name, translated, form = "curve", translate_curve(fields), _CURVE_FORM
    else:
        name, translated, form = "surface", translate_surface(fields), _FORM
    if translated is None or where not in ("", f"/{name}") or not is_valid({name: translated}):
        return form
    text = orjson.dumps({name: translated}).decode()
    return text if len(text) <= MAX_REQUEST else form
