"""Discs of complex numbers that contain the values of functions on ellipses.

A disc has a real centre, and a radius for each of R ellipses. Sums, products and quotients are
discs that contain all results, with their rounding.

Proof in docs/proofs.md: "Panels of trimmed faces".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.measures.cells import UPWARDS

ROUNDING = 2.0**-48
"""Share of the largest value in a disc that covers the rounding of a few operations."""


@dataclass(frozen=True, eq=False, slots=True)
class Discs:
    """K discs on R ellipses: |z − centre| ≤ radius.

    Attributes
    ----------
    center : ndarray of float64, shape (K,)
    radius : ndarray of float64, shape (R, K)
        Infinite or NaN where nothing is known.
    """

    center: FloatArray
    radius: FloatArray

    @classmethod
    def of(cls, coefficients: FloatArray, powers: FloatArray, error: FloatArray) -> "Discs":
        """The values of polynomials.

        Parameters
        ----------
        coefficients : ndarray of float64, shape (n+1, K)
            Chebyshev coefficients.
        powers : ndarray of float64, shape (R, at least n+1)
            Bounds of |T_k| on the ellipses.
        error : ndarray of float64, shape (K,)
            Bounds of the errors of coefficients.
        """
        longest = np.abs(coefficients[1:]) + error
        radius = powers[:, 1 : len(coefficients)] @ longest + error
        return cls(coefficients[0], radius * UPWARDS)

    @property
    def largest(self) -> FloatArray:
        """Bounds of |z|, (R, K)."""
        return np.asarray((np.abs(self.center) + self.radius) * UPWARDS)

    @property
    def least(self) -> FloatArray:
        """Lower bounds of |z|, (R, K); NaN if the disc may contain 0."""
        least = np.abs(self.center) - self.radius * UPWARDS
        return np.where(least > 0, least, np.nan)

    def minus(self, other: "Discs") -> "Discs":
        """The differences of numbers in two discs."""
        return _about(self.center - other.center, self.radius + other.radius)

    def times(self, other: "Discs") -> "Discs":
        """The products of numbers in two discs."""
        radius = np.abs(self.center) * other.radius + self.radius * other.largest
        return _about(self.center * other.center, radius)

    def over(self, other: "Discs") -> "Discs":
        """The quotients of numbers in two discs."""
        center = self.center / other.center
        radius = (self.radius + np.abs(center) * other.radius) / other.least
        return _about(center, radius)


def _about(center: FloatArray, radius: FloatArray) -> Discs:
    """Discs that are larger by the rounding of centres and radii."""
    return Discs(center, radius * UPWARDS + np.abs(center) * ROUNDING)
