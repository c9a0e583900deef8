"""Faces with any number of corners as fans of triangles, and back to faces of four corners.

A face a, b, c, d, e becomes a, b, c; a, c, d; a, d, e. Readers that take triangles alone keep their
order, so that the faces of four corners can be joined again afterwards.
"""

import numpy as np

from service.bases.arrays import Ints
from service.surface.given_mesh import NO_CORNER


def count_triangles(corners: Ints) -> int:
    """The number of triangles of faces with these numbers of corners, each at least 3."""
    return int(corners.sum()) - 2 * len(corners)


def divide_fans(corners: Ints) -> Ints:
    """The triangles (t, 3) of faces, whose corners are numbered one face after another."""
    firsts = np.cumsum(corners) - corners
    counts = corners - 2
    starts = np.cumsum(counts) - counts
    first = np.repeat(firsts, counts)
    second = first + 1 + np.arange(len(first)) - np.repeat(starts, counts)
    return np.stack([first, second, second + 1], axis=1)


def join_quads(triangles: Ints, corners: Ints) -> Ints:
    """The faces of which `divide_fans` has made triangles; those of five and more stay triangles.

    Parameters
    ----------
    triangles : ndarray of int, shape (t, 3)
    corners : ndarray of int, shape (f,)
        The number of corners of each face, at least 3.

    Returns
    -------
    ndarray of int, shape (n, 3); or (n, 4) if there are faces of four corners
        The fourth corner of a triangle is `NO_CORNER`.
    """
    is_quad = corners == 4
    if not is_quad.any():
        return triangles
    firsts = (np.cumsum(corners - 2) - (corners - 2))[is_quad]
    faces = np.full((len(triangles), 4), NO_CORNER, np.intp)
    faces[:, :3] = triangles
    faces[firsts, 3] = triangles[firsts + 1, 2]
    is_kept = np.ones(len(triangles), np.bool_)
    is_kept[firsts + 1] = False
    return faces[is_kept]


def write_rows(form: bytes, rows: Ints) -> bytes:
    """Whole numbers as lines of a text; `form` is that of one row."""
    return b"".join([form % tuple(row) for row in rows.tolist()])
