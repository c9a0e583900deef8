"""Up to which distance points and curves of trimmed faces count as equal."""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.splines import project_points
from service.decoders.iges.shapes import find_all_ends
from service.decoders.iges.trimmed import TrimmedFace

LEAST, MOST = 1e-6, 1e-4
"""The tolerance is between these shares of the diagonal, whatever a file says: many files state a
resolution that is finer than their curves, and some one that is as large as their faces."""

ROUNDING = 2.0**-40
"""The tolerance is at least this share of the largest coordinate."""


def choose_tolerances(resolution: float, faces: Sequence[TrimmedFace]) -> tuple[float, float]:
    """The tolerance, in units of the file, for a resolution that the file states; and the most."""
    curves = [
        side.curve
        for face in faces
        for loop in face.loops
        for side in loop
        if side.curve is not None
    ]
    if curves:
        every = find_all_ends(curves).reshape(-1, 3)
    else:
        every = np.concatenate([project_points(f.surface.points).reshape(-1, 3) for f in faces])
    return limit_tolerance(resolution, every), limit_tolerance(np.inf, every)


def limit_tolerance(resolution: float, points: FloatArray) -> float:
    """A resolution, between the least and the most that fits these points, (k, 3)."""
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    least = max(LEAST * diagonal, ROUNDING * float(np.abs(points).max()))
    return max(least, min(resolution, MOST * diagonal)) or LEAST
