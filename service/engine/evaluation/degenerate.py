"""Limits of unit normals where S_u × S_v vanishes.

N = S_u × S_v is a polynomial in the Bernstein basis. So the lowest term of N that does not vanish
is computed from the coefficients, and not estimated from neighbouring samples.
"""

from typing import Literal, TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein, binomials
from service.engine.evaluation.nets import DerivativeNets, evaluate_along, longest_vectors
from service.engine.vectors import length

VANISHING = 2.0**-40
"""A length below this share of the largest possible length counts as zero. Rounding errors are some
2^-52 of the largest possible length, so a length that does not count as zero has at least a dozen
correct binary digits."""

NEGLIGIBLE = 2.0**-36
"""Coefficients of N below this share of the longest coefficient of their patch count as zero: they
come from rounding."""

SAME_DIRECTION = 2.0**-30
"""Unit vectors whose difference is at most this long count as one limit."""

Direction: TypeAlias = Literal["v", "u", "diagonal"]


def limit_normals(
    nets: DerivativeNets, patch_numbers: Ints, u: FloatArray, v: FloatArray
) -> FloatArray:
    """Limit normals at parameters where N vanishes.

    The limit is the direction of the first coefficient of N that does not vanish on a line from the
    sample into the patch. The first line leads straight away from the side on which the sample
    lies. If all coefficients vanish on it, the next line leads along that side, and at a corner or
    inside the patch the last line leads diagonally. If all coefficients vanish on all lines, the
    result is the mean normal of the patch.

    At a corner and inside a patch, the lines along u and along v may have different limits, as
    where S_u and S_v are parallel: the normal has no limit then. The result is that on the diagonal
    line, which stays the same if u and v are exchanged.

    Parameters
    ----------
    nets : DerivativeNets
        K patches.
    patch_numbers : ndarray of int, shape (m,)
        The patch of each parameter: a number in `nets`.
    u, v : ndarray of float64, shape (m,)
        Parameters in [0, 1].

    Returns
    -------
    ndarray of float64, shape (m, 3)
        Unit vectors.
    """
    coefficients = nets.normal_net
    largest = longest_vectors(coefficients)
    min_length = np.maximum(NEGLIGIBLE * largest, VANISHING * nets.longest_product)[patch_numbers]
    # Restriction to a line averages coefficients: if no coefficient of the patch is longer than
    # `min_length`, no coefficient on a line is.
    has_limit = largest[patch_numbers] > min_length
    normals = np.full((len(patch_numbers), 3), np.nan)
    for group, directions in choose_directions(u, v):
        for direction in directions:
            unresolved = np.flatnonzero(group & has_limit & np.isnan(normals[:, 0]))
            if len(unresolved):
                lines = trace_inwards(
                    coefficients, patch_numbers[unresolved], u[unresolved], v[unresolved], direction
                )
                normals[unresolved] = _find_leading(lines, min_length[unresolved])
    both = np.flatnonzero(_has_two_ways(u, v) & np.isfinite(normals[:, 0]))
    if len(both):
        samples = patch_numbers[both], u[both], v[both]
        along_u = _find_leading(trace_inwards(coefficients, *samples, "u"), min_length[both])
        differs = np.flatnonzero(length(along_u - normals[both], -1) > SAME_DIRECTION)
        if len(differs):
            rows, along_u = both[differs], along_u[differs]
            samples = patch_numbers[rows], u[rows], v[rows]
            diagonal = trace_inwards(coefficients, *samples, "diagonal")
            limits = _find_leading(diagonal, min_length[rows])
            normals[rows] = np.where(np.isnan(limits), _mean(normals[rows], along_u), limits)
    remaining = np.flatnonzero(np.isnan(normals[:, 0]))
    if len(remaining):
        normals[remaining] = _find_mean_normals(nets, coefficients, patch_numbers[remaining])
    return normals


def choose_directions(
    u: FloatArray, v: FloatArray
) -> tuple[tuple[Bools, tuple[Direction, ...]], ...]:
    """For groups of samples (m,): the directions of lines, in the order in which they are tried.

    The first line leads inwards from the side on which the sample lies; at a corner, or inside the
    patch, it leads in direction v. If this line is a collapsed side, N vanishes along it, and the
    next line is tried. For the last group, corners and places inside, N may vanish along both.
    """
    is_on_u_side = (u == 0) | (u == 1)
    is_within_u_side = is_on_u_side & (v > 0) & (v < 1)
    return (
        (~is_within_u_side, ("v", "u")),
        (is_within_u_side, ("u", "v")),
        (_has_two_ways(u, v), ("diagonal",)),
    )


def _has_two_ways(u: FloatArray, v: FloatArray) -> Bools:
    """Which samples (m,) are at corners or inside: there neither u nor v leads straight inwards."""
    is_on_u_side, is_on_v_side = ((t == 0) | (t == 1) for t in (u, v))
    two_ways: Bools = is_on_u_side == is_on_v_side
    return two_ways


