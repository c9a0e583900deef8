"""Edges and faces of a brep as columns, in which a child process sends them.

A part of a thousand faces has some ten thousand objects in its document, which the service would
have to make and to read under Python's lock. Their numbers are some twenty arrays.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from service.bases.arrays import AnyArray, Bools, FloatArray, Ints
from service.decoders.format import Tree
from service.surface.brep_lists import EdgeColumns, FaceColumns, number_colors, number_given
from service.surface.spline_tables import CurveTable, SurfaceTable

_OTHER_FORM = "columns of another form"

_MAX_COUNT = 1 << 31
"""The largest count or index: the product of two of them is exact."""


def pack_brep(tree: Tree) -> Tree:
    """The document of a brep that a CAD file has, with packed edges and faces; others stay."""
    if "faces" not in tree:
        return tree
    return tree | {"edges": _pack_edges(tree.get("edges", [])), "faces": _pack_faces(tree["faces"])}


def unpack_brep(tree: Tree) -> Tree:
    """The document of a brep with the columns that `pack_brep` has packed; others stay.

    Only the form of the columns is checked, so that none is read beyond its end. Their values are
    checked as those of a document.

    Raises
    ------
    ValueError, LookupError, TypeError
        The columns are not those of `pack_brep`.
    """
    if not isinstance(tree.get("faces"), dict):
        return tree
    return tree | {
        "edges": _unpack_edges(_Columns(tree["edges"])),
        "faces": _unpack_faces(_Columns(tree["faces"])),
    }


def _pack_edges(edges: Sequence[Tree]) -> Tree:
    ends = [edge["vertices"] for edge in edges]
    return {
        "vertices": np.array([(each[0], each[-1]) for each in ends], np.int64).reshape(-1, 2),
        "has_curve": _flags("curve" in edge for edge in edges),
        "uncertainties": np.array([edge.get("uncertainty", np.nan) for edge in edges], np.float64),
        "is_degenerate": _flags("degenerate" in edge for edge in edges),
        "curves": _pack_splines([edge["curve"] for edge in edges if "curve" in edge], 1, 3),
    }


def _pack_faces(faces: Sequence[Tree]) -> Tree:
    lists = [face.get("loops", []) for face in faces]
    loops = list(chain.from_iterable(lists))
    edges = [loop["edges"] for loop in loops]
    none = [len(each) * [None] for each in edges]
    pcurves = _chain(loop.get("pcurves", rest) for loop, rest in zip(loops, none, strict=True))
    colors = [face["color"] for face in faces if "color" in face]
    return {
        "names": [face.get("name", "") for face in faces],
        "has_color": _flags("color" in face for face in faces),
        "colors": np.array([[*color, 1.0][:4] for color in colors], np.float64).reshape(-1, 4),
        "is_reversed": _flags("reversed" in face for face in faces),
        "surfaces": _pack_splines([face["surface"] for face in faces], 2, 3),
        "face_loops": np.array([len(each) for each in lists], np.int64),
        "loop_counts": np.array([len(each) for each in edges], np.int64),
        "coedge_edges": np.array(_chain(edges), np.int64),
        "coedge_reversed": _flags(
            _chain(loop.get("reversed", rest) for loop, rest in zip(loops, none, strict=True))
        ),
        "has_pcurve": _flags(curve is not None for curve in pcurves),
        "pcurves": _pack_splines([curve for curve in pcurves if curve is not None], 1, 2),
    }


def _pack_splines(splines: Sequence[Tree], axes: int, dimension: int) -> Tree:
    """The columns of `CurveTable`, or of `SurfaceTable`; weights only of rational splines."""
    nets = [spline["control_points" if axes == 1 else "control_net"] for spline in splines]
    knots = [spline["knots"] for spline in splines]
    shape = (-1,) if axes == 1 else (-1, 2)
    return {
        "degrees": np.array([spline["degree"] for spline in splines], np.int64).reshape(shape),
        "counts": np.array([net.shape[:axes] for net in nets], np.int64).reshape(shape),
        "points": _concatenate([net.reshape(-1, dimension) for net in nets], dimension),
        "is_rational": _flags("weights" in spline for spline in splines),
        "weights": _concatenate([item["weights"].ravel() for item in splines if "weights" in item]),
        "knots": _concatenate(knots if axes == 1 else _chain(knots)),
    }


def _flags(values: Iterable[object]) -> Ints:
    return np.array([bool(value) for value in values], np.int64)


def _chain(lists: Iterable[Iterable[Any]]) -> list[Any]:
    return list(chain.from_iterable(lists))


def _concatenate(arrays: Sequence[FloatArray], *shape: int) -> FloatArray:
    """The rows of all arrays; each row has this shape."""
    return np.concatenate([np.empty((0, *shape)), *arrays])


class _Columns:
    """Packed columns, each of which is checked and copied when it is taken."""

    def __init__(self, columns: Mapping[str, Any]) -> None:
        self._columns = columns

    def inner(self, name: str) -> "_Columns":
        """The columns that are one of these."""
        return _Columns(self._columns[name])

    def numbers(self, name: str, *shape: int) -> FloatArray:
        """Numbers of this shape, in which −1 stands for any length."""
        return self._take(name, np.float64, shape).astype(np.float64)

    def counts(self, name: str, *shape: int, least: int = 0) -> Ints:
        """Counts or indices of this shape, from `least` to `_MAX_COUNT`."""
        counts = self._take(name, np.int64, shape).astype(np.intp)
        _require(counts.min(initial=least) >= least)
        _require(counts.max(initial=least) <= _MAX_COUNT)
        return counts

    def flags(self, name: str, *shape: int) -> Bools:
        """True and false, stored as 1 and 0."""
        flags: Bools = self._take(name, np.int64, shape) != 0
        return flags

    def names(self, name: str) -> tuple[str, ...]:
        """Texts, whose characters are checked later."""
        names = self._columns[name]
        _require(isinstance(names, list) and set(map(type, names)) <= {str})
        return tuple(names)

    def _take(self, name: str, kind: type, shape: tuple[int, ...]) -> AnyArray:
        value: object = self._columns[name]
        if not isinstance(value, np.ndarray) or value.dtype != kind or value.ndim != len(shape):
            raise ValueError(_OTHER_FORM)
        pairs = zip(shape, value.shape, strict=True)
        _require(all(length in (-1, found) for length, found in pairs))
        return value


def _require(condition: object) -> None:
    """Refuse columns of another form."""
    if not condition:
        raise ValueError(_OTHER_FORM)


def _unpack_edges(columns: _Columns) -> EdgeColumns:
    vertices = columns.counts("vertices", -1, 2)
    count = len(vertices)
    has_curve = columns.flags("has_curve", count)
    return EdgeColumns(
        vertices,
        number_given(has_curve),
        columns.numbers("uncertainties", count),
        columns.flags("is_degenerate", count),
        _unpack_curves(columns.inner("curves"), has_curve, 3),
    )


def _unpack_faces(columns: _Columns) -> FaceColumns:
    names = columns.names("names")
    count = len(names)
    has_color = columns.flags("has_color", count)
    palette, numbers = number_colors(columns.numbers("colors", int(has_color.sum()), 4))
    colors = np.full(count, -1)
    colors[has_color] = numbers
    face_loops = columns.counts("face_loops", count)
    loop_counts = columns.counts("loop_counts", face_loops.sum(), least=1)
    coedges = loop_counts.sum()
    has_pcurve = columns.flags("has_pcurve", coedges)
    return FaceColumns(
        names,
        palette,
        colors,
        columns.flags("is_reversed", count),
        SurfaceTable(*_unpack_splines(columns.inner("surfaces"), (count, 2), 3)),
        np.repeat(np.arange(count), face_loops),
        loop_counts,
        columns.counts("coedge_edges", coedges),
        columns.flags("coedge_reversed", coedges),
        number_given(has_pcurve),
        _unpack_curves(columns.inner("pcurves"), has_pcurve, 2),
    )


def _unpack_curves(columns: _Columns, is_given: Bools, dimension: int) -> CurveTable:
    """The table of the curves of edges or coedges, those that have one."""
    return CurveTable(*_unpack_splines(columns, (int(is_given.sum()),), dimension))


def _unpack_splines(
    columns: _Columns, shape: tuple[int, ...], dimension: int
) -> tuple[Ints, Ints, FloatArray, FloatArray, Bools, FloatArray]:
    """The columns of a table whose degrees have this shape."""
    degrees = columns.counts("degrees", *shape, least=1)
    counts = columns.counts("counts", *shape, least=2)
    points = columns.numbers("points", -1, dimension)
    knots = columns.numbers("knots", -1)
    _require((degrees < counts).all() and counts.max(initial=0) <= len(points))
    sizes = counts if counts.ndim == 1 else counts.prod(axis=1)
    _require(sizes.sum() == len(points) and (counts + degrees + 1).sum() == len(knots))
    is_rational = columns.flags("is_rational", len(counts))
    weights, has_weight = np.ones(len(points)), np.repeat(is_rational, sizes)
    weights[has_weight] = columns.numbers("weights", int(has_weight.sum()))
    return degrees, counts, points, weights, is_rational, knots
