"""One step of Newton's method towards the nearest point of a cell."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.queries.cell_models import UNIT
from service.engine.queries.cells import CellTree
from service.engine.queries.net_partials import net_partials

RIDGE = 2.0**-33
"""The part of second derivatives that is added to them: where a patch is a line, the distance
does not change in one direction, and Newton's method shall not go far along it."""


@dataclass(frozen=True, eq=False, slots=True)
class Place:
    """Places of n cells, seen from one point each.

    Attributes
    ----------
    place : ndarray of float64, shape (2, n)
        In the parameters of the net.
    partials : ndarray of float64, shape (6, 3, n)
        S, and its partials in the parameters of the cell.
    y : ndarray of float64, shape (3, n)
        x − S.
    gradient : ndarray of float64, shape (2, n)
        Of ½ |x − S|² in the parameters of the cell.
    distance, low, high : ndarray of float64, shape (n,)
        |x − S| as computed, and what holds it.
    """

    place: FloatArray
    partials: FloatArray
    y: FloatArray
    gradient: FloatArray
    distance: FloatArray
    low: FloatArray
    high: FloatArray

    def take(self, rows: Ints | Bools) -> "Place":
        """Some of them."""
        return Place(*(getattr(self, name)[..., rows] for name in Place.__slots__))

    @staticmethod
    def joined(places: Sequence["Place"]) -> "Place":
        """All of them, one after another."""
        return Place(
            *(
                np.concatenate([getattr(place, name) for place in places], axis=-1)
                for name in Place.__slots__
            )
        )

    def next(self, at: FloatArray, sides: FloatArray) -> FloatArray:
        """Newton's next place (2, n) in the cells, from `at`, in [−1, 1]².

        It keeps to a side of the cell on which it is where the distance falls beyond it, and to
        those where `sides` (2, n) is not 0.
        """
        _, da, db, daa, dab, dbb = self.partials
        faa = _dot(da, da) - _dot(self.y, daa)
        fab = _dot(da, db) - _dot(self.y, dab)
        fbb = _dot(db, db) - _dot(self.y, dbb)
        ridge = RIDGE * (np.abs(faa) + np.abs(fbb))
        faa, fbb = faa + ridge, fbb + ridge
        fa, fb = self.gradient
        fixed = (sides != 0) | ((at <= -1) & (self.gradient > 0))
        fixed |= (at >= 1) & (self.gradient < 0)
        determinant = faa * fbb - fab * fab
        with np.errstate(all="ignore"):
            step = np.stack([fab * fb - fbb * fa, fab * fa - faa * fb]) / determinant
            alone = np.stack([-fa / faa, -fb / fbb])
        step = np.where(fixed[::-1] | (determinant <= 0), alone, step)
        step = np.where(fixed | ~np.isfinite(step), 0.0, step)
        return np.asarray(np.clip(at + step, -1.0, 1.0))


def measure(
    cells: CellTree, net: Ints, rectangle: FloatArray, at: FloatArray, x: FloatArray
) -> Place:
    """Places `at` (2, n) in [−1, 1]² of rectangles (4, n) of nets, seen from x (3, n)."""
    low = rectangle[::2]
    half = (rectangle[1::2] - low) / 2
    place = low + half * (at + 1)
    partials = net_partials(cells.nets, net, place)
    ha, hb = half
    partials[1] *= ha
    partials[2] *= hb
    partials[3] *= ha * ha
    partials[4] *= ha * hb
    partials[5] *= hb * hb
    y = x - partials[0]
    distance = np.sqrt(_dot(y, y))
    gradient = -np.stack([_dot(y, partials[1]), _dot(y, partials[2])])
    error = cells.errors[net] + 8 * UNIT * distance
    nearest = np.maximum(distance - error, 0.0)
    return Place(place, partials, y, gradient, distance, nearest, distance + error)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
