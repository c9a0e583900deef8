"""Unit normals at any parameter of a patch, poles and other degenerate points included.

The normal is S_u × S_v made unit. Where that vector vanishes the limit from inside the patch is
taken, and for that N = S_u × S_v itself is written in the Bernstein basis: its derivatives, and so
the lowest term that does not vanish, are then known and need not be guessed from neighbours.

Slow beside `service.engine.evaluate`, which therefore sends only those samples here whose normals
it cannot vouch for.
"""

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.engine.basis import bernstein, binomials, multiply
from service.engine.mesh import RealArray
from service.surface.lowered import FloatArray, TensorPatches

VANISHING = 2.0**-40
"""S_u below this part of the longest difference in the net counts as zero, so does S_v, and so does
S_u × S_v below this part of |S_u| |S_v|: all are exact to some 2^-52 of these measures, so what is
larger still has a dozen binary digits."""

NEGLIGIBLE = 2.0**-36
"""Coefficients of N below this part of the largest are rounding of what should be zero."""

CHUNK_BYTES = 8 << 20
"""Working memory for one round of gathered nets."""

Direction: TypeAlias = Literal["v", "u", "diagonal"]


def unit_normals(
    patches: TensorPatches, index: NDArray[np.intp], u: FloatArray, v: FloatArray
) -> tuple[FloatArray, int]:
    """Unit normals of patch `index[m]` at (u[m], v[m]), and how many of them are limits.

    Parameters
    ----------
    patches : TensorPatches
    index : ndarray of int, shape (m,)
    u, v : ndarray of float64, shape (m,)
        Parameters in [0, 1].

    Returns
    -------
    normals : ndarray of float64, shape (m, 3)
        Unit length, never NaN. A patch without area has no normals: it gets a unit vector
        perpendicular to its extent.
    limits : int
        Samples at which S_u × S_v vanishes.

    References
    ----------
    Limits at singular points: Farin, Curves and Surfaces for CAGD, 5th ed., section 16.6 gives
    the case of one collapsed edge; the general one is the Taylor expansion of N.
    """
    p, q = patches.degree
    net_bytes = 8 * 4 * 3 * (3 * p + 1) * (3 * q + 1)
    step = max(1, CHUNK_BYTES // net_bytes)
    normals = np.empty((len(index), 3))
    limits = 0
    for first in range(0, len(index), step):
        part = slice(first, first + step)
        normals[part], found = _chunk(patches, index[part], u[part], v[part])
        limits += found
    return normals, limits


def pole_normals(
    patches: TensorPatches, side: int, index: NDArray[np.intp], basis: tuple[RealArray, RealArray]
) -> FloatArray:
    """Limit normals along sides that are one point, the usual pole.

    About the pole, N = v (C'(u) × C(u)) + O(v²) for a side v = 0, where C is the Bézier curve of
    the next row of control points seen from the pole, times their weights. So the limit is that
    of the cone which the row spans, and no polynomial of high degree is needed.

    Parameters
    ----------
    patches : TensorPatches
    side : int
        0 … 3 for u = 0, u = 1, v = 0, v = 1.
    index : ndarray of int, shape (m,)
        Patches of which this side is collapsed.
    basis : ndarrays of float64, shapes (k, n+1) and (k, n)
        Bernstein bases of degrees n and n − 1 at k parameters along the side.

    Returns
    -------
    ndarray of float64, shape (m, k, 3)
        Unit length; NaN where the cone has no tangent plane either.
    """
    at = 0 if side % 2 == 0 else -1
    beside = 1 if side % 2 == 0 else -2
    points = patches.points if side >= 2 else patches.points.swapaxes(1, 2)
    rows = points[:, :, beside][index]
    rows -= points[:, :1, at][index]
    if patches.weights is not None:
        weights = patches.weights if side >= 2 else patches.weights.swapaxes(1, 2)
        rows *= weights[index, :, beside, None]
    normals = _cone_normals(rows, *basis)
    # du × dv turns with C on the sides u = 0 and v = 1, against it on the other two.
    if side in {0, 3}:
        return np.add(normals, 0.0, out=normals)
    return np.subtract(0.0, normals, out=normals)


def _cone_normals(rows: FloatArray, basis: RealArray, basis_below: RealArray) -> FloatArray:
    """C × C' made unit for Bézier curves C with control points (m, n+1, 3): (m, k, 3) or NaN."""
    steps = rows[:, 1:] - rows[:, :-1]
    vectors = _cross(np.matmul(basis, rows), np.matmul(basis_below, steps))
    length = np.sqrt(np.einsum("mkd,mkd->mk", vectors, vectors))
    measure = np.einsum("mid,mid->m", rows, rows)
    length[length <= NEGLIGIBLE * measure[:, None]] = np.nan
    vectors /= length[:, :, None]
    return vectors


def _powers_of_two(sizes: FloatArray) -> FloatArray:
    """Factors that bring sizes near 1 without rounding, as far as there are such factors."""
    factors: FloatArray = np.exp2(np.minimum(-np.frexp(sizes)[1].astype(np.float64), 1000.0))
    return factors


def _chunk(
    patches: TensorPatches, index: NDArray[np.intp], u: FloatArray, v: FloatArray
) -> tuple[FloatArray, int]:
    used, which = np.unique(index, return_inverse=True)
    nets = _Nets(patches, used)
    p, q = patches.degree
    du, dv = nets.partials(
        which, (bernstein(p, u), bernstein(p - 1, u)), (bernstein(q, v), bernstein(q - 1, v))
    )
    vectors = _cross(du, dv)
    lengths, length_u, length_v = (np.linalg.norm(rows, axis=-1) for rows in (vectors, du, dv))
    vanishes = lengths <= VANISHING * length_u * length_v
    vanishes |= length_u <= VANISHING * nets.longest_u[which]
    vanishes |= length_v <= VANISHING * nets.longest_v[which]
    zero = np.flatnonzero(vanishes)
    lengths[zero] = 1.0
    normals = vectors / lengths[:, None]
    if len(zero):
        normals[zero] = _limits(nets, which[zero], u[zero], v[zero])
    return normals, len(zero)


class _Nets:
    """Homogeneous nets of some patches, about their own middle and in their own scale.

    `point`, `du`, `dv` have shape (K, d, …) with d = 3, or 4 if rational; `longest_u`, `longest_v`
    (K,) are the lengths of the longest differences.
    """

    def __init__(self, patches: TensorPatches, used: NDArray[np.intp]) -> None:
        points = patches.points[used]
        middle = points.mean(axis=(1, 2), keepdims=True)
        local = np.moveaxis(points - middle, -1, 1)
        # A power of two scales without rounding; a patch that is one point keeps scale 1.
        size = np.abs(local).max(axis=(1, 2, 3))
        local = local * _powers_of_two(size)[:, None, None, None]
        self.rational = patches.weights is not None
        if patches.weights is not None:
            weights = patches.weights[used][:, None]
            weights = weights / weights.max(axis=(2, 3), keepdims=True)
            local = np.concatenate([local * weights, weights], axis=1)
        self.point: FloatArray = local
        self.du: FloatArray = np.diff(local, axis=2)
        self.dv: FloatArray = np.diff(local, axis=3)
        self.longest_u: FloatArray = _largest(self.du[:, :3])
        self.longest_v: FloatArray = _largest(self.dv[:, :3])

    @property
    def measure(self) -> FloatArray:
        """Upper bound of |S_u| |S_v| for each patch, as far as weights do not lessen it."""
        return self.longest_u * self.longest_v

    def partials(
        self,
        which: NDArray[np.intp],
        along_u: tuple[FloatArray, FloatArray],
        along_v: tuple[FloatArray, FloatArray],
    ) -> tuple[FloatArray, FloatArray]:
        """S_u and S_v up to positive factors at one parameter each, shapes (m, 3).

        For a rational patch X_u − S w_u and X_v − S w_v, which need no second division.
        """
        du = np.einsum("mi,mdij,mj->md", along_u[1], self.du[which], along_v[0], optimize=True)
        dv = np.einsum("mi,mdij,mj->md", along_u[0], self.dv[which], along_v[1], optimize=True)
        if self.rational:
            at = np.einsum(
                "mi,mdij,mj->md", along_u[0], self.point[which], along_v[0], optimize=True
            )
            place = at[:, :3] / at[:, 3:]
            du = du[:, :3] - place * du[:, 3:]
            dv = dv[:, :3] - place * dv[:, 3:]
        return du, dv

    def normal_net(self) -> FloatArray:
        """N = S_u × S_v in the Bernstein basis, up to a positive factor; shape (K, 3, …).

        Polynomial: degree (2p−1, 2q−1). Rational: degree (3p−1, 3q−1), and times w³

            w X_u × X_v + w_u X_v × X + w_v X × X_u
        """
        if not self.rational:
            return _cross_product(self.du, self.dv)
        x, w = self.point[:, :3], self.point[:, 3:]
        (xu, wu), (xv, wv) = (self.du[:, :3], self.du[:, 3:]), (self.dv[:, :3], self.dv[:, 3:])
        return (
            multiply(w, _cross_product(xu, xv))
            + multiply(wu, _cross_product(xv, x))
            + multiply(wv, _cross_product(x, xu))
        )


def _limits(nets: _Nets, which: NDArray[np.intp], u: FloatArray, v: FloatArray) -> FloatArray:
    """Limit normals where N vanishes: the first term of N, seen inwards, that does not."""
    coefficients = nets.normal_net()
    largest = _largest(coefficients)
    boxes = _from_corner(_from_corner(coefficients[which], u, axis=2), v, axis=3)
    floor = np.maximum(NEGLIGIBLE * largest, VANISHING * nets.measure)[which]
    normals = np.full((len(which), 3), np.nan)
    # Inwards from the edge on which the sample lies; a corner counts to the v edge first. Along a
    # collapsed edge N vanishes throughout, so that a wrong first choice finds nothing.
    on_u_edge_only = ((u == 0) | (u == 1)) & (v > 0) & (v < 1)
    orders: tuple[tuple[NDArray[np.bool_], tuple[Direction, ...]], ...] = (
        (~on_u_edge_only, ("v", "u", "diagonal")),
        (on_u_edge_only, ("u", "v", "diagonal")),
    )
    for group, directions in orders:
        for direction in directions:
            open_ = np.flatnonzero(group & np.isnan(normals[:, 0]))
            if len(open_):
                normals[open_] = _leading(_along(boxes[open_], direction), floor[open_])
    rest = np.flatnonzero(np.isnan(normals[:, 0]))
    if len(rest):
        normals[rest] = _patch_normals(nets, coefficients, which[rest])
    return normals


def _from_corner(coefficients: FloatArray, t: FloatArray, axis: int) -> FloatArray:
    """The polynomials again, on the part of the domain that begins at t and goes inwards.

    Restriction by de Casteljau, then turned round where the larger part lies before t. After it
    the sample is the corner with index 0 along `axis`.
    """
    moved = np.moveaxis(coefficients, axis, -1).copy()
    flip = t > 0.5
    moved[flip] = moved[flip][..., ::-1]
    begin = np.where(flip, 1.0 - t, t)
    inner = np.flatnonzero(begin > 0)
    if len(inner):
        # The right part of a subdivision is the last value of every level of the triangle.
        triangle, s = moved[inner], begin[inner][:, None, None, None]
        n = triangle.shape[-1]
        for level in range(1, n):
            keep = n - level
            triangle[..., :keep] = (1 - s) * triangle[..., :keep] + s * triangle[..., 1 : keep + 1]
        moved[inner] = triangle
    return np.moveaxis(moved, -1, axis)


def _along(boxes: FloatArray, direction: Direction) -> FloatArray:
    """Coefficients (m, 3, n) of N along a line that starts at the corner (0, 0) of each box."""
    if direction == "v":
        return boxes[:, :, 0, :]
    if direction == "u":
        return boxes[:, :, :, 0]
    rows, columns = boxes.shape[2:]
    weighted = boxes * np.multiply.outer(binomials(rows - 1), binomials(columns - 1))
    line = np.zeros((*boxes.shape[:2], rows + columns - 1))
    for i in range(rows):
        line[:, :, i : i + columns] += weighted[:, :, i]
    return line / binomials(rows + columns - 2)


def _leading(lines: FloatArray, floor: FloatArray) -> FloatArray:
    """The first coefficient longer than `floor` of each line, made unit; NaN if there is none."""
    lengths = np.linalg.norm(lines, axis=1)
    large = lengths > floor[:, None]
    first = large.argmax(axis=1)
    rows = np.arange(len(lines))
    found = large[rows, first]
    length = np.where(found, lengths[rows, first], 1.0)
    return np.where(found[:, None], lines[rows, :, first] / length[:, None], np.nan)


def _patch_normals(nets: _Nets, coefficients: FloatArray, which: NDArray[np.intp]) -> FloatArray:
    """Last resort: the mean normal of the whole patch, weighted by area; else a perpendicular.

    The mean of the coefficients of N is its integral over the patch.
    """
    used, back = np.unique(which, return_inverse=True)
    mean = coefficients[used].mean(axis=(2, 3))
    length = np.linalg.norm(mean, axis=1)
    flat = np.flatnonzero(length <= VANISHING * nets.measure[used])
    length[flat] = 1.0
    normals = mean / length[:, None]
    # Without any area the patch is a line or a point: perpendicular to its longest difference.
    for row in flat.tolist():
        edges = np.concatenate(
            [nets.du[used[row], :3].reshape(3, -1), nets.dv[used[row], :3].reshape(3, -1)], axis=1
        )
        longest = edges[:, np.square(edges).sum(axis=0).argmax()]
        # The coordinate axis that leans on it least; z if several do.
        axis = np.zeros(3)
        axis[2 - np.abs(longest[::-1]).argmin()] = 1.0
        across = axis - longest * (longest @ axis) / max(float(longest @ longest), 1e-300)
        normals[row] = across / np.linalg.norm(across)
    shared: FloatArray = normals[back]
    return shared


def _largest(nets: FloatArray) -> FloatArray:
    """Largest length among the vectors of each net (K, 3, …): shape (K,)."""
    longest: FloatArray = np.sqrt(np.square(nets).sum(axis=1).max(axis=(1, 2)))
    return longest


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product a × b along the last axis; plainer and faster than numpy.cross."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    product = np.empty(a.shape)
    np.subtract(ay * bz, az * by, out=product[..., 0])
    np.subtract(az * bx, ax * bz, out=product[..., 1])
    np.subtract(ax * by, ay * bx, out=product[..., 2])
    return product


def _cross_product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product a × b of vector polynomials (K, 3, …) in the Bernstein basis."""
    first = multiply(a[:, (1, 2, 0)], b[:, (2, 0, 1)])
    first -= multiply(a[:, (2, 0, 1)], b[:, (1, 2, 0)])
    return first
