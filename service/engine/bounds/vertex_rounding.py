"""Bounds of the distance from stored vertices to their points of the surface.

If the error of each corner of a triangle is at most e, then the error of each of its points is at
most e. So this bound is added to the bound of bending: that of the distance between the surface and
triangles with exact corners (`service.engine.bounds.second_derivatives`).

Proofs in docs/proofs.md: "Sums of products", "Stored vertices" and "Rounding of bending".
"""

from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from service.bases import triangle, triangle_basis
from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import FloatArray, RealArray
from service.bases.bernstein import sample_basis
from service.bases.row_batches import row_slices
from service.engine.connectivity.degree_matching import SAME_CURVE
from service.engine.connectivity.edges import sample_edges
from service.engine.connectivity.incidence import SAME_WEIGHT
from service.engine.connectivity.seams import Seams
from service.engine.evaluation.evaluate import choose_formulation
from service.engine.options import Method
from service.engine.plans.layout import Layout
from service.engine.scratch import Real
from service.engine.vectors import UNIT
from service.surface.batches import Patches, TrianglePatches

MARGIN = 1.02
"""Factor for products of small relative errors; the largest error, of 65² terms in float32, is
2.5e-4."""

STEPS = 1 + 2.0**-30
"""Factor for the rounding of bounds in float64, and of the steps of up to 2^16 divisions."""

PRECISIONS: dict[Real, tuple[float, float]] = {
    dtype: (float(np.finfo(dtype).eps) / 2, float(np.finfo(dtype).tiny))
    for dtype in (np.float32, np.float64)
}
"""For each type, the relative error of one operation and the least number with full precision."""

CHUNK_SAMPLES = 1 << 15
"""Samples in one chunk of comparisons."""


class _Sizes(NamedTuple):
    """Bounds of the distances of a batch's control points from three points, in model units.

    These are the origin of the model, the origin of the mesh, and the middle of the batch.
    """

    from_model_origin: float
    from_mesh_origin: float
    from_middle: float


def bound_vertex_error(
    patches: Patches, resolution: tuple[int, int], normals: bool, dtype: Real, origin: FloatArray
) -> float:
    """Bound of the distance from a vertex to its point, for the method `matrix`.

    Grids are evaluated in the precision `dtype` of the vertices, about the middle of their batch if
    they are rational; edges in float64, in model coordinates. The bases of both are computed in
    float64, with errors of at most 12 (p + q + 1) units. Vertices are stored relative to `origin`.
    `normals` tells whether normals are computed too, because the formulation depends on it.
    """
    unit, least = PRECISIONS[dtype]
    sizes = _measure_sizes(patches, origin)
    from_origin, from_middle = sizes.from_mesh_origin, sizes.from_middle
    # `degrees` is p + q.
    terms, degrees = _count_terms(patches, resolution, normals)
    basis = 12 * (degrees + 1) * UNIT
    if patches.weights is None:
        # A sum of products, in which rounding the net and the basis to `dtype` costs at most 4
        # units more; the error of the basis; and subtracting the origin.
        grids = from_origin * ((terms + 4) * unit + basis + UNIT)
    else:
        # The same for the numerator and the denominator; their quotient; and adding the middle.
        grids = from_middle * ((2 * (terms + 4) + 1) * unit + 2 * basis + 12 * UNIT)
        grids += 3 * from_origin * unit
    edges = _bound_edge_samples(patches, degrees, unit, sizes)
    underflow = (terms + 8) * find_weight_ratio(patches) * least
    return MARGIN * (grids + edges) + underflow


def bound_edge_error(seams: Seams, layout: Layout, method: Method) -> float:
    """Bound of the errors of samples of edges that two steps cause.

    One is that sides of different degrees were joined as one edge. The other is a method other than
    `matrix`, by which samples of edges are computed in float64: those beside the grid of a stitched
    patch are compared here with samples by `matrix`; `measure_errors` compares all others with
    their patch.
    """
    curves = seams.curves
    error = 0.0
    # Each group has the curves of one degree; curves of degree 0 are single points.
    if len(curves) > 1 and sum(group.points.shape[1] > 1 for group in curves) > 1:
        max_coordinate = max(float(np.abs(group.points).max(initial=0.0)) for group in curves)
        error += 10 * SAME_CURVE * max_coordinate  # `SAME_CURVE` explains the factor
    if method == "matrix" or not layout.is_stitched:
        return error
    largest = 0.0
    for divisions, chosen in layout.border_writes.groups:
        samples = sample_edges(curves, chosen, divisions, method)
        samples -= sample_edges(curves, chosen, divisions)
        largest = max(largest, float(np.square(samples).sum(axis=2).max()))
    return error + MARGIN * sqrt(largest)


def bound_bending_rounding(patches: Patches, along_u: float, along_v: float) -> float:
    """Bound of the rounding in the bounds of bending, for boxes of these sides.

    Rounding that is relative to the bound is not counted: `STEPS` includes it.
    """
    p, q = (patches.degree,) * 2 if isinstance(patches, TrianglePatches) else patches.degree
    units = (p + 1) * (q + 1) + 4 * (p + q) + 17
    error = units * (p * along_u + q * along_v) ** 2
    if patches.weights is not None:
        # The net and the weights have an error each, and the sum is divided by the least weight.
        error *= 2 * find_weight_ratio(patches)
    return error * UNIT * patches.diagonal / 2


