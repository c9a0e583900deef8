"""The state of one evaluation: the steps that load nets and write points and normals.

All formulations share these steps. Nets are differenced, centred and scaled in float64. Samples are
computed in the precision of the result. A normal for which this precision is not sufficient is
computed again (`service.engine.evaluation.normals`).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, RealArray
from service.bases.row_batches import row_runs
from service.engine.evaluation.chunks import (
    CHUNK_SAMPLES,
    SUBNORMAL,
    TRUSTED,
    find_shift,
    weight_points,
    write_local,
)
from service.engine.extent import find_scale, is_moved
from service.engine.scratch import Real, scratch
from service.surface.batches import Patches

ONE_BY_ONE = 128
"""A normal computed singly takes as long as this number of samples of a patch in float64."""


@dataclass(frozen=True, eq=False, slots=True)
class PatchSamples:
    """Points and unit normals at all samples of a batch: (P, Ru+1, Rv+1, 3); triangles (P, S, 3).

    `poles` counts the samples at which S_u × S_v vanishes.
    """

    positions: RealArray
    normals: RealArray | None
    poles: int


class Evaluation(ABC):
    """The state of one evaluation: inputs, outputs, and the steps that all formulations share.

    `each` counts the samples of one patch. `positions` and `normals` are the arrays of the result.
    `doubtful` has the numbers of samples, counted over all patches, whose normals are computed
    again in the end.
    """

    def __init__(
        self,
        patches: Patches,
        each: int,
        dtype: Real,
        out: PatchSamples,
        origin: FloatArray | None,
    ) -> None:
        self.patches = patches
        self.each = each
        self.dtype = dtype
        self.rational = patches.weights is not None
        self.positions = out.positions
        self.normals = out.normals
        self.origin = None if origin is None or not is_moved(origin) else origin
        # Rational nets are evaluated about the batch's middle, as in `at_once`.
        self.scale = find_scale(patches.extent)
        self.heaviest = 1.0 if patches.weights is None else float(patches.weights.max())
        self.dimension = 4 if self.rational else 3
        self.doubtful: list[NDArray[np.intp]] = []

    def load_points(self, first: int, last: int, at: FloatArray) -> FloatArray:
        """Writes the control points of patches [first, last) that are evaluated.

        They are homogeneous if the patches are rational. The patches are the innermost axis:
        differences between neighbours in a net then run over long contiguous rows.

        Parameters
        ----------
        at : ndarray of float64, shape (K, d, r)
            The output.

        Returns
        -------
        ndarray of float64, shape (K, d, r)
            The control points whose differences give the partials: `at` itself, or another array if
            positions have another origin or scale than partials.
        """
        np.copyto(at[:, :3], self._planes(self.patches.points, first, last))
        if self.patches.weights is not None:
            weights = self.patches.weights[first:last].reshape(last - first, -1).T
            np.multiply(weights, 1 / self.heaviest, out=at[:, 3])
            weight_points(at[:, :3], at[:, 3:], self.patches.middle, self.scale)
            return at
        if self.origin is None and self.scale == 1.0:
            return at
        # Positions are relative to the requested origin, but partials are differences of the
        # original points: so neither loses digits.
        net: FloatArray = at * self.scale
        if self.origin is not None:
            at -= self.origin[:, None]
        return net

    def sample_planes(self, *shape: int) -> tuple[RealArray, RealArray, RealArray]:
        """Work arrays for S, S_u and S_v at some samples: planes of coordinates."""
        form = (self.dimension, *shape)
        at, du, dv = (scratch(name, form, self.dtype) for name in ("at", "du", "dv"))
        return at, du, dv

    def find_least_trusted(self, du: FloatArray, dv: FloatArray) -> FloatArray:
        """The least trusted |S_u × S_v|² of each patch (r,), from the differences (…, d, r)."""
        planes, count = du.shape[-2:]
        trust = _square_sums(du) * _square_sums(dv)
        trust *= TRUSTED[self.dtype] ** 2 / (du.size * dv.size / (planes * count) ** 2)
        np.maximum(trust, SUBNORMAL[self.dtype], out=trust)
        return trust

    def write_positions(self, planes: RealArray, out: RealArray) -> None:
        """Writes S from the planes of its homogeneous coordinates; projects them in place."""
        if self.rational:
            self.write_local(planes, out)
        else:
            np.positive(planes, out=_take_coordinates(out))

    def load_local(self, first: int, last: int) -> FloatArray:
        """Control points (K, d, r) about the batch's middle and in the scale of the evaluation.

        Homogeneous if the patches are rational.
        """
        points = self._planes(self.patches.points, first, last)
        if self.rational:
            return self.load_points(first, last, np.empty((len(points), 4, last - first)))
        local: FloatArray = (points - self.patches.middle[:, None]) * self.scale
        return local

    @staticmethod
    def _planes(points: FloatArray, first: int, last: int) -> FloatArray:
        """Control points of patches [first, last): (P, …, 3) to (K, 3, r), a view."""
        planes: FloatArray = points[first:last].reshape(last - first, -1, 3).transpose(1, 2, 0)
        return planes

    def write_local(self, planes: RealArray, out: RealArray) -> None:
        """Writes S from the planes of `load_local`; projects homogeneous coordinates in place."""
        if self.rational:
            planes[:3] /= planes[3]
        write_local(planes, find_shift(self.patches, self.origin), self.scale, out)

    def write_normals(
        self,
        vectors: RealArray,
        out: RealArray,
        trust: RealArray,
        first: int,
    ) -> None:
        """Writes unit vectors of samples from `first` on, and records the doubtful samples."""
        square, term = scratch("square", (2, *vectors.shape[1:]), self.dtype)
        x, y, z = vectors
        np.multiply(x, x, out=square)
        np.multiply(y, y, out=term)
        np.add(square, term, out=square)
        np.multiply(z, z, out=term)
        np.add(square, term, out=square)
        doubtful = square <= trust
        if np.count_nonzero(doubtful):
            # The normal is NaN, which marks that it must be computed again.
            square[doubtful] = np.nan
            self.doubtful.append(doubtful.reshape(-1).nonzero()[0] + first)
        np.sqrt(square, out=square)
        np.divide(vectors, square, out=_take_coordinates(out))

    def partials_to_vectors(self, at: RealArray, du: RealArray, dv: RealArray) -> RealArray:
        """Planes of S_u × S_v up to a positive factor; `at` already contains S if rational."""
        term = scratch("square", (2, *du.shape[1:]), self.dtype)[1]
        if self.rational:
            for partial in (du, dv):
                for axis in range(3):
                    np.multiply(at[axis], partial[3], out=term)
                    np.subtract(partial[axis], term, out=partial[axis])
        # S is no longer needed: the vectors overwrite it, so that a chunk stays small.
        x, y, z = vectors = scratch("at", (self.dimension, *du.shape[1:]), self.dtype)[:3]
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

    def finish(self, in_double: Callable[[NDArray[np.intp]], PatchSamples] | None) -> PatchSamples:
        """The result, after the doubtful normals have been computed again.

        Limits at poles come first. A patch with many other doubtful normals is evaluated again in
        float64, by `in_double`; the normals that are still doubtful are computed one by one.
        """
        if self.normals is None or not self.doubtful:
            return PatchSamples(self.positions, self.normals, 0)
        doubtful = self.doubtful[0] if len(self.doubtful) == 1 else np.concatenate(self.doubtful)
        normals = self.normals.reshape(-1, 3)
        self._write_poles(self.normals)
        is_missing = np.isnan(normals[doubtful, 0])
        remaining = doubtful[is_missing]
        poles = len(doubtful) - len(remaining)
        if len(remaining) and in_double is not None:
            counts = np.bincount(remaining // self.each, minlength=self.patches.count)
            is_crowded = counts * ONE_BY_ONE > self.each
            index = np.flatnonzero(is_crowded)
            if len(index):
                poles = int(np.count_nonzero(~is_crowded[doubtful[~is_missing] // self.each]))
                remaining = remaining[~is_crowded[remaining // self.each]]
            for first, last in row_runs(len(index), max(1, CHUNK_SAMPLES // self.each)):
                samples_again = in_double(index[first:last])
                self.normals[index[first:last]] = samples_again.normals
                poles += samples_again.poles
        if len(remaining):
            patch, sample = np.divmod(remaining, self.each)
            normals[remaining], limits = self._slow_normals(patch, sample)
            poles += limits
        return PatchSamples(self.positions, self.normals, poles)

    @abstractmethod
    def _slow_normals(
        self, patch: NDArray[np.intp], sample: NDArray[np.intp]
    ) -> tuple[FloatArray, int]:
        """Normals of samples, each computed singly; and the number of limits among them."""

    @abstractmethod
    def _write_poles(self, normals: RealArray) -> None:
        """Writes the limits at poles that have a simple formula."""


def _take_coordinates(points: RealArray) -> RealArray:
    """Planes of coordinates (3, …) of points (…, 3): a view."""
    return points.transpose(points.ndim - 1, *range(points.ndim - 1))


def _square_sums(nets: FloatArray) -> FloatArray:
    """Sum of the squared lengths of the vectors of each net: (…, d, r) to (r,)."""
    rows = nets[..., :3, :] if nets.shape[-2] > 3 else nets
    rows = rows.reshape(-1, nets.shape[-1])
    sums: FloatArray = np.einsum("kr,kr->r", rows, rows)
    return sums
