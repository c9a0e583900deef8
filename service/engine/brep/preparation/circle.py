"""Coordinates around a closed axis: how far they are apart, and which steps cross a line.

All questions are answered from sorted coordinates: time and memory do not grow with the product of
their numbers.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints


@dataclass(frozen=True, eq=False, slots=True)
class Circle:
    """Coordinates around a closed axis, as shares of its period: 0 is at `low`."""

    low: float
    period: float

    def find_distance(self, candidates: FloatArray, values: FloatArray) -> FloatArray:
        """The distance of each candidate to the nearest value; 1 if there are none."""
        around = self._sort(values)
        share = self._reduce(candidates)
        at = np.searchsorted(around, share)
        around = np.concatenate([[-1.0], around, [2.0]])
        return np.minimum(np.minimum(share - around[at], around[at + 1] - share), 1.0)

    def count_near(self, candidates: FloatArray, values: FloatArray, distance: float) -> Ints:
        """How many values are within a distance of each candidate."""
        around, share = self._sort(values), self._reduce(candidates)
        first = np.searchsorted(around, share - distance)
        last = np.searchsorted(around, share + distance, side="right")
        count: Ints = last - first
        return count

    def count_crossings(
        self, candidates: FloatArray, begins: FloatArray, ends: FloatArray
    ) -> FloatArray:
        """How often steps from `begins` to `ends` cross the line of each candidate.

        A step from x to y > x crosses the lines c + k with floor(x − c) < k ≤ floor(y − c); and
        floor(x − c) = floor(x) if c is not above x − floor(x), else one less.
        """
        low, high = (f(begins, ends) for f in (np.minimum, np.maximum))
        low, high = ((each - self.low) / self.period for each in (low, high))
        whole = (np.floor(high) - np.floor(low)).sum()
        share = self._reduce(candidates)
        below = [np.searchsorted(np.sort(each % 1.0), share) for each in (low, high)]
        crossings: FloatArray = whole + below[0] - below[1]
        return crossings

    def _reduce(self, values: FloatArray) -> FloatArray:
        """Shares from 0 to 1 of the period."""
        shares: FloatArray = ((values - self.low) / self.period) % 1.0
        return shares

    def _sort(self, values: FloatArray) -> FloatArray:
        """Shares in ascending order, also of a period before and of one after."""
        shares = np.sort(self._reduce(values))
        return np.concatenate([shares - 1.0, shares, shares + 1.0])
