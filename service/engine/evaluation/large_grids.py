"""Two formulations for grids that are too large for the cache: some rows of a patch at a time.

- `separable`: first along u, then along v, with at most p + q + 2 multiplications for each value
  if Rv ≥ q.
- `normal_polynomial`: separable too, but N = S_u × S_v is one polynomial of degree (2p−1, 2q−1), in
  place of two partials and a cross product for each sample. It is faster for low degrees.
"""

from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np

from service.bases.arrays import RealArray
from service.bases.bernstein import (
    product_coefficients,
    sample_basis,
    sample_basis_columns,
    sample_interleaved_basis,
)
from service.bases.row_batches import row_runs
from service.engine.evaluation.chunks import CHUNK_SAMPLES
from service.engine.evaluation.grid_evaluation import GridEvaluation
from service.engine.evaluation.nets import cross_polynomial
from service.engine.scratch import Real
from service.engine.vectors import BEFORE, NEXT

RowRun: TypeAlias = tuple[slice, tuple[RealArray, RealArray, RealArray], RealArray, RealArray, int]
"""Rows of samples of a patch, work arrays for S, S_u and S_v, the outputs for positions and
normals, and the number of the first sample among the samples of all patches."""


MAX_PAIRS_DEGREE = 6
"""Up to this degree, the net of S_u × S_v is computed from all pairs of a vector of the net of S_u
and one of S_v, with cached coefficients.

The coefficients take 2 MB at degree 6, and grow with the sixth power of the degree."""

MAX_INTERLEAVED_DEGREE = 6
"""Up to this degree along v, one product writes x, y and z of each position side by side. It takes
three times the multiplications, but saves copying from separate planes of x, y and z."""


def evaluate_separably(work: GridEvaluation) -> None:
    """The formulation `separable`: computes B(u) P B(v)ᵀ for S and both partials.

    It evaluates patch by patch, some rows of samples at a time.
    """
    (p, q), (ru, rv) = work.patches.degree, work.resolution
    u, u_lower = (sample_basis(degree, ru, work.dtype) for degree in (p, p - 1))
    v, v_lower = (sample_basis_columns(degree, rv, work.dtype) for degree in (q, q - 1))
    write_positions = _choose_position_writer(work)
    for patch, (net, *partial_nets), threshold in _iterate_patches(work, work.dtype):
        points_at_u = np.matmul(u, net)
        if not partial_nets:
            for rows, (point, _, _), out, _, _ in _row_runs(work, patch):
                write_positions(points_at_u[:, rows], point, out)
            continue
        du_at_u, dv_at_u = map(np.matmul, (u_lower, u), partial_nets)
        for rows, (point, du, dv), out, normals, first in _row_runs(work, patch):
            write_positions(points_at_u[:, rows], point, out)
            np.matmul(du_at_u[:, rows], v, out=du)
            np.matmul(dv_at_u[:, rows], v_lower, out=dv)
            work.write_normals(work.partials_to_vectors(point, du, dv), normals, threshold, first)


def evaluate_by_normal_polynomial(work: GridEvaluation) -> None:
    """The formulation `normal_polynomial`: separable, with one net for S_u × S_v.

    It is only for polynomial patches, and only if normals are requested. The net of S_u × S_v is
    computed in float64, because its products may cancel, and then rounded.
    """
    (p, q), (ru, rv) = work.patches.degree, work.resolution
    u, u_normal = (sample_basis(degree, ru, work.dtype) for degree in (p, 2 * p - 1))
    v_normal = sample_basis_columns(2 * q - 1, rv, work.dtype)
    write_positions = _choose_position_writer(work)
    for patch, (net, *partial_nets), threshold in _iterate_patches(work, np.float64):
        if not partial_nets:
            raise ValueError("The normal polynomial is only for normals.")
        points_at_u = np.matmul(u, net.astype(work.dtype))
        normals_at_u = np.matmul(u_normal, _normal_net(*partial_nets).astype(work.dtype))
        for rows, (point, vectors, _), out, normals, first in _row_runs(work, patch):
            write_positions(points_at_u[:, rows], point, out)
            np.matmul(normals_at_u[:, rows], v_normal, out=vectors)
            work.write_normals(vectors, normals, threshold, first)