def _restrict_to_longer_part(coefficients: FloatArray, t: FloatArray, axis: int) -> FloatArray:
    """The polynomials restricted to [0, t] or to [t, 1], whichever is longer, by de Casteljau.

    Restrictions to [0, t] are reversed, so that in the result the sample has index 0 along `axis`.
    """
    rows = np.moveaxis(coefficients, axis, -1).copy()
    ones = (1,) * (rows.ndim - 1)
    is_reversed = t > 0.5
    rows[is_reversed] = rows[is_reversed][..., ::-1]
    begin = np.where(is_reversed, 1.0 - t, t)
    inner = np.flatnonzero(begin > 0)
    if len(inner):
        # The coefficients on the right part are the last values of all levels of the algorithm.
        # Each level overwrites all values of the level before but the last.
        values, s = rows[inner], begin[inner].reshape(-1, *ones)
        n = values.shape[-1]
        for level in range(1, n):
            size = n - level
            values[..., :size] = (1 - s) * values[..., :size] + s * values[..., 1 : size + 1]
        rows[inner] = values
    return np.moveaxis(rows, -1, axis)


def trace_inwards(
    coefficients: FloatArray,
    patch_numbers: Ints,
    u: FloatArray,
    v: FloatArray,
    direction: Direction,
) -> FloatArray:
    """Coefficients (m, d, n) of polynomials along a line from each sample into the patch.

    Sample k is at (u[k], v[k]) of the polynomial `patch_numbers[k]` of `coefficients` (K, d, …).
    """
    if direction == "v":
        basis = bernstein(coefficients.shape[2] - 1, u)
        return _restrict_to_longer_part(
            evaluate_along(coefficients, patch_numbers, basis), v, axis=2
        )
    if direction == "u":
        basis = bernstein(coefficients.shape[3] - 1, v)
        return _restrict_to_longer_part(
            evaluate_along(coefficients.swapaxes(2, 3), patch_numbers, basis), u, axis=2
        )
    boxes = _restrict_to_longer_part(
        _restrict_to_longer_part(coefficients[patch_numbers], u, axis=2), v, axis=3
    )
    # On the diagonal the coefficients are Σ_{i+j=k} C(p, i) C(q, j) b_ij / C(p+q, k).
    rows, columns = boxes.shape[2:]
    weighted = boxes * np.multiply.outer(binomials(rows - 1), binomials(columns - 1))
    line = np.zeros((*boxes.shape[:2], rows + columns - 1))
    for i in range(rows):
        line[:, :, i : i + columns] += weighted[:, :, i]
    return line / binomials(rows + columns - 2)


def _find_leading(lines: FloatArray, min_length: FloatArray) -> FloatArray:
    """Unit vectors of the first coefficients of lines that are longer than `min_length`, or NaN."""
    lengths = length(lines)
    is_long = lengths > min_length[:, None]
    first = is_long.argmax(axis=1)
    rows = np.arange(len(lines))
    has_vector = is_long[rows, first]
    leading = np.where(has_vector, lengths[rows, first], 1.0)
    return np.where(has_vector[:, None], lines[rows, :, first] / leading[:, None], np.nan)


def _mean(first: FloatArray, second: FloatArray) -> FloatArray:
    """Unit vectors half way between two, (m, 3); the first if they are opposite."""
    total = first + second
    lengths = length(total, -1)
    is_opposite = lengths <= SAME_DIRECTION
    total[is_opposite], lengths[is_opposite] = first[is_opposite], 1.0
    mean: FloatArray = total / lengths[:, None]
    return mean


def _find_mean_normals(
    nets: DerivativeNets, coefficients: FloatArray, patch_numbers: Ints
) -> FloatArray:
    """The mean normals (m, 3) of patches, weighted by area.

    The mean of the coefficients of N is the integral of N over the patch. A patch without area gets
    a vector perpendicular to the longest difference of its neighbouring control points.
    """
    used, inverse = np.unique(patch_numbers, return_inverse=True)
    mean = coefficients[used].mean(axis=(2, 3))
    lengths = length(mean, -1)
    rows_without_area = np.flatnonzero(lengths <= VANISHING * nets.longest_product[used])
    lengths[rows_without_area] = 1.0
    normals = mean / lengths[:, None]
    for row in rows_without_area.tolist():
        differences = np.concatenate(
            [nets.du[used[row], :3].reshape(3, -1), nets.dv[used[row], :3].reshape(3, -1)], axis=1
        )
        longest = differences[:, np.square(differences).sum(axis=0).argmax()]
        # The coordinate axis with the largest angle to this vector; of equal angles the last axis,
        # so the coordinates are searched from z to x.
        axis = np.zeros(3)
        axis[2 - np.abs(longest[::-1]).argmin()] = 1.0
        across = axis - longest * (longest @ axis) / max(float(longest @ longest), 1e-300)
        normals[row] = across / np.linalg.norm(across)
    normals_of_samples: FloatArray = normals[inverse]
    return normals_of_samples
