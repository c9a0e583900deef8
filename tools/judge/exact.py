"""Reads what `tools.judge.proof` compares: Bézier nets of a surface, and triangles of its mesh.

Nets are homogeneous, and all their numbers are exact fractions. The module reads only public
formats: the JSON of a surface, binary STL, and GLB with at most one translation.
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

# STL: a header of 84 bytes, then one record for each triangle.
STL_HEADER_BYTES = 84
STL_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(content: bytes) -> tuple[Array, Array]:
    """Corners (T, 3, 3) of an STL file, and the origin (3,) of their coordinates."""
    records = np.frombuffer(content[STL_HEADER_BYTES:], STL_RECORD)
    return records["corners"].astype(np.float64), np.zeros(3)


def read_glb(content: bytes) -> tuple[Array, Array]:
    """Corners (T, 3, 3) of a GLB file as they are stored, and the origin (3,) of their coordinates.

    The origin is the translation of the node.
    """
    # A header of 12 bytes; then two chunks, the JSON and the buffer, with headers of 8 bytes each.
    (length,) = struct.unpack("<I", content[12:16])
    document, buffer = json.loads(content[20 : 20 + length]), content[28 + length :]

    def read_accessor(index: int) -> NDArray[Any]:
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        component_type = accessor["componentType"]
        dtype = np.dtype({5126: "<f4", 5125: "<u4", 5123: "<u2", 5121: "<u1"}[component_type])
        columns = {"VEC3": 3, "SCALAR": 1}[accessor["type"]]
        stride = view.get("byteStride", columns * dtype.itemsize)
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        shape, strides = (accessor["count"], columns), (stride, dtype.itemsize)
        rows = np.ndarray(shape, dtype, buffer, start, strides)
        return rows if columns == 3 else rows[:, 0]

    origins = [node["translation"] for node in document["nodes"] if "translation" in node]
    assert len(origins) < 2
    assert not any({"rotation", "scale", "matrix"} & node.keys() for node in document["nodes"])
    primitives = [p for mesh in document["meshes"] for p in mesh["primitives"]]
    corners = [
        read_accessor(p["attributes"]["POSITION"])[read_accessor(p["indices"])].reshape(-1, 3, 3)
        for p in primitives
        if p.get("mode", 4) == 4  # triangles
    ]
    origin = np.array(origins[0] if origins else [0.0] * 3)
    return np.concatenate(corners).astype(np.float64), origin


def list_nets(surface: dict[str, Any], origin: Array) -> list[Exact]:
    """The nets of all Bézier patches of a surface (the JSON of a request), exact.

    Patches of the same degree are in one array (m, p+1, q+1, 4) of fractions: wx, wy, wz, w, where
    x, y, z are relative to the origin. Triangular patches become tensor-product patches with one
    side collapsed to a point: u leads away from their first corner, v along the opposite side.
    """
    nets = list(_iterate_nets(surface, origin))
    shapes = dict.fromkeys(net.shape for net in nets)
    return [np.stack([net for net in nets if net.shape == shape]) for shape in shapes]


def _iterate_nets(surface: dict[str, Any], origin: Array) -> Iterator[Exact]:
    """The net (p+1, q+1, 4) of each Bézier patch, as in `list_nets`."""
    kind = surface.get("type", "bezier")
    if kind == "bezier":
        yield _to_homogeneous(surface["control_net"], surface.get("weights"), origin)
    elif kind == "bspline":
        net = _to_homogeneous(surface["control_net"], surface.get("weights"), origin)
        yield from _iterate_spans(net, surface["degree"], surface["knots"])
    elif kind == "triangle":
        weights = surface.get("weights") or [None] * len(surface["control_net"])
        rows = zip(surface["control_net"], weights, strict=True)
        yield _to_square([_to_homogeneous(row, each, origin) for row, each in rows])
    elif kind == "multipatch":
        for member in surface["surfaces"]:
            yield from _iterate_nets(member, origin)
    else:  # "patches"
        points = _to_homogeneous(surface["vertices"], surface.get("weights"), origin)
        yield from (points[np.array(grid)] for grid in surface.get("patches", []))
        for rows in surface.get("triangles", []):
            yield _to_square([points[row] for row in rows])


def _to_homogeneous(points: Any, weights: Any, origin: Array) -> Exact:
    local = to_fractions(np.array(points, dtype=np.float64)) - to_fractions(origin)
    rounded = np.ones(local.shape[:-1]) if weights is None else np.array(weights, dtype=np.float64)
    w = to_fractions(rounded)[..., np.newaxis]
    return np.concatenate([local * w, w], axis=-1)


def _to_square(rows: Sequence[Exact]) -> Exact:
    """The rows of a triangular net of degree n as the net (n+1, n+1, 4) of a patch.

    The point P_ijk is rows[k][j]. At the barycentric coordinates (1 − u, u (1 − v), u v), its
    Bernstein polynomial is that of a = j + k of degree n at u, times that of k of degree a at v. So
    row a of the patch is the curve of the points with j + k = a, of degree a, elevated to degree n.
    """
    n = len(rows) - 1
    curves = []
    for a in range(n + 1):
        curve = [rows[k][a - k] for k in range(a + 1)]
        for m in range(a + 1, n + 1):  # elevates the degree from m − 1 to m
            curve = [
                (curve[i - 1] * i if i else 0) / Fraction(m)
                + (curve[i] * (m - i) / Fraction(m) if i < m else 0)
                for i in range(m + 1)
            ]
        curves.append(np.stack(curve))
    return np.stack(curves)


def _iterate_spans(net: Exact, degree: Sequence[int], knots: Sequence[Any]) -> Iterator[Exact]:
    """The Bézier net of every pair of spans, from blossoms by de Boor's recurrence.

    In each direction, `knots` has all knots (the first and the last too), or the name of a rule.
    """
    matrices = []
    for axis, (p, given) in enumerate(zip(degree, knots, strict=True)):
        if isinstance(given, str) and given == "periodic":
            net = np.concatenate([net, np.take(net, range(p), axis=axis)], axis=axis)
        count = net.shape[axis]
        # The knots of "uniform", and of "periodic" with its first p points repeated at the end.
        vector: list[Fraction] = [Fraction(k - p) for k in range(count + p + 1)]
        if not isinstance(given, str):
            vector = [Fraction(float(knot)) for knot in given]
        elif given == "clamped":
            vector = [min(max(knot, Fraction(0)), Fraction(count - p)) for knot in vector]
        spans = [s for s in range(p, count) if vector[s] < vector[s + 1]]
        # Span s depends on the control points s − p to s.
        matrices.append([(s - p, _compute_blossoms(vector, p, s)) for s in spans])
    for i, u in matrices[0]:
        for j, v in matrices[1]:
            points = net[i : i + len(u), j : j + len(v)]
            # tensordot puts the axis of v first.
            yield np.swapaxes(np.tensordot(v, np.tensordot(u, points, 1), (1, 1)), 0, 1)


def _compute_blossoms(knots: Sequence[Fraction], p: int, span: int) -> Exact:
    """The matrix (p+1, p+1) from the control points of a span to those of its Bézier curve."""
    rows = []
    for i in range(p + 1):
        # Point i is the blossom at the beginning of the span p − i times and at its end i times.
        arguments = [knots[span]] * (p - i) + [knots[span + 1]] * i
        points = list(to_fractions(np.eye(p + 1)))
        for r in range(1, p + 1):
            for j in range(p, r - 1, -1):
                low, high = knots[j + span - p], knots[j + 1 + span - r]
                share = (arguments[r - 1] - low) / (high - low)
                points[j] = (1 - share) * points[j - 1] + share * points[j]
        rows.append(points[p])
    return np.stack(rows)
