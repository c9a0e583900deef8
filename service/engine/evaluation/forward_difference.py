"""The method `forward_difference`: each row of samples by additions alone.

For equal steps the differences of order n of a polynomial of degree n are constant. So each sample
takes n additions, beginning with the differences at the start of the row. These starting
differences are computed in float64. Every addition then rounds in the working precision, and the
rounding errors add up along the row: the error grows with the number of divisions.

References
----------
Farin, Curves and Surfaces for CAGD, 5th ed., section 5.6 (forward differencing); Lien, Shantz and
Pratt, Adaptive forward differencing, SIGGRAPH 1987.
"""

from functools import lru_cache

import numpy as np

from service.bases import triangle
from service.bases.arrays import FloatArray, Ints, RealArray
from service.bases.bernstein import bernstein, binomials, sample_basis
from service.bases.row_batches import row_slices
from service.bases.triangle import tensor_net
from service.cancellation import checkpoint
from service.engine.evaluation.chunks import split_work
from service.engine.evaluation.grid_evaluation import GridEvaluation
from service.engine.evaluation.triangle_evaluation import TriangleEvaluation
from service.engine.evaluation.triangle_nets import partial_nets
from service.engine.scratch import Real

MAX_DEGREE: dict[Real, int] = {np.float32: 8, np.float64: 16}
"""The highest degree in each precision. The rounding error grows with 3 to the power of the degree;
above these degrees it exceeds 1e-3 (float32) or 1e-9 (float64) of the size of the net."""

CHUNK_SAMPLES = 1 << 17
"""Samples in one chunk: the more rows advance together, the fewer NumPy calls are needed."""


