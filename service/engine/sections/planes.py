"""Planes, and what is asked of a section."""

from dataclasses import dataclass
from math import inf

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.vectors import cross
from service.errors import InvalidRequest, Issue

RELATIVE_TOLERANCE = 1e-3
"""Of polylines, in diagonals of the box of control points, if nothing is said."""

LEAST_TOLERANCE = 1e-9
"""In diagonals: nearer to the curve rounding is seen."""


@dataclass(frozen=True, eq=False, slots=True)
class Planes:
    """Planes n · p = d.

    Attributes
    ----------
    normals : ndarray of float64, shape (m, 3)
        Unit normals n.
    offsets : ndarray of float64, shape (m,)
        Distances d of the planes from zero, along their normals, in model units.
    """

    normals: FloatArray
    offsets: FloatArray

    @property
    def axes(self) -> tuple[FloatArray, FloatArray]:
        """Unit vectors x and y (m, 3) within each plane: x × y = n.

        x has no part along the axis that follows the longest coordinate of n but one: the axes of
        a plane z = d are those of space.
        """
        rows = np.arange(len(self.normals))
        start = np.zeros_like(self.normals)
        start[rows, (np.abs(self.normals).argmax(axis=1) + 1) % 3] = 1.0
        along = start - np.einsum("mk,mk->m", start, self.normals)[:, np.newaxis] * self.normals
        along /= np.sqrt(np.einsum("mk,mk->m", along, along))[:, np.newaxis]
        along += 0.0  # no −0
        return along, cross(self.normals, along) + 0.0

    def __len__(self) -> int:
        return len(self.normals)


@dataclass(frozen=True, slots=True)
class SectionTolerance:
    """How near polylines shall be to the section.

    Attributes
    ----------
    distance : float or None
        Model units.
    relative : float
        In diagonals of the box of control points; where there is no distance.
    """

    distance: float | None = None
    relative: float = RELATIVE_TOLERANCE

    def within(self, diagonal: float) -> float:
        """The tolerance in model units.

        Raises
        ------
        InvalidRequest
            `tolerance_too_small`.
        """
        if self.distance is None:
            return self.relative * diagonal
        least = LEAST_TOLERANCE * diagonal
        if not least <= self.distance < inf:
            raise InvalidRequest(
                Issue(
                    "tolerance_too_small",
                    "The numbers of the answer are not so precise.",
                    "/tolerance",
                    f"{self.distance:.6g}",
                    f"at least {least:.3g} for this surface",
                )
            )
        return self.distance
