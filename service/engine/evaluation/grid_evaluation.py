"""The evaluation of tensor-product patches on grids of samples, with any method, and at poles.

At a pole a side of a patch is one point; normals there follow from a short formula.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints, RealArray
from service.bases.bernstein import sample_basis_with_slopes, sample_parameters
from service.bases.cache import MESH_PLANS
from service.engine.evaluation.chunks import ChunkNets
from service.engine.evaluation.evaluation_state import Evaluation, PatchSamples
from service.engine.evaluation.normals import unit_normals
from service.engine.scratch import Real, scratch
from service.surface.batches import TensorPatches


class GridEvaluation(Evaluation):
    """Tensor-product patches on grids of samples.

    `shape` is (Ru+1, Rv+1), `sample_count` the product of both numbers; results have the shape
    (P, Ru+1, Rv+1, 3). `net_rows` are the rows of the nets of S, S_u and S_v in an array that has
    one net after another (`ChunkNets.rows`).
    """

    patches: TensorPatches

    def __init__(
        self,
        patches: TensorPatches,
        resolution: tuple[int, int],
        dtype: Real,
        out: PatchSamples,
        origin: FloatArray | None,
    ) -> None:
        self.resolution = resolution
        self.shape = (resolution[0] + 1, resolution[1] + 1)
        p, q = patches.degree
        point_end, du_end = (p + 1) * (q + 1), (2 * p + 1) * (q + 1)
        self.net_rows = (
            slice(0, point_end),
            slice(point_end, du_end),
            slice(du_end, du_end + (p + 1) * q),
        )
        super().__init__(patches, self.shape[0] * self.shape[1], dtype, out, origin)

    def load_nets(self, first: int, last: int) -> ChunkNets:
        """The nets of patches [first, last)."""
        p, q = self.patches.degree
        point_rows, du_rows, dv_rows = self.net_rows
        count = (point_rows if self.normals is None else dv_rows).stop
        rows = scratch("nets", (count, self.dimension, last - first), np.float64)
        point = rows[point_rows].reshape(p + 1, q + 1, *rows.shape[1:])
        net = self.load_points(first, last, rows[point_rows]).reshape(point.shape)
        if self.normals is None:
            return ChunkNets(rows, point)
        du = rows[du_rows].reshape(p, q + 1, *rows.shape[1:])
        dv = rows[dv_rows].reshape(p + 1, q, *rows.shape[1:])
        np.subtract(net[1:], net[:-1], out=du)
        np.subtract(net[:, 1:], net[:, :-1], out=dv)
        return ChunkNets(rows, point, du, dv, self.find_thresholds(du, dv))

    def _compute_normals_singly(self, patch: Ints, sample: Ints) -> tuple[FloatArray, int]:
        """Normals of samples, each computed singly; and the number of limits among them."""
        i, j = np.divmod(sample, self.shape[1])
        u, v = (sample_parameters(r) for r in self.resolution)
        return unit_normals(self.patches, patch, u[i], v[j])

    def _write_poles(self, normals: RealArray) -> None:
        """Writes limit normals along collapsed sides, unless the pole has no tangent plane."""
        write_pole_normals(self.patches, self.resolution, normals)


MIN_CONE_ANGLE = 2.0**-36
"""The least angle of a cone, in radians: rounding would decide the normals of a narrower cone."""

YZX_ZXY = np.array([1, 2, 0, 2, 0, 1])
"""Coordinates in the two orders that a cross product multiplies."""


@dataclass(frozen=True, eq=False, slots=True)
class _Sides:
    """m sides of patches that are one point each: either all of constant u, or all of constant v.

    n is the degree along the sides. C is the curve of `write_pole_normals`.

    Attributes
    ----------
    beside : ndarray of int, shape (6, m, n+1)
        Indices, into the coordinates of all control points, of the row of control points next to
        the side, in the order `YZX_ZXY`.
    pole : ndarray of int, shape (6, m, 1)
        Indices, into the coordinates of all control points, of the control point at the pole, in
        the order `YZX_ZXY`.
    weights : ndarray of int, shape (m, n+1)
        Indices, into all weights, of the row of control points next to the side.
    sign : ndarray of float64, shape (m, 1)
        The sign of S_u × S_v relative to C × C′: +1 on the sides u = 0 and v = 1, −1 on the others.
    samples : ndarray of int, shape (m k,)
        Numbers of the k samples along each side, among all samples of all patches.
    basis : ndarray of float64, shape (n+1, 2k)
        The Bernstein basis of degree n at the samples, then the derivatives of the basis ÷ n.
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
        """Bytes of all arrays."""
        arrays_of_sides = (
            (s.beside, s.pole, s.weights, s.sign, s.samples, s.basis) for s in self.sides
        )
        return sum(array.nbytes for arrays in arrays_of_sides for array in arrays)