def evaluate_grids(work: GridEvaluation) -> None:
    """Points and normals of tensor-product patches: many rows along v advance together."""
    p, q = work.patches.degree
    row_count, row_length = work.shape
    step = max(1, CHUNK_SAMPLES // row_length)
    for first, last, begin, end in split_work(work.patches.count, row_count, step):
        checkpoint()
        nets = work.load_nets(first, last)  # used for the threshold of normals
        local = work.load_local(first, last).reshape(p + 1, q + 1, -1, last - first)
        rows = slice(begin, end)
        point = _evaluate_rows(local, work, rows)
        work.write_local(point, work.positions[first:last, rows])
        if work.normals is not None:
            du, dv = (_evaluate_rows(np.diff(local, axis=axis), work, rows) for axis in (0, 1))
            work.write_normals(
                work.partials_to_vectors(point, du, dv),
                work.normals[first:last, rows],
                nets.threshold_column(work.dtype)[:, :, np.newaxis],
                first * work.sample_count + begin * work.shape[1],
            )


def _evaluate_rows(net: FloatArray, work: GridEvaluation, rows: slice) -> RealArray:
    """Samples of some rows, (d, r, rows, Rv+1), of nets (m+1, n+1, d, r)."""
    basis = sample_basis(len(net) - 1, work.resolution[0])[rows]
    curves = np.moveaxis(np.tensordot(basis, net, axes=(1, 0)), 0, -1)
    divisions = np.full(len(basis), work.resolution[1])
    return np.moveaxis(_add_differences(curves, divisions, work.dtype), 0, -1)


def evaluate_triangles(work: TriangleEvaluation) -> None:
    """Points and normals of triangles: row m of samples, at t = m/R, has R − m divisions."""
    starts = triangle.row_starts(work.divisions)
    row_count = work.divisions + 1  # the longest row has as many samples
    step = max(1, CHUNK_SAMPLES // row_count)
    for first, last, begin, end in split_work(work.patches.count, row_count, step):
        nets = work.load_nets(first, last)  # used for the threshold of normals
        local = work.load_local(first, last)
        samples = slice(starts[begin], starts[end])
        point = _evaluate_triangle_rows(local, work.divisions, slice(begin, end), work.dtype)
        work.write_local(point, work.positions[first:last, samples])
        if work.normals is not None:
            du, dv = (
                _evaluate_triangle_rows(net, work.divisions, slice(begin, end), work.dtype)
                for net in partial_nets(local)
            )
            work.write_normals(
                work.partials_to_vectors(point, du, dv),
                work.normals[first:last, samples],
                nets.threshold_column(work.dtype),
                first * work.sample_count + int(starts[begin]),
            )


def _evaluate_triangle_rows(net: FloatArray, divisions: int, rows: slice, dtype: Real) -> RealArray:
    """Samples of some rows, (d, r, samples), of triangular nets (K, d, r).

    At a fixed t the surface is a curve of degree n in s/(1 − t). The net of this curve follows from
    the tensor-product form of the triangle.
    """
    # Shape (r, n+1, n+1, d): along s/(1 − t), then along t.
    tensor_nets = tensor_net(np.moveaxis(net, -1, 0))
    number = np.arange(divisions + 1)[rows]
    basis = bernstein(tensor_nets.shape[1] - 1, number / divisions)
    curves = np.einsum("mk,rlkd->ldrm", basis, tensor_nets)
    lengths = divisions - number
    # The last row is one sample: with 1 division in place of 0, its step is finite.
    values = _add_differences(curves, np.maximum(lengths, 1), dtype)
    row = np.repeat(np.arange(len(number)), lengths + 1)
    column = np.concatenate([np.arange(length + 1) for length in lengths.tolist()])
    return np.moveaxis(values[column, :, :, row], 0, -1)


def evaluate_curves(points: FloatArray, divisions: int) -> FloatArray:
    """Bézier curves (E, n+1, d) at R equal divisions: (E, R+1, d).

    Each number is computed separately, so its bits depend on its curve and its parameter alone.
    """
    out = np.empty((len(points), divisions + 1, points.shape[2]))
    for rows in row_slices(len(points), divisions + 1, CHUNK_SAMPLES):
        part = points[rows].transpose(1, 2, 0)
        values = _add_differences(part, np.full(part.shape[2], divisions), np.float64)
        out[rows] = values.transpose(2, 0, 1)
    return out


def _add_differences(curves: FloatArray, divisions: Ints, dtype: Real) -> RealArray:
    """Values of curves (n+1, …, rows) at equal divisions: (largest division + 1, …, rows).

    Each row has its own number of divisions, and the longest rows come first. Values after the end
    of a row are 0. The sums are relative to the first point of the row, so that the distance of the
    row from the origin costs no digits.
    """
    in_double = find_starting_differences(curves, divisions)
    first_points, differences = in_double[0].astype(dtype), in_double.astype(dtype)
    differences[0] = 0
    values = np.zeros((int(divisions.max()) + 1, *curves.shape[1:]), dtype)
    for j in range(len(values)):
        active_count = int(np.count_nonzero(divisions >= j))
        active_differences = differences[..., :active_count]
        np.add(
            first_points[..., :active_count],
            active_differences[0],
            out=values[j, ..., :active_count],
        )
        # The operands overlap: NumPy copies them first, so all sums are of old differences.
        np.add(active_differences[:-1], active_differences[1:], out=active_differences[:-1])
    return values


def find_starting_differences(curves: FloatArray, divisions: Ints) -> FloatArray:
    """Forward differences of order 0 … n at t = 0 of curves, (n+1, …, rows), for steps h = 1/R.

    A Bézier curve is Σ_m C(n, m) Δ^m b_0 t^m. The differences of the powers at t = 0 are

        Δ_h^k t^m = k! S(m, k) h^m

    with the Stirling numbers S of the second kind. Differences of samples would lose digits by
    cancellation.
    """
    degree = len(curves) - 1
    counts = _count_surjections(degree)
    step = 1.0 / divisions
    differences = np.zeros(curves.shape)
    difference = curves
    for m in range(degree + 1):
        power = binomials(degree)[m] * difference[0] * step**m
        for k in range(m + 1):
            differences[k] += counts[m, k] * power
        difference = difference[1:] - difference[:-1]
    return differences


@lru_cache(maxsize=32)
def _count_surjections(degree: int) -> FloatArray:
    """The numbers k! S(m, k) of maps of m elements onto k elements: row m, column k."""
    counts = np.zeros((degree + 1, degree + 1))
    counts[0, 0] = 1
    for m in range(1, degree + 1):
        for k in range(1, m + 1):
            counts[m, k] = k * (counts[m - 1, k] + counts[m - 1, k - 1])
    counts.flags.writeable = False
    return counts
