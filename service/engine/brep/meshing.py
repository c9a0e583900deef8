"""Triangles of a whole brep, by tolerance: no crack between its faces, and a bound for each.

1. Edges are sampled once, in space (`sampling`). Both faces of an edge take these very points.
2. Loops become polygons of places (`border`), near enough to the surface (`border_measure`), and
   without crossings (`settling`).
3. Curved faces get points inside (`inner_points`), poles samples (`poles`).
4. Polygons are triangulated (`triangulation`).
5. Triangles are measured and refined (`refine`).

Proofs in docs/proofs.md: "The polygon of a trimmed face", "No crack between trimmed faces",
"The distance from the mesh to trimmed faces".
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, find_begins
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.goal import Goal, check_goal, find_least_tolerance
from service.engine.brep.border_sampling import sample_borders, settle_borders
from service.engine.brep.borders.border import Border
from service.engine.brep.borders.border_measure import bound_overhangs
from service.engine.brep.borders.border_vertices import BorderVertices
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.borders.settling import take_faces
from service.engine.brep.brep_triangulation import BrepTriangulation
from service.engine.brep.filling.corners import FaceCorners
from service.engine.brep.filling.inner_points import (
    LeafPoints,
    find_leaf_points,
    find_points_inside,
)
from service.engine.brep.filling.measure import TriangleMeasure
from service.engine.brep.filling.refine import Refinement
from service.engine.brep.filling.scales import find_scales
from service.engine.brep.filling.triangles import Triangles
from service.engine.brep.filling.triangulation import FaceTriangulations
from service.engine.brep.preparation.input_checks import skip_faces, word_loop_faults
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.places import SIZE
from service.engine.trims.slack import bound_slack
from service.engine.vectors import NEXT

FINEST = 2.0**-28
"""The least tolerance, as a share of the diagonal: rounding of places moves surfaces by about this
much."""

SLACK = 0.1
"""Slack up to this share of the tolerance is subtracted from what triangles may take."""


def triangulate_brep(prepared: PreparedBrep, goal: Goal, limits: MeshLimits) -> BrepTriangulation:
    """The triangles of all faces of a brep.

    Parameters
    ----------
    prepared : PreparedBrep
    goal : Goal
        Model units, without a view.
    limits : MeshLimits
        Of triangles and of work.

    Raises
    ------
    TooLarge
        `too_many_triangles`, `too_costly`.
    InvalidRequest
        `tolerance_too_small`.
    Cancelled
    """
    check_goal(goal, _find_least_tolerance(prepared), 0.0)
    samples, border = sample_borders(prepared, goal, limits)
    boxes = _find_boxes(border, len(prepared.surfaces))
    leaves = _find_leaves(prepared, border, boxes, goal, limits)
    samples, border, faults = settle_borders(prepared, samples, border, leaves, goal, limits=limits)
    is_valid = np.ones(len(prepared.surfaces), bool)
    is_valid[faults.faces] = False
    corners, triangulations = _fill(prepared, samples, border, is_valid, (leaves, boxes))
    slack = bound_slack(
        prepared.places,
        prepared.pcurves,
        prepared.coedge_faces,
        prepared.coedge_loops,
        prepared.coedge_reversed,
    )
    aims = goal.tolerance - np.where(slack < SLACK * goal.tolerance, slack, 0.0)
    beside = _bound_beside(prepared, samples, border, goal)
    measure = TriangleMeasure(corners, aims, beside, goal, limits)
    refinement = Refinement(measure, triangulations)
    triangles = refinement.run()
    owners = corners.faces[triangles.corners[0]]
    bounds = np.fmax(border.segment_bounds, border.sliver_bounds)
    face_bounds = _find_maxima(len(slack), (border.faces, bounds), (owners, triangles.bounds))
    mesh_bounds = _find_maxima(len(slack), (owners, triangles.mesh_bounds)) + beside
    proved = np.where(is_valid, slack, np.inf)
    return replace(
        _build(prepared, samples, corners, triangles),
        face_bounds=face_bounds + proved,
        mesh_bounds=mesh_bounds + proved if goal.two_sided else None,
        rounds=refinement.rounds,
        skipped_faces=skip_faces(word_loop_faults(prepared, faults)),
    )


def _find_least_tolerance(prepared: PreparedBrep) -> float:
    """The least tolerance for which a mesh is attempted.

    It is that of the patches that faces touch, and at least `FINEST` diagonals.
    """
    faces, nets = prepared.places.faces, prepared.surfaces.nets
    face, number = expand_runs(faces.spans.prod(axis=0))
    row, column = np.divmod(number, faces.spans[1, face])
    used = np.zeros(len(nets.sizes), bool)
    used[faces.first[face] + row * faces.stride[face] + column] = True
    return max(find_least_tolerance(nets, used=used), FINEST * prepared.diagonal)


def _find_maxima(count: int, *values: tuple[Ints, FloatArray]) -> FloatArray:
    """The largest value of each of `count` faces; 0 without one, infinite if one is not known."""
    maxima = np.zeros(count)
    for faces, known in values:
        np.maximum.at(maxima, faces, np.where(np.isnan(known), np.inf, known))
    return maxima


def _fill(
    prepared: PreparedBrep,
    samples: EdgeSamples,
    border: Border,
    is_valid: Bools,
    inner: tuple[LeafPoints, tuple[Ints, Ints]],
) -> tuple[FaceCorners, FaceTriangulations]:
    """The triangulations of valid faces, with points inside.

    `inner` has the corners of leaves, and the boxes of polygons.
    """
    leaves, boxes = inner
    scales = find_scales(prepared.places, *boxes, leaves.cells)
    polygons = take_faces(border, is_valid[border.faces].nonzero()[0])
    vertices = BorderVertices.of(polygons, len(prepared.surfaces))
    triangulations = FaceTriangulations(vertices, scales)
    corners = FaceCorners.of(prepared.places, vertices, samples.positions, scales)
    inside = leaves.take(find_points_inside(leaves, border, boxes) & is_valid[leaves.faces])
    triangulations.insert(inside.faces, inside.places)
    corners.add(inside.faces, inside.places)
    return corners, triangulations


def _find_boxes(border: Border, count: int) -> tuple[Ints, Ints]:
    """The least and the greatest places (F, 2) of the polygons of faces."""
    low, high = np.zeros((count, 2), np.intp), np.full((count, 2), SIZE)
    first = find_begins(border.faces)
    if len(first):
        faces = border.faces[first]
        low[faces] = np.minimum.reduceat(border.begins, first)
        high[faces] = np.maximum.reduceat(border.begins, first)
    return low, high


def _find_leaves(
    prepared: PreparedBrep,
    border: Border,
    boxes: tuple[Ints, Ints],
    goal: Goal,
    limits: MeshLimits,
) -> LeafPoints:
    """The corners of the leaves of curved faces that have loops."""
    has_loops = np.zeros(len(prepared.surfaces), bool)
    has_loops[border.faces] = True
    faces = (has_loops & ~prepared.surfaces.is_planar).nonzero()[0]
    return find_leaf_points(prepared.places, faces, boxes, goal, limits)


def _bound_beside(
    prepared: PreparedBrep, samples: EdgeSamples, border: Border, goal: Goal
) -> FloatArray:
    """How much further (F,) the mesh may be from a face and its edges than from its surface.

    0 if the goal is not two-sided.

    Where a polygon reaches beyond its loop, the surface is near the chord, and this near the edge.
    """
    bounds = np.zeros(len(prepared.surfaces))
    if not goal.two_sided:
        return bounds
    overhangs = bound_overhangs(prepared, samples, border, goal)
    beyond = overhangs + samples.bounds[border.samples]
    np.maximum.at(bounds, border.faces, np.where(overhangs > 0, beyond, 0.0))
    return bounds


def _build(
    prepared: PreparedBrep,
    samples: EdgeSamples,
    corners: FaceCorners,
    triangles: Triangles,
) -> BrepTriangulation:
    """Triangles with three points, oriented as their faces; the bounds of faces are unknown."""
    points = corners.points[triangles.corners]
    proper = np.all(points != points[NEXT], axis=0)
    chosen = triangles.corners[:, proper].T
    faces = corners.faces[chosen[:, 0]]
    backward = prepared.is_reversed[faces]
    chosen[backward] = chosen[backward, ::-1]
    edge_bounds = np.zeros(len(prepared.edge_vertices))
    np.maximum.at(edge_bounds, samples.edges, samples.bounds)
    return BrepTriangulation(
        positions=corners.positions,
        triangles=np.ascontiguousarray(chosen),
        faces=faces,
        points=corners.points,
        corner_faces=corners.faces,
        places=corners.places,
        face_bounds=np.full(len(prepared.surfaces), np.inf),
        edge_bounds=edge_bounds,
        mesh_bounds=None,
        edge_starts=samples.offsets,
        edge_points=samples.vertices,
        rounds=0,
    )
