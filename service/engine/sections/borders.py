"""Numbers for the lines on which borders of nets lie, and coordinates of places on these lines.

Two patches that share an edge must compute the same points of a section on this edge, bit for bit.
So each line that two nets may share has a number, and each place on a line has an integer
coordinate. Each root on a line, and each sign at a place, is computed once for all nets that meet
there.

The lines are the distinct edges of the patches (`service.engine.connectivity.connect`), and then
three lines for every patch, which are used only for triangles: the medians, from the middle of a
side to the centroid. They are the borders between the three nets of a triangle
(`service.engine.nets.query_nets`). Coordinates of lines run from 0 to `LINE`, parameters of nets
from 0 to `ONE`.

A place has a name of two numbers: the line and the coordinate; at a corner of patches, −1 and the
number of the corner; at the centroid of a triangle, `CENTROID` and the number of the patch.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.connectivity.seams import Seams
from service.engine.nets.query_nets import QueryNets
from service.surface.sides import BEGINS, ENDS

MAX_HALVINGS = 30
"""The most halvings of a net in each direction."""

ONE = 1 << MAX_HALVINGS
"""The integer that stands for the parameter 1 of a net."""

LINE = 2 * ONE
"""The coordinate of the end of a line: twice `ONE`, because nets of a triangle have half a side."""

CENTROID = -2
"""The first number in the name of a place at the centroid of a triangle."""


@dataclass(frozen=True, eq=False, slots=True)
class Borders:
    """The lines on which the borders of N nets lie.

    Attributes
    ----------
    line : ndarray of int, shape (N, 4)
        The number of the line of each side of a net (`service.surface.sides`).
    start, step : ndarray of int, shape (N, 4)
        The parameter t of a side has the coordinate start + step · t on its line.
    is_point : ndarray of bool, shape (L,)
        Whether each line is one point.
    ends : ndarray of int, shape (L, 2, 2)
        The names of the places at both ends of each line.
    """

    line: Ints
    start: Ints
    step: Ints
    is_point: Bools
    ends: Ints

    @property
    def count(self) -> int:
        """Number of lines, L."""
        return len(self.is_point)


def find_border_lines(nets: QueryNets, seams: Seams, is_triangle: Bools) -> Borders:
    """Find the lines of the nets of patches with these seams."""
    edges, patches = seams.edge_count, len(seams.edge)
    is_point = np.zeros(edges + 3 * patches, bool)
    is_point[seams.edge[seams.collapsed]] = True
    ends = np.zeros((len(is_point), 2, 2), np.int64)
    ends[:edges, :, 0] = -1
    begin, end = seams.corner[:, BEGINS], seams.corner[:, ENDS]
    ends[seams.edge, 0, 1] = np.where(seams.backward, end, begin)
    ends[seams.edge, 1, 1] = np.where(seams.backward, begin, end)
    # Medians of side k of patch m: from the middle of the edge to the centroid.
    medians = edges + 3 * np.arange(patches)[:, np.newaxis] + np.arange(3)
    ends[medians, 0, 0], ends[medians, 0, 1] = seams.edge[:, :3], ONE
    ends[medians, 1, 0], ends[medians, 1, 1] = CENTROID, np.arange(patches)[:, np.newaxis]
    # The middle of an edge that is one point has the name of this point.
    is_collapsed = seams.collapsed[:, :3]
    ends[medians[is_collapsed], 0] = ends[seams.edge[:, :3][is_collapsed], 0]

    patch = nets.patch
    line, start = seams.edge[patch], np.where(seams.backward[patch], LINE, 0)
    step = np.where(seams.backward[patch], -2, 2)
    for third in _thirds(nets, is_triangle[patch]):
        rows, sides = third.rows, third.sides
        patch_of_row = patch[rows, np.newaxis]
        line[rows] = np.where(
            third.is_inner, medians[patch_of_row, sides], seams.edge[patch_of_row, sides]
        )
        # On an outer side a net begins at an end of the patch's side and reaches its middle.
        is_reversed = third.is_reversed != seams.backward[patch_of_row, sides]
        start[rows] = np.where(third.is_inner, 0, np.where(is_reversed, LINE, 0))
        step[rows] = np.where(third.is_inner, 2, np.where(is_reversed, -1, 1))
    return Borders(line, start, step, is_point, ends)


@dataclass(frozen=True, eq=False, slots=True)
class _Third:
    """The nets at one corner of triangles.

    Attributes
    ----------
    rows : ndarray of int, shape (m,)
        Numbers of the nets.
    sides : ndarray of int, shape (4,)
        For each side of a net, the side of the triangle on which it lies, or on whose median it
        lies.
    is_inner : ndarray of bool, shape (4,)
        Whether each side of a net lies on a median.
    is_reversed : ndarray of bool, shape (4,)
        Whether each side of a net begins at the end of the side of the triangle.
    """

    rows: Ints
    sides: Ints
    is_inner: Bools
    is_reversed: Bools


_THIRDS = (
    # For each of the three nets of a triangle A, B, C: the parameters of the corner at which it
    # begins, `sides` and `is_reversed`. The nets begin at A, B and C. Their parameter a runs along
    # AB, BC and CA, their parameter b along AC, BA and CB. The sides 0, 1, 2 of a triangle are AC,
    # BC and AB.
    ((0.0, 0.0), (0, 2, 2, 0), (False, False, False, False)),
    ((1.0, 0.0), (2, 1, 1, 2), (True, False, False, False)),
    ((0.0, 1.0), (1, 0, 0, 1), (True, False, True, False)),
)


def _thirds(nets: QueryNets, is_triangle: Bools) -> list[_Third]:
    """The nets that are thirds of triangles, for each of the three corners."""
    # A triangle of high degree is one net, not three; two of the corners of this net are at C.
    is_divided = is_triangle & (nets.corners[:, 2] != nets.corners[:, 3]).any(axis=1)
    is_inner = np.array([False, True, False, True])
    thirds = []
    for corner, sides, is_reversed in _THIRDS:
        rows = np.flatnonzero(is_divided & (nets.corners[:, 0] == corner).all(axis=1))
        thirds.append(_Third(rows, np.array(sides), is_inner, np.array(is_reversed)))
    return thirds