def write_pole_normals(
    patches: TensorPatches, resolution: tuple[int, int], normals: RealArray
) -> None:
    """Writes limit normals along sides that are one point: poles.

    Let the side be v = 0. Near the pole, N = v (C'(u) × C(u)) + O(v²). C is the Bézier curve of the
    next row of control points, taken relative to the pole and multiplied by their weights. So the
    limit is the normal of the cone from the pole over C, and no polynomial of high degree is
    needed. Where this cone has no tangent plane, the normals are NaN.

    Parameters
    ----------
    normals : ndarray, shape (P, Ru+1, Rv+1, 3)
    """
    collapsed, degree = patches.collapsed, patches.degree
    if not np.count_nonzero(collapsed):
        return
    key = ("poles", collapsed.tobytes(), degree, resolution)
    plan = MESH_PLANS.get(key, lambda: _plan_poles(patches, resolution))
    assert isinstance(plan, _Plan)
    points, rows = patches.points.reshape(-1), normals.reshape(-1, 3)
    for sides in plan.sides:
        # The control vectors of the curves C, shape (6, m, n+1): rows 0 to 2 are y, z, x, and rows
        # 3 to 5 are z, x, y (`YZX_ZXY`).
        control_vectors = points.take(sides.beside)
        control_vectors -= points.take(sides.pole)
        if patches.weights is not None:
            control_vectors *= patches.weights.reshape(-1).take(sides.weights)
        values_and_slopes = control_vectors @ sides.basis
        count = values_and_slopes.shape[2] // 2
        value, slope = values_and_slopes[:, :, :count], values_and_slopes[:, :, count:]
        vectors = value[:3] * slope[3:]
        vectors -= value[3:] * slope[:3]
        length = np.sqrt(np.add.reduce(vectors * vectors))
        # |C × C′| / |C|² is about the angle of the cone; the sum of the squares of the control
        # points stands for |C|².
        control_vectors *= control_vectors
        sizes = np.add.reduce(control_vectors[:3], axis=(0, 2))
        is_narrow = length <= MIN_CONE_ANGLE * sizes[:, np.newaxis]
        if np.count_nonzero(is_narrow):
            length[is_narrow] = np.nan
        length *= sides.sign
        vectors /= length
        rows[sides.samples] = vectors.reshape(3, -1).T


def _plan_poles(patches: TensorPatches, resolution: tuple[int, int]) -> _Plan:
    """Plans the normals at the poles of patches on grids of this resolution."""
    degree, sides = patches.degree, []
    # The numbers of all control points, and those of all samples, as one grid for each patch.
    grids = [
        np.arange(patches.count * (m + 1) * (n + 1)).reshape(patches.count, m + 1, n + 1)
        for m, n in (degree, resolution)
    ]
    for axis in range(2):
        index, end = patches.collapsed[:, 2 * axis : 2 * axis + 2].nonzero()
        if len(index):
            # Along a side of constant u, v varies, and the reverse. `end` is 0 at the beginning of
            # the axis and 1 at its end: the side has the index 0 or −1, the row beside it 1 or −2.
            along = 1 - axis
            points, samples = (grid if axis == 0 else grid.swapaxes(1, 2) for grid in grids)
            beside, pole = points[index, 1 - 3 * end], points[index, -end, :1]
            beside_coordinates, pole_coordinates = (
                3 * rows + YZX_ZXY[:, np.newaxis, np.newaxis] for rows in (beside, pole)
            )
            sides.append(
                _Sides(
                    beside_coordinates,
                    pole_coordinates,
                    beside,
                    np.where(end != axis, -1.0, 1.0)[:, np.newaxis],
                    samples[index, -end].ravel(),
                    sample_basis_with_slopes(degree[along], resolution[along]).T,
                )
            )
    return _Plan(tuple(sides))
