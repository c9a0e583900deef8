"""One step of Newton's method towards the point of a cell that is nearest to a given point."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.cells.tree import CellTree
from service.engine.nets.partials import net_partials
from service.engine.vectors import UNIT, Items, dot, length

RIDGE = 2.0**-33
"""The second partials by aa and bb are increased by this share of the sum of their sizes. If a
patch is a line, the distance does not change in one direction; the increase then keeps the steps of
Newton's method small."""


@dataclass(frozen=True, eq=False, slots=True)
class SurfacePoints(Items):
    """Points of the surface, one in each of n cells, with their distances from n points x.

    Attributes
    ----------
    point, net : ndarray of int, shape (n,)
        The number of each x, and the net of its cell.
    parameters : ndarray of float64, shape (2, n)
        The parameters (u, v) of the net, in [0, 1].
    position : ndarray of float64, shape (3, n)
        The points S of the surface.
    gradient : ndarray of float64, shape (2, n)
        The first partials of f = ½ |x − S|² by the parameters a and b of the cell.
    second_partials : ndarray of float64, shape (3, n)
        The second partials of f by aa, ab and bb.
    distance, low, high : ndarray of float64, shape (n,)
        |x − S| as computed, and bounds of the exact distance.
    """

    point: Ints
    net: Ints
    parameters: FloatArray
    position: FloatArray
    gradient: FloatArray
    second_partials: FloatArray
    distance: FloatArray
    low: FloatArray
    high: FloatArray

    def replace_where(self, by: "SurfacePoints", where: Bools) -> "SurfacePoints":
        """These points; where `where` (n,) is true, the points of `by` replace them."""
        names = SurfacePoints.__slots__
        return SurfacePoints(*(np.where(where, getattr(by, n), getattr(self, n)) for n in names))

    def next(self, cell_parameters: FloatArray, sides_of_minimum: FloatArray) -> FloatArray:
        """The next parameters (a, b) of Newton's method in the cells: (2, n), in [−1, 1]².

        `cell_parameters` (2, n) are the present ones. `sides_of_minimum` (2, n) is −1 or 1, for a
        and for b, if it is proved that the minimum lies on this side of the cell, else 0. A point
        moves neither in a direction with −1 or 1, nor beyond a side of the cell.
        """
        (fa, fb), (faa, fab, fbb) = self.gradient, self.second_partials
        ridge = RIDGE * (np.abs(faa) + np.abs(fbb))
        faa, fbb = faa + ridge, fbb + ridge
        is_fixed = (sides_of_minimum != 0) | ((cell_parameters <= -1) & (self.gradient > 0))
        is_fixed |= (cell_parameters >= 1) & (self.gradient < 0)
        determinant = faa * fbb - fab * fab
        with np.errstate(all="ignore"):
            step = np.stack([fab * fb - fbb * fa, fab * fa - faa * fb]) / determinant
            step_along_axis = np.stack([-fa / faa, -fb / fbb])
        # If b is fixed, a moves alone, and the reverse: row 0 of `is_fixed` is a, and row 1 is b.
        # Both move alone, too, if the determinant is not positive: the step may then lead uphill.
        step = np.where(is_fixed[::-1] | (determinant <= 0), step_along_axis, step)
        step = np.where(is_fixed | ~np.isfinite(step), 0.0, step)
        return np.asarray(np.clip(cell_parameters + step, -1.0, 1.0))


def measure_surface_points(
    cells: CellTree, x: FloatArray, point: Ints, cell: Ints, cell_parameters: FloatArray
) -> SurfacePoints:
    """Evaluate points of the surface in cells, with their distances from points x.

    Parameters
    ----------
    cells : CellTree
    x : ndarray of float64, shape (3, m)
        All points.
    point, cell : ndarray of int, shape (n,)
        The pairs.
    cell_parameters : ndarray of float64, shape (2, n)
        The parameters (a, b) in the cells, in [−1, 1]².
    """
    net, rectangle = cells.net.take(cell), cells.rectangle.take(cell, axis=1)
    low, high = rectangle[::2], rectangle[1::2]  # (u₀, v₀) and (u₁, v₁)
    half = (high - low) / 2
    parameters = low + half * (cell_parameters + 1)
    position, du, dv, duu, duv, dvv = net_partials(cells.nets, net, parameters)
    y = x.take(point, axis=1) - position
    distance = length(y)
    # The partials by a and b are those by u and v, times half the sides of the cell.
    ha, hb = half
    gradient = -half * [dot(y, du), dot(y, dv)]
    second_partials = np.stack(
        [
            (dot(du, du) - dot(y, duu)) * (ha * ha),
            (dot(du, dv) - dot(y, duv)) * (ha * hb),
            (dot(dv, dv) - dot(y, dvv)) * (hb * hb),
        ]
    )
    # The rounding errors of the position and of the distance.
    error = cells.errors[net] + 8 * UNIT * distance
    interval = np.maximum(distance - error, 0.0), distance + error
    return SurfacePoints(
        point, net, parameters, position, gradient, second_partials, distance, *interval
    )
