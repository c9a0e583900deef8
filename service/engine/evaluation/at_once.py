"""Polynomial patches on small grids: all samples of many patches in a few products.

The everyday way. Coordinates are planes throughout: rows of the products are the coordinates of the
patches, columns first the control points and their differences, then the samples.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, RealArray
from service.bases.bernstein import sample_partials_basis
from service.cancellation import checkpoint
from service.engine.extent import is_moved
from service.engine.scratch import Real, Workspaces
from service.surface.batches import Patches, TensorPatches

CHUNK_SAMPLES = 18_432
"""Samples worked on at a time: a dozen planes of them fit the second-level cache."""

TRUSTED: dict[Real, float] = {np.float32: 2.0**-6, np.float64: 2.0**-20}
"""|S_u × S_v| ÷ (mean |Δ_u P| · mean |Δ_v P|) above which the working precision is good enough: the
direction is then wrong by at most about 1e-5 (float32, usually 2e-7) or 1e-10 (float64)."""

SUBNORMAL: dict[Real, float] = {np.float32: 2.0**-100, np.float64: 2.0**-900}
"""|S_u × S_v|² below which squares of its coordinates have lost digits to underflow."""

ORDINARY = 16
"""Models larger than 2^-16 and smaller than 2^16 are not scaled: fourth powers of such lengths are
far from float32's limits."""

SMALL = 64
"""Control points of a patch up to which a product takes differences as fast as subtractions."""


def can_evaluate_at_once(patches: TensorPatches, resolution: tuple[int, int]) -> bool:
    """Whether `evaluate_at_once` can evaluate these, at least four at a time."""
    (p, q), (ru, rv) = patches.degree, resolution
    is_small = (p + 1) * (q + 1) <= SMALL and (ru + 1) * (rv + 1) <= CHUNK_SAMPLES // 4
    return is_small and patches.weights is None and is_ordinary(patches)


def is_ordinary(patches: Patches) -> bool:
    """Whether patches are evaluated as they are, and not scaled."""
    return 2.0**-ORDINARY <= patches.extent <= 2.0**ORDINARY or patches.extent == 0


def evaluate_at_once(
    patches: TensorPatches,
    resolution: tuple[int, int],
    origin: FloatArray | None,
    positions: RealArray,
    normals: RealArray | None,
) -> list[NDArray[np.intp]]:
    """Writes points and unit normals; returns which samples, counted over all, are doubtful.

    Their normals are NaN. The vectors S_u × S_v are computed in the precision of the result, from
    differences of the control points in float64: such a product of a point, its neighbour and
    zeros is their difference, rounded once.

    Parameters
    ----------
    patches : TensorPatches
        P polynomial patches.
    positions, normals : ndarray, shape (P, Ru+1, Rv+1, 3)
        Where to write to; `normals` is None where none are wanted.
    """
    dtype: Real = positions.dtype.type
    each = (resolution[0] + 1) * (resolution[1] + 1)
    doubtful: list[NDArray[np.intp]] = []
    # Sixteen numbers are a cache line: every plane of a chunk begins at one.
    chunk = CHUNK_SAMPLES // each // 16 * 16 or CHUNK_SAMPLES // each
    for first in range(0, patches.count, chunk):
        checkpoint()
        points = patches.points[first : first + chunk]
        count = len(points)
        work = _WORKSPACES.get(patches.degree, resolution, count, dtype)
        planes = points.reshape(count, -1, 3).transpose(2, 0, 1).reshape(3 * count, -1)
        work.take_nets(planes, origin)
        out = positions[first : first + chunk].reshape(count, each, 3)
        np.positive(work.at, out=out.transpose(2, 0, 1))
        if normals is None:
            continue
        short = work.find_vectors()
        if short is not None:
            work.square[short] = np.nan
            doubtful.append(short.reshape(-1).nonzero()[0] + first * each)
        np.sqrt(work.square, out=work.square)
        out = normals[first : first + chunk].reshape(count, each, 3)
        np.divide(work.at, work.square, out=out.transpose(2, 0, 1))
    return doubtful


