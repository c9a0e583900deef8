"""Signs of Bézier coefficients: they alone decide where a section is a graph, and find roots.

If all coefficients of f (`cells`) have one sign, the section does not meet the rectangle. If all
coefficients of ∂f/∂v do, the section is the graph of v over u, without loops; its crossings with
the border are, in the order of u, in turn beginnings and ends of pieces.

Roots. An interval without sign changes of the coefficients has no root, and an interval with one
change has one root. Other intervals are halved. Zero counts as positive, both for coefficients and
for values; so of two intervals that meet at a root, the one in which the polynomial is negative has
the root. An interval with several sign changes is not halved if all its coefficients are at most
the sign threshold. It has one root if the signs at its ends differ, else a double root at its
middle: the polynomials are those of a section on the sides of cells, and there the section touches
the side or crosses itself. The same rule is used for an interval after `MAX_HALVINGS` halvings. All
operations are elementwise, so the roots of one polynomial do not depend on the other polynomials.

Proofs in docs/proofs.md: "Graphs" and "Sign changes".
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.nets.subdivision import halve
from service.engine.sections.borders import ONE
from service.engine.sections.cells import ABOVE, BELOW, OVER_U, OVER_V, SINGULAR, OpenCells
from service.engine.vectors import UNIT

MAX_HALVINGS = 50
"""The most halvings of an interval; its length is then near the precision of float64."""

MAX_STEPS = 80
"""The most steps of Newton's method and bisection; bisection alone needs some 60."""


def classify_cells(nets: FloatArray) -> tuple[Ints, FloatArray, Bools]:
    """Classify cells by the signs of their coefficients.

    Parameters
    ----------
    nets : ndarray of float64, shape (p+1, q+1, n)
        Coefficients of f.

    Returns
    -------
    kind : ndarray of int, shape (n,)
        `ABOVE` or `BELOW` by the signs of f; `OVER_U` or `OVER_V` by those of a partial, and if
        both are possible, the one with the larger slope of f in the other parameter; else
        `SINGULAR`.
    sense : ndarray of float64, shape (n,)
        As in `EndedCells`.
    is_monotone : ndarray of bool, shape (n,)
        Whether the section is a graph over u and also over v.
    """
    count = nets.shape[-1]
    kind, sense = np.full(count, SINGULAR), np.zeros(count)
    steepest, graphs = np.zeros(count), np.zeros(count, np.intp)
    for axis, graph_kind in ((0, OVER_V), (1, OVER_U)):
        steps = np.diff(nets, axis=axis).reshape(-1, count)
        low, high = steps.min(axis=0), steps.max(axis=0)
        does_rise, does_fall = (low >= 0) & (high > 0), (high <= 0) & (low < 0)
        # A mean of contiguous numbers has the same bits, however many cells there are.
        means = np.ascontiguousarray(steps.T).mean(axis=1)
        slope = np.abs(means) * (nets.shape[axis] - 1)
        is_better = (does_rise | does_fall) & (slope >= steepest)
        graphs += does_rise | does_fall
        steepest[is_better] = slope[is_better]
        kind[is_better] = graph_kind
        # In the plane of parameters, f is larger to the left of the direction (f_v, −f_u).
        sense[is_better] = np.where(does_rise == (graph_kind == OVER_U), 1.0, -1.0)[is_better]
    is_above, is_below = nets.min(axis=(0, 1)) >= 0, nets.max(axis=(0, 1)) <= 0
    kind[is_above], kind[is_below] = ABOVE, BELOW
    sense[is_above | is_below] = 0.0
    return kind, sense, graphs == 2


def find_border_points(cells: OpenCells, axis: int) -> tuple[Ints, FloatArray]:
    """Find the points where graphs over u (`axis` 0) or v (1) cross the borders of their cells.

    Returns
    -------
    cell : ndarray of int, shape (k,)
        The cell of each point, ascending. Each cell occurs an even number of times.
    parameters : ndarray of float64, shape (2, k)
        The parameters (u, v) of each point; for each cell, they ascend along the axis.
    """
    rectangle = cells.rectangle / ONE
    numbers, points = [], []
    for side, coefficients in enumerate(cells.take_sides()):
        cell, t = find_roots(coefficients, cells.threshold)
        across, along = side // 2, 1 - side // 2
        parameters = np.empty((2, len(cell)))
        low, high = rectangle[2 * along, cell], rectangle[2 * along + 1, cell]
        parameters[across], parameters[along] = rectangle[side, cell], low + t * (high - low)
        numbers.append(cell)
        points.append(parameters)
    checkpoint()
    cell, parameters = np.concatenate(numbers), np.concatenate(points, axis=1)
    order = np.lexsort((parameters[axis], cell))
    return cell[order], parameters[:, order]


