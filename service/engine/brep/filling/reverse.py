"""Bounds of the distance from triangles of the mesh to the surface over their places.

A triangle is compared with the surface at the same barycentric coordinates, piece by piece
(`service.engine.bounds.clip.find_images`). This bound is large where the surface is parametrised
unevenly, and there is none for triangles of few units of places. Then each edge is compared with
the surface over its segment: the triangle is within its height of any of its edges.

Proof in docs/proofs.md: "The distance from the mesh to trimmed faces".
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import find_begins, row_slices
from service.engine.bounds.certificate import PieceMeasure
from service.engine.bounds.chords import measure_distances
from service.engine.bounds.clip import Parts, PatchPieces, clip_parts, find_images
from service.engine.bounds.goal import Goal
from service.engine.brep.borders.border import Border
from service.engine.brep.filling.corners import FaceCorners
from service.engine.trims.clip import clip_segments
from service.engine.trims.places import Places
from service.engine.vectors import NEXT, length

SHARES = (0.125, 0.25, 0.5, 0.75, 0.875)
"""Where on a side the surface is compared with the chord."""

BLOCK = 1 << 14
"""The most triangles that are measured in one step; it limits memory."""


def bound_reverse(corners: FaceCorners, triangles: Ints, tolerance: float) -> FloatArray:
    """Bounds (m,) of the distances of points of triangles (3, m) from the surface."""
    bounds = np.zeros(triangles.shape[1])
    for rows in row_slices(len(bounds), 1, BLOCK):
        own = triangles[:, rows]
        faces, places, points = corners.faces[own[0]], corners.places[own], corners.points[own]
        parts = Parts(
            faces,
            np.ascontiguousarray(places.swapaxes(1, 2)),
            points,
            np.full(points.shape, -1),
            np.ones(len(faces), bool),
        )
        found = _bound_images(corners, parts, tolerance)
        weak = (~(found <= 2 * tolerance)).nonzero()[0]
        if len(weak):
            by_edges = _bound_by_edges(corners, parts.take(weak), own[:, weak], tolerance)
            found[weak] = np.fmin(found[weak], by_edges)
        bounds[rows] = found
    return bounds


def find_uneven_sides(
    surface: Places, border: Border, positions: FloatArray, tolerance: float
) -> Ints:
    """Sides of curved faces over which the surface runs along the chord unevenly, by samples.

    Triangles at such a side would be further than the tolerance from their own places.
    """
    is_curved = ~surface.surfaces.is_planar[border.faces]
    rows: Ints = (is_curved & (border.begin_vertices != border.end_vertices)).nonzero()[0]
    begins, ends = border.begins[rows], border.ends[rows]
    first, last = (positions[v[rows]] for v in (border.begin_vertices, border.end_vertices))
    furthest = np.zeros(len(rows))
    for share in SHARES:
        points = surface.evaluate(border.faces[rows], begins + share * (ends - begins))
        apart = length(points - first - share * (last - first), -1)
        furthest = np.maximum(furthest, apart)
    uneven: Ints = rows[furthest > tolerance]
    return uneven


def _bound_images(corners: FaceCorners, parts: Parts, tolerance: float) -> FloatArray:
    """Bounds (m,) of the distances of points of triangles from their places on the surface.

    NaN where pieces have no coordinates.
    """
    pieces = clip_parts(corners.surface, parts.face, parts.corners)
    goal, images = Goal(tolerance, two_sided=True), find_images(pieces, parts.corners)
    bounds: FloatArray = _measure(corners, goal, parts, pieces, images)[1]
    return bounds


def _bound_by_edges(corners: FaceCorners, parts: Parts, own: Ints, tolerance: float) -> FloatArray:
    """The least of three bounds (m,), each by an edge and the distance of the third corner.

    The surface over a segment is a curve that ends near the ends of the edge. If it is within d of
    the edge, and its ends within r, then each point of the edge is within max(d, 2 r) of it.
    """
    count = len(parts.face)
    begins, ends = parts.corners, parts.corners[NEXT]
    segments = np.array([begins, ends]).transpose(0, 2, 1, 3).reshape(2, 2, -1)
    faces = np.tile(parts.face, 3)
    reference = np.array([parts.reference, parts.reference[NEXT], parts.reference[NEXT]])
    edges = Parts(
        faces,
        segments[[0, 1, 1]],
        reference.reshape(3, -1),
        np.full((3, 3 * count), -1),
        np.zeros(3 * count, bool),
    )
    pieces = clip_segments(corners.surface, faces, segments)
    bounds = _measure(corners, Goal(tolerance), edges, pieces, None)[0].reshape(3, -1)
    apart = 2.0 * np.maximum(corners.residuals[own], corners.residuals[own[NEXT]])
    vertices = corners.positions[parts.reference]
    chords = np.stack([vertices, vertices[NEXT]], axis=2).reshape(-1, 2, 3)
    third = vertices[NEXT[NEXT]].reshape(-1, 1, 3)
    heights = measure_distances(third, chords).reshape(3, -1)
    least: FloatArray = (np.maximum(bounds, apart) + heights).min(axis=0)
    return least


def _measure(
    corners: FaceCorners,
    goal: Goal,
    parts: Parts,
    pieces: PatchPieces,
    images: FloatArray | None,
) -> FloatArray:
    """The largest bounds (2, m) of the pieces of each part: from the surface, and from the mesh."""
    bounds = np.zeros((3, len(pieces.part)))
    nets = corners.surface.surfaces.nets
    measure = PieceMeasure(nets, parts, pieces, corners.positions, goal, images)
    measure.bound_pieces(bounds, np.arange(len(pieces.part)))
    return np.stack([find_maxima(bounds[k], pieces.part, len(parts.face)) for k in (0, 2)])


def find_maxima(values: FloatArray, owners: Ints, count: int) -> FloatArray:
    """The largest value of each of `count` owners, in ascending order; 0 where there is none."""
    maxima = np.zeros(count)
    begins = find_begins(owners)
    if len(begins):
        maxima[owners[begins]] = np.maximum.reduceat(values, begins)
    return maxima
