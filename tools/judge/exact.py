"""Reads the inputs of the proof: homogeneous Bézier nets of a document, and triangles of a file.

All numbers of nets are exact fractions. The module reads only public
formats: the JSON of a surface, binary STL, and glTF with at most one translation.
"""

import json
import struct
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Exact: TypeAlias = NDArray[np.object_]

to_fractions = np.vectorize(Fraction, otypes=[object])

RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(content: bytes) -> tuple[Array, Array]:
    """Corners (T, 3, 3) of an STL file, and the origin (3,) of their coordinates."""
    return np.frombuffer(content[84:], RECORD)["corners"].astype(np.float64), np.zeros(3)


def read_glb(content: bytes) -> tuple[Array, Array]:
    """Corners (T, 3, 3) of a GLB file, unchanged, and the origin (3,) of their coordinates."""
    (length,) = struct.unpack("<I", content[12:16])
    document, buffer = json.loads(content[20 : 20 + length]), content[28 + length :]

    def numbers(number: int) -> NDArray[Any]:
        accessor = document["accessors"][number]
        view = document["bufferViews"][accessor["bufferView"]]
        kind = {5126: "<f4", 5125: "<u4", 5123: "<u2", 5121: "<u1"}[accessor["componentType"]]
        columns = {"VEC3": 3, "SCALAR": 1}[accessor["type"]]
        step = view.get("byteStride", columns * np.dtype(kind).itemsize)
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        rows = np.ndarray((accessor["count"], columns), kind, buffer, start, (step, int(kind[2])))
        return rows if columns == 3 else rows[:, 0]

    places = [node["translation"] for node in document["nodes"] if "translation" in node]
    assert len(places) < 2
    assert not any({"rotation", "scale", "matrix"} & node.keys() for node in document["nodes"])
    primitives = [p for mesh in document["meshes"] for p in mesh["primitives"]]
    corners = [
        numbers(p["attributes"]["POSITION"])[numbers(p["indices"])].reshape(-1, 3, 3)
        for p in primitives
        if p.get("mode", 4) == 4
    ]
    return np.concatenate(corners).astype(np.float64), np.array(places[0] if places else [0.0] * 3)


def list_nets(surface: dict[str, Any], origin: Array) -> list[Exact]:
    """All Bézier pieces of a surface, one array for each degree: (wx, wy, wz, w) about the origin.

    Each array is (m, p+1, q+1, 4), of fractions. Triangles become patches with one side collapsed
    to a point: u leads away from their first corner, v along the opposite side.
    """
    pieces = list(_iterate_pieces(surface, origin))
    shapes = dict.fromkeys(net.shape for net in pieces)
    return [np.stack([net for net in pieces if net.shape == shape]) for shape in shapes]


def _iterate_pieces(surface: dict[str, Any], origin: Array) -> Iterator[Exact]:
    """The Bézier pieces of a surface, exact, as `list_nets` has them."""
    kind = surface.get("type", "bezier")
    if kind == "bezier":
        yield _to_homogeneous(surface["control_net"], surface.get("weights"), origin)
    elif kind == "bspline":
        net = _to_homogeneous(surface["control_net"], surface.get("weights"), origin)
        yield from _iterate_spans(net, surface["degree"], surface["knots"])
    elif kind == "triangle":
        weights = surface.get("weights") or [None] * len(surface["control_net"])
        rows = zip(surface["control_net"], weights, strict=True)
        yield _to_square([_to_homogeneous(row, load, origin) for row, load in rows])
    elif kind == "multipatch":
        for member in surface["surfaces"]:
            yield from _iterate_pieces(member, origin)
    else:
        points = _to_homogeneous(surface["vertices"], surface.get("weights"), origin)
        yield from (points[np.array(grid)] for grid in surface.get("patches", []))
        for rows in surface.get("triangles", []):
            yield _to_square([points[row] for row in rows])


def _to_homogeneous(points: Any, weights: Any, origin: Array) -> Exact:
    local = to_fractions(np.array(points, dtype=np.float64)) - to_fractions(origin)
    loads = np.ones(local.shape[:-1]) if weights is None else np.array(weights, dtype=np.float64)
    exact = to_fractions(loads)[..., np.newaxis]
    return np.concatenate([local * exact, exact], axis=-1)


def _to_square(rows: Sequence[Exact]) -> Exact:
    """Rows of a triangular net as a patch: C(n, a) C(a, k) is the coefficient of (n−a, a−k, k)."""
    n = len(rows) - 1
    curves = []
    for a in range(n + 1):
        line = [rows[k][a - k] for k in range(a + 1)]
        for m in range(a + 1, n + 1):
            line = [
                (line[i - 1] * i if i else 0) / Fraction(m)
                + (line[i] * (m - i) / Fraction(m) if i < m else 0)
                for i in range(m + 1)
            ]
        curves.append(np.stack(line))
    return np.stack(curves)


def _iterate_spans(net: Exact, degree: Sequence[int], knots: Sequence[Any]) -> Iterator[Exact]:
    """The Bézier net of every span, from blossoms by de Boor's recurrence."""
    matrices = []
    for axis, (p, named) in enumerate(zip(degree, knots, strict=True)):
        if isinstance(named, str) and named == "periodic":
            net = np.concatenate([net, np.take(net, range(p), axis=axis)], axis=axis)
        count = net.shape[axis]
        line: list[Fraction] = [Fraction(k - p) for k in range(count + p + 1)]
        if not isinstance(named, str):
            line = [Fraction(float(knot)) for knot in named]
        elif named == "clamped":
            line = [min(max(knot, Fraction(0)), Fraction(count - p)) for knot in line]
        spans = [s for s in range(p, count) if line[s] < line[s + 1]]
        matrices.append([(s - p, _compute_blossoms(line, p, s)) for s in spans])
    for i, u in matrices[0]:
        for j, v in matrices[1]:
            part = net[i : i + len(u), j : j + len(v)]
            yield np.swapaxes(np.tensordot(v, np.tensordot(u, part, 1), (1, 1)), 0, 1)


def _compute_blossoms(knots: Sequence[Fraction], p: int, span: int) -> Exact:
    """The matrix (p+1, p+1) from the control points of a span to those of its Bézier curve."""
    rows = []
    for i in range(p + 1):
        at = [knots[span]] * (p - i) + [knots[span + 1]] * i
        points = list(to_fractions(np.eye(p + 1)))
        for r in range(1, p + 1):
            for j in range(p, r - 1, -1):
                low, high = knots[j + span - p], knots[j + 1 + span - r]
                share = (at[r - 1] - low) / (high - low)
                points[j] = (1 - share) * points[j - 1] + share * points[j]
        rows.append(points[p])
    return np.stack(rows)
