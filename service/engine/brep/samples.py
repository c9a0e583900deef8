"""From the triangles of a brep to samples: stored positions, flat triangles, parameters of patches.

A corner on a knot line inside a face belongs to the patches on both sides of the line. If the
surface has a crease there, it has two normals at this corner, so triangles on different sides get
separate samples; they become one vertex later if their normals agree.

**Flat triangles**, of which two corners have equal positions in the file, are left out, if a
triangle of the mesh with their segment stays: the two corners become one vertex in all faces, so
the mesh stays closed where it was closed.

Proof in docs/proofs.md: "Omitted flat triangles".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, IndexArray, Ints, RealArray
from service.engine.adaptive.samples import PatchPlaces, find_triangles_beside
from service.engine.brep.brep_triangulation import BrepTriangulation
from service.engine.clustering import DisjointSets
from service.engine.trims.places import Places


@dataclass(frozen=True, eq=False, slots=True)
class FaceSamples:
    """N samples: places of faces, as parameters of patches.

    Attributes
    ----------
    samples : PatchPlaces
        `vertex` has the point of each sample.
    faces : ndarray of int, shape (N,)
    places : ndarray of int, shape (N, 2)
    """

    samples: PatchPlaces
    faces: Ints
    places: Ints


def merge_stored_points(triangles: Ints, stored: RealArray) -> tuple[Ints, Bools]:
    """The point that stands for each point, and which triangles stay.

    Points that are joined by an edge of a triangle, and are stored as equal positions, become one.

    Parameters
    ----------
    triangles : ndarray of int, shape (T, 3)
        Points.
    stored : ndarray, shape (N, 3)
        The positions of all points as the file stores them.

    Returns
    -------
    leader : ndarray of int, shape (N,)
    stays : ndarray of bool, shape (T,)
        All triangles stay, and no points are merged, if the segment of a flat triangle is in no
        triangle that stays.
    """
    leader, stays = np.arange(len(stored)), np.ones(len(triangles), bool)
    following = triangles[:, [1, 2, 0]]
    is_equal = np.logical_and.reduce([x.take(triangles) == x.take(following) for x in stored.T])
    if not is_equal.any():
        return leader, stays
    pairs = np.stack([triangles[is_equal], following[is_equal]], axis=1)
    ends, number = np.unique(pairs, return_inverse=True)
    sets = DisjointSets(len(ends))
    for first, second in number.reshape(-1, 2).tolist():
        sets.unite(first, second)
    merged = leader.copy()
    merged[ends] = ends[sets.list_roots()]
    corners = merged[triangles]
    is_flat = (corners == corners[:, [1, 2, 0]]).any(axis=1)
    # Any triangle of the mesh will do, so all triangles count as those of one face.
    beside = find_triangles_beside(np.zeros(len(corners), np.intp), corners, is_flat)
    return (leader, stays) if (beside < 0).any() else (merged, ~is_flat)


def find_face_samples(
    places: Places, triangulation: BrepTriangulation, chosen: Ints
) -> tuple[FaceSamples, IndexArray]:
    """The samples that triangles use, and the corners (T, 3) of triangles as sample numbers.

    `chosen` (T, 3) are triangles of the triangulation, as corners.
    """
    faces, at = triangulation.corner_faces, triangulation.places
    # For each axis, the span after and the span before each corner; they differ at knots.
    spans: list[tuple[Ints, Ints]] = []
    for axis, x in enumerate(at.T):
        after, _ = places.find_spans(faces, axis, x, x)
        _, before = places.find_spans(faces, axis, np.maximum(x - 1, 0), x)
        spans.append((after, before))
    # For each corner of a triangle: 1 if the triangle is before a knot of u through it, 2 if of v.
    sides = np.zeros(chosen.shape, dtype=np.intp)
    for axis, (after, before) in enumerate(spans):
        is_on_knot = before < after
        if is_on_knot.any():
            # A triangle with a corner on a knot is judged by the mean of its three corners.
            corners = at[chosen, axis]
            is_before = corners.sum(axis=1, keepdims=True) < 3 * corners
            sides |= (is_on_knot[chosen] & is_before).astype(np.intp) << axis
    key = chosen * 4 + sides
    is_used = np.zeros(4 * len(faces), dtype=bool)
    is_used[key] = True
    number = np.cumsum(is_used, dtype=np.uint32) - np.uint32(1)
    row, side = np.divmod(is_used.nonzero()[0], 4)
    face = faces[row]
    patch: Ints = places.faces.first[face]
    parameters: list[FloatArray] = []
    for axis, (after, before) in enumerate(spans):
        span: Ints = np.where(side >> axis & 1, before[row], after[row])
        begin, end = places.knots_at(face, axis, span)
        parameters.append((at[row, axis] - begin) / (end - begin))
        patch = patch + (span * places.faces.stride[face] if axis == 0 else span)
    samples = PatchPlaces(patch, parameters[0], parameters[1], triangulation.points[row])
    return FaceSamples(samples, face, at[row]), number[key]
