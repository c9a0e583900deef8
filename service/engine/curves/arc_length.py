"""The length of a curve up to each of its samples, by adaptive Gauss–Legendre quadrature.

    s(t) = ∫ |C′(τ)| dτ

The integrand is analytic except where C′ vanishes. Near such a parameter the intervals are halved
until their lengths are negligible.
"""

import numpy as np
from numpy.polynomial.legendre import leggauss

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.curves.evaluation import CHUNK, CurveSamples
from service.engine.vectors import UNIT, length
from service.surface.curve_model import CurvePieces

COARSE, FINE = (leggauss(count) for count in (6, 12))
"""Nodes and weights over [−1, 1] of two rules. If both rules give nearly the same integral, the
error of the finer rule is far smaller than the difference of the two integrals."""

ACCURACY = 1e-12
"""The largest difference of the two rules on one interval, relative to the sum of the length of the
interval and the mean length of all intervals. So the sum of all differences is at most twice this
times the length of the curve, except for rounding."""

MAX_HALVINGS = 60
"""The most halvings of an interval. Over an interval of length 2⁻⁶⁰, the arc is negligible."""

MAX_GROWTH = 256
"""The most open intervals for each initial interval, approximately; an interval is open while its
length is too imprecise. Near a cusp, one of two halves stays open; elsewhere a few halvings are
enough. More open intervals than this come from rounding, and their lengths are accepted."""


