"""The curves beside which panels lie, in the boxes about these: values, slopes, and bounds.

A panel lies between the curves (x_0(t), y(t)) and (x_1(t), y(t)) of a box [0, 1]². Both sides have
the same y. Rational curves have weights, with which their nets are multiplied.

Proof in docs/proofs.md: "Panels of trimmed faces".
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.measures.cells import UPWARDS
from service.engine.measures.discs import Discs
from service.engine.measures.quadrature import basis_at_nodes
from service.engine.measures.remainders import chebyshev
from service.engine.vectors import UNIT

RADII = np.array([1.25, 1.6, 2.1, 3, 5, 12])
"""The ρ of the ellipses for panels and strips. Each gives a bound of the remainder of a rule."""

AXES = (RADII + 1 / RADII) / 2 * (1 + 2.0**-48)
"""The long half axes of these ellipses, rounded upwards."""


@dataclass(frozen=True, eq=False)
class BorderCurves:
    """K pairs of curves of degree k.

    Attributes
    ----------
    x : ndarray of float64, shape (2, k+1, K)
        Of both sides; times the weights.
    y : ndarray of float64, shape (k+1, K)
        Times the weights.
    w : ndarray of float64, shape (k+1, K), or None
        Positive weights, of which the largest of each curve is at least ½ and less than 1.
    error : ndarray of float64, shape (2, K)
        Bounds of the errors of the control points' x and y, times the weights.
    """

    x: FloatArray
    y: FloatArray
    w: FloatArray | None
    error: FloatArray

    @property
    def degree(self) -> int:
        """Degree k."""
        return len(self.y) - 1

    @cached_property
    def least_weight(self) -> FloatArray:
        """Lower bounds of the weights, (K,)."""
        if self.w is None:
            return np.ones(self.y.shape[1])
        return np.asarray(self.w.min(axis=0) * (1 - 2.0**-30))

    @cached_property
    def slope_net(self) -> FloatArray:
        """The net (k, K) of the derivative of the polynomial y."""
        return self.degree * np.diff(self.y, axis=0)

    @cached_property
    def x_slope_net(self) -> FloatArray:
        """The net (k, K) of the derivative of the polynomial x of the second side."""
        return np.asarray(self.degree * np.diff(self.x[1], axis=0))

    @cached_property
    def weight_slope_net(self) -> FloatArray | None:
        """The net (k, K) of the derivative of the weights."""
        return None if self.w is None else self.degree * np.diff(self.w, axis=0)

    @cached_property
    def width(self) -> FloatArray:
        """Bounds of |x_1 − x_0|, (K,)."""
        steps = np.abs(self.x[1] - self.x[0]).max(axis=0) + 2 * self.error[0]
        return np.asarray(steps / self.least_weight * UPWARDS)

    @cached_property
    def sway(self) -> FloatArray:
        """Approximately, how far x moves along a side, (K,)."""
        x = self.x if self.w is None else self.x / self.w
        return np.asarray(np.ptp(x, axis=1).max(axis=0))

    @cached_property
    def steepness(self) -> FloatArray:
        """Bounds of |x′| of the second side and of |y′|, (2, K)."""
        steps = np.abs([self.x_slope_net, self.slope_net]).max(axis=1)
        steps = steps + 2 * self.degree * self.error
        if self.weight_slope_net is not None:
            # y′ = (Y′ − y w′) / w with 0 ≤ y ≤ 1.
            steps = (steps + np.abs(self.weight_slope_net).max(axis=0)) / self.least_weight
        return np.asarray(steps * UPWARDS)

    @cached_property
    def slope_error(self) -> FloatArray:
        """Bounds of the errors of x′ of the second side and of y′ at nodes, (2, K)."""
        k = self.degree
        largest = np.abs([self.x_slope_net, self.slope_net]).max(axis=1)
        error = 2 * k * self.error + 16 * (k + 2) * UNIT * largest
        if self.weight_slope_net is not None:
            steps = np.abs(self.weight_slope_net).max(axis=0)
            # Of Y′, of w′ (times y ≤ 1), of y (times w′), and of w.
            error = error + 16 * (k + 2) * UNIT * steps + 8 * k * UNIT
            error = error + steps * self.node_error
            error = error / self.least_weight
            error = error + 32 * (k + 2) * UNIT / self.least_weight * self.steepness
        return np.asarray((error + 16 * UNIT * self.steepness) * UPWARDS)

    @cached_property
    def node_error(self) -> FloatArray:
        """Bounds of the errors of x and of y at nodes, (2, K)."""
        error = self.error + 16 * (self.degree + 2) * UNIT
        if self.w is not None:
            error = (error + 16 * (self.degree + 2) * UNIT) / self.least_weight
        return np.asarray((error + 8 * UNIT) * UPWARDS)

    def at_nodes(self, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Both x, (2, m, K); y, (m, K); x′ of the second side and y′, (2, m, K), at m nodes."""
        basis, lower = basis_at_nodes(self.degree, count), basis_at_nodes(self.degree - 1, count)
        x, y = basis @ self.x, basis @ self.y
        slopes = lower @ np.array([self.x_slope_net, self.slope_net])
        if self.w is None or self.weight_slope_net is None:
            return x, y, slopes
        w = basis @ self.w
        x, y = x / w, y / w
        return x, y, (slopes - np.stack([x[1], y]) * (lower @ self.weight_slope_net)) / w

    @cached_property
    def _coefficients(self) -> tuple[FloatArray, FloatArray, FloatArray | None]:
        """Chebyshev coefficients of 2 x − 1, (2, k+1, K), of 2 y − 1 and of w, (k+1, K)."""
        matrix = chebyshev(self.degree)
        if self.w is None:
            one, w = np.zeros((self.degree + 1, 1)), None
            one[0] = 1.0
        else:
            w = one = matrix @ self.w
        return 2 * (matrix @ self.x) - one, 2 * (matrix @ self.y) - one, w

    @cached_property
    def _coefficient_error(self) -> FloatArray:
        """Bounds of the errors of coefficients, (2, K)."""
        return 4 * self.error + 64 * (self.degree + 2) * UNIT

    def find_axes(self) -> tuple[FloatArray, FloatArray]:
        """Long half axes (R, K) of ellipses with the values of 2 x − 1 and of 2 y − 1.

        The foci are −1 and 1. Those for x hold for all curves between both sides.
        """
        (x_0, x_1), y, w = self._coefficients
        error_x, error_y = self._coefficient_error
        sides = [_find_axis(x, w, error_x) for x in (x_0, x_1)]
        return np.maximum(*sides), _find_axis(y, w, error_y)

    def find_heights(self) -> Discs:
        """Discs with the values of (x_1 − x_0) y′ on the ellipses."""
        (x_0, x_1), y, w = self._coefficients
        error = self._coefficient_error
        width = Discs.of((x_1 - x_0) / 2, bound_powers(self.degree), error[0])
        if w is not None:
            width = width.over(Discs.of(w, bound_powers(self.degree), error[1]))
        return width.times(self._bound_slope(y, self.slope_net, error[1]))

    def find_slopes(self) -> tuple[Discs, Discs]:
        """Discs with the values of x′ of the second side, and of y′, on the ellipses."""
        (_, x), y, _ = self._coefficients
        errors = self._coefficient_error
        return (
            self._bound_slope(x, self.x_slope_net, errors[0]),
            self._bound_slope(y, self.slope_net, errors[1]),
        )

    def _bound_slope(self, z: FloatArray, slope_net: FloatArray, error: FloatArray) -> Discs:
        """Discs with the values of a derivative.

        `z` (k+1, K) are the coefficients of 2 y − 1, and `slope_net` (k, K) is the net of y′.
        """
        powers, matrix = bound_powers(self.degree), chebyshev(self.degree - 1)
        slope_error = 8 * self.degree * error
        w = self._coefficients[2]
        if w is None or self.weight_slope_net is None:
            return Discs.of(matrix @ slope_net, powers, slope_error)
        # y′ = (Y′ w − Y w′) / w², where Y may be about any multiple of w.
        weight = Discs.of(w, powers, error)
        middle = z[0] / w[0]
        raised = Discs.of((z - middle * w) / 2, powers, 4 * error)
        shift = (middle + 1) / 2
        moved = matrix @ (slope_net - shift * self.weight_slope_net)
        slope = Discs.of(moved, powers, 4 * slope_error)
        weight_slope = Discs.of(matrix @ self.weight_slope_net, powers, slope_error)
        top = slope.times(weight).minus(raised.times(weight_slope))
        return top.over(weight.times(weight))


