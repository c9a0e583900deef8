"""Exact points of the surfaces of filled faces, and brute distances to their meshes."""

from collections.abc import Iterator

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.brep.filling.triangles import Triangles
from service.engine.vectors import NEXT
from tests.engine.brep.filled_faces import FilledFaces, build_table
from tests.engine.trims.tables import find_surface_point


def find_distance(point: FloatArray, triangles: FloatArray) -> float:
    """The distance of a point (3,) to the nearest of triangles (m, 3, 3), in extended precision."""
    corners = triangles.astype(np.longdouble)
    a, b, c = corners.swapaxes(0, 1)
    p = point.astype(np.longdouble)
    best = np.full(len(a), np.inf, np.longdouble)
    for begin, end in ((a, b), (b, c), (c, a)):
        along = end - begin
        share = ((p - begin) * along).sum(axis=1) / (along**2).sum(axis=1)
        foot = begin + np.clip(share, 0, 1)[:, np.newaxis] * along
        best = np.minimum(best, np.sqrt(((foot - p) ** 2).sum(axis=1)))
    normal = np.cross(b - a, c - a)
    sides = [
        (np.cross(end - begin, p - begin) * normal).sum(axis=1)
        for begin, end in ((a, b), (b, c), (c, a))
    ]
    inside = np.all(np.array(sides) >= 0, axis=0)
    area = np.sqrt((normal**2).sum(axis=1))
    height = np.abs(((p - a) * normal).sum(axis=1)) / np.where(area > 0, area, 1)
    return float(np.where(inside & (area > 0), height, best).min())


def sample(filled: FilledFaces, row: Ints, rng: np.random.Generator) -> Iterator[FloatArray]:
    """Exact points of the surface over a triangle (3,): its middle, and random places."""
    table, surface = build_table(), filled.corners.surface
    face = filled.corners.faces[row[:1]]
    for shares in (np.ones(3), rng.random(3), rng.random(3) ** 4):
        place = shares / shares.sum() @ filled.corners.places[row]
        u, v = surface.to_parameters(face, place[np.newaxis])[0].tolist()
        yield np.array([float(x) for x in find_surface_point(table, int(face[0]), u, v)])


def check_bounds(filled: FilledFaces, triangles: Triangles, rng: np.random.Generator) -> None:
    """No sampled point over a triangle is further from the mesh of its face than its bound."""
    corners = filled.corners
    points, faces = corners.points[triangles.corners], corners.faces[triangles.corners[0]]
    proper = (points != points[NEXT]).all(axis=0)
    for face in np.unique(faces):
        mesh = corners.positions[points[:, proper & (faces == face)].T]
        for t in (faces == face).nonzero()[0][:12]:
            for point in sample(filled, triangles.corners[:, t], rng):
                assert find_distance(point, mesh) <= triangles.bounds[t] + 1e-9