class _Workspace:
    """Memory for a chunk of r patches, cut once into all the arrays that are worked on.

    `nets` are the control points and their differences; `at` (3, r, samples) is S, then the vectors
    S_u × S_v. Of the partials there are planes x y z x y, so that `du_yzx`, `dv_zxy` and so on are
    what a cross product multiplies.
    """

    def __init__(
        self, degree: tuple[int, int], resolution: tuple[int, int], count: int, dtype: Real
    ) -> None:
        p, q = degree
        size, end = (p + 1) * (q + 1), (2 * p + 1) * (q + 1)
        self.steps, means = _operators(p, q)
        self.means = means * TRUSTED[dtype]
        basis = sample_partials_basis(degree, resolution, dtype)
        self.of_at, self.of_du, self.of_dv = basis[:size], basis[size:end], basis[end:]
        each = basis.shape[1]
        self.nets = np.empty((3 * count, self.steps.shape[1]))
        self.points = self.nets.reshape(3, count, -1)[:, :, :size]
        self.differences = self.nets[:, size:]
        self.rounded = rounded = np.empty(self.nets.shape, dtype)
        self.net, self.du_net, self.dv_net = (
            rounded[:, :size],
            rounded[:, size:end],
            rounded[:, end:],
        )
        memory = np.empty((17, count, each), dtype)
        self.at, self.term, self.square = memory[:3], memory[3:6], memory[16]
        partials = memory[6:16].reshape(2, 5, count, each)
        self.xyz, self.xy, self.again = partials[:, :3], partials[:, :2], partials[:, 3:]
        self.at_rows = self.at.reshape(-1, each)
        self.du_rows, self.dv_rows = (plane[:3].reshape(-1, each) for plane in partials)
        (self.du_yzx, self.dv_yzx), (self.du_zxy, self.dv_zxy) = partials[:, 1:4], partials[:, 2:5]
        self.sums = np.empty((3 * count, 2))
        self.sums_by_axis, self.sizes = self.sums.reshape(3, count, 2), np.empty((count, 2))
        self.size_u, self.size_v = self.sizes.T
        self.trust = np.empty((count, 1), dtype)
        self.trusts = self.trust[:, 0]
        self.short = np.empty((count, each), np.bool_)
        self.subnormal = SUBNORMAL[dtype]

    def take_nets(self, planes: FloatArray, origin: FloatArray | None) -> None:
        """Finds S from control points (3 r, (p+1)(q+1)), and the differences of these."""
        np.matmul(planes, self.steps, out=self.nets)
        if origin is not None and is_moved(origin):
            self.points -= origin[:, np.newaxis, np.newaxis]
        np.copyto(self.rounded, self.nets, casting="same_kind")
        np.matmul(self.net, self.of_at, out=self.at_rows)

    def find_vectors(self) -> NDArray[np.bool_] | None:
        """Finds S_u × S_v and its squared length; which samples are doubtful, None if none is."""
        np.matmul(self.du_net, self.of_du, out=self.du_rows)
        np.matmul(self.dv_net, self.of_dv, out=self.dv_rows)
        np.copyto(self.again, self.xy)
        np.multiply(self.du_yzx, self.dv_zxy, out=self.at)
        np.multiply(self.du_zxy, self.dv_yzx, out=self.term)
        np.subtract(self.at, self.term, out=self.at)
        np.multiply(self.at, self.at, out=self.term)
        np.add.reduce(self.term, out=self.square)
        # The mean squares of the differences of each patch, along u and along v.
        np.multiply(self.differences, self.differences, out=self.differences)
        np.matmul(self.differences, self.means, out=self.sums)
        np.add.reduce(self.sums_by_axis, out=self.sizes)
        np.multiply(self.size_u, self.size_v, out=self.size_u)
        np.maximum(self.size_u, self.subnormal, out=self.trusts, casting="same_kind")
        np.less_equal(self.square, self.trust, out=self.short)
        return self.short if np.count_nonzero(self.short) else None


_WORKSPACES = Workspaces(_Workspace)


@lru_cache(64)
def _operators(p: int, q: int) -> tuple[FloatArray, FloatArray]:
    """The factors of nets, and those of the squares of their differences.

    The columns of the first are those of 1, then differences along u, then those along v. The
    second has a column for the mean along u, and one for that along v.
    """
    rows, columns = np.eye(p + 1), np.eye(q + 1)
    along_u, along_v = np.diff(rows, axis=0), np.diff(columns, axis=0)
    kinds = [np.kron(*pair).T for pair in ((rows, columns), (along_u, columns), (rows, along_v))]
    means = np.zeros((kinds[1].shape[1] + kinds[2].shape[1], 2))
    for column, part in enumerate((slice(0, p * (q + 1)), slice(p * (q + 1), None))):
        means[part, column] = 1 / len(means[part])
    return np.concatenate(kinds, axis=1), means
