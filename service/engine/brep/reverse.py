"""Bounds of the distance from triangles of the mesh to the surface over their places.

A triangle is compared with the surface at the same barycentric coordinates, piece by piece
(`service.engine.bounds.clip.find_images`). Pieces of triangles of few units of places have no exact
coordinates. Such a triangle is within its height of any of its edges, and an edge is compared with
the surface over its segment of places, where coordinates are one-dimensional.

Proof in docs/proofs.md: "The distance from the mesh to trimmed faces".
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.bounds.certificate import PieceMeasure
from service.engine.bounds.chords import measure_distances
from service.engine.bounds.clip import Parts, PatchPieces, clip_parts, find_images
from service.engine.bounds.goal import Goal
from service.engine.brep.corners import FaceCorners
from service.engine.trims.clip import clip_segments
from service.engine.vectors import NEXT

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
        pieces = clip_parts(corners.surface, faces, parts.corners)
        images = find_images(pieces, parts.corners)
        found = _measure(corners, parts, pieces, images, tolerance)
        thin = (~np.isfinite(found)).nonzero()[0]
        if len(thin):
            found[thin] = _bound_by_edges(corners, parts.take(thin), tolerance)
        bounds[rows] = found
    return bounds


def _measure(
    corners: FaceCorners,
    parts: Parts,
    pieces: PatchPieces,
    images: FloatArray,
    tolerance: float,
) -> FloatArray:
    """The largest bound of the pieces of each part (m,); infinite where one is not a number."""
    goal, bounds = Goal(tolerance, two_sided=True), np.zeros((3, len(pieces.part)))
    nets = corners.surface.surfaces.nets
    measure = PieceMeasure(nets, parts, pieces, corners.positions, goal, images)
    measure.bound_pieces(bounds, np.arange(len(pieces.part)))
    largest = np.zeros(len(parts.face))
    np.maximum.at(largest, pieces.part, np.where(bounds[2] >= 0, bounds[2], np.inf))
    return largest


def _bound_by_edges(corners: FaceCorners, parts: Parts, tolerance: float) -> FloatArray:
    """The least of three bounds (m,), each by an edge and the distance of the third corner."""
    count = len(parts.face)
    begins, ends = parts.corners, parts.corners[NEXT]
    segments = np.stack([begins, ends]).transpose(0, 2, 1, 3).reshape(2, 2, -1)
    faces = np.tile(parts.face, 3)
    reference = np.stack([parts.reference, parts.reference[NEXT], parts.reference[NEXT]])
    edges = Parts(
        faces,
        segments[[0, 1, 1]],
        reference.reshape(3, -1),
        np.full((3, 3 * count), -1),
        np.ones(3 * count, bool),
    )
    pieces = clip_segments(corners.surface, faces, segments)
    bounds = _measure(corners, edges, pieces, _find_shares(pieces, segments), tolerance)
    vertices = corners.positions[parts.reference]
    chords = np.stack([vertices, vertices[NEXT]], axis=2).reshape(-1, 2, 3)
    third = vertices[NEXT[NEXT]].reshape(-1, 1, 3)
    heights = measure_distances(third, chords)[:, 0]
    least: FloatArray = (bounds + heights).reshape(3, -1).min(axis=0)
    return least


def _find_shares(pieces: PatchPieces, segments: Ints) -> FloatArray:
    """Barycentric coordinates (3, 3, M) of the corners of pieces of segments (2, 2, m).

    The coordinate along a segment is the share of its longer side, so pieces follow each other.
    """
    begin, along = segments[0], segments[1] - segments[0]
    axis = np.abs(along).argmax(axis=0)[pieces.part]
    column = np.arange(len(pieces.part))
    run = along[axis, pieces.part]
    offset = pieces.corners[:, axis, column] - begin[axis, pieces.part]
    share = np.clip(offset / np.where(run == 0, 1, run), 0.0, 1.0)
    return np.stack([1.0 - share, share, np.zeros(share.shape)], axis=1)
