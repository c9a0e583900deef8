"""VTK files of unstructured grids (.vtu): each Bézier patch is one cell, exact.

A tensor-product patch is a Bézier quadrilateral (cell type 77), a triangular patch a Bézier
triangle (76). The order of control points is that of VTK's cells of higher order: corners, then the
inner points of the sides, then those inside. Weights are the array `RationalWeights` of points, and
degrees the array `HigherOrderDegrees` of cells; `part` is the number of the part of each patch.
Arrays follow the XML as they are (appended, raw), little-endian, each after its length.

References
----------
VTK File Formats, "XML File Formats"; Kitware, "Implementation of rational Bézier cells into VTK"
(2020).
"""

from functools import lru_cache
from typing import TypeAlias

import numpy as np

from service.bases.arrays import AnyArray, Ints
from service.bases.triangle import find_index
from service.cancellation import checkpoint
from service.encoders.cad.format import Allow, WritingReport, WrittenFile
from service.encoders.format import Content, pack
from service.engine.models import to_patches
from service.surface.batches import Patches, TensorPatches
from service.surface.lowered import Model
from service.surface.sizes import SurfaceSize

QUADRILATERAL, TRIANGLE = 77, 76
"""The types of Bézier cells."""

HEAD_BYTES = 2_000
"""More bytes than the XML has."""

POINT_BYTES, CELL_BYTES = 40, 37
"""Bytes of a control point: coordinates, weight and index; and of a cell: end, type, degrees and
part."""

Column: TypeAlias = tuple[str, str, int, AnyArray]
"""Name, type, number of components, and values of an array."""


def encode(model: Model, _metres_per_unit: float | None, allow: Allow) -> WrittenFile:
    """The file of a model of patches, in model units: the format has none.

    Raises
    ------
    InvalidRequest
        `not_parametric` for tubes, ribbons and breps; its pointer is relative to the surface.
    """
    patches = to_patches(model)
    point_count = sum(batch.points.size // 3 for batch in patches.batches)
    allow(_bound_bytes(point_count, patches.patch_count))
    orders = [_find_order(batch) for batch in patches.batches]
    points, weights, degrees, counts, kinds = [], [], [], [], []
    is_rational = any(batch.weights is not None for batch in patches.batches)
    for batch, order in zip(patches.batches, orders, strict=True):
        checkpoint()
        points.append(batch.points.reshape(batch.count, -1, 3)[:, order].reshape(-1, 3))
        if is_rational:
            own = np.ones(batch.points.shape[:-1]) if batch.weights is None else batch.weights
            weights.append(own.reshape(batch.count, -1)[:, order].ravel())
        p, q = batch.degree if isinstance(batch, TensorPatches) else (batch.degree, batch.degree)
        degrees.append(np.tile([float(p), float(q), 0.0], (batch.count, 1)))
        counts.append(np.full(batch.count, len(order)))
        kind = QUADRILATERAL if isinstance(batch, TensorPatches) else TRIANGLE
        kinds.append(np.full(batch.count, kind, np.uint8))
    ends = np.cumsum(np.concatenate(counts))
    point_columns: list[Column] = []
    if is_rational:
        point_columns = [("RationalWeights", "Float64", 1, np.concatenate(weights))]
    groups: list[tuple[str, list[Column]]] = [
        ("Points", [("Points", "Float64", 3, np.concatenate(points))]),
        (
            "Cells",
            [
                ("connectivity", "Int64", 1, np.arange(point_count)),
                ("offsets", "Int64", 1, ends),
                ("types", "UInt8", 1, np.concatenate(kinds)),
            ],
        ),
        ('PointData RationalWeights="RationalWeights"', point_columns),
        (
            'CellData HigherOrderDegrees="HigherOrderDegrees"',
            [
                ("HigherOrderDegrees", "Float64", 3, np.concatenate(degrees)),
                ("part", "Int32", 1, patches.part_numbers),
            ],
        ),
    ]
    content = _write(groups, point_count, patches.patch_count)
    return WrittenFile(content, WritingReport(faces=patches.patch_count))


def _write(groups: list[tuple[str, list[Column]]], point_count: int, cell_count: int) -> Content:
    """The XML, and all arrays after it."""
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64">',
        "<UnstructuredGrid>",
        f'<Piece NumberOfPoints="{point_count}" NumberOfCells="{cell_count}">',
    ]
    buffers: list[bytes | memoryview] = []
    offset = 0
    for title, columns in groups:
        if not columns:
            continue
        lines.append(f"<{title}>")
        for name, kind, components, values in columns:
            lines.append(
                f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" '
                f'format="appended" offset="{offset}"/>'
            )
            stored = np.ascontiguousarray(values, dtype=_TYPES[kind])
            buffers += [
                stored.nbytes.to_bytes(8, "little"),
                stored.reshape(-1).view(np.uint8).data,
            ]
            offset += 8 + stored.nbytes
        lines.append(f"</{title.partition(' ')[0]}>")
    lines += ["</Piece>", "</UnstructuredGrid>", '<AppendedData encoding="raw">']
    head = "\n".join(lines) + "\n_"
    return pack((head.encode(), *buffers, b"\n</AppendedData>\n</VTKFile>\n"))


_TYPES = {"Float64": "<f8", "Int64": "<i8", "Int32": "<i4", "UInt8": "u1"}


def estimate_bytes(size: SurfaceSize) -> int:
    """The most bytes of the file of a surface."""
    return _bound_bytes(size.control_points, size.patches)


def _bound_bytes(points: int, cells: int) -> int:
    """The most bytes of a file."""
    return HEAD_BYTES + points * POINT_BYTES + cells * CELL_BYTES


def _find_order(batch: Patches) -> Ints:
    """The control points of a patch in the order of a cell."""
    if isinstance(batch, TensorPatches):
        return order_grid(*batch.degree)
    return order_triangle(batch.degree)


@lru_cache(64)
def order_grid(p: int, q: int) -> Ints:
    """The points i (q + 1) + j of a grid in the order of a quadrilateral."""
    along_u, along_v = range(1, p), range(1, q)
    pairs = [(0, 0), (p, 0), (p, q), (0, q)]
    pairs += [(i, 0) for i in along_u] + [(p, j) for j in along_v]
    pairs += [(i, q) for i in along_u] + [(0, j) for j in along_v]
    pairs += [(i, j) for j in along_v for i in along_u]
    i, j = np.array(pairs).T
    order: Ints = i * (q + 1) + j
    return order


@lru_cache(64)
def order_triangle(n: int) -> Ints:
    """The points of a triangle in the order of a cell: triangles inside of one another."""
    pairs: list[tuple[int, int]] = []
    first, m = 0, n  # the corner (first, first) and the degree of the triangle that is next
    while m >= 0:
        if m == 0:
            pairs.append((first, first))
            break
        pairs += [(first, first), (first + m, first), (first, first + m)]
        pairs += [(first + i, first) for i in range(1, m)]
        pairs += [(first + m - i, first + i) for i in range(1, m)]
        pairs += [(first, first + m - i) for i in range(1, m)]
        first, m = first + 1, m - 3
    j, k = np.array(pairs).T
    return find_index(n, j, k)
