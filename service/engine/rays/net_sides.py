"""The faces to which nets belong, and their sides."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.rays.bounds import Rays
from service.engine.rays.hits import Hits


@dataclass(frozen=True, eq=False, slots=True)
class NetSides:
    """The faces of N nets.

    Attributes
    ----------
    patch : ndarray of int, shape (N,)
    is_reversed : ndarray of bool, shape (N,)
        Whether the normal of the face is −(du × dv).
    """

    patch: Ints
    is_reversed: Bools

    def find_sines(self, hits: Hits, rays: Rays) -> FloatArray:
        """Sines (n,) of the angles between rays and faces, positive in the direction of normals."""
        sines = hits.sines(rays.direction[:, hits.ray])
        return np.where(self.is_reversed[hits.net], -sines, sines)
