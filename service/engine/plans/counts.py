"""Counts the vertices and faces of a mesh without computing them.

The counts depend on which sides are one edge and which are one point, but not on coordinates in
any other way. So the counts follow from the index patterns of the patches, and from the edges and
corners of the model.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from service.bases.arrays import IndexArray, Ints
from service.bases.cache import BASES
from service.engine.connectivity.connect import connect
from service.engine.connectivity.curve_patches import leave_out_curves
from service.engine.options import Faces, MeshOptions
from service.engine.plans.layout import Layout
from service.engine.plans.patterns import (
    AnyShape,
    Shape,
    TriangleShape,
    build_faces,
    build_rim,
    find_used_samples,
    merge_collapsed,
)
from service.surface.lowered import PatchModel


@dataclass(frozen=True, slots=True)
class Counts:
    """Counts of positions, triangles and quads, equal to those in the report of the mesh."""

    vertices: int
    triangles: int
    quads: int


def count_mesh(model: PatchModel, options: MeshOptions) -> Counts:
    """The exact counts that `tessellate` will report for a model at the resolution of the options.

    Counting takes little longer than finding the shared edges. If two sides of a patch are one
    edge, or a side has one division, it takes longer, because each face at a border is examined.
    """
    kind = options.faces
    connectivity = connect(model).connectivity
    if connectivity.has_thin:
        connectivity = connect(leave_out_curves(model, connectivity)).connectivity
    layout = Layout.plan(connectivity, options.resolution)
    groups = [
        _Group(shape, patches, *_count_shape(shape, kind)) for shape, patches in layout.shapes
    ]
    triangles = sum(len(group.patches) * group.triangles for group in groups)
    quads = sum(len(group.patches) * group.quads for group in groups)
    if not (layout.is_stitched or (options.weld and layout.has_shared_samples)):
        return Counts(layout.size, triangles, quads)  # each sample is a vertex
    is_complete = all(group.is_complete for group in groups)
    if is_complete and not layout.may_fold and options.weld:
        return Counts(_count_positions(layout, groups), triangles, quads)

    leaders = layout.find_leaders()
    if layout.may_fold:
        counts = [_count_proper_faces(layout, group, kind, leaders) for group in groups]
        triangles, quads = (sum(group_counts) for group_counts in zip(*counts, strict=True))
    if options.weld and is_complete:
        vertices = _count_positions(layout, groups)
    else:
        vertices = _count_used_positions(
            layout,
            groups,
            kind,
            leaders if options.weld else np.arange(layout.size, dtype=np.uint32),
        )
    return Counts(vertices, triangles, quads)


class _Group(NamedTuple):
    """Patches of one shape, and the numbers of faces of one of them.

    `is_complete` says whether each position is in a face.
    """

    shape: AnyShape
    patches: Ints
    triangles: int
    quads: int
    is_complete: bool


def _count_shape(shape: AnyShape, kind: Faces) -> tuple[int, int, bool]:
    """The last three attributes of `_Group`; faces at the border are examined one by one."""
    if isinstance(shape, TriangleShape) and not any(shape.collapsed[:3]):
        return shape.divisions**2, 0, True
    if isinstance(shape, Shape) and not shape.is_stitched and not any(shape.collapsed):
        return *_count_cell_faces(shape.resolution[0] * shape.resolution[1], kind), True

    def build() -> Ints:
        (triangles, quads), inner_cells = _build_border_faces(shape, kind)
        # The first sample of each position is its own index in `merged`. The position is missing if
        # no face has it.
        merged = merge_collapsed(shape)
        is_missing = merged == np.arange(len(merged))
        for rows in (triangles, quads):
            is_missing[merged[rows]] = False
        # The samples inside a grid are in faces of the inner cells.
        if inner_cells and isinstance(shape, Shape):
            ru, rv = shape.resolution
            is_missing[: (ru + 1) * (rv + 1)].reshape(ru + 1, rv + 1)[1:-1, 1:-1] = False
        cell_faces = _count_cell_faces(inner_cells, kind)
        return np.array(
            [len(triangles) + cell_faces[0], len(quads) + cell_faces[1], not is_missing.any()]
        )

    triangles, quads, is_complete = BASES.array(("tally", shape, kind), build).tolist()
    return triangles, quads, bool(is_complete)


def _build_border_faces(shape: AnyShape, kind: Faces) -> tuple[tuple[IndexArray, IndexArray], int]:
    """Triangles and quads at the border of a shape as local indices, and the number of other cells.

    For a triangular patch these are all faces.
    """
    if isinstance(shape, TriangleShape):
        return build_faces(shape, kind), 0
    ru, rv = shape.resolution
    return build_rim(shape, kind), max(ru - 2, 0) * max(rv - 2, 0)


def _count_cell_faces(count: int, kind: Faces) -> tuple[int, int]:
    """Triangles and quads of `count` cells."""
    return (2 * count, 0) if kind == "triangles" else (0, count)


def _count_proper_faces(
    layout: Layout, group: _Group, kind: Faces, leaders: IndexArray
) -> tuple[int, int]:
    """Numbers of triangles and quads of a group, without those that have two equal vertices.

    A quad with two equal neighbouring vertices counts as a triangle. `leaders` (N,) are as in
    `Layout.find_leaders`: they stand for the vertices.
    """
    (triangles, quads), inner_cells = _build_border_faces(group.shape, kind)
    vertices = leaders[layout.patch_samples(group.patches, group.shape)]
    cell_faces = _count_cell_faces(inner_cells * len(group.patches), kind)
    corner_vertices = vertices[:, quads]
    distinct_counts = _count_distinct(corner_vertices)
    has_equal_neighbours = (corner_vertices == np.roll(corner_vertices, -1, axis=-1)).any(axis=-1)
    halved_quads = int(((distinct_counts == 3) & has_equal_neighbours).sum())
    return (
        int((_count_distinct(vertices[:, triangles]) == 3).sum()) + halved_quads + cell_faces[0],
        int((distinct_counts == 4).sum()) + cell_faces[1],
    )


def _count_distinct(vertices: IndexArray) -> Ints:
    """The number of distinct vertices of each face: shape (n, F), from shape (n, F, corners)."""
    ordered = np.sort(vertices, axis=-1)
    distinct: Ints = (ordered[..., 1:] != ordered[..., :-1]).sum(axis=-1) + 1
    return distinct


def _count_positions(layout: Layout, groups: Sequence[_Group]) -> int:
    """The number of distinct positions: those inside patches, inside edges, and at corners."""
    inner_samples = sum(len(group.patches) * group.shape.inner for group in groups)
    samples_on_edges = int((layout.divisions[layout.connectivity.is_line] - 1).sum())
    return inner_samples + samples_on_edges + layout.connectivity.corner_count


def _count_used_positions(
    layout: Layout, groups: Sequence[_Group], kind: Faces, leaders: IndexArray
) -> int:
    """The number of distinct positions in faces; without faces, of all samples."""
    is_used = np.zeros(layout.size, dtype=bool)
    for group in groups:
        samples = layout.patch_samples(group.patches, group.shape)
        is_used[leaders[samples[:, find_used_samples(group.shape, kind)]]] = True
    return int(np.count_nonzero(is_used if is_used.any() else leaders == np.arange(layout.size)))
