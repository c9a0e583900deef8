"""Vertices and faces of a mesh, planned once for a layout and the samples that share vertices.

If a model is smooth across its edges, all samples at one position become one vertex, and the plan
depends on the layout alone. If creases, colours or texture coordinates separate samples at one
position, the plan also depends on which samples share vertices.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import AnyArray, Bools, IndexArray, Ints
from service.bases.cache import MESH_PLANS
from service.cancellation import checkpoint
from service.engine.connectivity.incidence import hash_arrays
from service.engine.options import Faces, MeshOptions
from service.engine.plans.faces import find_mesh_borders, join_faces
from service.engine.plans.layout import Layout
from service.engine.plans.patterns import find_used_samples
from service.engine.plans.vertices import (
    Averages,
    Sharing,
    Welding,
    count_positions,
    drop_unused,
    find_shared_positions,
    number_vertices,
)


@dataclass(frozen=True, eq=False, slots=True)
class FacePlan:
    """Vertices and faces of a mesh without coordinates; all arrays are read-only.

    Attributes
    ----------
    is_vertex : ndarray of bool, shape (N,), or None
        Which samples become vertices, in the same order; None if all samples do.
    means : Averages and ndarray of uint32, shape (G,), or None
        Groups of samples that share a vertex, and the number of the vertex of each group. The
        vertex gets the mean of their normals.
    triangles : ndarray of uint32, shape (T, 3)
    quads : ndarray of uint32, shape (Q, 4)
    ends : ndarray of int, shape (2, P + 1)
        The number of triangles and of quads before each patch, in the order of the mesh; then both
        totals.
    grids, welds
        As in `Mesh`.
    position_count : int
        The number of distinct positions.
    boundary_edges, watertight
        As in `MeshReport`.
    """

    is_vertex: Bools | None
    means: tuple[Averages, IndexArray] | None
    triangles: IndexArray
    quads: IndexArray
    ends: Ints
    grids: tuple[IndexArray, ...]
    welds: IndexArray | None
    position_count: int
    boundary_edges: int
    watertight: bool

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self.arrays)

    @property
    def arrays(self) -> list[AnyArray]:
        """All arrays of the plan."""
        arrays: list[AnyArray | None] = [self.triangles, self.quads, self.ends, *self.grids]
        arrays += [self.is_vertex, self.welds]
        if self.means is not None:
            averages, vertices = self.means
            arrays += [*averages.arrays, vertices]
        return [array for array in arrays if array is not None]


def plan_faces(
    layout: Layout, options: MeshOptions, sharing: Sharing | None, sequence: Ints | None
) -> FacePlan:
    """The cached plan of a mesh.

    Parameters
    ----------
    sharing : Sharing or None
        Which samples at one position share a vertex; None if all of them do. It is not used if the
        options turn welding off.
    sequence : ndarray of int, shape (P,), or None
        The order of the patches in the mesh.
    """
    sharing_key = b"" if sharing is None else (sharing.key, sharing.is_averaged)
    order = b"" if sequence is None else hash_arrays(sequence)
    layout_key = layout.connectivity.key, layout.resolution
    key = ("faces", layout_key, options.faces, options.weld, options.normals, sharing_key, order)
    plan = MESH_PLANS.get(key, lambda: _build_plan(layout, options, sharing, sequence))
    assert isinstance(plan, FacePlan)
    return plan


def _build_plan(
    layout: Layout, options: MeshOptions, sharing: Sharing | None, sequence: Ints | None
) -> FacePlan:
    """Builds the plan without the cache."""
    welding = means = None
    if layout.is_stitched or (options.weld and layout.has_shared_samples):
        used_samples = (
            _find_used(layout, options.faces) if layout.is_stitched or layout.has_poles else None
        )
        leaders = layout.find_leaders()
        leader = leaders
        if not options.weld:
            leader = np.arange(layout.size, dtype=np.uint32)
        elif sharing is not None:
            leader = np.arange(layout.size, dtype=np.uint32)
            leader[layout.averages.members] = sharing.leaders
        welding = number_vertices(leaders, leader, used_samples)
    checkpoint()
    faces = join_faces(layout, welding, options.faces, sequence)
    if welding is not None and layout.may_fold and options.weld:
        # `join_faces` dropped the faces with two vertices at one position. Now the vertices that
        # only these faces used are dropped, and the others are renumbered.
        welding = drop_unused(welding, faces[:2])
        faces = join_faces(layout, welding, options.faces, sequence)
    checkpoint()
    if welding is not None and options.weld and options.normals:
        if sharing is None:
            means = _find_means(welding, layout.averages, leader)
        elif not sharing.is_averaged:
            means = _find_means(welding, Averages.from_leaders(leader), leader)
    triangles, quads, ends = faces
    welds = find_shared_positions(welding) if options.weld else None
    boundary_edges, watertight = find_mesh_borders(layout, options, (triangles, quads), welds)
    vertex_count, is_vertex = layout.size, None
    if welding is not None:
        vertex_count, is_vertex = len(welding.samples), np.zeros(layout.size, np.bool_)
        is_vertex[welding.samples] = True
    plan = FacePlan(
        is_vertex=is_vertex,
        means=means,
        triangles=triangles,
        quads=quads,
        ends=ends,
        grids=_build_grids(layout, welding),
        welds=welds,
        position_count=count_positions(vertex_count, welds),
        boundary_edges=boundary_edges,
        watertight=watertight,
    )
    for array in plan.arrays:
        array.flags.writeable = False
    return plan


def _find_means(
    welding: Welding, averages: Averages, leader: IndexArray
) -> tuple[Averages, IndexArray] | None:
    """Groups of samples that share a vertex, and these vertices; only vertices in faces."""
    # A leader in no face may be none of `welding.samples`.
    vertices = welding.vertex[averages.leaders].astype(np.uint32, copy=False)
    has_vertex = welding.samples[vertices] == averages.leaders
    if not has_vertex.all():
        averages = Averages.from_leaders(
            leader, np.sort(averages.members[has_vertex[averages.slot]])
        )
        vertices = welding.vertex[averages.leaders].astype(np.uint32, copy=False)
    return (averages, vertices) if len(averages.leaders) else None


def _find_used(layout: Layout, kind: Faces) -> Bools:
    """Which samples occur in faces, (N,).

    Samples of grids that stitched sides replace do not occur, and of the samples at a pole only
    some.
    """
    is_used = np.zeros(layout.size, dtype=bool)
    for shape, patches in layout.shapes:
        used_samples = find_used_samples(shape, kind)
        for run in layout.split_patches(patches, shape):
            is_used[layout.patch_samples(run, shape)[:, used_samples]] = True
    return is_used


def _build_grids(layout: Layout, welding: Welding | None) -> tuple[IndexArray, ...]:
    """The vertex at every sample of every patch; empty if any patch is stitched or triangular."""
    if layout.is_stitched or layout.is_triangle.any():
        return ()
    grids = []
    for block in layout.blocks:
        size = block.count * len(block.patches)
        rows = slice(block.base, block.base + size)
        if welding is None:
            vertex = np.arange(rows.start, rows.stop, dtype=np.uint32)
        else:
            vertex = welding.vertex[rows].astype(np.uint32, copy=False)
        grids.append(vertex.reshape(-1, block.resolution[0] + 1, block.resolution[1] + 1))
    return tuple(grids)
