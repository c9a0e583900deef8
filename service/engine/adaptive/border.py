"""The vertices on the sides of the faces: decided by the edges alone."""

from dataclasses import dataclass

from service.bases.arrays import Bools, FloatArray, Ints


@dataclass(frozen=True, eq=False, slots=True)
class Border:
    """Where every side of every face is divided; sides as in `service.surface.sides`.

    Side s of face f has the vertices `vertex[start[4f+s] : start[4f+s+1]]` at the places
    `at[…]` along it, rising, in units of the face, both ends among them. A side that is one point
    has two places, its ends, and the same vertex at both.

    Attributes
    ----------
    start : ndarray of int, shape (4F+1,)
    at, vertex : ndarray of int, shape (M,)
    points : ndarray of float64, shape (B, 3)
        The vertices, in model coordinates.
    collapsed : ndarray of bool, shape (F, 4)
        Sides that are one point.
    """

    start: Ints
    at: Ints
    vertex: Ints
    points: FloatArray
    collapsed: Bools
