"""The method `de_casteljau`: points by repeated interpolation between neighbouring control points.

All steps are convex combinations, so no method is numerically more stable. The points before the
last step give the partials. The cost is high, because all steps are repeated for every sample.

References
----------
Farin, Curves and Surfaces for CAGD, 5th ed., sections 4.2, 14.1 (bilinear) and 17.1 (triangles).
"""

import numpy as np

from service.bases import triangle
from service.bases.arrays import FloatArray, RealArray
from service.bases.bernstein import sample_parameters
from service.cancellation import checkpoint
from service.engine.evaluation.chunks import split_work
from service.engine.evaluation.grid_evaluation import GridEvaluation
from service.engine.evaluation.triangle_evaluation import TriangleEvaluation
from service.engine.evaluation.triangle_nets import neighbour_rows
from service.surface.batches import Patches, TrianglePatches
from service.surface.lowered import PatchModel

CHUNK_NUMBERS = 1 << 17
"""The most numbers that one step of the interpolation computes in a chunk: they fit the
second-level cache. A chunk of `MIN_SAMPLES` samples may have more."""

MIN_SAMPLES = 64
"""The least number of samples in a chunk: for fewer, NumPy's calls cost more than the
arithmetic."""


def evaluate_grids(work: GridEvaluation) -> None:
    """Points and normals of tensor-product patches: bilinear steps, then linear steps.

    While both degrees are above 1, every 2 × 2 block of points is interpolated along u, then along
    v. Then neighbours are interpolated in the direction whose degree is above 1.
    The last step is bilinear, because its four points give both partials.
    """
    p, q = work.patches.degree
    parameters: list[RealArray] = [sample_parameters(r).astype(work.dtype) for r in work.resolution]
    out = work.positions.reshape(work.patches.count, work.sample_count, 3)
    normals = None if work.normals is None else work.normals.reshape(out.shape)
    step = _count_samples((p + 1) * (q + 1))
    for first, last, begin, end in split_work(work.patches.count, work.sample_count, step):
        checkpoint()
        nets = work.load_nets(first, last)  # used for the threshold of normals
        net = work.load_local(first, last).reshape(p + 1, q + 1, -1, last - first)
        i, j = np.divmod(np.arange(begin, end), work.shape[1])
        u, v = parameters[0][i], parameters[1][j]
        last_points = _find_last_points(net.astype(work.dtype), u, v)
        sides = _interpolate(last_points[:, 0], last_points[:, 1], v)
        point = _interpolate(sides[0], sides[1], u)
        work.write_local(point, out[first:last, begin:end])
        if normals is not None:
            du = sides[1] - sides[0]
            dv = _interpolate(
                last_points[0, 1] - last_points[0, 0], last_points[1, 1] - last_points[1, 0], u
            )
            vectors = work.partials_to_vectors(point, du, dv)
            first_sample = first * work.sample_count + begin
            work.write_normals(
                vectors,
                normals[first:last, begin:end],
                nets.threshold_column(work.dtype),
                first_sample,
            )


def _find_last_points(net: RealArray, u: RealArray, v: RealArray) -> RealArray:
    """The points (2, 2, d, r, m) before the last bilinear step, from nets (p+1, q+1, d, r)."""
    points = net[..., np.newaxis]
    while len(points) > 2 and points.shape[1] > 2:
        points = _interpolate(points[:-1], points[1:], u)
        points = _interpolate(points[:, :-1], points[:, 1:], v)
    while len(points) > 2:
        points = _interpolate(points[:-1], points[1:], u)
    while points.shape[1] > 2:
        points = _interpolate(points[:, :-1], points[:, 1:], v)
    # A bilinear net takes no step above: its points are the same for all samples.
    return np.broadcast_to(points, (*points.shape[:-1], len(u)))


def evaluate_triangles(work: TriangleEvaluation) -> None:
    """Points and normals of triangles: every upright triangle of neighbours becomes one point.

        b_ijk ← r b_{i+1,j,k} + s b_{i,j+1,k} + t b_{i,j,k+1}

    The last three points give the partials.
    """
    step = _count_samples(triangle.count_points(work.patches.degree))
    for first, last, begin, end in split_work(work.patches.count, work.sample_count, step):
        nets = work.load_nets(first, last)  # used for the threshold of normals
        r, s, t = triangle.barycentric(work.divisions, begin, end).astype(work.dtype).T
        points = work.load_local(first, last).astype(work.dtype)[..., np.newaxis]
        while len(points) > 3:
            corner, along, above = neighbour_rows(len(points))
            points = r * points[corner] + s * points[along] + t * points[above]
        # A net of degree 1 takes no step above: its points are the same for all samples.
        points = np.broadcast_to(points, (*points.shape[:-1], end - begin))
        point = r * points[0] + s * points[1] + t * points[2]
        work.write_local(point, work.positions[first:last, begin:end])
        if work.normals is not None:
            vectors = work.partials_to_vectors(point, points[1] - points[0], points[2] - points[0])
            first_sample = first * work.sample_count + begin
            out = work.normals[first:last, begin:end]
            work.write_normals(vectors, out, nets.threshold_column(work.dtype), first_sample)


def evaluate_curves(points: FloatArray, divisions: int) -> FloatArray:
    """Bézier curves (E, n+1, d) at R equal divisions: (E, R+1, d).

    Each number is computed separately, so its bits depend on its curve and its parameter alone.
    """
    t = sample_parameters(divisions)[:, np.newaxis]
    out = np.empty((len(points), divisions + 1, points.shape[2]))
    step = _count_samples(points.shape[1])
    for first, last, begin, end in split_work(len(points), divisions + 1, step):
        level: RealArray = points[first:last, :, np.newaxis]
        while level.shape[1] > 1:
            level = _interpolate(level[:, :-1], level[:, 1:], t[begin:end])
        out[first:last, begin:end] = level[:, 0]
    return out


def estimate_effort(model: PatchModel, resolution: tuple[int, int]) -> int:
    """The number of multiplications for all samples of a model; a million take one millisecond."""
    ru, rv = resolution
    total = 0
    for batch in model.batches:
        sample_count = (ru + 1) * (rv + 1)
        if isinstance(batch, TrianglePatches):
            sample_count = triangle.count_points(max(ru, rv))
        total += batch.count * sample_count * count_multiplications(batch)
    return total


def count_multiplications(patches: Patches) -> int:
    """The number of multiplications for each sample: of the order of p³ at degree p."""
    planes = 3 if patches.weights is None else 4
    if isinstance(patches, TrianglePatches):
        return planes * 3 * sum(triangle.count_points(n) for n in range(patches.degree))
    rows, columns = patches.degree
    count = 0
    while rows and columns:
        count += 2 * rows * (columns + 1) + 2 * rows * columns
        rows, columns = rows - 1, columns - 1
    linear_degree = max(rows, columns)  # the other degree is 0: only linear steps follow
    return planes * (count + linear_degree * (linear_degree + 1))


def _interpolate(a: RealArray, b: RealArray, t: RealArray) -> RealArray:
    """(1 − t) a + t b."""
    out: RealArray = (1 - t) * a
    out += t * b
    return out


def _count_samples(points: int) -> int:
    """The number of samples in one chunk, for nets of this number of points."""
    return max(MIN_SAMPLES, CHUNK_NUMBERS // (4 * points))  # points have up to 4 coordinates
