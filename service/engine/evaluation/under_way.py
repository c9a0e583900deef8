"""One evaluation under way: nets on the way in, points and normals on the way out.

What all formulations share. Nets are differenced, centred and scaled in float64; what comes of
them is computed in the precision of the result, and a normal that this precision cannot vouch for
is computed anew (`service.engine.evaluation.normals`).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, RealArray
from service.engine.scratch import Real, scratch
from service.surface.batches import Patches

ORDINARY = 16
"""Models larger than 2^-16 and smaller than 2^16 are not scaled: fourth powers of such lengths are
far from float32's limits."""

TRUSTED: dict[Real, float] = {np.float32: 2.0**-6, np.float64: 2.0**-20}
"""|S_u × S_v| ÷ (mean |Δ_u P| · mean |Δ_v P|) above which the working precision is good enough: the
direction is then wrong by at most about 1e-5 (float32, usually 2e-7) or 1e-10 (float64)."""

SUBNORMAL: dict[Real, float] = {np.float32: 2.0**-100, np.float64: 2.0**-900}
"""|S_u × S_v|² below which squares of its coordinates have lost digits to underflow."""


@dataclass(frozen=True, eq=False, slots=True)
class Samples:
    """Points and unit normals at all samples of a batch: (P, Ru+1, Rv+1, 3); triangles (P, S, 3).

    `poles` counts the samples at which S_u × S_v vanishes.
    """

    positions: RealArray
    normals: RealArray | None
    poles: int


