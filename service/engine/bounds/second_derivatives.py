"""Bounds of the second derivatives of patches, and of the distance to triangles between points.

Each point of a surface over a triangle in a box of sides h_u, h_v of parameters has at most the
distance

    ⅛ (h_u² M_uu + 2 h_u h_v M_uv + h_v² M_vv),
    M_uu = p (p−1) max (|Δ_u² Y| + r |Δ_u² w|) / min w,   Y = X − c w,   r = max |P − c|

from the triangle between the points at its corners. Nets are cut along lines of the grid into
blocks, each with a middle c of its own, so that large second derivatives count only where they
occur.

Proofs in docs/proofs.md: "Bending between samples" and "Triangular patches".

References
----------
Filip, Magedson and Markot, Surface algorithms using bounds on derivatives, CAGD 3 (1986).
Zheng and Sederberg, Estimating tessellation parameter intervals for rational curves and surfaces,
ACM TOG 19 (2000), on rational patches.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import FloatArray
from service.bases.cache import BASES
from service.bases.polynomials import restriction_matrices
from service.bases.row_batches import row_slices
from service.engine.evaluation.triangle_nets import partial_nets
from service.engine.vectors import dot, length
from service.surface.batches import Patches, TensorPatches, TrianglePatches

COORDINATES = -6
"""The axis of coordinates in nets of blocks, (d, a, n_u, b, n_v, m)."""

CHUNK = 1 << 17
"""Numbers in the cut nets of one chunk: they fit the second-level cache."""

MOST_BLOCKS = 8
"""Most blocks in one direction: more blocks would hardly lower the bound."""

MOST_BLOCK_POINTS = 64
"""Most control points of all blocks in one direction: patches of high degree have fewer blocks."""


@dataclass(frozen=True, eq=False, slots=True)
class SecondDerivativeBounds:
    """M_uu, M_uv and M_vv of the n_u × n_v blocks of P patches: shape (n_u, n_v, P) each.

    `across` (n_u, n_v, P) has upper bounds of the diameters of the hulls of blocks. The distance
    from a point of the block to a triangle between other points of the block is never larger.
    """

    uu: FloatArray
    uv: FloatArray
    vv: FloatArray
    across: FloatArray

    def bound_deviations(
        self, along_u: FloatArray | float, along_v: FloatArray | float
    ) -> FloatArray:
        """Bounds (P,) of the distances to triangles in boxes of these sides: maxima over blocks."""
        bounds = along_u**2 * self.uu
        bounds += 2 * along_u * along_v * self.uv
        bounds += along_v**2 * self.vv
        bounds /= 8
        largest: FloatArray = np.minimum(bounds, self.across).max(axis=(0, 1))
        return largest


def count_blocks(divisions: int, degree: int) -> int:
    """Number of blocks along R divisions; their nets have about R points together, or fewer."""
    return max(1, min(MOST_BLOCKS, min(MOST_BLOCK_POINTS, divisions) // (degree + 1)))


def bound_second_derivatives(
    patches: TensorPatches, divisions: tuple[int, int], blocks: tuple[int, int]
) -> SecondDerivativeBounds:
    """The bounds over the n_u × n_v blocks of each patch, which end at lines of the grid.

    `divisions` (R_u, R_v) are those of the grid, `blocks` is (n_u, n_v).
    """
    p, q = patches.degree
    # The fields of the result: M_uu, M_uv, M_vv and `across`.
    bounds = np.zeros((4, *blocks, patches.count))
    bounds[3] = patches.diagonal
    numbers_per_patch = 4 * blocks[0] * blocks[1] * (p + 1) * (q + 1)
    for rows in row_slices(patches.count, numbers_per_patch, CHUNK):
        net = _build_local_nets(patches, rows)
        du, dv = _subtract_neighbours(net, 1), _subtract_neighbours(net, 2)
        middles = None
        if patches.weights is not None:
            middles = _Middles.of(_cut_into_blocks(net, divisions, blocks))
            bounds[3, ..., rows] = 2 * middles.radii[:, 0]  # diameters
        for field, second in enumerate(
            (_subtract_neighbours(du, 1), _subtract_neighbours(du, 2), _subtract_neighbours(dv, 2))
        ):
            if second.size:
                longest = _find_longest(_cut_into_blocks(second, divisions, blocks), middles)
                bounds[field, ..., rows] = longest.reshape(*blocks, -1)
    bounds[:3] *= np.array([p * (p - 1), p * q, q * (q - 1)])[:, None, None, None]
    return SecondDerivativeBounds(*bounds)


def bound_triangle_deviations(patches: TrianglePatches, divisions: int) -> FloatArray:
    """Bounds (P,) of the distances from triangular patches to their small triangles at R divisions.

    They are M/6 + max(0, 2 Σ N_i − 3 M)/54. With e_ij the vector from corner i to corner j of a
    small triangle, M is the largest |D²f[e_ij, e_ij]|, and N_i the largest |D²f[e_ij, e_ik]|.
    """
    degree = patches.degree
    bounds = np.zeros(patches.count)
    if degree < 2:
        return bounds
    for rows in row_slices(patches.count, 4 * patches.points.shape[1], CHUNK):
        # The whole patch is one block. The points of its net are on the first axis of a grid: the
        # shape is (d, points, 1, 1, 1, m), as for `_cut_into_blocks`.
        net = _build_local_nets(patches, rows)[:, :, np.newaxis, np.newaxis, np.newaxis]
        ds, dt = partial_nets(net.swapaxes(0, 1))
        (ss, st), tt = partial_nets(ds), partial_nets(dt)[1]
        middles = None if patches.weights is None else _Middles.of(net)
        # The nets of D²f[e, e] for the three sides e, and of D²f[e_ij, e_ik] for the corners i.
        sides = (ss, tt, ss - 2 * st + tt)
        corners = (st, ss - st, tt - st)
        m_ij, n_i = (
            np.stack([_find_longest(second.swapaxes(0, 1), middles)[0, 0] for second in each])
            for each in (sides, corners)
        )
        most = m_ij.max(axis=0)
        bounds[rows] = most / 6 + np.maximum(2 * n_i.sum(axis=0) - 3 * most, 0) / 54
    return np.minimum(bounds * (degree * (degree - 1) / divisions**2), patches.diagonal)


def _build_local_nets(patches: Patches, rows: slice) -> FloatArray:
    """Nets (d, …, m) about the middle of all patches; homogeneous nets if the patches are rational.

    Coordinates are the outermost axis and patches the innermost one, so that all operations run
    over long contiguous rows.
    """
    net = to_homogeneous(
        patches.points[rows] - patches.middle,
        None if patches.weights is None else patches.weights[rows] / patches.weights.max(),
    )
    return np.ascontiguousarray(np.moveaxis(net, (-1, 0), (0, -1)))


def _subtract_neighbours(net: FloatArray, axis: int) -> FloatArray:
    """Differences of neighbouring points of nets along u (axis 1) or along v (axis 2)."""
    return net[:, 1:] - net[:, :-1] if axis == 1 else net[:, :, 1:] - net[:, :, :-1]


def _cut_into_blocks(
    net: FloatArray, divisions: tuple[int, int], blocks: tuple[int, int]
) -> FloatArray:
    """Nets (d, a, b, m) of a × b points, over every block: (d, a, n_u, b, n_v, m)."""
    dimension, rows, columns, count = net.shape
    if blocks == (1, 1):
        return net[:, :, np.newaxis, :, np.newaxis]
    lines = net.reshape(dimension, rows, -1)
    along_u = build_block_shares(rows - 1, divisions[0], blocks[0]) @ lines
    rows_in_blocks = along_u.reshape(-1, columns, count)
    cut = build_block_shares(columns - 1, divisions[1], blocks[1]) @ rows_in_blocks
    return cut.reshape(dimension, rows, blocks[0], columns, blocks[1], count)


def build_block_shares(degree: int, divisions: int, blocks: int) -> FloatArray:
    """Matrix from a net to the control points of its blocks, rows (i, block).

    The matrix is cached and read-only.
    """

    def build() -> FloatArray:
        block_ends = np.arange(blocks + 1) * divisions // blocks / divisions
        return restriction_matrices(degree, block_ends).swapaxes(0, 1).reshape(-1, degree + 1)

    return BASES.array(("blocks", degree, divisions, blocks), build)


@dataclass(frozen=True, eq=False, slots=True)
class _Middles:
    """The middle c, the radius r and the least weight of every block.

    Attributes
    ----------
    points : ndarray of float64, shape (3, 1, n_u, 1, n_v, m)
    radii : ndarray of float64, shape (n_u, 1, n_v, m)
    least : ndarray of float64, shape (n_u, n_v, m)
    """

    points: FloatArray
    radii: FloatArray
    least: FloatArray

    @staticmethod
    def of(nets: FloatArray) -> "_Middles":
        """The middles of homogeneous nets (4, a, n_u, b, n_v, m)."""
        points = nets[:3] / nets[3]
        low, high = points.min(axis=(1, 3), keepdims=True), points.max(axis=(1, 3), keepdims=True)
        middles = (low + high) / 2
        radii = _find_block_maxima(length(points - middles, COORDINATES))
        return _Middles(middles, radii[:, np.newaxis], nets[3].min(axis=(0, 2)))


def _find_longest(vectors: FloatArray, middles: _Middles | None) -> FloatArray:
    """Length of the longest of the vectors (d, a, n_u, b, n_v, m) of each block: (n_u, n_v, m).

    For homogeneous vectors (X, w), which are differences of a net, it is the largest
    |X − c w| + r |w|, divided by the least weight of the net.
    """
    if middles is None:
        return np.sqrt(_find_block_maxima(dot(vectors, vectors, COORDINATES)))
    lengths = length(vectors[:3] - middles.points * vectors[3], COORDINATES)
    lengths += middles.radii * np.abs(vectors[3])
    return _find_block_maxima(lengths) / middles.least


def _find_block_maxima(values: FloatArray) -> FloatArray:
    """The largest value of each block: (a, n_u, b, n_v, m) to (n_u, n_v, m)."""
    largest: FloatArray = values.max(axis=0).max(axis=1)
    return largest
