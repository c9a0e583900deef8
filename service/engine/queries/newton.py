"""One step of Newton's method towards the nearest point of a cell."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.queries.cell_models import UNIT
from service.engine.queries.cells import CellTree
from service.engine.queries.column_vectors import dot
from service.engine.queries.net_partials import net_partials

RIDGE = 2.0**-33
"""The second derivatives are increased by this share. If a patch is a line, the distance does not
change in one direction; the increase then keeps the steps of Newton's method small."""


@dataclass(frozen=True, eq=False, slots=True)
class Place:
    """Places in n cells, with their distances from n points x.

    Attributes
    ----------
    place : ndarray of float64, shape (2, n)
        The parameters in the net.
    position : ndarray of float64, shape (3, n)
        The points S of the surface.
    gradient, forms : ndarray of float64, shapes (2, n) and (3, n)
        First and second partials of ½ |x − S|² in the parameters of the cell.
    distance, low, high : ndarray of float64, shape (n,)
        |x − S| as computed, and bounds of the exact distance.
    """

    place: FloatArray
    position: FloatArray
    gradient: FloatArray
    forms: FloatArray
    distance: FloatArray
    low: FloatArray
    high: FloatArray

    def take(self, rows: Ints) -> "Place":
        """The places with these rows."""
        return Place(*(getattr(self, name).take(rows, axis=-1) for name in Place.__slots__))

    def replace_where(self, by: "Place", where: Bools) -> "Place":
        """The places, with those of `by` where `where` (n,) is true."""
        names = Place.__slots__
        return Place(*(np.where(where, getattr(by, n), getattr(self, n)) for n in names))

    @staticmethod
    def join(places: Sequence["Place"]) -> "Place":
        """All places, one after another."""
        return Place(
            *(
                np.concatenate([getattr(place, name) for place in places], axis=-1)
                for name in Place.__slots__
            )
        )

    def next(self, at: FloatArray, sides: FloatArray) -> FloatArray:
        """The next places (2, n) of Newton's method in the cells, in [−1, 1]².

        `at` (2, n) are the present places. A place stays on a side of the cell if the distance
        decreases beyond this side, or if `sides` (2, n) is not 0 in this direction.
        """
        (fa, fb), (faa, fab, fbb) = self.gradient, self.forms
        ridge = RIDGE * (np.abs(faa) + np.abs(fbb))
        faa, fbb = faa + ridge, fbb + ridge
        fixed = (sides != 0) | ((at <= -1) & (self.gradient > 0))
        fixed |= (at >= 1) & (self.gradient < 0)
        determinant = faa * fbb - fab * fab
        with np.errstate(all="ignore"):
            step = np.stack([fab * fb - fbb * fa, fab * fa - faa * fb]) / determinant
            alone = np.stack([-fa / faa, -fb / fbb])
        step = np.where(fixed[::-1] | (determinant <= 0), alone, step)
        step = np.where(fixed | ~np.isfinite(step), 0.0, step)
        return np.asarray(np.clip(at + step, -1.0, 1.0))


def measure_places(
    cells: CellTree, net: Ints, rectangle: FloatArray, at: FloatArray, x: FloatArray
) -> Place:
    """Evaluate places in cells, with their distances from points.

    Parameters
    ----------
    cells : CellTree
    net : ndarray of int, shape (n,)
    rectangle : ndarray of float64, shape (4, n)
        The rectangles of the cells in their nets.
    at : ndarray of float64, shape (2, n)
        The places in the cells, in [−1, 1]².
    x : ndarray of float64, shape (3, n)
        The points.
    """
    low = rectangle[::2]
    half = (rectangle[1::2] - low) / 2
    place = low + half * (at + 1)
    position, da, db, daa, dab, dbb = net_partials(cells.nets, net, place)
    y = x - position
    distance = np.sqrt(dot(y, y))
    ha, hb = half
    gradient = -half * [dot(y, da), dot(y, db)]
    forms = np.stack(
        [
            (dot(da, da) - dot(y, daa)) * (ha * ha),
            (dot(da, db) - dot(y, dab)) * (ha * hb),
            (dot(db, db) - dot(y, dbb)) * (hb * hb),
        ]
    )
    error = cells.errors[net] + 8 * UNIT * distance
    nearest = np.maximum(distance - error, 0.0)
    return Place(place, position, gradient, forms, distance, nearest, distance + error)