def _iterate_patches(
    work: GridEvaluation, dtype: Real
) -> Iterator[tuple[int, list[RealArray], RealArray]]:
    """The patches one by one; the nets of several patches are prepared together.

    Yields
    ------
    patch : int
    nets : list of ndarray of `dtype`
        Planes (d, p+1, q+1) of S, (d, p, q+1) of S_u and (d, p+1, q) of S_v; of S alone if only
        positions are requested.
    threshold : ndarray, shape (1,)
        The least |S_u × S_v|² whose direction is precise enough.
    """
    p, q = work.patches.degree
    shapes = ((p + 1, q + 1), (p, q + 1), (p + 1, q))
    net_count = 1 if work.normals is None else 3
    columns_and_shapes = [*zip(work.net_rows, shapes, strict=True)][:net_count]
    for first, last in row_runs(work.patches.count, max(1, CHUNK_SAMPLES // ((p + 1) * (q + 1)))):
        nets = work.load_nets(first, last)
        threshold = nets.threshold_column(work.dtype)
        for k in range(last - first):
            # The coordinates of all three nets of one patch; each net has some of the columns.
            planes: RealArray = np.ascontiguousarray(nets.rows[:, :, k].T, dtype)
            yield (
                first + k,
                [planes[:, columns].reshape(-1, *shape) for columns, shape in columns_and_shapes],
                threshold[k],
            )


def _normal_net(du: RealArray, dv: RealArray) -> RealArray:
    """The net (3, 2p, 2q) of S_u × S_v, from nets (3, p, q+1) and (3, p+1, q).

    Up to `MAX_PAIRS_DEGREE`, it is computed from the cross products of all pairs of vectors, times
    cached coefficients.
    """
    p, q = du.shape[1], dv.shape[2]
    if max(p, q) > MAX_PAIRS_DEGREE:
        nets = (net[np.newaxis].astype(np.float64) for net in (du, dv))
        net: RealArray = cross_polynomial(*nets)[0]
        return net
    a, b = du.reshape(3, -1, 1), dv.reshape(3, 1, -1)
    # The cross product: y, z, x times z, x, y, minus z, x, y times y, z, x.
    pairs = a[NEXT] * b[BEFORE]
    pairs -= a[BEFORE] * b[NEXT]
    products = product_coefficients((p - 1, q), (p, q - 1))
    net = pairs.reshape(3, -1) @ products
    return net.reshape(3, 2 * p, 2 * q)


def _choose_position_writer(
    work: GridEvaluation,
) -> Callable[[RealArray, RealArray, RealArray], None]:
    """Returns the function that writes the positions of some rows of samples.

    Its arguments are planes (d, rows, q+1) that are already evaluated along u, a work array
    (d, rows, Rv+1), and the output (rows, Rv+1, 3). For rational patches, the function leaves S in
    the work array.
    """
    degree, divisions = work.patches.degree[1], work.resolution[1]
    if work.is_rational or degree > MAX_INTERLEAVED_DEGREE:
        columns = sample_basis_columns(degree, divisions, work.dtype)

        def write_planes(along_u: RealArray, point: RealArray, out: RealArray) -> None:
            np.matmul(along_u, columns, out=point)
            work.write_positions(point, out)

        return write_planes
    interleaved = sample_interleaved_basis(degree, divisions, work.dtype)

    def write_points(along_u: RealArray, _: RealArray, out: RealArray) -> None:
        # One product writes interleaved coordinates. It has three times the multiplications, but
        # the output is written only once.
        points = along_u.transpose(1, 2, 0).reshape(len(out), -1)
        np.matmul(points, interleaved, out=out.reshape(len(out), -1))

    return write_points


def _row_runs(work: GridEvaluation, patch: int) -> Iterator[RowRun]:
    """Runs of rows of samples of a patch, with their work arrays and outputs."""
    step = max(1, CHUNK_SAMPLES // work.shape[1])
    # If no normals are requested, nothing is written to their output: any array serves.
    normals = work.positions if work.normals is None else work.normals
    for first, last in row_runs(work.shape[0], step):
        rows = slice(first, last)
        planes = work.sample_planes(last - first, work.shape[1])
        first_sample = patch * work.sample_count + first * work.shape[1]
        yield rows, planes, work.positions[patch, rows], normals[patch, rows], first_sample
