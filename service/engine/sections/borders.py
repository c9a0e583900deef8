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


THIRDS = (
    # For each of the three nets of a triangle A, B, C: the parameters of the corner at which it
    # begins; for each side of the net, the side of the triangle on which it lies or on whose median
    # it lies; and whether it begins at the end of the side of the triangle. The nets begin at A, B
    # and C. Their parameter a runs along AB, BC and CA, their parameter b along AC, BA and CB. The
    # sides 0, 1, 2 of a triangle are AC, BC and AB.
    ((0.0, 0.0), np.array([0, 2, 2, 0]), np.array([False, False, False, False])),
    ((1.0, 0.0), np.array([2, 1, 1, 2]), np.array([True, False, False, False])),
    ((0.0, 1.0), np.array([1, 0, 0, 1]), np.array([True, False, True, False])),
)

ON_MEDIAN = np.array([False, True, False, True])
"""Whether each side of a third of a triangle lies on a median."""


@dataclass(frozen=True, eq=False, slots=True)
class BorderLines:
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


def find_border_lines(nets: QueryNets, seams: Seams, is_triangle: Bools) -> BorderLines:
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
    # A triangle of high degree is one net, not three; two of the corners of this net are at C.
    is_third = is_triangle[patch] & (nets.corners[:, 2] != nets.corners[:, 3]).any(axis=1)
    for corner, sides, is_reversed in THIRDS:
        rows = np.flatnonzero(is_third & (nets.corners[:, 0] == corner).all(axis=1))
        patch_of_row = patch[rows, np.newaxis]
        edge, backward = seams.edge[patch_of_row, sides], seams.backward[patch_of_row, sides]
        line[rows] = np.where(ON_MEDIAN, medians[patch_of_row, sides], edge)
        # On an outer side a net begins at an end of the patch's side and reaches its middle.
        runs_back = ~ON_MEDIAN & (is_reversed != backward)
        start[rows] = np.where(runs_back, LINE, 0)
        step[rows] = np.where(ON_MEDIAN, 2, np.where(runs_back, -1, 1))
    return BorderLines(line, start, step, is_point, ends)
