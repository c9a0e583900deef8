"""Deviation of polynomial patches of low degree from grids of their points, by two matrix products.

The bound is that of `service.engine.bounds.second_derivatives` over each block, a rectangle of
several divisions of the patch:

    ⅛ (h_u² p (p−1) max |Δ_u² P| + 2 h_u h_v p q max |Δ_u Δ_v P| + h_v² q (q−1) max |Δ_v² P|)

with h_u = 1/R_u and h_v = 1/R_v. The first matrix computes the second differences of all patches in
float64, with their factors; the second, one for each of the three kinds, their means over all
blocks in float32.

Proof in docs/proofs.md: "Blocks in single precision".
"""

from dataclasses import dataclass
from functools import lru_cache
from sys import float_info

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.cancellation import checkpoint
from service.engine.bounds.second_derivatives import build_block_shares, count_blocks
from service.engine.scratch import Workspaces
from service.surface.batches import TensorPatches

MAX_MATRIX_NUMBERS = 1 << 14
"""The most numbers in the second matrix of one kind of difference. If it is larger, one product
with it is slower than cutting along u and then along v, as `bound_second_derivatives` does."""

CHUNK = 1 << 17
"""Numbers in one chunk of a workspace: they fit the second-level cache."""

ORDERS = ((2, 0), (1, 1), (0, 2))
"""Orders along u and along v of the three kinds of second differences."""


def is_small(patches: TensorPatches, divisions: tuple[int, int]) -> bool:
    """Whether `bound_grid_deviations` is the fastest way; it does not support rational patches."""
    return patches.weights is None and _is_small_plan(patches.degree, divisions)


@lru_cache(256)
def _is_small_plan(degree: tuple[int, int], divisions: tuple[int, int]) -> bool:
    """Whether the second matrix of one kind has about `MAX_MATRIX_NUMBERS` numbers or fewer.

    Control points are counted in place of differences; there are a few more of them.
    """
    p, q = degree
    blocks = count_blocks(divisions[0], p) * count_blocks(divisions[1], q)
    return blocks * ((p + 1) * (q + 1)) ** 2 <= MAX_MATRIX_NUMBERS