def bound_powers(degree: int) -> FloatArray:
    """Bounds of |T_k| on the ellipses for k = 0 … degree, (R, degree + 1)."""
    return np.asarray(grow_chebyshev(AXES[:, np.newaxis], degree)[0])


def grow_chebyshev(axis: FloatArray, degree: int) -> FloatArray:
    """T_k at numbers a ≥ 1, (R, K), for k = 0 … degree: (K, R, degree + 1), rounded upwards.

    They bound |T_k| on the ellipses with the long half axes a.
    """
    axis = axis.T
    values = np.empty((*axis.shape, degree + 1))
    values[..., 0] = 1.0
    if degree:
        values[..., 1] = axis
    for k in range(2, degree + 1):
        values[..., k] = 2 * axis * values[..., k - 1] - values[..., k - 2]
    return values * UPWARDS


def _find_axis(z: FloatArray, w: FloatArray | None, error: FloatArray) -> FloatArray:
    """Long half axes (R, K) of ellipses with the values of functions of z (k+1, K).

    An ellipse about the foci −1 and 1 with the long half axis a has all numbers whose distances
    from the foci add up to at most 2 a.
    """
    powers = bound_powers(len(z) - 1)
    if w is None:
        rest = powers[:, 2:] @ (np.abs(z[2:]) + error) + 4 * error
        linear = np.abs(z[1]) + error if len(z) > 1 else np.zeros_like(z[0])
        ends = np.abs(1 - z[0] - linear) + np.abs(1 + z[0] - linear)
        return np.asarray(np.maximum(AXES[:, np.newaxis] * linear + ends / 2 + rest, 1.0) * UPWARDS)
    value = Discs.of(z, powers, error).over(Discs.of(w, powers, error))
    center = value.center
    near = (np.abs(1 - center) + np.abs(1 + center)) / 2 + value.radius
    return np.asarray(np.minimum(near, np.sqrt(1 + np.square(value.largest))) * UPWARDS)