class Evaluation(ABC):
    """One evaluation under way: its inputs, its outputs, and what the formulations share.

    `each` counts the samples of one patch. `positions` and `normals` are those of the result.
    """

    def __init__(
        self,
        patches: Patches,
        each: int,
        dtype: Real,
        out: Samples,
        origin: FloatArray | None,
    ) -> None:
        self.patches = patches
        self.each = each
        self.dtype = dtype
        self.rational = patches.weights is not None
        self.positions = out.positions
        self.normals = out.normals
        self.origin = None if origin is None or not origin.any() else origin
        # Rational nets are evaluated about the batch's middle, where S_u = (X_u − w_u S)/w loses
        # least; their points are moved back when they are written. A power of two scales exactly.
        self.scale = 1.0
        if not 2.0**-ORDINARY <= patches.extent <= 2.0**ORDINARY and patches.extent > 0:
            self.scale = float(np.exp2(min(ORDINARY - np.frexp(patches.extent)[1], 1000)))
        self.heaviest = 1.0 if patches.weights is None else float(patches.weights.max())
        self._doubtful: list[NDArray[np.intp]] = []
        self._poles = 0
        self._replaced = False

    def points(self, first: int, last: int) -> tuple[FloatArray, FloatArray]:
        """Control points of patches [first, last) to evaluate, and to take differences of.

        Two nets (K, d, r), homogeneous if the patches are rational. The patches are the innermost
        axis: differences between neighbours in a net then run over long contiguous rows.
        """
        planes, count = 4 if self.rational else 3, last - first
        points = self.patches.points[first:last].reshape(count, -1, 3)
        net = scratch("net", (points.shape[1], planes, count), np.float64)
        np.copyto(net[:, :3], points.transpose(1, 2, 0))
        at = net
        if self.patches.weights is None:
            # Positions about the origin asked for, partials from differences of the points
            # themselves: neither loses digits to the other's needs.
            if self.origin is not None:
                at = net - self.origin[:, None]
            if self.scale != 1.0:
                net = net * self.scale
        else:
            weights = self.patches.weights[first:last].reshape(count, -1).T
            np.multiply(weights, 1 / self.heaviest, out=net[:, 3])
            net[:, :3] -= self.patches.middle[:, None]
            net[:, :3] *= self.scale
            net[:, :3] *= net[:, 3:]
        return at, net

    def trust(self, du: FloatArray, dv: FloatArray) -> FloatArray:
        """The least |S_u × S_v|² that is good enough, from the differences (…, d, r): (r,)."""
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
            for axis in range(3):
                out[..., axis] = planes[axis]

    def local(self, first: int, last: int) -> FloatArray:
        """Control points (K, d, r) about the batch's middle and in the scale of the evaluation.

        Homogeneous if the patches are rational.
        """
        if self.rational:
            return self.points(first, last)[1]
        points = self.patches.points[first:last].reshape(last - first, -1, 3)
        local: FloatArray = (points.transpose(1, 2, 0) - self.patches.middle[:, None]) * self.scale
        return local

    def write_local(self, planes: RealArray, out: RealArray) -> None:
        """Writes S from the planes of what `local` has; projects homogeneous ones in place."""
        if self.rational:
            planes[:3] /= planes[3]
        shift = self.patches.middle if self.origin is None else self.patches.middle - self.origin
        for axis in range(3):
            np.multiply(planes[axis], self.dtype(1 / self.scale), out=out[..., axis])
            if shift[axis]:
                out[..., axis] += self.dtype(shift[axis])

    def write_normals(
        self,
        vectors: RealArray,
        out: RealArray,
        trust: RealArray,
        first: int,
    ) -> None:
        """Writes unit vectors, and notes which samples, counted from `first`, are doubtful."""
        square, term = scratch("square", (2, *vectors.shape[1:]), self.dtype)
        x, y, z = vectors
        np.multiply(x, x, out=square)
        np.multiply(y, y, out=term)
        np.add(square, term, out=square)
        np.multiply(z, z, out=term)
        np.add(square, term, out=square)
        found = (square <= trust).reshape(-1).nonzero()[0]
        if len(found):
            # The normal comes out as NaN, which marks that it is still owed.
            square.reshape(-1)[found] = np.nan
            self._doubtful.append(found + first)
        np.sqrt(square, out=square)
        np.divide(vectors, square, out=vectors)
        out[..., 0] = x
        out[..., 1] = y
        out[..., 2] = z

    def partials_to_vectors(self, at: RealArray, du: RealArray, dv: RealArray) -> RealArray:
        """Planes of S_u × S_v up to a positive factor; `at` holds S already if rational."""
        term = scratch("square", (2, *du.shape[1:]), self.dtype)[1]
        if self.rational:
            for partial in (du, dv):
                for axis in range(3):
                    np.multiply(at[axis], partial[3], out=term)
                    np.subtract(partial[axis], term, out=partial[axis])
        # S is not needed any more: its memory takes the vectors, so that a chunk stays small.
        vectors = scratch("at", (3, *du.shape[1:]), self.dtype)
        x, y, z = vectors
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

    def crowded(self) -> NDArray[np.intp]:
        """Patches of whose normals more than an eighth are doubtful."""
        if 8 * sum(map(len, self._doubtful)) <= self.each:
            return np.empty(0, dtype=np.intp)
        patch = np.concatenate(self._doubtful) // self.each
        counts = np.bincount(patch, minlength=self.patches.count)
        return np.flatnonzero(8 * counts > self.each)

    def replace_normals(self, index: NDArray[np.intp], normals: RealArray, poles: int) -> None:
        """Takes the normals of some patches, so many limits among them, as they are."""
        if self.normals is None:
            return
        self.normals[index] = normals
        self._poles += poles
        self._replaced = True
        done = np.zeros(self.patches.count, dtype=bool)
        done[index] = True
        found = np.concatenate(self._doubtful)
        self._doubtful = [found[~done[found // self.each]]]

    def finished(self) -> Samples:
        """The result, after the doubtful normals have been computed anew."""
        if self.normals is None or not self._doubtful:
            return Samples(self.positions, self.normals, self._poles)
        # First the poles are paid, then what is still owed.
        doubtful = self._doubtful[0] if len(self._doubtful) == 1 else np.concatenate(self._doubtful)
        normals = self.normals.reshape(-1, 3)
        self._write_poles(self.normals)
        rest = doubtful[np.isnan(normals[doubtful, 0])]
        poles = self._poles + len(doubtful) - len(rest)
        if len(rest):
            patch, sample = np.divmod(rest, self.each)
            normals[rest], limits = self._slow_normals(patch, sample)
            poles += limits
        return Samples(self.positions, self.normals, poles)

    @abstractmethod
    def _slow_normals(
        self, patch: NDArray[np.intp], sample: NDArray[np.intp]
    ) -> tuple[FloatArray, int]:
        """Normals of samples, by their number in a patch, one by one; how many are limits."""

    @abstractmethod
    def _write_poles(self, normals: RealArray) -> None:
        """Limits where they can be had without much ado."""


@dataclass(frozen=True, eq=False, slots=True)
class ChunkNets:
    """Nets (p+1, q+1, d, r) of S and of its partials, in float64; of triangles (K, d, r).

    `trust` (r,) is the least |S_u × S_v|² that is good enough.
    """

    at: FloatArray
    du: FloatArray | None
    dv: FloatArray | None
    trust: FloatArray | None

    def single(self, k: int) -> "ChunkNets":
        """The nets of patch k alone, its coordinates as planes (d, p+1, q+1)."""
        at = self.at[..., k].transpose(2, 0, 1)
        if self.du is None or self.dv is None or self.trust is None:
            return ChunkNets(at, None, None, None)
        du, dv = (net[..., k].transpose(2, 0, 1) for net in (self.du, self.dv))
        return ChunkNets(at, du, dv, self.trust[k : k + 1])

    def least(self, dtype: Real) -> RealArray:
        """`trust` in the working precision, to compare (r, samples) with."""
        if self.trust is None:
            raise ValueError("nets without partials have no normals to trust")
        least: RealArray = self.trust.astype(dtype)
        return least[:, None]


def _square_sums(nets: FloatArray) -> FloatArray:
    """Sum of the squared lengths of the vectors of each net: (…, d, r) to (r,)."""
    rows = nets[..., :3, :] if nets.shape[-2] > 3 else nets
    rows = rows.reshape(-1, nets.shape[-1])
    sums: FloatArray = np.einsum("kr,kr->r", rows, rows)
    return sums
