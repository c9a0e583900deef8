"""Evaluates all samples of many patches in a few matrix products (the option `method="matrix"`).

Grids that fit the cache (`fits_cache`) are evaluated here, and larger grids of rational bilinear
patches. Control points and their differences are arrays with the patches innermost, and the results
have a plane for each of x, y and z, so that every step is one operation on long rows.

Rational patches are evaluated in homogeneous coordinates (X, w) with X = w S, relative to the
middle of their batch, because S_u = (X_u − w_u S)/w then has the smallest rounding errors; at the
end, their points are translated back. A model that is very large or very small is scaled by a power
of two, which rounds nothing.
"""

from functools import lru_cache

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints, RealArray
from service.cancellation import checkpoint
from service.engine.evaluation.chunks import (
    CHUNK_SAMPLES,
    SUBNORMAL,
    build_means,
    count_vectors,
    find_shift,
    plan_separable_products,
    plan_whole_products,
    weight_points,
    write_local,
)
from service.engine.extent import find_scale, is_moved
from service.engine.scratch import Real, Workspaces
from service.surface.batches import TensorPatches


def fits_cache(resolution: tuple[int, int]) -> bool:
    """Whether the samples of a patch fit the processor's cache."""
    return (resolution[0] + 1) * (resolution[1] + 1) <= CHUNK_SAMPLES


