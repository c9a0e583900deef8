"""Reads the edges and the faces of a brep to columns, in batches, and checks such columns."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.schemas.batches import (
    Objects,
    read_distances,
    read_indices,
    read_names,
    read_numbers,
    require,
    require_keys,
    require_type,
    take,
)
from service.schemas.divided_splines import CURVES, NETS, divide_splines
from service.schemas.document import DocumentLimits
from service.schemas.spline_batches import read_curves, read_surfaces
from service.surface.brep_lists import (
    EdgeColumns,
    FaceColumns,
    number_colors,
    number_given,
)
from service.surface.spline_checks import check_curves, check_surfaces
from service.surface.spline_tables import CurveTable, SurfaceTable

_EDGE_KEYS = frozenset({"vertices", "curve", "uncertainty", "degenerate"})
_FACE_KEYS = frozenset({"name", "color", "reversed", "surface", "loops"})
_LOOP_KEYS = frozenset({"edges", "reversed", "pcurves"})


def read_edges(items: Objects, limits: DocumentLimits) -> EdgeColumns:
    """The columns of edges; raises `Unreadable` if any of them is wrong."""
    used = require_keys(items, _EDGE_KEYS)
    count = len(items)
    vertices = take(items, "vertices")
    require_type(vertices, list)
    lengths = np.fromiter(map(len, vertices), np.intp, count)
    is_degenerate = _read_flags(items, "degenerate", used)
    require(((lengths == 2) | ((lengths == 1) & is_degenerate)).all())
    ends = np.repeat(
        read_indices(list(chain.from_iterable(vertices))), np.repeat(3 - lengths, lengths)
    ).reshape(-1, 2)
    has_curve = np.array(["curve" in item for item in items], bool)
    curves = _read_curves([item["curve"] for item in items if "curve" in item], 3, limits)
    uncertainties = np.full(count, np.nan)
    if "uncertainty" in used:
        is_given = ["uncertainty" in item for item in items]
        given = [item["uncertainty"] for item in items if "uncertainty" in item]
        uncertainties[is_given] = read_distances(given)
    numbers = number_given(has_curve)
    return check_edges(EdgeColumns(ends, numbers, uncertainties, is_degenerate, curves), limits)


def check_edges(edges: EdgeColumns, limits: DocumentLimits) -> EdgeColumns:
    """The columns of edges, with normal curves; raises `Unreadable` if any of them is wrong."""
    vertices, is_degenerate = edges.vertices, edges.is_degenerate
    require((vertices[is_degenerate, 0] == vertices[is_degenerate, 1]).all())
    require((edges.curve_numbers[is_degenerate] < 0).all())
    return replace(edges, curves=_check_curves(edges.curves, limits))


def read_faces(items: Objects, limits: DocumentLimits) -> FaceColumns:
    """The columns of faces and their loops; raises `Unreadable` if any of them is wrong."""
    used = require_keys(items, _FACE_KEYS)
    names = [""] * len(items)
    if "name" in used:
        named = [number for number, item in enumerate(items) if "name" in item]
        given = read_names([items[number]["name"] for number in named])
        for number, name in zip(named, given, strict=True):
            names[number] = name
    palette, colors = _read_colors(items)
    surfaces = read_surfaces(divide_splines(take(items, "surface"), NETS, limits), limits)
    lists = [item.get("loops", ()) for item in items]
    require(set(map(type, lists)) <= {list, tuple})
    loop_counts = np.fromiter(map(len, lists), np.intp, len(lists))
    is_reversed = _read_flags(items, "reversed", used)
    loop_faces = np.repeat(np.arange(len(items)), loop_counts)
    loops = _read_loops(list(chain.from_iterable(lists)), limits)
    faces = FaceColumns(tuple(names), palette, colors, is_reversed, surfaces, loop_faces, *loops)
    return check_faces(faces, limits)


def check_faces(faces: FaceColumns, limits: DocumentLimits) -> FaceColumns:
    """The columns of faces, with normal splines; raises `Unreadable` if any of them is wrong."""
    require(((faces.palette >= 0) & (faces.palette <= 1)).all())
    _check_splines(faces.surfaces, limits)
    surfaces, invalid = check_surfaces(faces.surfaces)
    require(not len(invalid))
    return replace(faces, surfaces=surfaces, pcurves=_check_curves(faces.pcurves, limits))


def check_face_columns(faces: FaceColumns, limits: DocumentLimits) -> FaceColumns:
    """`check_faces` of columns whose names have not been read either."""
    read_names([name for name in faces.names if name])
    return check_faces(faces, limits)


def _read_curves(curves: Objects, dimension: int, limits: DocumentLimits) -> CurveTable:
    """The table of curves, of which some may have homogeneous points or weights of 0."""
    return read_curves(divide_splines(curves, CURVES, limits), dimension, limits)


def _check_curves(curves: CurveTable, limits: DocumentLimits) -> CurveTable:
    """The curves in their normal form."""
    _check_splines(curves, limits)
    curves, invalid = check_curves(curves)
    require(not len(invalid))
    return curves


def _check_splines(table: CurveTable | SurfaceTable, limits: DocumentLimits) -> None:
    """Check what `service.surface.spline_checks` takes for granted."""
    require((table.degrees <= limits.max_degree).all() and np.isfinite(table.knots).all())


def _read_loops(
    loops: Objects, limits: DocumentLimits
) -> tuple[Ints, Ints, Bools, Ints, CurveTable]:
    """Numbers of coedges of each loop, and the columns of coedges, with the table of pcurves."""
    used = require_keys(loops, _LOOP_KEYS)
    edges, reverses, pcurves = (
        _take_lists(loops, key, used) for key in ("edges", "reversed", "pcurves")
    )
    counts = [len(each or other or ()) for each, other in zip(edges, pcurves, strict=True)]
    require(all(counts))
    for lists in (edges, reverses, pcurves):
        pairs = zip(lists, counts, strict=True)
        require(all(each is None or len(each) == count for each, count in pairs))
    coedge_edges = read_indices(_join(edges, counts, -1))
    has_edge = np.repeat(np.array([each is not None for each in edges], bool), counts)
    require((coedge_edges[has_edge] >= 0).all())
    flags = _join(reverses, counts, False)
    require_type(flags, bool)
    curves = _join(pcurves, counts, None)
    has_pcurve = np.array([curve is not None for curve in curves], bool)
    require((has_pcurve | has_edge).all())
    table = _read_curves([curve for curve in curves if curve is not None], 2, limits)
    numbers = np.array(counts, np.intp), coedge_edges, np.array(flags, bool)
    return *numbers, number_given(has_pcurve), table


def _take_lists(loops: Objects, key: str, used: frozenset[str]) -> list[list[Any] | None]:
    """One field of all loops, None where it is left out; the field is a list."""
    if key not in used:
        return [None] * len(loops)
    lists = [loop.get(key, ()) for loop in loops]
    require(set(map(type, lists)) <= {list, tuple})
    return [each if type(each) is list else None for each in lists]


def _join(lists: Sequence[list[Any] | None], counts: Sequence[int], default: object) -> list[Any]:
    """The items of all lists; a list that is left out has `default` in place of each item."""
    return list(
        chain.from_iterable(
            [default] * count if each is None else each
            for each, count in zip(lists, counts, strict=True)
        )
    )


def _read_flags(items: Objects, key: str, used: frozenset[str]) -> Bools:
    """A field that is true or false, and false where it is left out."""
    if key not in used:
        return np.zeros(len(items), bool)
    flags = [item.get(key, False) for item in items]
    require_type(flags, bool)
    return np.array(flags, bool)


def _read_colors(items: Objects) -> tuple[FloatArray, Ints]:
    """The distinct colours in the order of their first faces, and the colour of each face."""
    colored = [number for number, item in enumerate(items) if "color" in item]
    colors = [items[number]["color"] for number in colored]
    require_type(colors, list)
    require(set(map(len, colors)) <= {3, 4})
    rows = [color if len(color) == 4 else [*color, 1.0] for color in colors]
    palette, numbers = number_colors(read_numbers(list(chain.from_iterable(rows))).reshape(-1, 4))
    face_colors = np.full(len(items), -1)
    face_colors[colored] = numbers
    return palette, face_colors