def bound_grid_deviations(patches: TensorPatches, divisions: tuple[int, int]) -> FloatArray:
    """Bounds (P,) of the distances from patches to triangles between points of their grids.

    Parameters
    ----------
    patches : TensorPatches
        P polynomial patches of degree (p, q).
    divisions : (R_u, R_v)
        Divisions of the grids; triangles lie in boxes of sides h = 1/R.
    """
    plan = _build_plan(patches.degree, divisions)
    diagonal, bounds = patches.diagonal, np.empty(patches.count)
    if 0 < diagonal < float_info.min:
        # The reciprocal of a subnormal number may be infinite. The diagonal of the box of all
        # patches bounds every distance.
        return np.full(patches.count, diagonal)
    scale, step = 1 / (diagonal or 1.0), max(1, CHUNK // (3 * plan.means[..., 0].size))
    for first in range(0, patches.count, step):
        checkpoint()
        points = patches.points[first : first + step]
        work = _WORKSPACES.get(patches.degree, divisions, len(points))
        # Patches are the innermost axis, so that all operations run over long rows.
        nets = points.reshape(len(points), -1, 3).transpose(1, 2, 0)
        np.subtract(nets, patches.middle[:, np.newaxis], out=work.nets)
        np.multiply(work.nets, scale, out=work.nets)
        np.matmul(plan.seconds, work.columns, out=work.seconds)
        np.copyto(work.rounded, work.seconds, casting="same_kind")
        np.matmul(plan.means, work.differences, out=work.vectors)
        # Squares replace the coordinates x, y, z, and add up to squared lengths.
        np.multiply(work.vectors, work.vectors, out=work.vectors)
        np.add(work.x, work.y, out=work.squares)
        np.add(work.squares, work.z, out=work.squares)
        np.maximum.reduce(work.squares_by_block, axis=1, out=work.longest)
        np.sqrt(work.longest, out=work.longest)
        np.add.reduce(work.longest, out=work.bounds)
        np.multiply(work.whole, plan.rounding, out=work.whole)
        np.maximum.reduce(work.blocks, out=work.largest)
        np.add(work.largest, work.whole, out=bounds[first : first + step])
    np.multiply(bounds, plan.unit * diagonal, out=bounds)
    return np.minimum(bounds, diagonal, out=bounds)


class _Workspace:
    """The arrays in which bounds of `count` patches are computed, patches innermost.

    `nets` are the control points, `seconds` their second differences, and `rounded` the same in
    float32. `vectors` are the second differences over the blocks, with the coordinates `x`, `y`,
    `z`. `longest` is the largest length for each kind and block, and `bounds` the sum over the
    kinds: `blocks` for each block, and `whole` for the patch. `largest` is the maximum over the
    blocks. `columns`, `differences` and `squares_by_block` are views of other shapes.
    """

    def __init__(self, degree: tuple[int, int], divisions: tuple[int, int], count: int) -> None:
        plan = _build_plan(degree, divisions)
        # `size` is the number of differences of one kind, and `rows` that for all its blocks.
        kinds, rows, size = plan.means.shape
        self.nets = np.empty((plan.seconds.shape[1], 3, count))
        self.columns = self.nets.reshape(-1, 3 * count)
        self.seconds = np.empty((kinds * size, 3 * count))
        self.rounded = np.empty(self.seconds.shape, np.float32)
        self.differences = self.rounded.reshape(kinds, size, -1)
        self.vectors = np.empty((kinds, rows, 3 * count), np.float32)
        self.x, self.y, self.z = np.moveaxis(self.vectors.reshape(kinds, rows, 3, -1), 2, 0)
        self.squares = np.empty((kinds, rows, count), np.float32)
        self.squares_by_block = self.squares.reshape(kinds, size, plan.blocks + 1, count)
        self.longest = np.empty((kinds, plan.blocks + 1, count), np.float32)
        self.bounds = np.empty((plan.blocks + 1, count), np.float32)
        self.blocks, self.whole = self.bounds[:-1], self.bounds[-1]
        self.largest = np.empty(count, np.float32)


_WORKSPACES = Workspaces(_Workspace)


@dataclass(frozen=True, eq=False, slots=True)
class _Plan:
    """The matrices for patches of one degree (p, q) and grids of R_u × R_v divisions.

    Attributes
    ----------
    seconds : ndarray of float64, shape (3 N, (p+1)(q+1))
        Maps nets to N second differences of each kind, times their factors over the largest factor.
        A kind with fewer than N differences is filled with zeros.
    means : ndarray of float32, shape (3, N (blocks + 1), N)
        Maps second differences of a kind to those over the blocks and over the patch, rows (vector,
        block).
    blocks : int
        Number of blocks of a patch.
    unit : float
        The largest factor, rounded up.
    rounding : float
        Share of the bound of a patch that is added for the rounding of float32.
    """

    seconds: FloatArray
    means: RealArray
    blocks: int
    unit: float
    rounding: float


@lru_cache(64)
def _build_plan(degree: tuple[int, int], divisions: tuple[int, int]) -> _Plan:
    """The plan of patches of a degree at some divisions; 64 plans take at most 13 MiB."""
    (p, q), (ru, rv) = degree, divisions
    blocks = count_blocks(ru, p), count_blocks(rv, q)
    factors = p * (p - 1) / ru**2 / 8, p * q / ru / rv / 4, q * (q - 1) / rv**2 / 8
    # For each kind, the matrix to its second differences, and from these to those over blocks.
    kinds = [
        (
            np.kron(_build_differences(p, i), _build_differences(q, j)) * (factor / max(factors)),
            _build_block_differences(degree, divisions, (i, j)),
        )
        for (i, j), factor in zip(ORDERS, factors, strict=True)
    ]
    max_count = max(len(differences) for differences, _ in kinds)
    seconds = np.zeros((len(kinds), max_count, (p + 1) * (q + 1)))
    means = np.zeros((len(kinds), max_count, blocks[0] * blocks[1] + 1, max_count), np.float32)
    for kind, (differences, block_differences) in enumerate(kinds):
        count = len(differences)
        seconds[kind, :count] = differences
        means[kind, :count, :-1, :count] = block_differences
        means[kind, :count, -1, :count] = np.eye(count)  # the last block is the whole patch
    return _Plan(
        seconds.reshape(len(kinds) * max_count, -1),
        means.reshape(len(kinds), -1, max_count),
        blocks[0] * blocks[1],
        max(factors) * (1 + 2.0**-20),
        (len(kinds) * max_count + 8) * 2.0**-23,
    )


def _build_differences(degree: int, order: int) -> FloatArray:
    """Matrix (n+1−order, n+1) of differences of n + 1 numbers; it has no rows if the order > n."""
    return np.diff(np.eye(degree + 1), order, axis=0)


def _build_block_differences(
    degree: tuple[int, int], divisions: tuple[int, int], order: tuple[int, int]
) -> FloatArray:
    """Matrix (vectors, blocks, vectors) from differences over the patch to those over blocks."""
    if min(n - k for n, k in zip(degree, order, strict=True)) < 0:
        return np.zeros((0, 1, 0))
    along_u, along_v = (
        build_block_shares(n - k, r, count_blocks(r, n)).reshape(n - k + 1, -1, n - k + 1)
        for n, k, r in zip(degree, order, divisions, strict=True)
    )
    count = len(along_u) * len(along_v)
    shares: FloatArray = np.einsum("iak,jbl->ijabkl", along_u, along_v)
    return shares.reshape(count, -1, count)
