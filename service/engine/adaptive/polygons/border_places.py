"""The border as places of the faces, sorted so that leaves can look up their corners in it."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.adaptive.borders.border import Border
from service.engine.bounds.faces import SPAN, Faces


@dataclass(frozen=True, eq=False, slots=True)
class BorderPlaces:
    """The border as places of the faces, which the boundaries of all rounds share.

    Attributes
    ----------
    faces : Faces
    border : Border
    side, u, v : ndarray of int, shape (M,)
        Side (4 f + s) and place of each entry of the border.
    base : ndarray of int, shape (4F,)
        Offset added to places along each side, so that places of all sides differ.
    key : ndarray of int, shape (M,)
        Places of the entries along their sides, plus the offset; rising.
    low : ndarray of int, shape (2, F)
        Offsets added to u and to v, so that lines of all faces differ.
    pole : ndarray of bool, shape (B,)
        Vertices that are whole sides.
    """

    faces: Faces
    border: Border
    side: Ints
    u: Ints
    v: Ints
    base: Ints
    key: Ints
    low: Ints
    pole: Bools

    @classmethod
    def of(cls, faces: Faces, border: Border) -> "BorderPlaces":
        """The places of the border of faces."""
        size = (faces.spans * SPAN).T
        side = np.arange(len(border.start) - 1).repeat(border.start[1:] - border.start[:-1])
        far, s, at = size[:, side // 4], side % 4, border.at
        u = np.where(s < 2, np.where(s == 1, far[0], 0), at)
        v = np.where(s < 2, at, np.where(s == 3, far[1], 0))
        length = size[[1, 1, 0, 0]].T.ravel() + 1
        base = length.cumsum() - length
        pole = np.zeros(len(border.points), dtype=bool)
        pole[border.vertex[border.start[:-1][border.collapsed.ravel()]]] = True
        low = (size + 1).cumsum(axis=1) - size - 1
        return cls(faces, border, side, u, v, base, base[side] + at, low, pole)
