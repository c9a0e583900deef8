"""Newton's method in settled cells, with the bounds that it proves.

Proof in docs/proofs.md: "Lower bound in a cell" and "Intervals of closest points".
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.cells import models as model_rows
from service.engine.cells.tree import CellTree
from service.engine.closest.distance_bounds import Minima, least_change
from service.engine.closest.newton import SurfacePoints, measure_surface_points
from service.engine.vectors import UNIT, Items

ERROR_ROWS = slice(model_rows.TANGENT_ERROR_A, model_rows.CENTER_ERROR_B + 1)
"""The rows of the errors of A and B, and of those that follow from the error of the centre."""

MAX_STEPS = 8
"""The most steps of Newton's method in a cell; after these, the cell is halved."""

MAX_DISTANCE_TO_MINIMUM = 2.0**-40
"""Newton's method ends at this distance from the minimum, in the coordinates of the nets."""


@dataclass(frozen=True, eq=False, slots=True)
class FoundMinima(Items):
    """The bounds of n minima at which Newton's method ended.

    Attributes
    ----------
    cell : ndarray of int, shape (n,)
    low, loss : ndarray of float64, shape (n,)
        Squared lower bounds of the distances of the cells, and the `loss` of `Minima`.
    is_narrow : ndarray of bool, shape (n,)
        Whether the interval is as narrow as allowed; otherwise the cell must be halved.
    """

    cell: Ints
    low: FloatArray
    loss: FloatArray
    is_narrow: Bools


def descend(
    cells: CellTree,
    x: FloatArray,
    minima: Minima,
    find_limit: Callable[[Ints, Ints], FloatArray],
    find_width: Callable[[FloatArray], FloatArray],
) -> tuple[Bools, SurfacePoints, FoundMinima]:
    """Compute the minima of N settled pairs by Newton's method.

    Parameters
    ----------
    cells : CellTree
    x : ndarray of float64, shape (3, m)
        All points.
    minima : Minima
    find_limit : callable
        The squared distances of interest for points and cells.
    find_width : callable
        The widths at which intervals are narrow enough, for distances.

    Returns
    -------
    is_ended : ndarray of bool, shape (N,)
        Which pairs have ended: their cells are too far, or the interval is narrow.
    found, bounds
        The points of the surface at which the method ended, without those that are too far.
    """
    is_ended = np.zeros(len(minima.point), bool)
    rows, cell_parameters = np.arange(len(is_ended)), minima.start
    points, bounds = list[SurfacePoints](), list[FoundMinima]()
    for remaining in range(MAX_STEPS, 0, -1):
        point, cell = minima.point, minima.cell
        found = measure_surface_points(cells, x, point, cell, cell_parameters)
        errors = cells.models[ERROR_ROWS].take(cell, axis=1)
        gradient_error = (
            errors[:2] * found.distance + errors[2:] + 4 * UNIT * np.abs(found.gradient)
        )
        # The squared distance changes by twice the change of f = ½ |x − S|²; an error e of the
        # gradient of f changes this by at most 4 e.
        change = 2 * least_change(found.gradient, minima.convexity, cell_parameters)
        low = found.low * found.low + change - 4 * gradient_error.sum(axis=0) - minima.loss
        is_far = low > find_limit(point, cell)
        is_narrow = found.high - np.sqrt(np.maximum(low, 0.0)) <= find_width(found.high)
        if remaining > 1:
            # Near a minimum the distance is exact before the parameters: take one more step.
            is_narrow &= change >= -(MAX_DISTANCE_TO_MINIMUM**2)
        is_narrow &= ~is_far
        chosen = np.flatnonzero(is_narrow | (remaining == 1))
        points.append(found.take(chosen))
        bounds.append(FoundMinima(cell, low, minima.loss, is_narrow).take(chosen))
        ends_now = is_narrow | is_far
        is_ended[rows[ends_now]] = True
        open_rows = np.flatnonzero(~ends_now)
        if remaining == 1 or not len(open_rows):
            break
        rows, minima = rows[open_rows], minima.take(open_rows)
        found, cell_parameters = found.take(open_rows), cell_parameters.take(open_rows, axis=1)
        cell_parameters = found.next(cell_parameters, minima.sides)
    return is_ended, SurfacePoints.join(points), FoundMinima.join(bounds)
