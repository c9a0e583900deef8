"""Points and unit normals of a batch of patches on a grid of samples: the inner loop.

Three formulations give the same figures at different prices; `evaluate` chooses by shape.

- `kronecker`: all samples of many patches in one product with a cached matrix. No overhead per
  patch, (p+1)(q+1) multiplications a value: for small grids of low degree.
- `separable`: first along u, then along v, some rows at a time so that what is worked on stays in
  the processor's cache. p + q + 2 multiplications a value, some numpy calls a patch.
- `normal_polynomial`: separable, but with N = S_u × S_v as one polynomial of degree (2p−1, 2q−1)
  instead of two partials and a cross product a sample: for large grids of low degree.

Arithmetic is in the precision of the result, on nets that were differenced, centred and scaled in
float64. A sample whose S_u × S_v is small against its net (near poles, at them, along slivers) is
not vouched for: `service.engine.normals` computes it anew in float64.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.engine.basis import multiply, sampled, sampled_grid, sampled_interleaved, samples
from service.engine.mesh import RealArray
from service.engine.normals import pole_normals, unit_normals
from service.engine.scratch import Real, scratch
from service.surface.lowered import FloatArray, TensorPatches

Formulation: TypeAlias = Literal["kronecker", "separable", "normal_polynomial"]

CHUNK_SAMPLES = 24_576
"""Samples worked on at a time: a dozen planes of them fit the second-level cache."""

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
    """Points and unit normals at all samples of a batch, shapes (P, Ru+1, Rv+1, 3).

    `poles` counts the samples at which S_u × S_v vanishes.
    """

    positions: RealArray
    normals: RealArray | None
    poles: int


def evaluate(
    patches: TensorPatches,
    resolution: tuple[int, int],
    *,
    dtype: Real = np.float64,
    normals: bool = True,
    origin: FloatArray | None = None,
    formulation: Formulation | None = None,
    out: Samples | None = None,
) -> Samples:
    """S(i/Ru, j/Rv) − origin and the unit normals there, for every patch of a batch.

    Parameters
    ----------
    patches : TensorPatches
        P patches of degree (p, q).
    resolution : (Ru, Rv)
        Divisions along u and v, at least 1.
    dtype : float32 or float64
        Precision of the result and of the arithmetic.
    normals : bool
        Whether normals are wanted.
    origin : ndarray of float64, shape (3,), optional
        Subtracted from the control points before they are rounded to `dtype`.
    formulation : str, optional
        Overrules the choice; the answer is the same up to rounding.
    out : Samples, optional
        An earlier result of the same shapes and precision to overwrite. Large fresh arrays cost
        as much as the arithmetic, because the system zeroes every page of them.

    References
    ----------
    Piegl and Tiller, The NURBS Book, 2nd ed., Algorithms A1.7 and A4.3, for all samples at once.
    """
    if out is None:
        shape = (patches.count, resolution[0] + 1, resolution[1] + 1, 3)
        out = Samples(np.empty(shape, dtype), np.empty(shape, dtype) if normals else None, 0)
    batch = _Batch(patches, resolution, dtype, out, origin)
    _FORMULATIONS[formulation or choose(patches, resolution, normals)](batch)
    return batch.finished()


def choose(patches: TensorPatches, resolution: tuple[int, int], normals: bool) -> Formulation:
    """The formulation expected to be fastest, by counting multiplications and numpy calls."""
    p, q = patches.degree
    count = (resolution[0] + 1) * (resolution[1] + 1)
    # A call per patch costs as much as some 100 000 multiplications.
    kronecker = (p + 1) * (q + 1)
    separable = (q + 1) * (1 + (p + 1) / (resolution[1] + 1)) + 12_000 / count
    if kronecker <= separable:
        return "kronecker"
    if normals and patches.weights is None and count >= 40_000 and max(p, q) <= 4:
        return "normal_polynomial"
    return "separable"


class _Batch:
    """One evaluation under way: its inputs, its outputs, and what the formulations share."""

    def __init__(
        self,
        patches: TensorPatches,
        resolution: tuple[int, int],
        dtype: Real,
        out: Samples,
        origin: FloatArray | None,
    ) -> None:
        self.patches = patches
        self.resolution = resolution
        self.dtype = dtype
        self.shape = (resolution[0] + 1, resolution[1] + 1)
        self.count = self.shape[0] * self.shape[1]
        self.rational = patches.weights is not None
        self.positions = out.positions
        self.normals = out.normals
        self.origin = np.zeros(3) if origin is None else origin
        # Rational nets are evaluated about the batch's middle, where S_u = (X_u − w_u S)/w loses
        # least; their points are moved back when they are written. A power of two scales exactly.
        low, high = patches.bounds
        self.middle = low + (high - low) / 2
        extent = float((high - low).max())
        self.scale = 1.0
        if not 2.0**-ORDINARY <= extent <= 2.0**ORDINARY and extent > 0:
            self.scale = float(np.exp2(min(ORDINARY - np.frexp(extent)[1], 1000)))
        self.heaviest = 1.0 if patches.weights is None else float(patches.weights.max())
        self._doubtful: list[NDArray[np.intp]] = []

    def nets(self, first: int, last: int) -> "_ChunkNets":
        """Planes of the nets of patches [first, last), ready for products.

        The patches are the innermost axis: differences between neighbours in a net then run over
        long contiguous rows.
        """
        p, q = self.patches.degree
        planes = 4 if self.rational else 3
        net = scratch("net", (p + 1, q + 1, planes, last - first), np.float64)
        np.copyto(net[:, :, :3], self.patches.points[first:last].transpose(1, 2, 3, 0))
        at = net
        if self.patches.weights is None:
            # Positions about the origin asked for, partials from differences of the points
            # themselves: neither loses digits to the other's needs.
            if self.origin.any():
                at = net - self.origin[:, None]
            if self.scale != 1.0:
                net = net * self.scale
        else:
            weights = self.patches.weights[first:last].transpose(1, 2, 0)
            np.multiply(weights, 1 / self.heaviest, out=net[:, :, 3])
            net[:, :, :3] -= self.middle[:, None]
            net[:, :, :3] *= self.scale
            net[:, :, :3] *= net[:, :, 3:]
        if self.normals is None:
            return _ChunkNets(at, None, None, None)
        du = scratch("net du", (p, q + 1, *net.shape[2:]), np.float64)
        dv = scratch("net dv", (p + 1, q, *net.shape[2:]), np.float64)
        np.subtract(net[1:], net[:-1], out=du)
        np.subtract(net[:, 1:], net[:, :-1], out=dv)
        trust = _square_sums(du) * _square_sums(dv)
        trust *= TRUSTED[self.dtype] ** 2 / (p * (q + 1) * (p + 1) * q)
        np.maximum(trust, SUBNORMAL[self.dtype], out=trust)
        return _ChunkNets(at, du, dv, trust)

    def write_positions(self, planes: RealArray, out: RealArray) -> None:
        """Writes S from the planes of its homogeneous coordinates; projects them in place."""
        if self.rational:
            planes[:3] /= planes[3]
            for axis in range(3):
                shift = float(self.middle[axis] - self.origin[axis])
                np.multiply(planes[axis], self.dtype(1 / self.scale), out=out[..., axis])
                if shift:
                    out[..., axis] += self.dtype(shift)
        else:
            for axis in range(3):
                out[..., axis] = planes[axis]

    def write_normals(
        self,
        vectors: RealArray,
        out: RealArray,
        trust: RealArray | float,
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
        found = np.flatnonzero(square <= trust)
        if len(found):
            square.reshape(-1)[found] = 1
            self._doubtful.append(found + first)
        np.sqrt(square, out=square)
        np.divide(vectors, square, out=vectors)
        for axis in range(3):
            out[..., axis] = vectors[axis]

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
        for axis, (b, c) in enumerate(((1, 2), (2, 0), (0, 1))):
            np.multiply(du[b], dv[c], out=vectors[axis])
            np.multiply(du[c], dv[b], out=term)
            np.subtract(vectors[axis], term, out=vectors[axis])
        return vectors

    def finished(self) -> Samples:
        """The result, after the doubtful normals have been computed anew."""
        if self.normals is None or not self._doubtful:
            return Samples(self.positions, self.normals, 0)
        # NaN marks what is still owed: first the poles are paid, then the rest.
        doubtful = self._doubtful[0] if len(self._doubtful) == 1 else np.concatenate(self._doubtful)
        normals = self.normals.reshape(-1, 3)
        normals[doubtful] = np.nan
        self._write_poles(self.normals)
        rest = doubtful[np.isnan(normals[doubtful, 0])]
        poles = len(doubtful) - len(rest)
        if len(rest):
            patch, sample = np.divmod(rest, self.count)
            i, j = np.divmod(sample, self.shape[1])
            u, v = (samples(r) for r in self.resolution)
            normals[rest], limits = unit_normals(self.patches, patch, u[i], v[j])
            poles += limits
        return Samples(self.positions, self.normals, poles)

    def _write_poles(self, normals: RealArray) -> None:
        """Limits along collapsed sides; NaN where only the general way is left."""
        for side, index in self.patches.poles:
            along = 1 if side < 2 else 0
            degree, divisions = self.patches.degree[along], self.resolution[along]
            basis = sampled(degree, divisions), sampled(degree - 1, divisions)
            end = 0 if side % 2 == 0 else -1
            rows = normals[:, end] if side < 2 else normals[:, :, end]
            rows[index] = pole_normals(self.patches, side, index, basis)


@dataclass(frozen=True, eq=False, slots=True)
class _ChunkNets:
    """Nets (p+1, q+1, d, r) of S and of its partials, in float64.

    `trust` (r,) is the least |S_u × S_v|² that is good enough.
    """

    at: FloatArray
    du: FloatArray | None
    dv: FloatArray | None
    trust: FloatArray | None

    def single(self, k: int) -> "_ChunkNets":
        """The nets of patch k alone, its coordinates as planes (d, p+1, q+1)."""
        at = self.at[..., k].transpose(2, 0, 1)
        if self.du is None or self.dv is None or self.trust is None:
            return _ChunkNets(at, None, None, None)
        du, dv = (net[..., k].transpose(2, 0, 1) for net in (self.du, self.dv))
        return _ChunkNets(at, du, dv, self.trust[k : k + 1])

    def least(self, dtype: Real) -> RealArray:
        """`trust` in the working precision, to compare (r, samples) with."""
        if self.trust is None:
            raise ValueError("nets without partials have no normals to trust")
        least: RealArray = self.trust.astype(dtype)
        return least[:, None]


def _kronecker(batch: _Batch) -> None:
    p, q = batch.patches.degree
    # Sixteen numbers are a cache line: every plane of a chunk begins at one.
    step = max(16, CHUNK_SAMPLES // batch.count // 16 * 16)
    out = batch.positions.reshape(batch.patches.count, batch.count, 3)
    normals = None if batch.normals is None else batch.normals.reshape(out.shape)
    for first, last in _runs(batch.patches.count, step):
        nets = batch.nets(first, last)
        at = _product("at", nets.at, (p, q), batch)
        batch.write_positions(at, out[first:last])
        if normals is None or nets.du is None or nets.dv is None:
            continue
        du = _product("du", nets.du, (p - 1, q), batch)
        dv = _product("dv", nets.dv, (p, q - 1), batch)
        vectors = batch.partials_to_vectors(at, du, dv)
        batch.write_normals(
            vectors, normals[first:last], nets.least(batch.dtype), first * batch.count
        )


def _product(
    name: str, nets: NDArray[np.floating], degree: tuple[int, int], batch: _Batch
) -> RealArray:
    """Planes (d, r, samples) of nets (p+1, q+1, d, r)."""
    grid = sampled_grid(degree, batch.resolution, batch.dtype)
    planes, patches = nets.shape[2:]
    out = scratch(name, (planes, patches, batch.count), batch.dtype)
    rounded = scratch("rounded", (grid.shape[0], planes * patches), batch.dtype)
    np.copyto(rounded, nets.reshape(rounded.shape), casting="same_kind")
    np.matmul(rounded.T, grid, out=out.reshape(planes * patches, batch.count))
    return out


def _separable(batch: _Batch) -> None:
    for patch, nets in _single(batch):
        along_u = _rows(nets.at, batch)
        if nets.du is None or nets.dv is None:
            for rows, out, _, _ in _row_runs(batch, patch):
                _write_row_positions(batch, along_u, rows, out)
            continue
        du_u, dv_u = _rows(nets.du, batch), _rows(nets.dv, batch)
        trust = nets.least(batch.dtype)
        for rows, out, normals, first in _row_runs(batch, patch):
            at = _write_row_positions(batch, along_u, rows, out)
            du = _columns("du", du_u, rows, batch)
            dv = _columns("dv", dv_u, rows, batch)
            batch.write_normals(batch.partials_to_vectors(at, du, dv), normals, trust, first)


def _normal_polynomial(batch: _Batch) -> None:
    for patch, nets in _single(batch):
        if nets.du is None or nets.dv is None:
            raise ValueError("the normal polynomial is of no use without normals")
        along_u = _rows(nets.at, batch)
        du, dv = nets.du, nets.dv
        normal = multiply(du[[1, 2, 0]], dv[[2, 0, 1]]) - multiply(du[[2, 0, 1]], dv[[1, 2, 0]])
        normal_u = _rows(normal, batch)
        trust = nets.least(batch.dtype)
        for rows, out, normals, first in _row_runs(batch, patch):
            _write_row_positions(batch, along_u, rows, out)
            vectors = _columns("du", normal_u, rows, batch)
            batch.write_normals(vectors, normals, trust, first)


def _single(batch: _Batch) -> Iterator[tuple[int, "_ChunkNets"]]:
    """The nets of the patches one by one, (d, p+1, q+1), prepared some at a time."""
    p, q = batch.patches.degree
    step = max(1, CHUNK_SAMPLES // ((p + 1) * (q + 1)))
    for first, last in _runs(batch.patches.count, step):
        nets = batch.nets(first, last)
        for k in range(last - first):
            yield first + k, nets.single(k)


def _rows(net: RealArray, batch: _Batch) -> RealArray:
    """One patch's planes (d, p+1, q+1) sampled along u: (d, Ru+1, q+1)."""
    basis = sampled(net.shape[1] - 1, batch.resolution[0], batch.dtype)
    rows: RealArray = np.matmul(basis, net.astype(batch.dtype, copy=False))
    return rows


