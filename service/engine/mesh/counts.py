"""Counts the vertices and faces of a mesh without computing them.

The counts depend on which borders are one edge and which are one point, and not on other
coordinates. So the index patterns of patches, and the edges and corners of the model, determine
them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from service.bases.arrays import IndexArray, Ints
from service.bases.cache import PLANS
from service.engine.mesh.connect import connect
from service.engine.mesh.curve_patches import leave_out_curves
from service.engine.mesh.layout import Layout
from service.engine.mesh.patterns import (
    AnyShape,
    Shape,
    TriangleShape,
    build_faces,
    build_rim,
    find_used_samples,
    merge_collapsed,
)
from service.engine.options import Faces, MeshOptions
from service.surface.lowered import PatchModel


@dataclass(frozen=True, slots=True)
class Counts:
    """Counts of positions, triangles and quads, equal to those in the report of the mesh."""

    vertices: int
    triangles: int
    quads: int


def count_mesh(model: PatchModel, options: MeshOptions) -> Counts:
    """The exact counts that `tessellate` will report for a model at its resolution.

    This takes little more time than finding the shared edges, unless two sides of a patch are one
    edge, or a side has one division: then every face at a border is examined.
    """
    kind = options.faces
    connectivity = connect(model).connectivity
    if connectivity.has_thin:
        connectivity = connect(leave_out_curves(model, connectivity)).connectivity
    layout = Layout.plan(connectivity, options.resolution)
    groups = [_Group(shape, each, _count_shape(shape, kind)) for shape, each in layout.shapes]
    triangles = sum(len(group.patches) * group.tally.triangles for group in groups)
    quads = sum(len(group.patches) * group.tally.quads for group in groups)
    if not (layout.is_framed or (options.weld and layout.has_shared_samples)):
        return Counts(layout.size, triangles, quads)
    complete = all(group.tally.complete for group in groups)
    if complete and not layout.may_fold and options.weld:
        return Counts(_count_positions(layout, groups), triangles, quads)

    place = layout.leaders
    if layout.may_fold:
        counts = [_count_proper(layout, group, kind, place) for group in groups]
        triangles, quads = (sum(column) for column in zip(*counts, strict=True))
    if options.weld and complete:
        vertices = _count_positions(layout, groups)
    else:
        vertices = _count_used_positions(
            layout, groups, kind, place if options.weld else np.arange(layout.size)
        )
    return Counts(vertices, triangles, quads)


class _Tally(NamedTuple):
    """Numbers of faces of one shape; `complete` says whether each of its positions is in a face."""

    triangles: int
    quads: int
    complete: bool


class _Group(NamedTuple):
    """Patches of one shape."""

    shape: AnyShape
    patches: Ints
    tally: _Tally


def _count_shape(shape: AnyShape, kind: Faces) -> _Tally:
    """The tally of a shape; its faces at the border are examined one by one."""
    if isinstance(shape, TriangleShape) and not any(shape.collapsed[:3]):
        return _Tally(shape.divisions**2, 0, complete=True)
    if isinstance(shape, Shape) and not shape.is_framed and not any(shape.collapsed):
        return _Tally(
            *_count_cell_faces(shape.resolution[0] * shape.resolution[1], kind), complete=True
        )

    def build() -> Ints:
        (triangles, quads), inside = _build_border_faces(shape, kind)
        merged = merge_collapsed(shape)
        missing = merged == np.arange(len(merged))
        for rows in (triangles, quads):
            missing[merged[rows]] = False
        if inside and isinstance(shape, Shape):
            ru, rv = shape.resolution
            missing[: (ru + 1) * (rv + 1)].reshape(ru + 1, rv + 1)[1:-1, 1:-1] = False
        more = _count_cell_faces(inside, kind)
        return np.array([len(triangles) + more[0], len(quads) + more[1], not missing.any()])

    triangles, quads, complete = PLANS.array(("tally", shape, kind), build).tolist()
    return _Tally(triangles, quads, complete=bool(complete))


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


def _count_proper(layout: Layout, group: _Group, kind: Faces, place: Ints) -> tuple[int, int]:
    """Numbers of triangles and quads of a group, without those that have two equal vertices.

    A quad with two equal neighbouring vertices counts as a triangle.
    """
    (triangles, quads), inside = _build_border_faces(group.shape, kind)
    vertices = place[layout.patch_samples(group.patches, group.shape)]
    more = _count_cell_faces(inside * len(group.patches), kind)
    around = vertices[:, quads]
    different = _count_distinct(around)
    sided = (around == np.roll(around, -1, axis=-1)).any(axis=-1)
    halved = int(((different == 3) & sided).sum())
    return (
        int((_count_distinct(vertices[:, triangles]) == 3).sum()) + halved + more[0],
        int((different == 4).sum()) + more[1],
    )


def _count_distinct(vertices: Ints) -> Ints:
    """The number of distinct vertices of each face: shape (n, F), from shape (n, F, corners)."""
    ordered = np.sort(vertices, axis=-1)
    distinct: Ints = (ordered[..., 1:] != ordered[..., :-1]).sum(axis=-1) + 1
    return distinct


def _count_positions(layout: Layout, groups: Sequence[_Group]) -> int:
    """The number of distinct positions: those inside patches, those inside edges, and corners."""
    inside = sum(len(group.patches) * group.shape.inner for group in groups)
    lines = np.zeros(len(layout.divisions), dtype=bool)
    lines[layout.connectivity.edge[~layout.connectivity.collapsed]] = True
    return inside + int((layout.divisions[lines] - 1).sum()) + layout.connectivity.corners


def _count_used_positions(
    layout: Layout, groups: Sequence[_Group], kind: Faces, place: Ints
) -> int:
    """The number of distinct positions in faces; without faces, of all samples."""
    is_shown = np.zeros(layout.size, dtype=bool)
    for shape, patches, _ in groups:
        samples = layout.patch_samples(patches, shape)
        is_shown[place[samples[:, find_used_samples(shape, kind)]]] = True
    return int(np.count_nonzero(is_shown if is_shown.any() else place == np.arange(len(place))))