def bound_slopes(cells: OpenCells, axis: int) -> FloatArray:
    """Bound the slopes (n,) of graphs over one parameter (`axis` 0 is u, 1 is v).

        |dv/du| = |f_u| / |f_v| ≤ max |f_u| / min |f_v|

    A partial derivative is bounded by its coefficients: differences of coefficients of f, times the
    degree, divided by the side of the cell. The bound is 1e300 if the least |f_v| is 0.
    """
    partials = []  # the sizes of the coefficients of f_u, then of f_v
    for direction, lengths in enumerate(cells.lengths):
        steps = np.abs(np.diff(cells.nets, axis=direction).reshape(-1, len(cells)))
        partials.append(steps * (cells.nets.shape[direction] - 1) / lengths)
    max_slope, min_slope = partials[axis].max(axis=0), partials[1 - axis].min(axis=0)
    return np.where(min_slope > 0, max_slope / np.where(min_slope > 0, min_slope, 1.0), 1e300)


def find_roots(coefficients: FloatArray, threshold: FloatArray) -> tuple[Ints, FloatArray]:
    """Find the parameters in [0, 1] at which polynomials change their sign.

    Parameters
    ----------
    coefficients : ndarray of float64, shape (n+1, m)
        Of m polynomials, in the Bernstein basis.
    threshold : ndarray of float64, shape (m,)
        For each polynomial, the largest absolute value of coefficients whose signs are not
        reliable.

    Returns
    -------
    number : ndarray of int, shape (k,)
        The polynomial of each root, ascending.
    t : ndarray of float64, shape (k,)
        The roots of each polynomial, ascending; double roots occur twice. A root at an end is
        exactly 0 or 1 if the coefficient at this end is 0.
    """
    # Of each interval to examine: its polynomial, begin and coefficients. Its length is 0.5**depth.
    number, begin = np.arange(len(threshold)), np.zeros(len(threshold))
    nets, depth = coefficients, 0
    parts: list[tuple[Ints, FloatArray]] = [(number[:0], begin[:0])]
    while len(number):
        checkpoint()
        is_negative = nets < 0
        changes = np.count_nonzero(is_negative[1:] != is_negative[:-1], axis=0)
        is_small = (np.abs(nets).max(axis=0) <= threshold[number]) | (depth == MAX_HALVINGS)
        signs_differ = is_negative[0] != is_negative[-1]
        has_single = (changes == 1) | (is_small & signs_differ)
        doubles = np.flatnonzero((changes > 1) & is_small & ~signs_differ).repeat(2)
        # A double root is at the middle of its interval, twice.
        parts.append((number[doubles], begin[doubles] + 0.5 ** (depth + 1)))
        if has_single.any():
            t = _find_single(nets[:, has_single], is_negative[:, has_single])
            parts.append((number[has_single], begin[has_single] + t * 0.5**depth))
        to_halve = np.flatnonzero((changes > 1) & ~is_small)
        if not len(to_halve):
            break
        depth += 1
        halves = np.empty((len(nets), 2, len(to_halve)))
        halve(nets[:, to_halve], 0, halves)
        nets = halves.reshape(len(nets), -1)
        number = np.tile(number[to_halve], 2)
        begin = np.concatenate([begin[to_halve], begin[to_halve] + 0.5**depth])
    number, t = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.lexsort((t, number))
    return number[order], t[order]


def _find_single(nets: FloatArray, is_negative: Bools) -> FloatArray:
    """The only parameter (m,) in [0, 1] at which each polynomial (n+1, m) changes its sign."""
    low, high = np.zeros(nets.shape[1]), np.ones(nets.shape[1])
    # The secant gives a better start than the middle.
    first, last = nets[0], nets[-1]
    span = first - last
    t = np.where(span != 0, first / np.where(span != 0, span, 1.0), 0.5)
    t = np.where((t > 0) & (t < 1), t, 0.5)
    # If the coefficients before the change, or after it, are all 0, the root is at this end.
    begins_negative, is_before_change = is_negative[0], is_negative == is_negative[0]
    t[~begins_negative & ~((nets != 0) & is_before_change).any(axis=0)] = 0.0
    t[begins_negative & ~((nets != 0) & ~is_before_change).any(axis=0)] = 1.0
    rest = np.flatnonzero((t > 0) & (t < 1))
    for _ in range(MAX_STEPS):
        if not len(rest):
            break
        t_now = t[rest]
        value, slope = _evaluate(nets[:, rest], t_now)
        is_before = (value < 0) == begins_negative[rest]
        low[rest] = np.where(is_before, t_now, low[rest])
        high[rest] = np.where(is_before, high[rest], t_now)
        with np.errstate(all="ignore"):
            newton_t = t_now - value / slope
        is_inside = (newton_t >= low[rest]) & (newton_t <= high[rest])
        next_t = np.where(is_inside, newton_t, (low[rest] + high[rest]) / 2)
        t[rest] = next_t
        # 2⁻⁵³ is the rounding error of numbers near 1.
        has_moved = np.abs(next_t - t_now) > UNIT
        rest = rest[has_moved & (value != 0) & (high[rest] - low[rest] > UNIT)]
    return t


def _evaluate(nets: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and derivatives (m,) of polynomials (n+1, m), each at its t, by de Casteljau."""
    rows, slope = nets, np.zeros(len(t))
    while len(rows) > 1:
        if len(rows) == 2:
            slope = (rows[1] - rows[0]) * (len(nets) - 1)
        rows = (1 - t) * rows[:-1] + t * rows[1:]
    return rows[0], slope
