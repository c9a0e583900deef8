"""Tables of splines: many curves, or many surfaces, of any degrees as flat columns.

A part of a thousand faces has thousands of curves. One object for each of them would take most of
the time of reading; a table has one array for each property of all of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints


def find_starts(counts: Ints) -> Ints:
    """Where the rows of each entry begin in a column, (n+1,): 0, c_0, c_0 + c_1, …, Σ c."""
    starts = np.zeros(len(counts) + 1, np.intp)
    counts.cumsum(out=starts[1:])
    return starts


def expand_rows(starts: Ints, numbers: Ints) -> Ints:
    """The rows of chosen entries of a column, one entry after the other.

    Parameters
    ----------
    starts : ndarray of int, shape (n+1,)
        As from `find_starts`.
    numbers : ndarray of int, shape (k,)
        The entries, in any order, also repeated.

    Returns
    -------
    ndarray of int, shape (Σ c[numbers],)
    """
    counts = starts[numbers + 1] - starts[numbers]
    ends = np.cumsum(counts)
    offsets = np.repeat(starts[numbers] - ends + counts, counts)
    return offsets + np.arange(len(offsets))


@dataclass(frozen=True, eq=False)
class CurveTable:
    """n B-spline curves of one dimension D, polynomial or rational, as flat columns.

        C_k(t) = Σ_i N_i(t) w_i P_i / Σ_i N_i(t) w_i  over [U_p, U_{count}]

    with the degree p, the control points P_i, the weights w_i and the knots U of curve k.

    Attributes
    ----------
    degrees : ndarray of int, shape (n,)
    counts : ndarray of int, shape (n,)
        Number of control points of each curve.
    points : ndarray of float64, shape (Σ counts, D)
        Control points, curve after curve.
    weights : ndarray of float64, shape (Σ counts,)
        Positive; 1 for the curves that are not rational.
    is_rational : ndarray of bool, shape (n,)
        Whether the weights of a curve differ.
    knots : ndarray of float64, shape (Σ (counts + degrees + 1),)
        Full knot vectors, curve after curve; no span of a domain is shorter than
        `service.surface.knots.find_least_span`, and inside a domain no multiplicity exceeds the
        degree.
    is_normal : bool
        Whether `service.surface.spline_checks` has accepted the table and made it normal, so that
        it need not be checked again. A table that is made from another one is not marked.
    """

    degrees: Ints
    counts: Ints
    points: FloatArray
    weights: FloatArray
    is_rational: Bools
    knots: FloatArray
    is_normal: bool = field(default=False, init=False)

    def __len__(self) -> int:
        return len(self.degrees)

    @cached_property
    def point_starts(self) -> Ints:
        """The first control point of each curve in `points`, and their number; (n+1,)."""
        return find_starts(self.counts)

    @cached_property
    def knot_starts(self) -> Ints:
        """The first knot of each curve in `knots`, and their number; (n+1,)."""
        return find_starts(self.counts + self.degrees + 1)

    @property
    def domains(self) -> FloatArray:
        """First and last parameter of each curve, (n, 2)."""
        first, last = self.knot_starts[:-1] + self.degrees, self.knot_starts[:-1] + self.counts
        return np.stack([self.knots[first], self.knots[last]], axis=1)

    def select(self, numbers: Ints) -> "CurveTable":
        """The table of the curves with these numbers, in this order."""
        rows = expand_rows(self.point_starts, numbers)
        return CurveTable(
            self.degrees[numbers],
            self.counts[numbers],
            self.points[rows],
            self.weights[rows],
            self.is_rational[numbers],
            self.knots[expand_rows(self.knot_starts, numbers)],
        )


def empty_curves(dimension: int) -> CurveTable:
    """A table without curves."""
    none, no_numbers = np.empty(0, np.intp), np.empty(0)
    no_points = np.empty((0, dimension))
    return CurveTable(none, none, no_points, no_numbers, np.empty(0, bool), no_numbers)


SingleCurve: TypeAlias = tuple[int, FloatArray, FloatArray, FloatArray | None]
"""Degree, knots, control points, and weights if the curve is rational."""


def stack_curves(curves: Sequence[SingleCurve], dimension: int) -> CurveTable:
    """Curves of this dimension as a table."""
    if not curves:
        return empty_curves(dimension)
    degrees, knots, points, weights = zip(*curves, strict=True)
    filled = [
        np.ones(len(net)) if own is None else own for net, own in zip(points, weights, strict=True)
    ]
    return CurveTable(
        np.array(degrees, np.intp),
        np.array([len(each) for each in points], np.intp),
        np.concatenate(points),
        np.concatenate(filled),
        np.array([each is not None for each in weights]),
        np.concatenate(knots),
    )


@dataclass(frozen=True, eq=False)
class SurfaceTable:
    """F tensor-product B-spline surfaces, polynomial or rational, as flat columns.

        S_f(u, v) = Σ_ij N_i(u) N_j(v) w_ij P_ij / Σ_ij N_i(u) N_j(v) w_ij

    over [U_p, U_{nu}] × [V_q, V_{nv}], with the degrees (p, q), the net, the weights and the knots
    of surface f.

    Attributes
    ----------
    degrees : ndarray of int, shape (F, 2)
        (p, q) of each surface.
    counts : ndarray of int, shape (F, 2)
        Numbers of control points along u and along v.
    points : ndarray of float64, shape (Σ nu · nv, 3)
        Control points, surface after surface; in a surface v varies fastest.
    weights : ndarray of float64, shape (Σ nu · nv,)
        Positive; 1 for the surfaces that are not rational.
    is_rational : ndarray of bool, shape (F,)
        Whether the weights of a surface differ.
    knots : ndarray of float64, shape (Σ (nu + p + 1 + nv + q + 1),)
        Full knot vectors: that of u, then that of v, surface after surface, with the spans and
        multiplicities of `CurveTable`.
    is_normal : bool
        As in `CurveTable`.
    """

    degrees: Ints
    counts: Ints
    points: FloatArray
    weights: FloatArray
    is_rational: Bools
    knots: FloatArray
    is_normal: bool = field(default=False, init=False)

    def __len__(self) -> int:
        return len(self.degrees)

    @cached_property
    def point_starts(self) -> Ints:
        """The first control point of each surface in `points`, and their number; (F+1,)."""
        return find_starts(self.counts.prod(axis=1))

    @cached_property
    def knot_starts(self) -> Ints:
        """The first knot of each knot vector in `knots`, and the number of knots; (2F+1,).

        The vector of axis a of surface f has the number 2 f + a.
        """
        return find_starts((self.counts + self.degrees + 1).ravel())

    @property
    def domains(self) -> FloatArray:
        """First and last parameters, (F, 2, 2): surface, axis, end."""
        starts = self.knot_starts[:-1]
        first, last = starts + self.degrees.ravel(), starts + self.counts.ravel()
        return np.stack([self.knots[first], self.knots[last]], axis=1).reshape(-1, 2, 2)

    def select(self, numbers: Ints) -> "SurfaceTable":
        """The table of the surfaces with these numbers, in this order."""
        rows = expand_rows(self.point_starts, numbers)
        vectors = (2 * numbers[:, np.newaxis] + np.arange(2)).ravel()
        return SurfaceTable(
            self.degrees[numbers],
            self.counts[numbers],
            self.points[rows],
            self.weights[rows],
            self.is_rational[numbers],
            self.knots[expand_rows(self.knot_starts, vectors)],
        )
