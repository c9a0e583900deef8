"""Nets of patches over boxes of their parameters, and bounds if parameters are complex.

Proof in docs/proofs.md: "Panels of trimmed faces".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.measures.cells import (
    UPWARDS,
    CellNets,
    MeasuredCells,
    Net,
    along,
    lengths,
)
from service.engine.measures.remainders import Spread, chebyshev
from service.engine.nets.blossoms import restrict
from service.engine.vectors import UNIT


@dataclass(frozen=True, eq=False, slots=True)
class MeasuredPatches:
    """N patches of one degree (p, q), parts of which are measured.

    Attributes
    ----------
    nets : ndarray of float64, shape (N, d, p+1, q+1)
        d = 3, or d = 4 for homogeneous coordinates. The largest weight of each patch is at least ½
        and less than 1.
    errors : ndarray of float64, shape (N,)
        Bounds of the errors of control points by lowering and placing.
    sizes : ndarray of float64, shape (N,)
        The largest absolute coordinate of each net, or 1 if it is smaller.
    orientation : int
        1; or −1 if u and v are exchanged, so that S_u × S_v is on the other side.
    """

    nets: FloatArray
    errors: FloatArray
    sizes: FloatArray
    orientation: int = 1

    @classmethod
    def of(cls, nets: FloatArray, errors: FloatArray) -> "MeasuredPatches":
        """Nets (N, d, p+1, q+1), divided by powers of two so that weights are as required."""
        if nets.shape[1] == 4:
            _, exponent = np.frexp(nets[:, 3].max(axis=(1, 2)))
            nets = np.ldexp(nets, -exponent[:, np.newaxis, np.newaxis, np.newaxis])
        sizes = np.maximum(np.abs(nets[:, :3]).max(axis=(1, 2, 3), initial=1.0), 1.0)
        return cls(nets, errors, sizes)

    @property
    def degree(self) -> tuple[int, int]:
        """Degree (p, q)."""
        return self.nets.shape[2] - 1, self.nets.shape[3] - 1

    def exchange_parameters(self) -> "MeasuredPatches":
        """The patches with u and v exchanged."""
        nets = np.ascontiguousarray(self.nets.swapaxes(2, 3))
        return MeasuredPatches(nets, self.errors, self.sizes, -self.orientation)

    def restrict(
        self, row: Ints, low: FloatArray, high: FloatArray, *, rounded: bool = False
    ) -> "BoxNets":
        """The nets of patches (K,) over boxes [low, high], (2, K) each.

        With `rounded` they are without errors: nets of other surfaces, which are near to these.
        """
        nets = restrict(self.nets.take(row, axis=0), np.array([low, high]))
        p, q = self.degree
        n = max(p, q)
        # Two restrictions round as four halvings do.
        rounding = (4 * (2 * n + 6) + 24 * n + 64) * UNIT * self.sizes[row]
        cells = MeasuredCells(
            np.ascontiguousarray(nets.transpose(1, 2, 3, 0)),
            row,
            np.zeros(len(row), np.intp),
            0.0 * rounding if rounded else self.errors[row],
        )
        return BoxNets(cells, 0.0 * rounding if rounded else rounding, high - low)


class BoxNets(CellNets):
    """Nets over boxes, whose rounding is given, and whose other errors are those of whole patches.

    Parameters
    ----------
    cells : MeasuredCells
    rounding : ndarray of float64, shape (K,)
        Bounds of the rounding of control points.
    widths : ndarray of float64, shape (2, K)
        The lengths of the boxes in the parameters of patches: partials of errors are that much
        smaller.
    """

    def __init__(self, cells: MeasuredCells, rounding: FloatArray, widths: FloatArray) -> None:
        super().__init__(cells)
        error = rounding + cells.point_error
        self.x = Net(self.x.values, error)
        if self.w is not None:
            self.w = Net(self.w.values, error)
        errors = [
            2 * degree * (rounding + cells.point_error * width)
            for degree, width in zip(cells.degree, widths, strict=True)
        ]
        self.x_partials, self.w_partials = (
            tuple(Net(net.values, each) for net, each in zip(nets, errors, strict=False))
            for nets in (self.x_partials, self.w_partials)
        )
        self._sizes: dict[int, tuple[FloatArray, FloatArray]] = {}

    def spread(self, net: Net, powers_u: FloatArray, powers_v: FloatArray) -> Spread:
        """The spread of a net if both parameters are complex.

        `powers_u` and `powers_v` bound the Chebyshev polynomials of u and of v: shape (K or 1, R,
        at least degree + 1).
        """
        value, sizes = self._find_sizes(net)
        deviation = combine(sizes, powers_u, powers_v)
        return Spread(value, deviation, deviation[0])

    def bound_norm(self, net: Net, powers_u: FloatArray, powers_v: FloatArray) -> FloatArray:
        """Bounds (R, K) of the lengths of values of a net; see `spread`."""
        value, sizes = self._find_sizes(net)
        return np.asarray((lengths(value) + combine(sizes, powers_u, powers_v)) * UPWARDS)

    @property
    def changes(self) -> FloatArray:
        """Approximately, how much partials and weights change along u and along v, (2, K).

        It only decides in which direction a box is halved.
        """
        total = np.zeros((2, len(self.x.error)))
        for net in (*self.x_partials, *((self.w,) if self.w is not None else ())):
            value, sizes = self._find_sizes(net)
            size = lengths(value) + 2.0**-1000
            total[0] += sizes[:, 1:].sum(axis=(1, 2)) / size
            total[1] += sizes[:, :, 1:].sum(axis=(1, 2)) / size
        return total

    def _find_sizes(self, net: Net) -> tuple[FloatArray, FloatArray]:
        """The first Chebyshev coefficient of a net, (d, K), and bounds of all others.

        The bounds are (K, a+1, b+1); that of the first coefficient is its error.
        """
        found = self._sizes.get(id(net))
        if found is None:
            rows, columns = net.values.shape[1:3]
            coefficients = along(chebyshev(rows - 1), net.values, 0)
            coefficients = along(chebyshev(columns - 1), coefficients, 1)
            # Each of the two products at most doubles errors, and rounds less than that.
            rounding = 96 * (rows + columns + 2) * UNIT
            error = 16 * net.error + rounding * net.largest
            sizes = lengths(coefficients) + error
            sizes[0, 0] = error
            found = self._sizes[id(net)] = coefficients[:, 0, 0], order_cells(sizes)
        return found


def order_cells(coefficients: FloatArray) -> FloatArray:
    """Coefficients (a, b, K) as (K, a, b), for `combine`."""
    return np.ascontiguousarray(coefficients.transpose(2, 0, 1))


def combine(sizes: FloatArray, powers_u: FloatArray, powers_v: FloatArray) -> FloatArray:
    """Sums (R, K) of sizes (K, a+1, b+1) times powers (K or 1, R, at least degree + 1)."""
    rows, columns = sizes.shape[1:]
    # One product of matrices for each cell, and then one sum.
    lines = powers_u[..., :rows] @ sizes
    total = np.einsum("krb,krb->rk", lines, powers_v[..., :columns])
    return np.asarray(total * (1 + 2.0**-40))
