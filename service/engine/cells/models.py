"""Models of second order of cells of nets, with bounds of the remainder.

A cell is a rectangle of parameters of one net. In its own parameters a, b ∈ [−1, 1] the surface is

    S(a, b) = c + A a + B b + ½ (Q_aa a² + 2 Q_ab a b + Q_bb b²) + rest

with the partials at its centre. From the third partials, bounded over the cell by the hulls of
their Bézier nets, follow bounds over the whole cell of |S − c|, |S_i − A_i|, |S_ij − Q_ij|, n ·
(S_ij − Q_ij), the rest, and of the products S_i · S_j + (S − c) · S_ij. All include rounding.

Proof in docs/proofs.md: "Models of second order".
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.nets.partials import (
    ORDERS,
    THIRD,
    bounds_of_partials,
    largest_length,
    partials_at_center,
)
from service.engine.vectors import UNIT, cross, dot, length, project

# The rows of a model; of a vector, the first of three rows.
CENTER, RADIUS, ERROR = 0, 3, 4  # c, r and ε
TANGENT_A, TANGENT_B = 5, 8  # A and B
SECOND_AA, SECOND_AB, SECOND_BB = 11, 14, 17  # Q_aa, Q_ab and Q_bb
FORM_AA, FORM_AB, FORM_BB = 20, 21, 22  # A · A, A · B, B · B
# Bounds of |rest| and of |n · rest|. The differences of S_a and of S_b from the partials of the
# model add up to at most 3 REST.
REST, REST_LIFT = 23, 24
# A bound of the rounding of products with the vectors of the model: 16 u times the sum of their
# lengths.
ROUND = 25
# Bounds of |S_i · S_j + (S − c) · S_ij − A_i · A_j| within the cell; then τ_aa, τ_ab and τ_bb.
SPREAD_AA, SPREAD_AB, SPREAD_BB = 26, 27, 28
BEND_AA, BEND_AB, BEND_BB = 29, 30, 31
# Bounds of the rounding errors of A and of B; then 2 ε, a bound of the rounding error of c with a
# margin, times |A| and times |B|.
TANGENT_ERROR_A, TANGENT_ERROR_B = 32, 33
CENTER_ERROR_A, CENTER_ERROR_B = 34, 35
NORMAL = 36  # the unit normal n at the centre; 0 where A × B vanishes
LIFT_AA, LIFT_AB, LIFT_BB = 39, 40, 41  # bounds of |n · (S_ij − Q_ij)|
SIZE_A, SIZE_B = 42, 43  # the greatest length of a row of control points along a, and along b
STRAIN = 44  # REST / min(|A|, |B|): large in cells that are far from flat; 0 for curves
ROW_COUNT = 45
VECTORS = TANGENT_A, TANGENT_B, SECOND_AA, SECOND_AB, SECOND_BB, NORMAL
"""The first rows of A, B, Q_aa, Q_ab, Q_bb and n."""

_MARGIN = 1.0000001
"""A factor that is larger than all rounding of the sums and products of a bound."""


@np.errstate(all="ignore")
def cell_models(nets: FloatArray, depth: Ints, largest: float) -> FloatArray:
    """Compute the models (ROW_COUNT, K) of cells.

    Parameters
    ----------
    nets : ndarray of float64, shape (p+1, q+1, 3 or 4, K)
        The nets over the cells.
    depth : ndarray of int, shape (K,)
        The number of halvings of each cell.
    largest : float
        M: no control point is further than this from the origin.
    """
    (p, q), is_rational = (nets.shape[0] - 1, nets.shape[1] - 1), nets.shape[2] == 4
    error = 4 * UNIT * largest * (depth + 2) * (p + q + 2)
    center, partials = partials_at_center(nets)
    ratio = np.ones(())
    points, weights = project(nets), None
    if is_rational:
        weights = nets[:, :, 3:]
        ratio = (weights.max(axis=(0, 1)) / weights.min(axis=(0, 1)))[0]
    points_about_center = points - center
    radius = largest_length(points_about_center)
    bounds = bounds_of_partials(points_about_center, weights, radius)
    # Rounding errors of partials, by order.
    errors = {(i, j): 8 * error * ratio ** (i + j) * float(p**i * q**j) for i, j in ORDERS}
    third_bounds = [_MARGIN * bounds[order] + errors[order] for order in THIRD]
    a, b, aa, ab, bb = (partials[order] for order in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2)))
    normal = _unit_normals(a, b)
    # The same bounds for n · (S − c), a surface with one coordinate.
    heights = dot(points_about_center, normal)[:, :, np.newaxis]
    bounds = bounds_of_partials(heights, weights, np.abs(heights).max(axis=(0, 1, 2)))
    third_lift_bounds = [_MARGIN * bounds[order] + errors[order] for order in THIRD]
    length_a, length_b, *second_lengths = (length(vector) for vector in (a, b, aa, ab, bb))
    error_a, error_b = errors[1, 0] + 8 * UNIT * length_a, errors[0, 1] + 8 * UNIT * length_b
    second_errors = [errors[2 - k, k] + 8 * UNIT * size for k, size in enumerate(second_lengths)]
    # The rounding error of a point of the model, at any |a|, |b| ≤ 1.
    point_error = (
        2 * error
        + error_a
        + error_b
        + second_errors[0] / 2
        + second_errors[1]
        + second_errors[2] / 2
    )
    radius += 2 * error
    table = np.empty((ROW_COUNT, nets.shape[3]))
    table[CENTER : CENTER + 3], table[RADIUS], table[ERROR] = center, radius, error
    for first, vector in zip(VECTORS, (a, b, aa, ab, bb, normal), strict=True):
        table[first : first + 3] = vector
    table[FORM_AA], table[FORM_AB], table[FORM_BB] = dot(a, a), dot(a, b), dot(b, b)
    table[REST] = _remainder(third_bounds, point_error)
    table[REST_LIFT] = _remainder(third_lift_bounds, point_error)
    for row, bounds_of_third in ((BEND_AA, third_bounds), (LIFT_AA, third_lift_bounds)):
        for k in range(3):
            table[row + k] = bounds_of_third[k] + bounds_of_third[k + 1] + second_errors[k]
    table[TANGENT_ERROR_A], table[TANGENT_ERROR_B] = error_a, error_b
    table[CENTER_ERROR_A] = 2 * error * (length_a + error_a)
    table[CENTER_ERROR_B] = 2 * error * (length_b + error_b)
    table[STRAIN] = table[REST] / np.minimum(length_a, length_b)
    # Q_ab counts twice, as in the model.
    table[ROUND] = (
        16
        * UNIT
        * (length_a + length_b + second_lengths[0] + 2 * second_lengths[1] + second_lengths[2])
    )
    table[SPREAD_AA : SPREAD_BB + 1] = _spreads(
        table, (length_a, length_b), second_lengths, second_errors
    )
    for row, axis in ((SIZE_A, 0), (SIZE_B, 1)):
        table[row] = length(np.diff(points, axis=axis)).sum(axis=axis).max(axis=0)
    if q == 0:
        # A curve does not depend on b. Add ½ b² to ½ |x − S|², so that the sum is least at b = 0.
        table[FORM_BB] = 1.0
        table[[SPREAD_AB, SPREAD_BB, BEND_AB, BEND_BB, LIFT_AB, LIFT_BB]] = 0.0
        table[[TANGENT_ERROR_B, CENTER_ERROR_B, STRAIN]] = 0.0
    return table


def _spreads(
    table: FloatArray,
    tangent_lengths: tuple[FloatArray, FloatArray],
    second_lengths: list[FloatArray],
    second_errors: list[FloatArray],
) -> list[FloatArray]:
    """The three rows SPREAD of a model.

    `tangent_lengths` are the lengths of A and B, `second_lengths` the lengths of Q_aa, Q_ab and
    Q_bb, and `second_errors` bounds of the rounding errors of these three.
    """
    a, b, aa, ab, bb = (table[first : first + 3] for first in VECTORS[:5])
    tau = table[BEND_AA : BEND_BB + 1]
    # ρ_a and ρ_b, then α and β, with bounds of rounding errors.
    remainders = [
        (tau[k] + tau[k + 1] + second_errors[k] + second_errors[k + 1]) / 2
        + table[TANGENT_ERROR_A + k]
        for k in range(2)
    ]
    max_changes = [second_lengths[k] + second_lengths[k + 1] + remainders[k] for k in range(2)]
    # The coefficients of the linear parts: 0 and 1 for aa, 1 and 2 for ab, 2 and 3 for bb.
    linear_parts = [
        np.abs(line)
        for line in (
            3 * dot(a, aa),
            2 * dot(a, ab) + dot(b, aa),
            2 * dot(b, ab) + dot(a, bb),
            3 * dot(b, bb),
        )
    ]
    rounding = (
        64
        * UNIT
        * (tangent_lengths[0] + tangent_lengths[1])
        * (second_lengths[0] + second_lengths[1] + second_lengths[2])
    )
    spreads = []
    for k, (i, j, second) in enumerate(((0, 0, aa), (0, 1, ab), (1, 1, bb))):
        value = linear_parts[k] + linear_parts[k + 1] + rounding
        value += (
            tangent_lengths[i] * remainders[j]
            + tangent_lengths[j] * remainders[i]
            + max_changes[i] * max_changes[j]
        )
        value += 0.5 * np.abs(dot(aa, second)) + np.abs(dot(ab, second))
        value += 0.5 * np.abs(dot(bb, second))
        value += table[REST] * second_lengths[k] + table[RADIUS] * tau[k]
        spreads.append(_MARGIN * value)
    return spreads


def _unit_normals(a: FloatArray, b: FloatArray) -> FloatArray:
    """The unit vectors of a × b, (3, K); 0 where a × b vanishes."""
    normal = cross(a, b)
    normal /= length(normal)
    normal[:, ~np.isfinite(normal).all(axis=0)] = 0.0
    return normal


def _remainder(third_bounds: list[FloatArray], point_error: FloatArray) -> FloatArray:
    """Bound of the remainder of a model of second order.

    It is `point_error`, for rounding, plus a bound that follows from the bounds of third partials.
    """
    aaa, aab, abb, bbb = third_bounds
    return np.asarray(point_error + (aaa + 3 * (aab + abb) + bbb) / 6)
