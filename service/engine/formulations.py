"""Three ways from nets to samples: the same figures at different prices.

- `kronecker`: all samples of many patches in one product with a cached matrix. No overhead per
  patch, (p+1)(q+1) multiplications a value: for small grids of low degree.
- `separable`: first along u, then along v, some rows at a time so that what is worked on stays in
  the processor's cache. p + q + 2 multiplications a value, some numpy calls a patch.
- `normal_polynomial`: separable, but with N = S_u × S_v as one polynomial of degree (2p−1, 2q−1)
  instead of two partials and a cross product a sample: for large grids of low degree.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from service.engine.basis import (
    multiply,
    sampled,
    sampled_columns,
    sampled_grid,
    sampled_interleaved,
)
from service.engine.batch import Batch, ChunkNets
from service.engine.mesh import RealArray
from service.engine.scratch import scratch

CHUNK_SAMPLES = 24_576
"""Samples worked on at a time: a dozen planes of them fit the second-level cache."""


def kronecker(batch: Batch) -> None:
    """All samples of some patches at a time: nets (3 r, (p+1)(q+1)) times one cached matrix."""
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
    name: str, nets: NDArray[np.floating], degree: tuple[int, int], batch: Batch
) -> RealArray:
    """Planes (d, r, samples) of nets (p+1, q+1, d, r)."""
    grid = sampled_grid(degree, batch.resolution, batch.dtype)
    planes, patches = nets.shape[2:]
    out = scratch(name, (planes, patches, batch.count), batch.dtype)
    rounded = scratch("rounded", (grid.shape[0], planes * patches), batch.dtype)
    np.copyto(rounded, nets.reshape(rounded.shape), casting="same_kind")
    np.matmul(rounded.T, grid, out=out.reshape(planes * patches, batch.count))
    return out


def separable(batch: Batch) -> None:
    """B(u) P B(v)ᵀ for S and both partials, patch by patch, some rows at a time."""
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


def normal_polynomial(batch: Batch) -> None:
    """The same with one net for S_u × S_v; polynomial patches only, and with normals only."""
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


def _single(batch: Batch) -> Iterator[tuple[int, ChunkNets]]:
    """The nets of the patches one by one, (d, p+1, q+1), prepared some at a time."""
    p, q = batch.patches.degree
    step = max(1, CHUNK_SAMPLES // ((p + 1) * (q + 1)))
    for first, last in _runs(batch.patches.count, step):
        nets = batch.nets(first, last)
        for k in range(last - first):
            yield first + k, nets.single(k)


def _rows(net: RealArray, batch: Batch) -> RealArray:
    """One patch's planes (d, p+1, q+1) sampled along u: (d, Ru+1, q+1)."""
    basis = sampled(net.shape[1] - 1, batch.resolution[0], batch.dtype)
    rows: RealArray = np.matmul(basis, net.astype(batch.dtype, copy=False))
    return rows


def _columns(name: str, along_u: RealArray, rows: slice, batch: Batch) -> RealArray:
    """Planes (d, rows, Rv+1): some rows sampled along v as well."""
    basis = sampled_columns(along_u.shape[2] - 1, batch.resolution[1], batch.dtype)
    part = along_u[:, rows]
    out = scratch(name, (*part.shape[:2], batch.shape[1]), batch.dtype)
    return np.matmul(part, basis, out=out)


def _write_row_positions(
    batch: Batch, along_u: RealArray, rows: slice, out: RealArray
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


def _row_runs(batch: Batch, patch: int) -> Iterator[tuple[slice, RealArray, RealArray, int]]:
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
