"""Many knot vectors in one column: completed, merged and checked together.

The functions follow `service.surface.knots`, which does the same for one knot vector, and words the
errors. A Python call for each knot vector would take most of the time of reading a part.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.surface.checks import MAX_COORDINATE, MAX_DEGREE
from service.surface.knots import MIN_LENGTH, MIN_RATIO, MIN_SPAN
from service.surface.spline_tables import find_starts


@dataclass(frozen=True, eq=False)
class KnotTable:
    """N full knot vectors in one column.

    Attributes
    ----------
    knots : ndarray of float64, shape (Σ (counts + degrees + 1),)
    degrees : ndarray of int, shape (N,)
        1 to `MAX_DEGREE`.
    counts : ndarray of int, shape (N,)
        Control points in this direction, at least degree + 1.
    """

    knots: FloatArray
    degrees: Ints
    counts: Ints

    @cached_property
    def starts(self) -> Ints:
        """The first knot of each vector, and the number of all knots; (N+1,)."""
        return find_starts(self.counts + self.degrees + 1)

    @cached_property
    def vectors(self) -> Ints:
        """The number of the vector of each knot."""
        return np.arange(len(self.degrees)).repeat(self.counts + self.degrees + 1)

    @cached_property
    def ends(self) -> Ints:
        """Positions of the knots U_p and U_{count}, between which the domain is; (2, N)."""
        ends: Ints = self.starts[:-1] + np.array([self.degrees, self.counts])
        return ends

    @cached_property
    def domains(self) -> FloatArray:
        """The first and the last parameter of each vector, (2, N)."""
        return self.knots[self.ends]

    @cached_property
    def is_span(self) -> Bools:
        """Whether the interval from each knot to the next is a span of the domain."""
        position = np.arange(len(self.knots))
        is_span: Bools = np.greater_equal(position, self.ends[0][self.vectors])
        is_span &= position < self.ends[1][self.vectors]
        is_span[:-1] &= self.knots[1:] > self.knots[:-1]
        return is_span

    @cached_property
    def span_counts(self) -> Ints:
        """The number of spans of each vector, (N,)."""
        return np.bincount(self.vectors[self.is_span], minlength=len(self.degrees))

    def merge(self) -> "KnotTable":
        """The table in which knots that differ by rounding alone are equal.

        The rule is that of `service.bases.knots.merge_knots`, with `find_least_span`. Knots must be
        finite.
        """
        knots, vectors = self.knots, self.vectors
        low, high = self.domains
        least = np.maximum(
            MIN_SPAN * (high - low), MIN_RATIO * np.maximum(np.abs(low), np.abs(high))
        )
        least = np.maximum(least, MIN_LENGTH)[vectors]
        is_first = np.ones(len(knots), bool)  # of a cluster
        np.greater_equal(knots[1:] - knots[:-1], least[1:], out=is_first[1:])
        is_first[self.starts[:-1]] = True
        number = np.cumsum(is_first) - 1
        first = np.flatnonzero(is_first)
        last = np.append(first[1:], len(knots)) - 1
        is_wide = knots[last] > knots[first]
        if not is_wide.any():
            return self
        new_knot, max_count = knots[first], self.degrees[vectors[first]].copy()
        for end in self.ends:
            new_knot[number[end]], max_count[number[end]] = knots[end], self.degrees + 1
        is_merged = is_wide & (knots[last] - knots[first] < least[first])
        is_merged &= last - first < max_count
        merged = np.where(is_merged[number], new_knot[number], knots)
        return KnotTable(merged, self.degrees, self.counts)

    def find_disordered(self) -> Bools:
        """Whether each vector has a knot out of range, a decrease, or degree + 2 equal knots."""
        knots, vectors = self.knots, self.vectors
        is_wrong = ~(np.abs(knots) <= MAX_COORDINATE)  # true for NaN, too
        is_wrong[1:] |= (knots[1:] < knots[:-1]) & (vectors[1:] == vectors[:-1])
        return self._any(is_wrong | self._find_equal(1))

    def find_discontinuous(self) -> Bools:
        """Whether each vector has no domain, too short a span, or a jump inside its domain.

        The vectors must be merged and must not be disordered. At degree + 1 equal knots inside its
        domain a spline would be discontinuous.
        """
        (low, high), vectors = self.domains, self.vectors
        is_short = self.is_span.copy()  # the last knot begins no span
        is_short[:-1] &= self.knots[1:] - self.knots[:-1] < MIN_LENGTH
        is_inside = (self.knots > low[vectors]) & (self.knots < high[vectors])
        is_wrong: Bools = self._any(is_short | (is_inside & self._find_equal(0))) | ~(low < high)
        return is_wrong

    def _find_equal(self, excess: int) -> Bools:
        """Whether each knot equals the knot of its vector that is degree + `excess` later."""
        later = np.arange(len(self.knots)) + self.degrees[self.vectors] + excess
        has_later = later < self.starts[1:][self.vectors]
        later[~has_later] = 0
        is_equal: Bools = has_later & (self.knots[later] == self.knots)
        return is_equal

    def _any(self, is_knot: Bools) -> Bools:
        """Whether any knot of each vector is one of these."""
        return np.bincount(self.vectors[is_knot], minlength=len(self.degrees)) > 0


def has_valid_form(degrees: Ints, counts: Ints, lengths: Ints) -> Bools:
    """Whether degrees are allowed, and numbers of control points and of knots fit them, (N,).

    `lengths` has the numbers of knots; the first and the last knot may both be missing.
    """
    missing = counts + degrees + 1 - lengths
    is_degree = (degrees >= 1) & (degrees <= MAX_DEGREE)
    has_form: Bools = is_degree & (counts > degrees) & ((missing == 0) | (missing == 2))
    return has_form


def complete_knots(knots: FloatArray, lengths: Ints, degrees: Ints, counts: Ints) -> KnotTable:
    """The table of full knot vectors; a missing first and last knot equal their neighbours.

    Parameters
    ----------
    knots : ndarray of float64, shape (Σ lengths,)
        Of a form that `has_valid_form`.
    lengths, degrees, counts : ndarray of int, shape (N,)
    """
    knots = knots + 0.0  # −0 becomes 0, so that equal splines have equal bytes
    full = counts + degrees + 1
    if (full != lengths).any():
        starts, full_starts = find_starts(lengths), find_starts(full)
        position = np.arange(full_starts[-1]) - np.repeat(full_starts[:-1], full)
        position -= np.repeat((full - lengths) // 2, full)
        position = np.clip(position, 0, np.repeat(lengths - 1, full))
        knots = knots[position + np.repeat(starts[:-1], full)]
    return KnotTable(knots, degrees, counts)
