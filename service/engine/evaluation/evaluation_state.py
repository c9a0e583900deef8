"""The state of one evaluation, with the steps that load nets and write points and normals.

All methods share these steps. Nets are differenced, centred and scaled in float64. Samples are
computed in the precision of the result. A normal for which this precision is not sufficient is
computed again (`service.engine.evaluation.normals`).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints, RealArray
from service.bases.row_batches import row_runs
from service.engine.evaluation.chunks import (
    CHUNK_SAMPLES,
    PRECISE_SHARE,
    SUBNORMAL,
    find_shift,
    weight_points,
    write_local,
)
from service.engine.extent import find_scale, is_moved
from service.engine.scratch import Real, scratch
from service.surface.batches import Patches

SINGLE_NORMAL_COST = 128
"""Computing one normal singly takes as long as evaluating this number of samples in float64."""


@dataclass(frozen=True, eq=False, slots=True)
class PatchSamples:
    """Points and unit normals at all samples of P patches: (P, Ru+1, Rv+1, 3).

    Those of triangular patches have the shape (P, (R+1)(R+2)/2, 3).

    `poles` counts the samples at which S_u × S_v vanishes.
    """

    positions: RealArray
    normals: RealArray | None
    poles: int


class Evaluation(ABC):
    """The state of one evaluation: inputs, outputs, and the steps that all methods share.

    `sample_count` is the number of samples of one patch. `positions` and `normals` are the arrays
    of the result. `doubtful` lists samples, numbered over all patches: their normals are too
    imprecise, and `finish` computes them again.
    """

    def __init__(
        self,
        patches: Patches,
        sample_count: int,
        dtype: Real,
        out: PatchSamples,
        origin: FloatArray | None,
    ) -> None:
        self.patches = patches
        self.sample_count = sample_count
        self.dtype = dtype
        self.is_rational = patches.weights is not None
        self.positions = out.positions
        self.normals = out.normals
        self.origin = None if origin is None or not is_moved(origin) else origin
        # Nets are scaled, and weights are divided by the largest weight, as in the module
        # `at_once`, which says why nets are scaled.
        self.scale = find_scale(patches.extent)
        self.largest_weight = 1.0 if patches.weights is None else float(patches.weights.max())
        self.dimension = 4 if self.is_rational else 3
        self.doubtful: list[Ints] = []

    def load_points(self, first: int, last: int, point: FloatArray) -> FloatArray:
        """Writes the control points of patches [first, last), ready for evaluation.

        They are relative to the origin; or, if the patches are rational, homogeneous, relative to
        the batch's middle and scaled. The patches are the innermost axis, so that differences
        between neighbours in a net are operations on long contiguous rows.

        Parameters
        ----------
        point : ndarray of float64, shape (K, d, r)
            The output.

        Returns
        -------
        ndarray of float64, shape (K, d, r)
            The control points whose differences give the partials: `point` itself, or another
            array if the origin or the scale of positions differs from that of partials.
        """
        np.copyto(point[:, :3], self._planes(self.patches.points, first, last))
        if self.patches.weights is not None:
            weights = self.patches.weights[first:last].reshape(last - first, -1).T
            np.multiply(weights, 1 / self.largest_weight, out=point[:, 3])
            weight_points(point[:, :3], point[:, 3:], self.patches.middle, self.scale)
            return point
        if self.origin is None and self.scale == 1.0:
            return point
        # Positions are relative to the requested origin, but partials are differences of the
        # original points: so neither loses digits.
        net: FloatArray = point * self.scale
        if self.origin is not None:
            point -= self.origin[:, None]
        return net

    def sample_planes(self, *shape: int) -> tuple[RealArray, RealArray, RealArray]:
        """Work arrays for S, S_u and S_v at samples of this shape: planes of coordinates."""
        planes = (self.dimension, *shape)
        point, du, dv = (scratch(name, planes, self.dtype) for name in ("point", "du", "dv"))
        return point, du, dv

    def find_thresholds(self, du: FloatArray, dv: FloatArray) -> FloatArray:
        """The least |S_u × S_v|² that is precise enough, for each patch, (r,).

        It is the product of the mean squares of the differences along u and of those along v, times
        the square of `PRECISE_SHARE`. `du` and `dv` (…, d, r) are these differences.
        """
        # A mean square is a sum of squares, divided by the number of vectors in the net of one
        # patch: `du.size` / (d r), or `dv.size` / (d r).
        dimension, count = du.shape[-2:]
        threshold = _square_sums(du) * _square_sums(dv)
        threshold *= PRECISE_SHARE[self.dtype] ** 2 / (du.size * dv.size / (dimension * count) ** 2)
        np.maximum(threshold, SUBNORMAL[self.dtype], out=threshold)
        return threshold

    def write_positions(self, planes: RealArray, out: RealArray) -> None:
        """Writes S from its `planes` (d, …) at samples, evaluated from the net of `load_points`.

        Homogeneous planes are projected in place.
        """
        if self.is_rational:
            self.write_local(planes, out)
        else:
            np.positive(planes, out=_take_coordinates(out))

    def load_local(self, first: int, last: int) -> FloatArray:
        """Control points (K, d, r) relative to the batch's middle, in the scale of the evaluation.

        They are homogeneous if the patches are rational.
        """
        points = self._planes(self.patches.points, first, last)
        if self.is_rational:
            return self.load_points(first, last, np.empty((len(points), 4, last - first)))
        return (points - self.patches.middle[:, None]) * self.scale

    @staticmethod
    def _planes(points: FloatArray, first: int, last: int) -> FloatArray:
        """The control points (P, …, 3) of patches [first, last) as planes (K, 3, r): a view."""
        return points[first:last].reshape(last - first, -1, 3).transpose(1, 2, 0)

    def write_local(self, planes: RealArray, out: RealArray) -> None:
        """Writes S from its `planes` (d, …) at samples, evaluated from the net of `load_local`.

        Homogeneous planes are projected in place.
        """
        if self.is_rational:
            planes[:3] /= planes[3]
        write_local(planes, find_shift(self.patches, self.origin), self.scale, out)

    def write_normals(
        self,
        vectors: RealArray,
        out: RealArray,
        threshold: RealArray,
        first: int,
    ) -> None:
        """Writes the vectors of samples as unit vectors, and records the doubtful samples.

        The first of the samples has the number `first` over all patches. A sample is doubtful if
        the squared length of its vector is at most `threshold`.
        """
        squared_length, term = scratch("square", (2, *vectors.shape[1:]), self.dtype)
        x, y, z = vectors
        np.multiply(x, x, out=squared_length)
        np.multiply(y, y, out=term)
        np.add(squared_length, term, out=squared_length)
        np.multiply(z, z, out=term)
        np.add(squared_length, term, out=squared_length)
        is_doubtful = squared_length <= threshold
        if np.count_nonzero(is_doubtful):
            # A normal of NaN marks that it must be computed again.
            squared_length[is_doubtful] = np.nan
            self.doubtful.append(is_doubtful.reshape(-1).nonzero()[0] + first)
        np.sqrt(squared_length, out=squared_length)
        np.divide(vectors, squared_length, out=_take_coordinates(out))

    def partials_to_vectors(self, point: RealArray, du: RealArray, dv: RealArray) -> RealArray:
        """Planes of S_u × S_v up to a positive factor.

        For rational patches `point` must already be projected. The result is in the work array that
        `sample_planes` returns for S. So a `point` in that work array is overwritten.
        """
        # `write_normals` reuses this memory under the same name.
        term = scratch("square", (2, *du.shape[1:]), self.dtype)[1]
        if self.is_rational:
            for partial in (du, dv):
                for axis in range(3):
                    np.multiply(point[axis], partial[3], out=term)
                    np.subtract(partial[axis], term, out=partial[axis])
        # The vectors overwrite S, which is no longer needed, so that a chunk stays small.
        x, y, z = vectors = scratch("point", (self.dimension, *du.shape[1:]), self.dtype)[:3]
        ax, ay, az = du[0], du[1], du[2]
        bx, by, bz = dv[0], dv[1], dv[2]
        np.multiply(ay, bz, out=x)
        np.multiply(az, by, out=term)
        np.subtract(x, term, out=x)
        np.multiply(az, bx, out=y)
        np.multiply(ax, bz, out=term)
        np.subtract(y, term, out=y)
        np.multiply(ax, by, out=z)
        np.multiply(ay, bx, out=term)
        np.subtract(z, term, out=z)
        return vectors

    def finish(self, evaluate_in_double: Callable[[Ints], PatchSamples] | None) -> PatchSamples:
        """The result, after the doubtful normals have been computed again.

        The limits at poles that have a simple formula are computed first. A patch with many other
        doubtful normals is evaluated again by `evaluate_in_double`. The remaining doubtful normals
        are computed one by one.
        """
        if self.normals is None or not self.doubtful:
            return PatchSamples(self.positions, self.normals, 0)
        doubtful = self.doubtful[0] if len(self.doubtful) == 1 else np.concatenate(self.doubtful)
        normals = self.normals.reshape(-1, 3)
        self._write_poles(self.normals)
        is_missing = np.isnan(normals[doubtful, 0])
        remaining = doubtful[is_missing]
        # Each sample that `_write_poles` wrote is at a pole.
        poles = len(doubtful) - len(remaining)
        if len(remaining) and evaluate_in_double is not None:
            counts = np.bincount(remaining // self.sample_count, minlength=self.patches.count)
            is_crowded = counts * SINGLE_NORMAL_COST > self.sample_count
            index = np.flatnonzero(is_crowded)
            if len(index):
                # The evaluation in float64 counts the poles of crowded patches again.
                poles = int(
                    np.count_nonzero(~is_crowded[doubtful[~is_missing] // self.sample_count])
                )
                remaining = remaining[~is_crowded[remaining // self.sample_count]]
            for first, last in row_runs(len(index), max(1, CHUNK_SAMPLES // self.sample_count)):
                samples_again = evaluate_in_double(index[first:last])
                self.normals[index[first:last]] = samples_again.normals
                poles += samples_again.poles
        if len(remaining):
            patch, sample = np.divmod(remaining, self.sample_count)
            normals[remaining], limits = self._compute_normals_singly(patch, sample)
            poles += limits
        return PatchSamples(self.positions, self.normals, poles)

    @abstractmethod
    def _compute_normals_singly(self, patch: Ints, sample: Ints) -> tuple[FloatArray, int]:
        """Normals of samples, each computed singly; and the number of limits among them."""

    @abstractmethod
    def _write_poles(self, normals: RealArray) -> None:
        """Writes the limits at poles that have a simple formula; other limits stay NaN."""


def _take_coordinates(points: RealArray) -> RealArray:
    """Planes of coordinates (3, …) of points (…, 3): a view."""
    return points.transpose(points.ndim - 1, *range(points.ndim - 1))


def _square_sums(nets: FloatArray) -> FloatArray:
    """Sums (r,) of the squared lengths of all vectors of each net (…, d, r), without weights."""
    rows = nets[..., :3, :].reshape(-1, nets.shape[-1])
    sums: FloatArray = np.einsum("kr,kr->r", rows, rows)
    return sums
