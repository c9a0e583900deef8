"""The nets of a part for sections, and the lines on which their borders lie.

Within a face, spans that meet at a knot share the line between them. Nets of different faces share
no line, and a closed surface is not joined to itself: there, sections are joined at edges.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.nets.query_nets import QueryNets
from service.engine.parts.part import Part
from service.engine.sections.borders import BorderLines
from service.engine.trims.trimmed_nets import NetTrims
from service.surface.sides import BEGINS, ENDS


@dataclass(frozen=True, eq=False)
class FaceNets:
    """The N nets of the faces and patches of a part.

    Attributes
    ----------
    nets : QueryNets
    face : ndarray of int, shape (N,)
        The number in the request of the face or patch of each net.
    low, high : ndarray of float64, shape (N, 2)
        The parameters of the surface of the face at the corners (0, 0) and (1, 1) of each net.
    is_face : ndarray of bool, shape (N,)
        Whether a net is of a face; if not, it is a patch without trims.
    trims : NetTrims
        Of these nets, and of others after them.
    """

    nets: QueryNets
    face: Ints
    low: FloatArray
    high: FloatArray
    is_face: Bools
    trims: NetTrims

    @classmethod
    def of(cls, part: Part) -> "FaceNets":
        """The nets of a part."""
        count, trims = part.surface_nets, part.trims
        return cls(
            part.faces,
            part.rows.patch[:count],
            trims.low[:count],
            trims.high[:count],
            trims.face[:count] >= 0,
            trims,
        )

    def to_face(self, net: Ints, parameters: FloatArray) -> FloatArray:
        """Parameters (m, 2) of faces, from parameters (2, m) of nets (m,)."""
        low, high, share = self.low[net], self.high[net], parameters.T
        of_face: FloatArray = np.where(share == 1.0, high, low + share * (high - low))
        return of_face

    def find_lines(self) -> BorderLines:
        """The lines on which borders of nets lie."""
        count = len(self.face)
        ends = np.stack([self.low, self.high])  # (2 ends, N, 2 axes)
        rank = np.empty((2, count, 2), np.int64)
        for axis in range(2):
            rank[:, :, axis] = np.unique(ends[:, :, axis], return_inverse=True)[1].reshape(2, -1)
        u, v = rank[:, :, 0], rank[:, :, 1]
        # A patch without trims is a face of its own.
        face = np.where(
            self.is_face, self.face, int(self.face.max(initial=0)) + 1 + np.arange(count)
        )
        zero, one = np.zeros((2, count), np.int64)
        one = one + 1
        # A line has a face, the axis that is constant along it, and the ranks of its begin.
        names = [(zero, u[0], v[0]), (zero, u[1], v[0]), (one, u[0], v[0]), (one, u[0], v[1])]
        line = _number_rows(np.stack([np.stack([face, *name], axis=1) for name in names], axis=1))
        corner = _number_rows(
            np.stack([np.stack([face, u[k // 2], v[k % 2]], axis=1) for k in range(4)], axis=1)
        )
        line_ends = np.full((int(line.max(initial=-1)) + 1, 2, 2), -1, np.int64)
        line_ends[line, 0, 1], line_ends[line, 1, 1] = corner[:, BEGINS], corner[:, ENDS]
        start = np.zeros_like(line)
        is_point = np.zeros(len(line_ends), bool)
        return BorderLines(line, start, start + 2, is_point, line_ends)


def _number_rows(rows: Ints) -> Ints:
    """A number for each row of (n, k, d), (n, k): equal rows have equal numbers."""
    shape, rows = rows.shape[:2], rows.reshape(-1, rows.shape[2])
    order = np.lexsort(rows.T[::-1])
    is_new = np.ones(len(rows), bool)
    is_new[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    number = np.empty(len(rows), np.intp)
    number[order] = np.cumsum(is_new) - 1
    return number.reshape(shape)
