"""Nets in the frame of a part: placed, moved to its origin and scaled."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.scenes.placing import scalings
from service.engine.vectors import UNIT, Items

IDENTITY = np.eye(4)


@dataclass(frozen=True, eq=False, slots=True)
class Frame:
    """Coordinates x of a model are (x − origin) / scale in nets; the scale is a power of two."""

    origin: FloatArray
    scale: float


@dataclass(frozen=True, eq=False, slots=True)
class NetRows(Items):
    """The faces, patches or edges of m nets.

    Attributes
    ----------
    patch : ndarray of int, shape (m,)
        The number in the request: of the face, or of the patch.
    copy : ndarray of int, shape (m,)
        The copy of a brep, in the order of the request; −1 for patches without trims.
    face : ndarray of int, shape (m,)
        The face among those of all breps; `WHOLE` for edges, and for patches without trims; `COVER`
        for points that only cover borders.
    span : ndarray of int, shape (m,)
        The patch of the surface in the model of all surfaces of the brep, or in that of all patches
        without trims; −1 for edges.
    low, high : ndarray of float64, shape (2, m)
        The parameters of the surface of the face at the corners (0, 0) and (1, 1).
    corners : ndarray of float64, shape (8, m)
        The parameters (u, v) of the patch `span` at (0, 0), (1, 0), (0, 1), (1, 1).
    errors : ndarray of float64, shape (m,)
        How far the nets may be from their surfaces or curves, in their coordinates.
    gaps, reaches : ndarray of float64, shape (m,)
        As those of `NetTrims`.
    """

    patch: Ints
    copy: Ints
    face: Ints
    span: Ints
    low: FloatArray
    high: FloatArray
    corners: FloatArray
    errors: FloatArray
    gaps: FloatArray
    reaches: FloatArray


def place_nets(
    values: FloatArray,
    middles: FloatArray,
    sizes: FloatArray,
    errors: FloatArray,
    *,
    matrix: FloatArray | None,
    frame: Frame,
) -> tuple[FloatArray, FloatArray]:
    """Nets in the frame of a part, (p+1, q+1, 3 or 4, m), and how far they may be off, (m,).

    Parameters
    ----------
    values : ndarray of float64, shape (m, 3 or 4, p+1, q+1)
        About the middles (3, m); homogeneous if rational.
    sizes : ndarray of float64, shape (m,)
        No coordinate of a point of the nets is larger.
    errors : ndarray of float64, shape (m,)
        How far the nets may be from their surfaces or curves, before placing. Model units.
    """
    placement = IDENTITY if matrix is None else matrix
    linear, shift = placement[:3, :3], placement[:3, 3]
    moved = (linear @ middles + shift[:, np.newaxis]) - frame.origin[:, np.newaxis]
    points = (
        np.einsum("ij,mj...->mi...", linear, values[:, :3])
        if matrix is not None
        else (values[:, :3].copy())
    )
    weights = values[:, 3:] if values.shape[1] == 4 else 1.0
    points += moved.T[:, :, np.newaxis, np.newaxis] * weights
    points /= frame.scale
    if values.shape[1] == 4:
        points = np.concatenate([points, values[:, 3:]], axis=1)
    # The rounding of each coordinate: sums of three products, and of the middle and the origin.
    magnitude = np.abs(linear) @ (np.abs(middles) + sizes) + np.abs(shift)[:, np.newaxis]
    magnitude += np.abs(frame.origin)[:, np.newaxis]
    total = scalings(matrix)[1] * errors + 16 * UNIT * magnitude.sum(axis=0)
    return np.ascontiguousarray(points.transpose(2, 3, 1, 0)), total / frame.scale
