"""Normals where a side of a patch is one point, the usual pole, by a short formula."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints, RealArray
from service.bases.bernstein import sample_basis_with_slopes
from service.bases.cache import MESH_PLANS
from service.surface.batches import TensorPatches

FLAT = 2.0**-36
"""The least angle of a cone: rounding would decide the normals of a flatter cone."""

YZX_ZXY = np.array([1, 2, 0, 2, 0, 1])
"""Coordinates in the two orders that a cross product multiplies."""


@dataclass(frozen=True, eq=False, slots=True)
class _Sides:
    """m sides of patches that are one point each: all have constant u, or all have constant v.

    Attributes
    ----------
    beside : ndarray of int, shape (6, m, n+1)
        The numbers of the next row of control points, in the order `YZX_ZXY`, among all numbers of
        all control points.
    pole : ndarray of int, shape (6, m, 1)
        The numbers of the control point at the pole, likewise.
    weights : ndarray of int, shape (m, n+1)
        The numbers of the weights of the next row.
    sign : ndarray of float64, shape (m, 1)
        The sign of du × dv relative to C′ × C: +1 on the sides u = 0 and v = 1, −1 on the others.
    samples : ndarray of int, shape (m k,)
        The k samples along each side, among all samples of all patches.
    basis : ndarray of float64, shape (n+1, 2k)
        Bernstein basis of degree n at the samples, then its derivatives.
    """

    beside: Ints
    pole: Ints
    weights: Ints
    sign: FloatArray
    samples: Ints
    basis: RealArray


@dataclass(frozen=True, eq=False, slots=True)
class _Plan:
    """The sides that are one point: those of constant u, and those of constant v."""

    sides: tuple[_Sides, ...]

    @property
    def nbytes(self) -> int:
        """Bytes held."""
        arrays = ((s.beside, s.pole, s.weights, s.sign, s.samples, s.basis) for s in self.sides)
        return sum(array.nbytes for each in arrays for array in each)


def write_pole_normals(
    patches: TensorPatches, resolution: tuple[int, int], normals: RealArray
) -> None:
    """Writes limit normals along sides that are one point, the usual pole.

    About the pole, N = v (C'(u) × C(u)) + O(v²) for a side v = 0, where C is the Bézier curve of
    the next row of control points seen from the pole, times their weights. So the limit is the
    normal of the cone over that row, and no polynomial of high degree is needed. Where the cone has
    no tangent plane either, the normals are NaN.

    Parameters
    ----------
    normals : ndarray, shape (P, Ru+1, Rv+1, 3)
    """
    collapsed, degree = patches.collapsed, patches.degree
    if not np.count_nonzero(collapsed):
        return
    key = ("poles", collapsed.tobytes(), degree, resolution)
    plan = MESH_PLANS.get(key, lambda: _plan(patches, resolution))
    assert isinstance(plan, _Plan)
    points, rows = patches.points.reshape(-1), normals.reshape(-1, 3)
    for sides in plan.sides:
        cones = points.take(sides.beside)
        cones -= points.take(sides.pole)
        if patches.weights is not None:
            cones *= patches.weights.reshape(-1).take(sides.weights)
        both = cones @ sides.basis
        count = both.shape[2] // 2
        place, slope = both[:, :, :count], both[:, :, count:]
        vectors = place[:3] * slope[3:]
        vectors -= place[3:] * slope[:3]
        length = np.sqrt(np.add.reduce(vectors * vectors))
        cones *= cones
        sizes = np.add.reduce(cones[:3], axis=(0, 2))
        is_flat = length <= FLAT * sizes[:, np.newaxis]
        if np.count_nonzero(is_flat):
            length[is_flat] = np.nan
        length *= sides.sign
        vectors /= length
        rows[sides.samples] = vectors.reshape(3, -1).T


def _plan(patches: TensorPatches, resolution: tuple[int, int]) -> _Plan:
    """The plan of patches at these divisions."""
    degree, poles = patches.degree, []
    grids = [
        np.arange(patches.count * (m + 1) * (n + 1)).reshape(patches.count, m + 1, n + 1)
        for m, n in (degree, resolution)
    ]
    for axis in range(2):
        index, end = patches.collapsed[:, 2 * axis : 2 * axis + 2].nonzero()
        if len(index):
            # A side along v has differences along u, and a side along u has differences along v.
            across = 1 - axis
            points, samples = (grid if axis == 0 else grid.swapaxes(1, 2) for grid in grids)
            beside, pole = points[index, 1 - 3 * end], points[index, -end, :1]
            next_row, point = (
                3 * rows + YZX_ZXY[:, np.newaxis, np.newaxis] for rows in (beside, pole)
            )
            poles.append(
                _Sides(
                    next_row,
                    point,
                    beside,
                    np.where(end != axis, -1.0, 1.0)[:, np.newaxis],
                    samples[index, -end].ravel(),
                    sample_basis_with_slopes(degree[across], resolution[across]).T,
                )
            )
    return _Plan(tuple(poles))
