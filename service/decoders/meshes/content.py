"""A mesh file in the plain form that trimesh reads right, and the errors of meshes.

trimesh takes much as it comes: it lets indices below 0 count from the end, leaves out what it does
not understand, sorts faces by their number of corners, and allocates what a header asks for. So the
readers of this room write each file again, with positions, normals and triangles alone, and say how
many there are. What trimesh then finds must be as much.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Ints
from service.decoders.format import FileLimits, build_file_error
from service.errors import InvalidRequest, Issue, TooLarge, count_nouns
from service.surface.given_mesh import VERTICES_PER_TRIANGLE


@dataclass(frozen=True, eq=False, slots=True)
class PlainFile:
    """A file with one mesh of triangles.

    Attributes
    ----------
    content : bytes
    corners : ndarray of int, shape (f,)
        For each face of the original file its number of corners: a face of n corners is n − 2
        triangles of the plain file, which follow each other (`divide_fans`).
    vertices : int, optional
        The number of its vertices; None if trimesh makes a vertex for each pair of a position and a
        normal.
    """

    content: bytes
    corners: Ints
    vertices: int | None


def check_size(vertices: int, triangles: int, limits: FileLimits) -> None:
    """Refuse a mesh with too many vertices or triangles; count before allocating."""
    most = limits.max_control_points
    message, setting = "The mesh is larger than this service takes.", "SURFACE_MAX_CONTROL_POINTS"
    if triangles > most:
        got, needed = count_nouns(triangles, "triangles"), f"at most {most} ({setting})"
        raise TooLarge(Issue("too_many_triangles", message, "", got, needed))
    if vertices > VERTICES_PER_TRIANGLE * most:
        got, needed = count_nouns(vertices, "vertices"), f"at most {VERTICES_PER_TRIANGLE * most}"
        raise TooLarge(Issue("too_many_vertices", message, "", got, f"{needed} ({setting})"))


def check_corners(corners: Ints) -> None:
    """Refuse a mesh without faces, and faces without triangles."""
    if not len(corners):
        message, needed = (
            "The file has no face.",
            "a mesh with faces; lines and points are left out",
        )
        raise InvalidRequest(Issue("no_geometry", message, "", "no face", needed))
    least = int(np.min(corners))
    if least < 3:
        got, needed = count_nouns(least, "corners"), "at least 3"
        raise build_file_error("A face has too few corners.", got, needed)


def check_indices(indices: Ints, count: int) -> None:
    """Refuse corners that are not among `count` vertices, counted from 0."""
    low, high = int(indices.min()), int(indices.max())
    if low < 0 or high >= count:
        message, needed = "Faces index the vertices of their mesh.", f"0 to {count - 1}"
        got = str(low if low < 0 else high)
        raise InvalidRequest(Issue("index_out_of_range", message, "", got, needed))
