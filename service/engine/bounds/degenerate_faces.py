"""Bounds of the distance from the mesh to parts of the surface whose triangles the mesh omits.

If two corners of a triangle are one point, the triangle has no area, and the mesh omits it. If the
line between its two points is not a side of a face of the mesh, the triangle is *missing*, and the
distance of its part to the nearest vertex bounds the distance to the mesh. Only the *rim* is
examined: the triangles with a corner on the border of a patch.

Proof in docs/proofs.md: "Missing triangles".
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases import triangle
from service.bases.arrays import AnyInts, Bools, FloatArray, IndexArray, Ints, RealArray
from service.bases.cache import BASES, MESH_PLANS
from service.cancellation import checkpoint
from service.engine.options import Faces, MeshOptions
from service.engine.plans.layout import Layout
from service.engine.plans.patterns import (
    AnyShape,
    Shape,
    TriangleShape,
    build_faces,
    merge_collapsed,
)
from service.engine.vectors import length

NOT_COLLAPSED = (False, False, False, False)

CANDIDATES = 64
"""For each missing triangle, at most this many vertices of the mesh are candidates for the nearest
vertex, besides its own corners if they are vertices of the mesh."""


def bound_missing_distances(
    layout: Layout, options: MeshOptions, positions: RealArray
) -> FloatArray:
    """Bounds (P,) of the distance that missing triangles add to the deviation of each patch.

    Bounds are 0 for patches without missing triangles. No patch has any if `layout.may_lose_faces`
    is false. `positions` (N, 3) are the samples in the precision of the file.
    """
    # Without welding, two samples are one point only on sides that are one point; the shapes of
    # patches tell which sides are. Welding may also make two corners of other triangles one point.
    may_weld_corners = layout.may_fold and options.weld
    if not (
        may_weld_corners
        or any(has_missing_triangles(shape, options.faces) for shape, _ in layout.shapes)
    ):
        return np.zeros(len(layout.base))
    layout_key = layout.connectivity.key, layout.resolution
    missing = MESH_PLANS.get(
        ("missing", layout_key, options.faces, options.weld),
        lambda: _find_missing(layout, options),
    )
    assert isinstance(missing, _Missing)
    bounds = np.zeros(len(layout.base))
    if len(missing.patches):
        distances = _bound_distances(missing.corners, missing.vertices, positions)
        np.maximum.at(bounds, missing.patches, distances)
    return bounds


@dataclass(frozen=True, eq=False, slots=True)
class _Missing:
    """The missing triangles of a mesh, which depend on its layout and options alone.

    Attributes
    ----------
    corners : ndarray of int, shape (n, 3)
        The samples at the corners of each.
    patches : ndarray of int, shape (n,)
        The patch of each.
    vertices : ndarray of int, shape (k,)
        The samples that are vertices of the mesh, ascending; none if no triangle is missing.
    """

    corners: AnyInts
    patches: AnyInts
    vertices: AnyInts

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return self.corners.nbytes + self.patches.nbytes + self.vertices.nbytes


def _find_missing(layout: Layout, options: MeshOptions) -> _Missing:
    """Finds the missing triangles among those of the rims of all patches."""
    # For each sample, one sample that stands for all samples at its point.
    point = layout.find_leaders() if options.weld else _find_pinched_points(layout)
    rims = [
        (
            *build_rim_triangles(shape, point[layout.patch_samples(patches, shape)], options.faces),
            np.repeat(patches, len(_build_rim(shape))),
        )
        for shape, patches in layout.shapes
    ]
    # Arrays of all triangles of the rims; `patch` is the patch of each.
    corners, written, halves, patch = (np.concatenate(parts) for parts in zip(*rims, strict=True))
    missing = find_missing_triangles(corners, written, halves).nonzero()[0]
    vertices = np.unique(corners[written]) if len(missing) else corners[:0, 0]
    return _Missing(corners[missing], patch[missing], vertices)


def has_missing_triangles(shape: AnyShape, kind: Faces) -> bool:
    """Whether a patch of this shape has missing triangles because some of its sides are points."""

    def build() -> Bools:
        point = merge_collapsed(shape)[np.newaxis]
        return find_missing_triangles(*build_rim_triangles(shape, point, kind))

    return bool(BASES.array(("loses", shape, kind), build).any())


def _find_pinched_points(layout: Layout) -> Ints:
    """For each sample itself; on a side that is one point, the same sample for the whole side."""
    point = np.arange(layout.size)
    samples, corner = layout.find_collapsed_samples()
    stand_in = np.zeros(layout.connectivity.corner_count, dtype=np.intp)
    stand_in[layout.connectivity.corner] = layout.corner_samples()
    point[samples] = stand_in[corner]
    return point


def build_rim_triangles(
    shape: AnyShape, point: AnyInts, kind: Faces
) -> tuple[AnyInts, Bools, Bools]:
    """The rims of n patches of one shape.

    `point` (n, samples) has the number of the point of each sample of each patch.

    Returns
    -------
    corners : ndarray of int, shape (m, 3)
        Points at the corners of triangles.
    written : ndarray of bool, shape (m,)
        Whether a triangle is in the mesh, by itself or as half of a quad.
    halves : ndarray of bool, shape (m,)
        Whether it is half of a quad in the mesh: its last two corners are the ends of the diagonal.
    """
    if kind == "quads" and isinstance(shape, Shape):
        # Quads are written without diagonals, so the shape's diagonals do not matter.
        shape = replace(shape, is_turned=(False, False))
    rim = _build_rim(shape)
    corners = point[:, rim[:, :3]].reshape(-1, 3)
    a, b, c = corners.T
    written = (a != b) & (b != c) & (a != c)
    halves = np.zeros(len(written), dtype=bool)
    if kind == "quads":
        # The halves of a quad follow one another: (00, 10, 01) and (10, 11, 01), where uv is the
        # corner with these u and v. They are folded onto each other if 00 and 11 are one point.
        first = np.flatnonzero(np.tile(rim[:, 3] > 0, len(point)))[::2]
        is_folded = a[first] == b[first + 1]
        written[first] &= ~is_folded
        written[first + 1] &= ~is_folded
        halves[first] = halves[first + 1] = written[first] & written[first + 1]
        # (11, 01, 10): the diagonal last
        corners[first + 1] = np.roll(corners[first + 1], -1, axis=1)
    return corners, written, halves


def find_missing_triangles(corners: AnyInts, written: Bools, halves: Bools) -> Bools:
    """Which triangles (m,) are not written and do not lie on a side of a written triangle."""
    checkpoint()
    missing = ~written
    if not missing.any():
        return missing
    present, omitted = corners[written], np.sort(corners[missing], axis=1)
    # The diagonal of a quad is not a side; a single point counts as a side.
    points = np.repeat(present.reshape(-1, 1), 2, axis=1)
    sides = np.concatenate([present[:, :2], present[:, ::2], present[~halves[written], 1:], points])
    # Most sides have other ends than any omitted triangle.
    is_end = np.zeros(int(corners.max()) + 1, dtype=bool)
    is_end[omitted] = True
    sides = sides[is_end[sides].all(axis=1)]
    # A triangle without area is a line or a point; its ends are the first and the last of its
    # sorted corners. A pair of points is compared as one number, pair @ digits.
    digits = np.array([len(is_end), 1])
    missing[~written] = ~np.isin(
        np.matmul(omitted[:, ::2], digits), np.matmul(np.sort(sides, axis=1), digits)
    )
    # A quad whose halves are folded onto each other is omitted, but its halves have an area.
    missing[~written] |= (np.diff(omitted, axis=1) > 0).all(axis=1)
    return missing


def _bound_distances(corners: AnyInts, vertices: AnyInts, positions: RealArray) -> FloatArray:
    """Bounds (m,) of the distance from any point of a triangle (m, 3) to the nearest vertex."""
    if not len(vertices):
        return np.full(len(corners), np.inf)
    candidates = vertices[:: -(-len(vertices) // CANDIDATES)]
    targets = np.concatenate([corners, np.tile(candidates, (len(corners), 1))], axis=1)
    points = positions[corners].astype(np.float64)
    nearest = np.full(len(corners), np.inf)
    for target in targets.T:
        difference = points - positions[target].astype(np.float64)[:, np.newaxis]
        # Of the corners of each triangle, the one farthest from the target.
        far = length(difference, -1).max(axis=1)
        np.minimum(nearest, np.where(np.isin(target, vertices), far, np.inf), out=nearest)
    return nearest


def _build_rim(shape: AnyShape) -> IndexArray:
    """Triangles with a corner on the border of the patch, and whether they are half a quad: (m, 4).

    Triangles without area are included; a quad has both of its halves here, or neither.
    """
    if any(shape.collapsed):
        return _build_rim(replace(shape, collapsed=NOT_COLLAPSED))

    def build() -> IndexArray:
        corners = build_faces(shape, "triangles")[0]
        # The number of triangles that are half a quad; these come first.
        halves = 2 * len(build_faces(shape, "quads")[1])
        if isinstance(shape, TriangleShape):
            border = np.zeros(triangle.count_points(shape.divisions), dtype=bool)
            border[triangle.side_rows(shape.divisions)] = True
        else:
            grid = np.arange((shape.resolution[0] + 1) * (shape.resolution[1] + 1))
            inside = grid.reshape(-1, shape.resolution[1] + 1)[1:-1, 1:-1]
            border = np.ones(len(merge_collapsed(shape)), dtype=bool)
            border[inside] = False
        rim: Bools = np.asarray(border[corners].any(axis=1))
        rim[:halves] = np.repeat(rim[:halves].reshape(-1, 2).any(axis=1), 2)
        half = np.arange(len(corners), dtype=np.uint32) < halves
        return np.column_stack([corners, half]).astype(np.uint32)[rim]

    return BASES.array(("rim", shape), build)