def _columns(name: str, along_u: RealArray, rows: slice, batch: _Batch) -> RealArray:
    """Planes (d, rows, Rv+1): some rows sampled along v as well."""
    basis = sampled(along_u.shape[2] - 1, batch.resolution[1], batch.dtype)
    part = along_u[:, rows]
    out = scratch(name, (*part.shape[:2], batch.shape[1]), batch.dtype)
    return np.matmul(part, basis.T, out=out)


def _write_row_positions(
    batch: _Batch, along_u: RealArray, rows: slice, out: RealArray
) -> RealArray:
    """Positions of some rows, written; and their planes, where a rational patch needs them."""
    degree = along_u.shape[2] - 1
    if batch.rational or degree > 6:
        at = _columns("at", along_u, rows, batch)
        batch.write_positions(at, out)
        return at
    # Points side by side in one product: three times the multiplications, no second pass.
    points = along_u[:, rows].transpose(1, 2, 0)
    basis = sampled_interleaved(degree, batch.resolution[1], batch.dtype)
    np.matmul(points.reshape(len(points), -1), basis, out=out.reshape(len(out), -1))
    return out


def _row_runs(batch: _Batch, patch: int) -> Iterator[tuple[slice, RealArray, RealArray, int]]:
    """Rows of a patch some at a time: which, where their results go, their first sample."""
    step = max(1, CHUNK_SAMPLES // batch.shape[1])
    normals = batch.positions if batch.normals is None else batch.normals
    for first, last in _runs(batch.shape[0], step):
        rows = slice(first, last)
        at = patch * batch.count + first * batch.shape[1]
        yield rows, batch.positions[patch, rows], normals[patch, rows], at


def _runs(count: int, step: int) -> Iterator[tuple[int, int]]:
    for first in range(0, count, step):
        yield first, min(first + step, count)


def _square_sums(nets: FloatArray) -> FloatArray:
    """Sum of the squared lengths of the vectors of each net: (m, n, d, r) to (r,)."""
    rows = nets[:, :, :3].reshape(-1, nets.shape[3])
    sums: FloatArray = np.einsum("kr,kr->r", rows, rows)
    return sums


_FORMULATIONS: dict[Formulation, Callable[[_Batch], None]] = {
    "kronecker": _kronecker,
    "separable": _separable,
    "normal_polynomial": _normal_polynomial,
}
