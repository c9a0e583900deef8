"""The report on the mesh of a brep: its bounds, and the edges and faces that need a look."""

from dataclasses import replace
from math import isfinite

import numpy as np

from service.bases.arrays import Ints
from service.engine.bounds.goal import Goal
from service.engine.brep.brep_triangulation import BrepTriangulation
from service.engine.brep.prepared import PreparedBrep
from service.engine.clustering import find_components
from service.engine.mesh.brep_report import BrepReport
from service.engine.mesh.mesh import MeshReport
from service.engine.trims.spline_shapes import measure_polygons

NOT_FINITE = "The part is too thin for this tolerance."
"""The reason for which the second bound is not finite: a triangle of the mesh is as near to another
face as to its own."""


def list_bounds(triangulation: BrepTriangulation, faces: Ints, error: float) -> list[float | None]:
    """The bound of each face, plus `error`; None without triangles, or if nothing was proved.

    `faces` (T,) are the faces of the triangles of the mesh.
    """
    counts = np.bincount(faces, minlength=len(triangulation.face_bounds))
    bounds: list[float] = (triangulation.face_bounds + error).tolist()
    return [
        bound if count and isfinite(bound) else None
        for bound, count in zip(bounds, counts.tolist(), strict=True)
    ]


def build_report(
    prepared: PreparedBrep,
    triangulation: BrepTriangulation,
    report: MeshReport,
    goal: Goal,
    *,
    faces: Ints,
    unpaired: Ints,
    error: float,
) -> MeshReport:
    """The report on a mesh with the facts of its brep.

    Parameters
    ----------
    prepared : PreparedBrep
    triangulation : BrepTriangulation
    report : MeshReport
        Without bounds, and without the facts of breps.
    goal : Goal
    faces : ndarray of int, shape (T,)
        The faces of all triangles in the file.
    unpaired : ndarray of int, shape (k, 2)
        The ends of edges at which triangles form no pairs.
    error : float
        Bound of the distance by which storing moved a vertex.
    """
    skipped_faces = prepared.skipped_faces + triangulation.skipped_faces
    skipped = [face.face for face in skipped_faces]
    counts = np.bincount(faces, minlength=prepared.model.face_count)
    degenerate = int(np.count_nonzero(counts == 0)) - len(skipped)
    bound, mesh_bound, reason = triangulation.bound + error, None, None
    if not are_borders_in_mesh(prepared, triangulation, skipped):
        bound = np.inf
    if triangulation.mesh_bounds is not None:
        mesh_bound = float(triangulation.mesh_bounds[counts > 0].max(initial=0.0)) + error
        if not isfinite(mesh_bound):
            mesh_bound, reason = None, NOT_FINITE
    collapsed, longest = measure_collapsed_chains(prepared, triangulation)
    non_manifold, double = count_unpaired(prepared, triangulation, unpaired)
    return replace(
        report,
        deviation_bound=bound if isfinite(bound) and len(faces) else None,
        mesh_deviation_bound=mesh_bound,
        brep=BrepReport(
            reached=bound <= goal.tolerance,
            gap_bound=float(prepared.gaps.max(initial=prepared.left_out_gap)),
            pcurves_replaced=prepared.pcurves_replaced,
            complete=not skipped and not degenerate,
            non_manifold_edges=non_manifold,
            double_edges=double,
            degenerate_faces=degenerate,
            collapsed_edges=collapsed,
            longest_chain=longest,
            skipped_faces=tuple(sorted(skipped_faces, key=lambda each: each.face)),
            unbounded_reason=reason,
        ),
    )


def are_borders_in_mesh(
    prepared: PreparedBrep, triangulation: BrepTriangulation, skipped: list[int]
) -> bool:
    """Whether all edges of faces without triangles, but those that are skipped, are in the mesh.

    The bound of such a face is that to the polylines of its edges, which says something about the
    mesh only if a face with triangles has these edges, too.
    """
    has_triangles = np.zeros(len(triangulation.face_bounds), bool)
    has_triangles[triangulation.faces] = True
    is_missing = ~has_triangles
    is_missing[skipped] = False
    if not is_missing.any():
        return True
    is_present = np.zeros(len(prepared.edge_vertices), bool)
    is_present[prepared.coedge_edges[has_triangles[prepared.coedge_faces]]] = True
    is_used = np.zeros(len(triangulation.positions), bool)
    is_used[triangulation.points[triangulation.triangles]] = True
    edges, points = _list_points(triangulation)
    is_present[edges] |= is_used[points]
    return bool(is_present[prepared.coedge_edges[is_missing[prepared.coedge_faces]]].all())


def _list_points(triangulation: BrepTriangulation) -> tuple[Ints, Ints]:
    """The edges that are one point, and these points."""
    starts, points = triangulation.edge_starts, triangulation.edge_points
    sampled = np.flatnonzero(np.diff(starts) > 0)
    if not len(sampled):
        return sampled, sampled
    first = points[starts[sampled]]
    is_point = np.logical_and.reduceat(
        points == np.repeat(first, np.diff(starts)[sampled]), starts[sampled]
    )
    return sampled[is_point], first[is_point]


def count_unpaired(
    prepared: PreparedBrep, triangulation: BrepTriangulation, unpaired: Ints
) -> tuple[int, int]:
    """The number of edges that are not manifold, and of other pairs of points with such an edge.

    `unpaired` (k, 2) are the ends of the edges of the mesh at which triangles form no pairs
    (`separate_fans`). An edge of the brep is not manifold if it has more than two coedges in one
    shell, and one of its pieces is among them.
    """
    if not len(unpaired):
        return 0, 0
    shells = prepared.model.face_shells
    uses, counts = np.unique(
        np.array([prepared.coedge_edges, shells[prepared.coedge_faces]]), axis=1, return_counts=True
    )
    is_crowded = np.zeros(len(prepared.edge_vertices), bool)
    is_crowded[uses[0, counts > 2]] = True
    starts, points = triangulation.edge_starts, triangulation.edge_points
    edges = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    begin = np.flatnonzero(is_crowded[edges[:-1]] & (edges[:-1] == edges[1:]))
    ends = np.sort(np.stack([points[begin], points[begin + 1]], axis=1), axis=1)
    size = len(triangulation.positions)
    keys, pieces = unpaired[:, 0] * size + unpaired[:, 1], ends[:, 0] * size + ends[:, 1]
    non_manifold = np.unique(edges[begin[np.isin(pieces, keys)]])
    return len(non_manifold), len(np.setdiff1d(keys, pieces))


def measure_collapsed_chains(
    prepared: PreparedBrep, triangulation: BrepTriangulation
) -> tuple[int, float]:
    """The number of edges that became one vertex, and the greatest length of a chain of them.

    A chain is all such edges that are connected at vertices; its length is that of their control
    polygons together.
    """
    edges, _ = _list_points(triangulation)
    collapsed = edges[prepared.edge_curves[edges] >= 0]
    if not len(collapsed):
        return 0, 0.0
    lengths = measure_polygons(prepared.curves)[prepared.edge_curves[collapsed]]
    first, second = prepared.edge_vertices[collapsed].T
    roots = find_components(len(prepared.vertices), first, second)[first]
    return len(collapsed), float(np.bincount(roots, lengths).max())