def find_weight_ratio(patches: Patches) -> float:
    """The largest weight of a batch over the least."""
    return 1.0 if patches.weights is None else float(patches.weights.max() / patches.weights.min())


def measure_errors(
    patches: Patches, resolution: tuple[int, int], positions: RealArray, origin: FloatArray
) -> FloatArray:
    """Bounds (m,) of the errors of vertices by methods other than `matrix`.

    Vertices are compared with points by `matrix` in float64. For forward differences a bound that
    depends on the degree alone would be too large to be useful. The comparison takes only a
    fraction of the time of each of these methods. `positions` (m, samples, 3) are the stored
    samples, relative to `origin`.
    """
    shift = origin - patches.middle
    nets = to_homogeneous(patches.points - patches.middle, patches.weights)
    largest = np.empty(patches.count)
    for rows in row_slices(patches.count, positions.shape[1], CHUNK_SAMPLES):
        exact = _evaluate(nets[rows], resolution)
        squares = np.zeros(exact.shape[1:])
        for axis in range(3):
            difference = positions[rows, :, axis].astype(np.float64) + shift[axis]
            difference -= exact[axis] if patches.weights is None else exact[axis] / exact[3]
            difference *= difference
            squares += difference
        largest[rows] = squares.max(axis=1)
    sizes = _measure_sizes(patches, origin)
    if isinstance(patches, TrianglePatches):
        degrees, more_terms = 2 * patches.degree, patches.points.shape[1]
    else:
        degrees, more_terms = sum(patches.degree), 0
    # The bound of `bound_vertex_error` for a rational patch in float64: 24 (p + q + 1) units come
    # from the bases, 2 (terms + 4) from the sums, 13 from the quotient. A sum for a grid has at
    # most p + q + 2 terms, so all these are at most 28 (p + q + 2); a sum for a triangle may have a
    # term for each control point. The last units are for the differences from the vertices.
    units = 28 * (degrees + 2) + 2 * more_terms
    compared = (units * sizes.from_middle + 2 * sizes.from_mesh_origin) * UNIT
    unit = float(np.finfo(positions.dtype).eps) / 2
    edges = _bound_edge_samples(patches, degrees, unit, sizes)
    errors: FloatArray = MARGIN * (np.sqrt(largest) + compared + edges)
    return errors


def _bound_edge_samples(patches: Patches, degrees: int, unit: float, sizes: _Sizes) -> float:
    """Bound of the rounding of edges: evaluated in float64 in model coordinates, then stored.

    Evaluating takes at most 16 (p + q + 2) units, with p + q = `degrees`; most of them are for the
    error of the basis. Storing relative to the origin of the mesh rounds once in float64, and once
    in the precision of the vertices, by `unit`.
    """
    error = sizes.from_model_origin * 16 * (degrees + 2) * UNIT
    error += sizes.from_mesh_origin * (unit + UNIT)
    if patches.weights is not None:
        # The weights of an edge are those of one of its patches; those of another may differ by
        # `SAME_WEIGHT` times the largest. That changes the numerator and the denominator.
        error += 2 * sizes.from_middle * find_weight_ratio(patches) * SAME_WEIGHT
    return error


def _evaluate(nets: FloatArray, resolution: tuple[int, int]) -> FloatArray:
    """Values (d, m, samples) of nets (m, p+1, q+1, d), or of triangular nets (m, K, d)."""
    if nets.ndim == 3:
        return np.moveaxis(triangle_basis.evaluate_triangles(nets, resolution[0]), -1, 0)
    along_u, along_v = (
        sample_basis(n - 1, r) for n, r in zip(nets.shape[1:3], resolution, strict=True)
    )
    values: FloatArray = along_u @ np.ascontiguousarray(np.moveaxis(nets, -1, 0)) @ along_v.T
    return values.reshape(*values.shape[:2], -1)


def _measure_sizes(patches: Patches, origin: FloatArray) -> _Sizes:
    """The sizes of a batch; `origin` is that of the mesh, in model coordinates."""
    (low_x, low_y, low_z), (high_x, high_y, high_z) = patches.box
    x, y, z = origin.tolist()
    from_model_origin = hypot(max(-low_x, high_x), max(-low_y, high_y), max(-low_z, high_z))
    from_mesh_origin = hypot(
        max(x - low_x, high_x - x), max(y - low_y, high_y - y), max(z - low_z, high_z - z)
    )
    return _Sizes(from_model_origin, from_mesh_origin, patches.diagonal / 2)


def _count_terms(patches: Patches, resolution: tuple[int, int], normals: bool) -> tuple[int, int]:
    """Number of terms in all sums that compute a point of a grid, and the sum of the degrees."""
    if isinstance(patches, TrianglePatches):
        n, divisions = patches.degree, resolution[0]
        small = triangle_basis.is_small(n, divisions)
        return triangle.count_points(n) if small else n + 1, 2 * n
    p, q = patches.degree
    is_kronecker = choose_formulation(patches, resolution, normals) == "kronecker"
    return (p + 1) * (q + 1) if is_kronecker else p + q + 2, p + q
