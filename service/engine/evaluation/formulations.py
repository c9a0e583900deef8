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

from service.bases.arrays import RealArray
from service.bases.bernstein import sampled, sampled_columns, sampled_grid, sampled_interleaved
from service.bases.chunks import runs
from service.engine.evaluation.grid_evaluation import GridEvaluation
from service.engine.evaluation.under_way import ChunkNets
from service.engine.scratch import scratch
from service.engine.vectors import cross_polynomial

CHUNK_SAMPLES = 18_432
"""Samples worked on at a time: a dozen planes of them fit the second-level cache."""


def kronecker(work: GridEvaluation) -> None:
    """All samples of some patches at a time: nets (3 r, (p+1)(q+1)) times one cached matrix."""
    p, q = work.patches.degree
    # Sixteen numbers are a cache line: every plane of a chunk begins at one.
    step = max(16, CHUNK_SAMPLES // work.each // 16 * 16)
    out = work.positions.reshape(work.patches.count, work.each, 3)
    normals = None if work.normals is None else work.normals.reshape(out.shape)
    for first, last in runs(work.patches.count, step):
        nets = work.nets(first, last)
        at = _product("at", nets.at, (p, q), work)
        work.write_positions(at, out[first:last])
        if normals is None or nets.du is None or nets.dv is None:
            continue
        du = _product("du", nets.du, (p - 1, q), work)
        dv = _product("dv", nets.dv, (p, q - 1), work)
        vectors = work.partials_to_vectors(at, du, dv)
        work.write_normals(vectors, normals[first:last], nets.least(work.dtype), first * work.each)


def _product(
    name: str, nets: NDArray[np.floating], degree: tuple[int, int], work: GridEvaluation
) -> RealArray:
    """Planes (d, r, samples) of nets (p+1, q+1, d, r)."""
    grid = sampled_grid(degree, work.resolution, work.dtype)
    planes, patches = nets.shape[2:]
    out = scratch(name, (planes, patches, work.each), work.dtype)
    rounded = scratch("rounded", (grid.shape[0], planes * patches), work.dtype)
    np.copyto(rounded, nets.reshape(rounded.shape), casting="same_kind")
    np.matmul(rounded.T, grid, out=out.reshape(planes * patches, work.each))
    return out


def separable(work: GridEvaluation) -> None:
    """B(u) P B(v)ᵀ for S and both partials, patch by patch, some rows at a time."""
    for patch, nets in _single(work):
        along_u = _rows(nets.at, work)
        if nets.du is None or nets.dv is None:
            for rows, out, _, _ in _row_runs(work, patch):
                _write_row_positions(work, along_u, rows, out)
            continue
        du_u, dv_u = _rows(nets.du, work), _rows(nets.dv, work)
        trust = nets.least(work.dtype)
        for rows, out, normals, first in _row_runs(work, patch):
            at = _write_row_positions(work, along_u, rows, out)
            du = _columns("du", du_u, rows, work)
            dv = _columns("dv", dv_u, rows, work)
            work.write_normals(work.partials_to_vectors(at, du, dv), normals, trust, first)


def normal_polynomial(work: GridEvaluation) -> None:
    """The same with one net for S_u × S_v; polynomial patches only, and with normals only."""
    for patch, nets in _single(work):
        if nets.du is None or nets.dv is None:
            raise ValueError("the normal polynomial is of no use without normals")
        along_u = _rows(nets.at, work)
        du, dv = nets.du, nets.dv
        normal_u = _rows(cross_polynomial(du[np.newaxis], dv[np.newaxis])[0], work)
        trust = nets.least(work.dtype)
        for rows, out, normals, first in _row_runs(work, patch):
            _write_row_positions(work, along_u, rows, out)
            vectors = _columns("du", normal_u, rows, work)
            work.write_normals(vectors, normals, trust, first)


def _single(work: GridEvaluation) -> Iterator[tuple[int, ChunkNets]]:
    """The nets of the patches one by one, (d, p+1, q+1), prepared some at a time."""
    p, q = work.patches.degree
    step = max(1, CHUNK_SAMPLES // ((p + 1) * (q + 1)))
    for first, last in runs(work.patches.count, step):
        nets = work.nets(first, last)
        for k in range(last - first):
            yield first + k, nets.single(k)


def _rows(net: RealArray, work: GridEvaluation) -> RealArray:
    """One patch's planes (d, p+1, q+1) sampled along u: (d, Ru+1, q+1)."""
    basis = sampled(net.shape[1] - 1, work.resolution[0], work.dtype)
    rows: RealArray = np.matmul(basis, net.astype(work.dtype, copy=False))
    return rows


def _columns(name: str, along_u: RealArray, rows: slice, work: GridEvaluation) -> RealArray:
    """Planes (d, rows, Rv+1): some rows sampled along v as well."""
    basis = sampled_columns(along_u.shape[2] - 1, work.resolution[1], work.dtype)
    part = along_u[:, rows]
    out = scratch(name, (*part.shape[:2], work.shape[1]), work.dtype)
    return np.matmul(part, basis, out=out)


def _write_row_positions(
    work: GridEvaluation, along_u: RealArray, rows: slice, out: RealArray
) -> RealArray:
    """Positions of some rows, written; and their planes, where a rational patch needs them."""
    degree = along_u.shape[2] - 1
    if work.rational or degree > 6:
        at = _columns("at", along_u, rows, work)
        work.write_positions(at, out)
        return at
    # Points side by side in one product: three times the multiplications, no second pass.
    points = along_u[:, rows].transpose(1, 2, 0)
    basis = sampled_interleaved(degree, work.resolution[1], work.dtype)
    np.matmul(points.reshape(len(points), -1), basis, out=out.reshape(len(out), -1))
    return out


def _row_runs(
    work: GridEvaluation, patch: int
) -> Iterator[tuple[slice, RealArray, RealArray, int]]:
    """Rows of a patch some at a time: which, where their results go, their first sample."""
    step = max(1, CHUNK_SAMPLES // work.shape[1])
    normals = work.positions if work.normals is None else work.normals
    for first, last in runs(work.shape[0], step):
        rows = slice(first, last)
        at = patch * work.each + first * work.shape[1]
        yield rows, work.positions[patch, rows], normals[patch, rows], at
