"""Decides in which cells the section is a graph, by the signs of Bézier coefficients alone.

Theorem. Let f be the polynomial of `heights` over a rectangle of parameters.

1. If all coefficients of f are positive, or all are negative, the section does not meet the
   rectangle. If no coefficient is negative, or none is positive, and not all are zero, the section
   meets at most the border of the rectangle: whole sides whose coefficients are all zero, and
   corners whose coefficient is zero.
2. If no coefficient of ∂f/∂v is negative and not all are zero, f(u, ·) increases for every u in the
   open interval. So the section has at most one point at each such u: it is the graph of v over u,
   without loops, and its pieces begin and end on the border. In the order of u, the points where it
   crosses the border are in turn beginnings and ends of pieces. The same holds if f(u, ·)
   decreases, and with u and v exchanged.

Proof. A Bézier polynomial is a mean of its coefficients. In the open rectangle all weights of this
mean are positive. At an inner point of a side, the weights of the coefficients of this side are
positive. This proves part 1, and that ∂f/∂v > 0 at every inner point. So f(u, ·) increases, and it
has a zero if and only if f(u, v₀) ≤ 0 ≤ f(u, v₁). The pieces of the graph are the connected parts
of the set of all such u. Each part is an interval; at its ends one of the two values changes its
sign, or the interval of u ends. ∎
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.sections.cells import ABOVE, BELOW, OVER_U, OVER_V, SINGULAR, OpenCells
from service.engine.sections.roots import roots
from service.surface.sides import take_side


def classify(nets: FloatArray) -> tuple[Ints, FloatArray, Bools]:
    """Classify cells by the theorem.

    Parameters
    ----------
    nets : ndarray of float64, shape (n, p+1, q+1)
        Coefficients of f.

    Returns
    -------
    kind : ndarray of int, shape (n,)
        By part 1 `ABOVE` or `BELOW`; by part 2 `OVER_U` or `OVER_V`, and if both are possible, the
        one with the larger slope of f in the other parameter; else `SINGULAR`.
    sense : ndarray of float64, shape (n,)
        As in `Cells`.
    is_monotone : ndarray of bool, shape (n,)
        Whether the section is a graph over u and also over v.
    """
    count = len(nets)
    kind, sense = np.full(count, SINGULAR), np.zeros(count)
    steepest, graphs = np.zeros(count), np.zeros(count, np.intp)
    for axis, graph_kind in ((1, OVER_V), (2, OVER_U)):
        steps = np.diff(nets, axis=axis).reshape(count, -1)
        low, high = steps.min(axis=1), steps.max(axis=1)
        does_rise, does_fall = (low >= 0) & (high > 0), (high <= 0) & (low < 0)
        slope = np.abs(steps.mean(axis=1)) * (nets.shape[axis] - 1)
        is_better = (does_rise | does_fall) & (slope >= steepest)
        graphs += does_rise | does_fall
        steepest[is_better] = slope[is_better]
        kind[is_better] = graph_kind
        # In the plane of parameters, f is larger to the left of the direction (f_v, −f_u).
        sense[is_better] = np.where(does_rise == (graph_kind == OVER_U), 1.0, -1.0)[is_better]
    coefficients = nets.reshape(count, -1)
    for graph_kind, is_of_kind in (
        (ABOVE, coefficients.min(axis=1) >= 0),
        (BELOW, coefficients.max(axis=1) <= 0),
    ):
        kind[is_of_kind], sense[is_of_kind] = graph_kind, 0.0
    return kind, sense, graphs == 2


def find_border_points(
    nets: FloatArray, floor: FloatArray, rectangle: FloatArray, axis: int
) -> tuple[Ints, FloatArray]:
    """Find the points where graphs cross the borders of their cells.

    Parameters
    ----------
    nets : ndarray of float64, shape (n, p+1, q+1)
        Coefficients of f.
    floor : ndarray of float64, shape (n,)
        As in `roots`.
    rectangle : ndarray of float64, shape (4, n)
        u₀, u₁, v₀, v₁ of the cells.
    axis : int
        0 for graphs over u, 1 over v.

    Returns
    -------
    cell : ndarray of int, shape (k,)
        The cell of each point, ascending. Each cell occurs an even number of times.
    parameters : ndarray of float64, shape (k, 2)
        The parameters (u, v) of each point; for each cell, they ascend along the axis.
    """
    cells, points = [], []
    for side in range(4):
        row, t = roots(take_side(nets, side), floor)
        across, along = side // 2, 1 - side // 2
        parameters = np.empty((len(row), 2))
        low, high = rectangle[2 * along, row], rectangle[2 * along + 1, row]
        parameters[:, across], parameters[:, along] = rectangle[side, row], low + t * (high - low)
        cells.append(row)
        points.append(parameters)
    checkpoint()
    cell, parameters = np.concatenate(cells), np.concatenate(points)
    order = np.lexsort((parameters[:, axis], cell))
    return cell[order], parameters[order]


def bound_slopes(cells: OpenCells, axis: int) -> FloatArray:
    """Bound the slopes of graphs over one parameter (`axis` 0 is u, 1 is v).

        |dv/du| = |f_u| / |f_v| ≤ max |f_u| / min |f_v|

    A partial derivative is bounded by its coefficients: differences of coefficients of f, times the
    degree, divided by the side of the cell. The result has shape (n,), and is 1e300 if the least
    |f_v| is 0.
    """
    steps = []  # the sizes of the coefficients of f_u, then of f_v
    for direction in (0, 1):
        length = cells.place[2 * direction + 1] - cells.place[2 * direction]
        steps.append(np.diff(cells.nets, axis=direction + 1).reshape(len(length), -1))
        steps[-1] = (
            np.abs(steps[-1]) * (cells.nets.shape[direction + 1] - 1) / length[:, np.newaxis]
        )
    min_slope = steps[1 - axis].min(axis=1)
    max_slope = steps[axis].max(axis=1)
    return np.where(min_slope > 0, max_slope / np.where(min_slope > 0, min_slope, 1.0), 1e300)
