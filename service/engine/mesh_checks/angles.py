"""The largest angle between the normals of a mesh and those of its surface, measured at points."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.mesh_checks.faults import find_flat
from service.engine.mesh_checks.reference import ReferenceMesh
from service.engine.mesh_distances.nearest import find_nearest
from service.engine.mesh_distances.tree import TriangleTree
from service.engine.vectors import NEXT, cross, length, normalize
from service.surface.given_mesh import GivenMesh

SAMPLES = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / [[3], [6], [6], [6]]
"""Barycentric coordinates of the points of a triangle at which normals are compared. If another
part of the surface passes through the triangle, it is the nearest at a few of them only."""

BATCH = 256
"""How many triangles are compared at all samples at once."""


def find_largest_angle(
    mesh: GivenMesh, reference: ReferenceMesh, tree: TriangleTree
) -> tuple[float | None, int | None]:
    """The largest angle, in radians, and the triangle with it; None if all are degenerate.

    The angle of a triangle is the least at its `SAMPLES`. There the normal of the surface is that
    of the nearest point of the reference mesh, in whose triangles normals are interpolated. It is
    compared with the normal of the triangle and, if the mesh has normals, with the mean of those at
    the corners of the triangle: the larger angle counts.
    """
    rows = np.flatnonzero(~find_flat(mesh.corners))
    if not len(rows):
        return None, None
    normals = _list_normals(mesh, rows)

    def measure(chosen: Ints, sample: FloatArray) -> FloatArray:
        corners = mesh.corners[rows[chosen]]
        nearest = find_nearest(tree, (corners * sample[:, np.newaxis]).sum(axis=1))
        at_corners = reference.normals[reference.triangles[nearest.triangle]]
        expected = (at_corners * nearest.weights[:, :, np.newaxis]).sum(axis=1)
        angles = [measure_angles(each[chosen], expected) for each in normals]
        return np.asarray(np.max(angles, axis=0))

    angles = measure(np.arange(len(rows)), SAMPLES[0])
    order = (-angles).argsort(kind="stable")
    best, triangle = -1.0, 0
    for batch in row_slices(len(order), 1, BATCH):
        chosen = order[batch]
        if angles[chosen[0]] <= best:  # the angle of a triangle is at most that at its middle
            break
        least = np.min([angles[chosen], *(measure(chosen, s) for s in SAMPLES[1:])], axis=0)
        largest = int(least.argmax())
        if least[largest] > best:
            best, triangle = float(least[largest]), int(rows[chosen[largest]])
    return best, triangle


def _list_normals(mesh: GivenMesh, rows: Ints) -> list[FloatArray]:
    """Normals of triangles: of their planes; and the means of those at their corners, if any."""
    corners = mesh.corners[rows]
    scale = np.abs(corners).max(axis=(1, 2), keepdims=True)
    sides = (corners[:, NEXT] - corners) / np.where(scale > 0, scale, 1.0)
    normals = [cross(sides[:, 0], sides[:, 1], -1)]
    if mesh.normals is not None:
        normals.append(normalize(mesh.normals, -1)[mesh.triangles[rows]].sum(axis=1))
    return normals


def measure_angles(first: FloatArray, second: FloatArray) -> FloatArray:
    """Angles (m,) between vectors (m, 3), in radians; 0 if one of them is 0.

    They are computed from the tangent of the half, because the cosine is imprecise for small ones.
    """
    first, second = normalize(first, -1), normalize(second, -1)
    angles = 2 * np.arctan2(length(first - second, -1), length(first + second, -1))
    is_known = (length(first, -1) > 0) & (length(second, -1) > 0)
    return np.where(is_known, angles, 0.0)
