"""Checks of splines from a file, and their form with clamped knots.

New control points are values of blossoms (`service.bases.blossoms`), weighted means of old ones.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from service.bases.arrays import FloatArray
from service.bases.blossoms import find_refinement, raise_knots
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import MAX_COORDINATE
from service.decoders.cad.knot_vectors import check_knots, to_floats
from service.surface.checks import MAX_WEIGHT_RATIO
from service.surface.knots import MAX_ENTRIES, MAX_PIECES

JUMP = 1e-9
"""At p + 1 equal knots the two control points may be this far apart, as a share of the largest
coordinate; then one of them is left out."""


def to_homogeneous(points: ArrayLike, weights: ArrayLike | None, axes: int) -> FloatArray:
    """Checked control points with their weights as (…, D + 1)."""
    values = to_floats(points)
    if values.ndim != axes or 0 in values.shape:
        raise InvalidGeometry("control points are missing or of different dimensions")
    if not np.abs(values).max() <= MAX_COORDINATE:  # true for NaN, too
        raise InvalidGeometry("a coordinate is not finite or too large")
    net = np.ones((*values.shape[:-1], values.shape[-1] + 1))
    net[..., :-1] = values
    if weights is None:
        return net
    factors = to_floats(weights)
    if factors.shape != values.shape[:-1]:
        raise InvalidGeometry("there is not one weight for each control point")
    low, high = float(factors.min()), float(factors.max())
    if not (low > 0.0 and np.isfinite(high)):
        raise InvalidGeometry("a weight is not positive")
    if high > MAX_WEIGHT_RATIO * low:
        raise InvalidGeometry("weights differ too much")
    if low < high:
        net *= (factors / high)[..., np.newaxis]
    return net


def clamp(knots: FloatArray, degree: int, net: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Checked knots and control points (n, …) of a clamped spline without jumps."""
    knots = check_knots(knots, degree, len(net))
    values = knots.tolist()
    first, last = values[degree], values[-degree - 1]
    pieces = len(set(values))
    if pieces > MAX_PIECES or pieces * (degree + 1) ** 2 > MAX_ENTRIES:
        raise InvalidGeometry("a spline has too many spans")
    pairs = enumerate(zip(values, values[degree:], strict=False))
    jumps = [at for at, (low, high) in pairs if low == high and first < low < last]
    if jumps:
        knots, net = _close_jumps(knots, net, jumps)
    if values[0] == first and values[-1] == last:
        return knots, net
    return restrict(knots, degree, net, first, last)


def _close_jumps(
    knots: FloatArray, net: FloatArray, at: Sequence[int]
) -> tuple[FloatArray, FloatArray]:
    """The spline without one of two equal control points at each p + 1 equal inner knots.

    Such knots begin at the positions `at`; the control points at − 1 and at are the two ends.
    """
    rows = np.array(at)
    ends = net[..., :-1] / net[..., -1:]
    if np.abs(ends[rows] - ends[rows - 1]).max() > JUMP * np.abs(ends).max():
        raise InvalidGeometry("a spline is discontinuous")
    if np.abs(net[rows] - net[rows - 1]).max() > 1e-6 * np.abs(net).max():
        raise InvalidGeometry("the weights of a spline are discontinuous")
    return np.delete(knots, rows), np.delete(net, rows, axis=0)


def restrict(
    knots: FloatArray, degree: int, net: FloatArray, first: float, last: float
) -> tuple[FloatArray, FloatArray]:
    """Clamped knots and control points (N, …) over a part [first, last] of the domain.

    Control points whose p knots are all inside the part stay; only p at each end are new.
    """
    target = raise_knots(knots, degree, degree, first, last)
    count = len(target) - 2 * (degree + 1)
    if count <= 2 * degree:
        return target, refine(knots, degree, net, target, degree)
    begin = int(np.searchsorted(knots, first, side="right"))
    ends = [
        refine(knots, degree, net, window, degree)
        for window in (target[: 2 * degree + 1], target[-2 * degree - 1 :])
    ]
    return target, np.concatenate([ends[0], net[begin - 1 : begin + count - degree], ends[1]])


def refine(
    knots: FloatArray, degree: int, net: FloatArray, target: FloatArray, new_degree: int
) -> FloatArray:
    """Control points (N, …) over other knots, from control points (n, …)."""
    index, shares = find_refinement(knots, degree, target, new_degree)
    flat = net.reshape(len(net), -1)
    points = shares[0][:, np.newaxis] * flat[index[0]]
    for rows, share in zip(index[1:], shares[1:], strict=True):
        points += share[:, np.newaxis] * flat[rows]
    refined: FloatArray = points.reshape(-1, *net.shape[1:])
    return refined