@lru_cache(256)
def count_chunk(degree: tuple[int, int], resolution: tuple[int, int]) -> int:
    """The number of patches that are evaluated together in one chunk."""
    samples = (resolution[0] + 1) * (resolution[1] + 1)
    fitting = max(1, CHUNK_SAMPLES // max(samples, sum(count_vectors(degree))))
    # A multiple of 16 patches, because a cache line has 16 float32 numbers: so every plane of a
    # chunk begins at a cache line.
    return fitting // 16 * 16 or fitting


def evaluate_at_once(
    patches: TensorPatches,
    resolution: tuple[int, int],
    origin: FloatArray | None,
    positions: RealArray,
    normals: RealArray | None,
    *,
    is_separable: bool,
) -> list[Ints]:
    """Writes points and unit normals; returns the numbers of the doubtful samples.

    A sample is doubtful if S_u × S_v is too short for its direction to be precise; its normal is
    NaN. Samples are numbered over all patches. The vectors S_u × S_v are computed in the precision
    of the result, from differences of the control points in float64.

    Parameters
    ----------
    patches : TensorPatches
        P patches.
    origin : ndarray of float64, shape (3,), or None
        Positions are relative to it.
    positions, normals : ndarray, shape (P, Ru+1, Rv+1, 3)
        The output; `normals` is None if only positions are requested.
    is_separable : bool
        Whether to multiply along u and then along v, else once with the basis of all samples.
    """
    dtype: Real = positions.dtype.type
    sample_count = (resolution[0] + 1) * (resolution[1] + 1)
    doubtful: list[Ints] = []
    chunk, scale = count_chunk(patches.degree, resolution), find_scale(patches.extent)
    dimension = 3 if patches.weights is None else 4
    largest_weight = 1.0 if patches.weights is None else float(patches.weights.max())
    for first in range(0, patches.count, chunk):
        checkpoint()
        rows = slice(first, first + chunk)
        count = len(positions[rows])
        planes = dimension, count
        work = _WORKSPACES.get(patches.degree, resolution, planes, dtype, is_separable)
        np.copyto(work.coordinates, patches.points[rows].reshape(count, -1, 3).transpose(1, 2, 0))
        out = positions[rows].reshape(count, sample_count, 3)
        if patches.weights is None:
            work.load_points(origin, scale)
            work.compute_points()
            # This copy is faster than `np.copyto`.
            np.positive(work.point, out=out.transpose(2, 0, 1))
        else:
            work.load_weighted(patches.weights[rows], largest_weight, patches.middle, scale)
            work.compute_points()
            work.project()
            write_local(work.point, find_shift(patches, origin), scale, out)
        if normals is None:
            continue
        is_doubtful = work.compute_vectors()
        if is_doubtful is not None:
            work.square[is_doubtful] = np.nan
            doubtful.append(is_doubtful.reshape(-1).nonzero()[0] + first * sample_count)
        np.sqrt(work.square, out=work.square)
        out = normals[rows].reshape(count, sample_count, 3)
        np.divide(work.point, work.square, out=out.transpose(2, 0, 1))
    return doubtful


class _Workspace:
    """Memory for a chunk of r patches, divided into all work arrays.

    `planes` is (d, r), with d = 3, or 4 for rational patches. `nets` (K, d, r) are the control
    points, then their differences along u, then those along v; `rounded` has these numbers in the
    working precision. `point` (3, r, samples) is S, and later the vectors S_u × S_v. `products`
    lists the matrix products that compute S, S_u and S_v: two factors and the result of each. S_u
    and S_v are without the factors p and q, which do not change the direction of S_u × S_v.
    `square` is |S_u × S_v|² and then its root. `term` holds intermediate products: w_u S or w_v S,
    the subtracted half of the cross product, and the squares of its coordinates.
    """

    def __init__(
        self,
        degree: tuple[int, int],
        resolution: tuple[int, int],
        planes: tuple[int, int],
        dtype: Real,
        is_separable: bool,
    ) -> None:
        (p, q), (dimension, count) = degree, planes
        point_count, du_count, dv_count = count_vectors(degree)
        vector_count = point_count + du_count + dv_count
        self.nets = np.empty((vector_count, dimension, count))
        self.points = self.nets[:point_count]
        self.coordinates, self.weights = self.points[:, :3], self.points[:, 3:]
        self.difference_nets = self.nets[point_count:]
        grid = self.points.reshape(p + 1, q + 1, -1)
        self.before_u, self.behind_u = grid[:-1], grid[1:]
        self.before_v, self.behind_v = grid[:, :-1], grid[:, 1:]
        self.du_net = self.nets[point_count : point_count + du_count].reshape(p, q + 1, -1)
        self.dv_net = self.nets[point_count + du_count :].reshape(p + 1, q, -1)
        self.rounded = np.empty(self.nets.shape, dtype)
        samples = (resolution[0] + 1) * (resolution[1] + 1)
        # S, S_u and S_v, then three planes for `term` and one for `square`.
        memory = np.empty((3 * dimension + 4, count, samples), dtype)
        results = [memory[i * dimension : (i + 1) * dimension] for i in range(3)]
        point, du, dv = (result[:3] for result in results)
        weight, *self.weight_partials = (result[3:] for result in results)
        self.point, self.weight, self.partials = point, weight, (du, dv)
        self.term = term = memory[-4:-1]
        self.square = memory[-1]
        # For the cross product: y and z of S_u times z and x of S_v, and x times y; then the same
        # with S_u and S_v exchanged. The slice [::-2] of x, y, z is z, x.
        self.factors = (
            (du[1:], dv[::-2], point[:2]),
            (du[0], dv[1], point[2]),
            (du[::-2], dv[1:], term[:2]),
            (du[1], dv[0], term[2]),
        )
        self.is_doubtful = np.empty((count, samples), np.bool_)
        rows = self.rounded.reshape(vector_count, -1)
        self.columns = rows.T
        self.transposed = np.empty_like(rows.T, order="C") if is_separable else None
        if self.transposed is None:
            self.products = plan_whole_products(rows, degree, resolution, results)
        else:
            self.products = plan_separable_products(self.transposed, degree, resolution, results)
        self.differences = rows[point_count:]
        self.squares = np.empty_like(self.differences)
        self.means = build_means(degree, dtype)
        self.coordinate_mean_squares = np.empty((2, dimension * count), dtype)
        self.mean_squares_by_axis = self.coordinate_mean_squares.reshape(2, dimension, -1)[:, :3]
        self.mean_square_u, self.mean_square_v = self.mean_squares = np.empty((2, count), dtype)
        self.threshold = np.empty((count, 1), dtype)
        self.threshold_row = self.threshold[:, 0]
        self.subnormal = dtype(SUBNORMAL[dtype])

    def load_points(self, origin: FloatArray | None, scale: float) -> None:
        """Computes the nets of polynomial patches from `coordinates`.

        Points are relative to the origin. Differences are computed before this translation, and
        scaled. So neither points nor differences lose digits.
        """
        self._subtract_neighbours()
        if scale != 1.0:
            self.difference_nets *= scale
        if origin is not None and is_moved(origin):
            self.points -= origin[:, np.newaxis]

    def load_weighted(
        self, weights: FloatArray, largest_weight: float, middle: FloatArray, scale: float
    ) -> None:
        """Computes homogeneous nets of rational patches, relative to the middle.

        Parameters
        ----------
        weights : ndarray of float64, shape (r, p+1, q+1)
            They are divided by `largest_weight`, the largest weight of the batch.
        middle : ndarray of float64, shape (3,)
        """
        weight_planes = weights.reshape(len(weights), 1, -1).transpose(2, 1, 0)
        np.multiply(weight_planes, 1 / largest_weight, out=self.weights)
        weight_points(self.coordinates, self.weights, middle, scale)
        self._subtract_neighbours()

    def _subtract_neighbours(self) -> None:
        """Computes the differences of neighbouring control points along u and along v."""
        np.subtract(self.behind_u, self.before_u, out=self.du_net)
        np.subtract(self.behind_v, self.before_v, out=self.dv_net)

    def compute_points(self) -> None:
        """Computes S, homogeneous if the patches are rational, from the nets."""
        np.copyto(self.rounded, self.nets, casting="same_kind")
        if self.transposed is not None:
            np.copyto(self.transposed, self.columns)
        for first, second, out in self.products[0]:
            np.matmul(first, second, out=out)

    def project(self) -> None:
        """Divides S by its weight."""
        self.point /= self.weight

    def compute_vectors(self) -> Bools | None:
        """Computes S_u × S_v and its squared length; returns which samples are doubtful.

        The result is a mask (r, samples), or None if no sample is doubtful. For rational patches
        the vectors are (X_u − w_u S) × (X_v − w_v S).
        """
        for products in self.products[1:]:
            for first, second, out in products:
                np.matmul(first, second, out=out)
        if len(self.weight):
            for partial, weight in zip(self.partials, self.weight_partials, strict=True):
                np.multiply(self.point, weight, out=self.term)
                np.subtract(partial, self.term, out=partial)
        for first, second, out in self.factors:
            np.multiply(first, second, out=out)
        point, term = self.point, self.term
        np.subtract(point, term, out=point)
        np.multiply(point, point, out=term)
        np.add.reduce(term, out=self.square)
        # The least squared length that is precise enough is the product of the mean squares of the
        # differences of each patch along u and along v; `means` includes the
        # factor `chunks.PRECISE_SHARE`.
        np.multiply(self.differences, self.differences, out=self.squares)
        np.matmul(self.means, self.squares, out=self.coordinate_mean_squares)
        np.add.reduce(self.mean_squares_by_axis, axis=1, out=self.mean_squares)
        np.multiply(self.mean_square_u, self.mean_square_v, out=self.threshold_row)
        np.maximum(self.threshold_row, self.subnormal, out=self.threshold_row)
        np.less_equal(self.square, self.threshold, out=self.is_doubtful)
        return self.is_doubtful if np.count_nonzero(self.is_doubtful) else None


_WORKSPACES = Workspaces(_Workspace)