def arc_lengths(pieces: CurvePieces, samples: CurveSamples) -> FloatArray:
    """Length of the curve from its beginning to each sample, shape (N,).

    Parameters
    ----------
    samples : CurveSamples
        In order along the curve, from its beginning to its end; a joint of two pieces is at t = 0
        of the second piece.
    """
    piece = samples.piece[:-1]
    # An interval ends at the next sample, or at t = 1 if the next sample is in another piece.
    end: FloatArray = np.where(samples.piece[1:] == piece, samples.t[1:], 1.0)
    speeds = Speeds(pieces)
    step = max(1, CHUNK // (len(FINE[0]) * (pieces.degree + 1) * pieces.dimension))
    coarse, fine = np.empty(len(piece)), np.empty(len(piece))
    for first in range(0, len(piece), step):
        rows = slice(first, first + step)
        coarse[rows], fine[rows] = speeds.integrals(piece[rows], samples.t[:-1][rows], end[rows])
    total_length = float(fine.sum())
    mean_length = total_length / len(piece)
    rounding = speeds.rounding[piece] * (end - samples.t[:-1])
    open_rows = np.flatnonzero(np.abs(fine - coarse) > ACCURACY * (fine + mean_length) + rounding)
    lengths = fine
    lengths[open_rows] = 0.0
    step = max(1, step // 16)  # leaves memory for the halves of the intervals
    for first in range(0, len(open_rows), step):
        block = open_rows[first : first + step]
        _refine(
            speeds, lengths, (block, piece[block], samples.t[:-1][block], end[block]), mean_length
        )
    return np.concatenate([[0.0], np.cumsum(lengths)])


def find_lengths(pieces: CurvePieces, samples: CurveSamples) -> FloatArray:
    """Length of the curve up to each of N samples in any order, and of the whole curve: (N+1,).

    The samples are sorted, together with the beginnings of all pieces and the end of the curve.
    """
    ends = CurveSamples.uniform(pieces.count, 1)
    piece = np.concatenate([samples.piece, ends.piece])
    t = np.concatenate([samples.t, ends.t])
    order = np.lexsort((t, piece))
    lengths = np.empty(len(order))
    lengths[order] = arc_lengths(pieces, CurveSamples(piece[order], t[order]))
    return lengths[[*range(len(samples)), len(lengths) - 1]]


def _refine(
    speeds: "Speeds",
    lengths: FloatArray,
    intervals: tuple[Ints, Ints, FloatArray, FloatArray],
    mean_length: float,
) -> None:
    """Adds the lengths of intervals (number, piece, begin, end) to `lengths[number]` by halving."""
    number, piece, begin, end = intervals
    max_intervals = MAX_GROWTH * (len(number) + 1)
    for _ in range(MAX_HALVINGS):
        middle = begin + (end - begin) / 2
        number, piece = np.repeat(number, 2), np.repeat(piece, 2)
        begin = np.stack([begin, middle], axis=1).ravel()
        end = np.stack([middle, end], axis=1).ravel()
        coarse, fine = speeds.integrals(piece, begin, end)
        # Two halves share what their interval was allowed, so that the sum of all differences stays
        # below its bound.
        mean_length /= 2
        rounding = speeds.rounding[piece] * (end - begin)
        is_done = np.abs(fine - coarse) <= ACCURACY * (fine + mean_length) + rounding
        if len(number) > max_intervals:
            is_done[:] = True
        np.add.at(lengths, number[is_done], fine[is_done])
        is_open = ~is_done
        number, piece = number[is_open], piece[is_open]
        begin, end = begin[is_open], end[is_open]
        if not len(number):
            return
    np.add.at(lengths, number, speeds.integrals(piece, begin, end)[1])


class Speeds:
    """Computes the speed |C′| of pieces; the control points are relative to the middle of each."""

    def __init__(self, pieces: CurvePieces) -> None:
        low, high = pieces.points.min(axis=1), pieces.points.max(axis=1)
        local = pieces.points - (low + (high - low) / 2)[:, None]
        # In units of a power of two, so that the squares of small numbers do not underflow.
        exponent = float(np.frexp(np.abs(local).max())[1])
        self.unit = 2.0 ** max(exponent, -1000.0)
        self.points: FloatArray = local / self.unit
        # The nets of C′; of a rational curve, those of (w C)′ and w′.
        self.derivative_nets: FloatArray = pieces.degree * np.diff(self.points, axis=1)
        self.weights = pieces.weights
        self.degree = pieces.degree
        if self.weights is not None:
            self.weighted: FloatArray = self.weights[:, :, None] * self.points
            self.derivative_nets = self.degree * np.diff(self.weighted, axis=1)
            self.weight_derivatives: FloatArray = self.degree * np.diff(self.weights, axis=1)
        self.rounding: FloatArray = self._bound_rounding() * self.unit

    def _bound_rounding(self) -> FloatArray:
        """Bound of the rounding error of the speed on each piece, (S,), in units of `self.unit`."""
        max_speed = np.abs(self.derivative_nets).max(axis=(1, 2))
        if self.weights is not None:
            max_coordinate = np.abs(self.points).max(axis=(1, 2))
            max_speed = (
                max_speed + max_coordinate * np.abs(self.weight_derivatives).max(axis=1)
            ) / self.weights.min(axis=1)
        bound: FloatArray = 16 * (self.degree + 1) * UNIT * max_speed
        return bound

    def integrals(
        self, piece: Ints, begin: FloatArray, end: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Lengths of intervals of pieces by the coarse and by the fine rule, (M,) each."""
        half = (end - begin) / 2
        lengths = []
        for nodes, weights in (COARSE, FINE):
            t = (begin + half)[:, None] + half[:, None] * nodes
            lengths.append(half * (self.evaluate(piece, t) * weights).sum(axis=1))
        return lengths[0], lengths[1]

    def evaluate(self, piece: Ints, t: FloatArray) -> FloatArray:
        """|C′| at k parameters of each of M pieces, (M, k), in model units."""
        shape = t.shape
        lower_basis = bernstein(self.degree - 1, t.ravel()).reshape(*shape, -1)
        derivative = np.einsum("mki,mid->mkd", lower_basis, self.derivative_nets[piece])
        if self.weights is not None:
            basis = bernstein(self.degree, t.ravel()).reshape(*shape, -1)
            w = np.einsum("mki,mi->mk", basis, self.weights[piece])[..., None]
            dw = np.einsum("mki,mi->mk", lower_basis, self.weight_derivatives[piece])[..., None]
            point = np.einsum("mki,mid->mkd", basis, self.weighted[piece]) / w
            derivative = (derivative - point * dw) / w
        speed: FloatArray = length(derivative, -1) * self.unit
        return speed
