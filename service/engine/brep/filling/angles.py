"""Angles between normals at the ends of edges: an aim, which is not proved.

The normal at a corner is that of the surface a little inside of the triangle. So both sides of a
crease have their own normal, and there is one at poles.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.borders.border import Border
from service.engine.brep.filling.corners import FaceCorners
from service.engine.trims.places import Places
from service.engine.vectors import NEXT, cross, dot, length

INWARD = 2.0**-12
"""The normal at a corner is taken at this share of the way to the middle."""


def find_turning_edges(corners: FaceCorners, triangles: Ints, angle: float) -> Bools:
    """Edges (3, T) of triangles inside curved faces whose normals turn by more than an angle."""
    turning = np.zeros(triangles.shape, bool)
    faces = corners.faces[triangles[0]]
    curved = (~corners.surface.surfaces.is_planar[faces]).nonzero()[0]
    if not len(curved):
        return turning
    own = triangles.take(curved, axis=1)
    normals = _evaluate_normals(corners.surface, faces[curved], corners.places[own])
    free = ~corners.find_fixed(own)
    turning[:, curved] = free & (_measure_angles(normals, normals[NEXT]) > angle)
    return turning


def find_turning_sides(surface: Places, border: Border, angle: float, most: float) -> Ints:
    """The sides of polygons of curved faces whose normals turn by more than an angle.

    The normals at both ends and in the middle are compared. Sides whose normals turn by more than
    `most` are left out.
    """
    is_curved = ~surface.surfaces.is_planar[border.faces]
    rows: Ints = (is_curved & (border.begin_vertices != border.end_vertices)).nonzero()[0]
    if not len(rows):
        return rows
    begins, ends = border.begins[rows], border.ends[rows]
    places = np.array([begins, (begins + ends) // 2, ends])
    normals = _evaluate_normals(surface, border.faces[rows], places)
    turns = _measure_angles(normals, normals[NEXT]).max(axis=0)
    turning: Ints = rows[(turns > angle) & (turns <= most)]
    return turning


def _evaluate_normals(surface: Places, faces: Ints, places: Ints) -> FloatArray:
    """Normals (k, m, 3), of any length, at the k corners (k, m, 2) of figures on faces (m,)."""
    middles = places.mean(axis=0)
    inner = places + INWARD * (middles - places)
    flat = surface.evaluate_partials(np.tile(faces, len(places)), inner.reshape(-1, 2))
    normals: FloatArray = cross(flat[1], flat[2], -1).reshape(*places.shape[:2], 3)
    return normals


def _measure_angles(one: FloatArray, other: FloatArray) -> FloatArray:
    """Angles (…,) between vectors (…, 3); 0 where one has no length."""
    angles: FloatArray = np.arctan2(length(cross(one, other, -1), -1), dot(one, other, -1))
    return angles
