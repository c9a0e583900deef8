"""Limits of unit normals where S_u × S_v vanishes.

N = S_u × S_v is itself a polynomial in the Bernstein basis: its derivatives, and so the lowest term
that does not vanish, are computed, and not estimated from neighbours.
"""

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein, binomials
from service.engine.evaluation.nets import DerivativeNets, evaluate_along, longest_vectors

VANISHING = 2.0**-40
"""A difference below this share of its measure counts as zero. Rounding errors are some 2^-52 of
the measure, so larger differences have at least a dozen correct binary digits."""

NEGLIGIBLE = 2.0**-36
"""Coefficients of N below this share of the largest count as zero: they come from rounding."""

Direction: TypeAlias = Literal["v", "u", "diagonal"]


def limit_normals(
    nets: DerivativeNets, which: NDArray[np.intp], u: FloatArray, v: FloatArray
) -> FloatArray:
    """Limit normals at parameters where N vanishes.

    The limit is the direction of the first coefficient of N, seen from the point inwards, that does
    not vanish: first straight away from the side on which the point lies, then along that side, at
    corners then diagonally. If none is found, it is the mean normal of the patch.

    Parameters
    ----------
    nets : DerivativeNets
        K patches.
    which : ndarray of int, shape (m,)
        Rows of `nets`.
    u, v : ndarray of float64, shape (m,)
        Parameters in [0, 1].

    Returns
    -------
    ndarray of float64, shape (m, 3)
        Unit vectors.
    """
    coefficients = nets.normal_net
    largest = longest_vectors(coefficients)
    floor = np.maximum(NEGLIGIBLE * largest, VANISHING * nets.measure)[which]
    # Restriction only averages coefficients: if none is above the floor before it, none is after
    # it.
    has_limit = largest[which] > floor
    normals = np.full((len(which), 3), np.nan)
    # Inwards from the edge on which the sample lies; at a corner, from the v edge first. Along a
    # collapsed edge N vanishes throughout, so a wrong first choice gives no direction.
    on_u_edge_only = ((u == 0) | (u == 1)) & (v > 0) & (v < 1)
    orders: tuple[tuple[NDArray[np.bool_], tuple[Direction, ...]], ...] = (
        (has_limit & ~on_u_edge_only, ("v", "u")),
        (has_limit & on_u_edge_only, ("u", "v")),
        # Corners where N vanishes along both edges.
        (has_limit & ((u == 0) | (u == 1)) & ((v == 0) | (v == 1)), ("diagonal",)),
    )
    for group, directions in orders:
        for direction in directions:
            unresolved = np.flatnonzero(group & np.isnan(normals[:, 0]))
            if len(unresolved):
                lines = trace_inwards(
                    coefficients, which[unresolved], u[unresolved], v[unresolved], direction
                )
                normals[unresolved] = _find_leading(lines, floor[unresolved])
    remaining = np.flatnonzero(np.isnan(normals[:, 0]))
    if len(remaining):
        normals[remaining] = _patch_normals(nets, coefficients, which[remaining])
    return normals


def _from_corner(coefficients: FloatArray, t: FloatArray, axis: int) -> FloatArray:
    """The polynomials restricted to the longer one of the parts before and after t.

    They are reversed if this part lies before t. So in the result the sample has index 0 along
    `axis`. The restriction is de Casteljau's algorithm.
    """
    rows = np.moveaxis(coefficients, axis, -1).copy()
    ones = (1,) * (rows.ndim - 1)
    flip = t > 0.5
    rows[flip] = rows[flip][..., ::-1]
    begin = np.where(flip, 1.0 - t, t)
    inner = np.flatnonzero(begin > 0)
    if len(inner):
        # The right part of a subdivision is the last value of every level of the triangle.
        triangle, s = rows[inner], begin[inner].reshape(-1, *ones)
        n = triangle.shape[-1]
        for level in range(1, n):
            keep = n - level
            triangle[..., :keep] = (1 - s) * triangle[..., :keep] + s * triangle[..., 1 : keep + 1]
        rows[inner] = triangle
    return np.moveaxis(rows, -1, axis)


def trace_inwards(
    coefficients: FloatArray,
    which: NDArray[np.intp],
    u: FloatArray,
    v: FloatArray,
    direction: Direction,
) -> FloatArray:
    """Coefficients (m, d, n) of polynomials (K, d, …) along a line from each sample inwards."""
    if direction == "v":
        basis = bernstein(coefficients.shape[2] - 1, u)
        return _from_corner(evaluate_along(coefficients, which, basis), v, axis=2)
    if direction == "u":
        basis = bernstein(coefficients.shape[3] - 1, v)
        return _from_corner(evaluate_along(coefficients.swapaxes(2, 3), which, basis), u, axis=2)
    boxes = _from_corner(_from_corner(coefficients[which], u, axis=2), v, axis=3)
    rows, columns = boxes.shape[2:]
    weighted = boxes * np.multiply.outer(binomials(rows - 1), binomials(columns - 1))
    line = np.zeros((*boxes.shape[:2], rows + columns - 1))
    for i in range(rows):
        line[:, :, i : i + columns] += weighted[:, :, i]
    return line / binomials(rows + columns - 2)


def _find_leading(lines: FloatArray, floor: FloatArray) -> FloatArray:
    """Unit vector of the first coefficient longer than `floor` of each line; else NaN."""
    lengths = np.linalg.norm(lines, axis=1)
    large = lengths > floor[:, None]
    first = large.argmax(axis=1)
    rows = np.arange(len(lines))
    has_large = large[rows, first]
    length = np.where(has_large, lengths[rows, first], 1.0)
    return np.where(has_large[:, None], lines[rows, :, first] / length[:, None], np.nan)


def _patch_normals(
    nets: DerivativeNets, coefficients: FloatArray, which: NDArray[np.intp]
) -> FloatArray:
    """The mean normal of the patch, weighted by area; without area, a perpendicular vector.

    The mean of the coefficients of N is its integral over the patch.
    """
    used, back = np.unique(which, return_inverse=True)
    mean = coefficients[used].mean(axis=(2, 3))
    length = np.linalg.norm(mean, axis=1)
    flat_rows = np.flatnonzero(length <= VANISHING * nets.measure[used])
    length[flat_rows] = 1.0
    normals = mean / length[:, None]
    # Without area, the patch is a line or a point: the result is perpendicular to its longest
    # difference.
    for row in flat_rows.tolist():
        edges = np.concatenate(
            [nets.du[used[row], :3].reshape(3, -1), nets.dv[used[row], :3].reshape(3, -1)], axis=1
        )
        chord = edges[:, np.square(edges).sum(axis=0).argmax()]
        # The coordinate axis with the largest angle to the chord; of equal ones the last.
        axis = np.zeros(3)
        axis[2 - np.abs(chord[::-1]).argmin()] = 1.0
        across = axis - chord * (chord @ axis) / max(float(chord @ chord), 1e-300)
        normals[row] = across / np.linalg.norm(across)
    shared: FloatArray = normals[back]
    return shared
