"""Points and unit normals of a batch of patches at all samples.

The method `matrix` has three formulations on tensor-product patches, in `at_once` and, for grids
that do not fit the cache, in `large_grids`. This module chooses the one that is fastest for the
shape of the batch. `triangle_evaluation` computes points and normals on triangles.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from math import prod
from types import MappingProxyType
from typing import Literal, TypeAlias

import numpy as np

from service.bases import triangle
from service.bases.arrays import FloatArray, Ints
from service.engine.evaluation import de_casteljau, forward_difference
from service.engine.evaluation.at_once import count_chunk, evaluate_at_once, fits_cache
from service.engine.evaluation.chunks import CHUNK_SAMPLES, count_vectors
from service.engine.evaluation.evaluation_state import Evaluation, PatchSamples
from service.engine.evaluation.grid_evaluation import GridEvaluation
from service.engine.evaluation.large_grids import evaluate_by_normal_polynomial, evaluate_separably
from service.engine.evaluation.triangle_evaluation import TriangleEvaluation
from service.engine.options import Method
from service.engine.scratch import Real, scratch
from service.measuring import Measured
from service.surface.batches import Patches, TensorPatches, TrianglePatches

Formulation: TypeAlias = Literal["kronecker", "separable", "normal_polynomial"]
"""The formulations of the method `matrix`: `kronecker` multiplies once with the basis of all
samples, `separable` along u and then along v. `normal_polynomial` is separable, too, with the
polynomial S_u × S_v in place of S_u and S_v."""

LARGE_GRIDS: Mapping[Formulation, Callable[[GridEvaluation], None]] = MappingProxyType(
    {"separable": evaluate_separably, "normal_polynomial": evaluate_by_normal_polynomial}
)
"""The formulations for large grids. `at_once` has another `separable`, for small grids, and
`kronecker`, for grids of every size."""

MAX_BASIS_NUMBERS = 1 << 20
"""The most numbers of a cached matrix: 8 MiB of float64, the largest that the cache accepts."""

GRID_METHODS: Mapping[Method, Callable[[GridEvaluation], None]] = MappingProxyType(
    {
        "de_casteljau": de_casteljau.evaluate_grids,
        "forward_difference": forward_difference.evaluate_grids,
    }
)
"""The methods other than `matrix`, on tensor-product patches."""

TRIANGLE_METHODS: Mapping[Method, Callable[[TriangleEvaluation], None]] = MappingProxyType(
    {
        "matrix": TriangleEvaluation.evaluate_by_matrix,
        "de_casteljau": de_casteljau.evaluate_triangles,
        "forward_difference": forward_difference.evaluate_triangles,
    }
)
"""All methods, on triangles."""


def evaluate(
    patches: Patches,
    resolution: tuple[int, int],
    *,
    dtype: Real = np.float64,
    normals: bool = True,
    origin: FloatArray | None = None,
    method: Method = "matrix",
    formulation: Formulation | None = None,
    out: PatchSamples | None = None,
) -> PatchSamples:
    """S(i/Ru, j/Rv) − origin and the unit normals there, for every patch of a batch.

    Parameters
    ----------
    patches : TensorPatches or TrianglePatches
        P patches of one degree.
    resolution : (Ru, Rv)
        Divisions along u and v, at least 1; a triangle takes the larger.
    dtype : float32 or float64
        Precision of the result and of the arithmetic.
    normals : bool
        Whether normals are computed too.
    origin : ndarray of float64, shape (3,), optional
        Positions are relative to it. The control points of polynomial patches are translated in
        float64, before they are rounded to `dtype`; rational patches are evaluated about the middle
        of the batch, and their points are translated from there.
    method : "matrix", "de_casteljau" or "forward_difference"
        The method that computes the samples. With every method, normals whose rounding errors may
        be too large are computed again.
    formulation : str, optional
        A formulation of `matrix`, by default the fastest. The result is the same up to rounding.
    out : PatchSamples, optional
        An earlier result of the same shapes and precision, which is overwritten. Allocating large
        arrays takes as long as the arithmetic, because the system zeroes every page.

    References
    ----------
    Piegl and Tiller, The NURBS Book, 2nd ed., Algorithms A1.7 and A4.3, for all samples at once.
    """
    divisions = max(resolution)
    if out is None:
        grid: tuple[int, ...] = (resolution[0] + 1, resolution[1] + 1)
        if isinstance(patches, TrianglePatches):
            grid = (triangle.count_points(divisions),)
        shape = (patches.count, *grid, 3)
        out = PatchSamples(np.empty(shape, dtype), np.empty(shape, dtype) if normals else None, 0)
    work: Evaluation
    evaluate_in_double = None
    if dtype is not np.float64:
        evaluate_in_double = partial(_evaluate_in_double, patches, resolution, method, formulation)
    if isinstance(patches, TrianglePatches):
        work = TriangleEvaluation(patches, divisions, dtype, out, origin)
        with Measured("triangles" if method == "matrix" else method):
            TRIANGLE_METHODS[method](work)
        return work.finish(evaluate_in_double)
    if method != "matrix":
        formulation = None
    elif formulation is None:
        formulation = choose_formulation(patches, resolution, normals)
    if formulation == "kronecker" or (formulation == "separable" and fits_cache(resolution)):
        with Measured(formulation):
            doubtful = evaluate_at_once(
                patches,
                resolution,
                origin,
                out.positions,
                out.normals,
                is_separable=formulation == "separable",
            )
        if not doubtful:
            return out
        work = GridEvaluation(patches, resolution, dtype, out, origin)
        work.doubtful = doubtful
        return work.finish(evaluate_in_double)
    work = GridEvaluation(patches, resolution, dtype, out, origin)
    with Measured(formulation or method):
        (LARGE_GRIDS[formulation] if formulation else GRID_METHODS[method])(work)
    return work.finish(evaluate_in_double)


def _evaluate_in_double(
    patches: Patches,
    resolution: tuple[int, int],
    method: Method,
    formulation: Formulation | None,
    index: Ints,
) -> PatchSamples:
    """Evaluates the patches with the numbers `index` in float64.

    If they are few, the next call overwrites the result, because it is in reused work arrays.
    """
    selected, out = patches.take(index), None
    if isinstance(selected, TensorPatches):
        shape = (selected.count, resolution[0] + 1, resolution[1] + 1, 3)
        if prod(shape[:3]) <= CHUNK_SAMPLES:
            points, vectors = (scratch(f"double {name}", shape, np.float64) for name in "SN")
            out = PatchSamples(points, vectors, 0)
    return evaluate(selected, resolution, method=method, formulation=formulation, out=out)


def choose_formulation(
    patches: TensorPatches, resolution: tuple[int, int], normals: bool
) -> Formulation:
    """The formulation expected to be fastest."""
    if fits_cache(resolution):
        return _choose_at_once(patches.degree, resolution, patches.count)
    if normals and patches.weights is None and max(patches.degree) <= 4:
        return "normal_polynomial"
    # A bilinear patch has four control points: one product with all four takes as long as each of
    # the two products, with two points each, of the separable formulation.
    is_rational_bilinear = patches.weights is not None and patches.degree == (1, 1)
    if is_rational_bilinear and patches.count > 1 and _is_basis_cached(patches.degree, resolution):
        return "kronecker"
    return "separable"


@lru_cache(256)
def _choose_at_once(
    degree: tuple[int, int], resolution: tuple[int, int], count: int
) -> Formulation:
    """The faster formulation of `evaluate_at_once`, by counting multiplications and NumPy calls.

    The unit of cost is a multiplication of three coordinates in one large product. A multiplication
    in the two products of `separable` costs 2 units. The second product has 3 q + 2 multiplications
    for each sample; each sample also costs as much as 5 further multiplications. The NumPy calls of
    `separable` cost 20,000 units for each patch and for each chunk of patches. A large product of
    few patches costs more for each multiplication.
    """
    q, vectors = degree[1], sum(count_vectors(degree))
    samples, chunk = (resolution[0] + 1) * (resolution[1] + 1), count_chunk(degree, resolution)
    chunks_per_patch = 1 / min(count, chunk)
    # The costs for each sample.
    kronecker_cost = vectors * (1 + 2 * chunks_per_patch)
    separable_cost = 2 * (3 * q + 7 + vectors / (resolution[1] + 1))
    separable_cost += 20_000 * (1 + chunks_per_patch) / samples
    is_faster = kronecker_cost <= separable_cost
    return "kronecker" if is_faster and _is_basis_cached(degree, resolution) else "separable"


def _is_basis_cached(degree: tuple[int, int], resolution: tuple[int, int]) -> bool:
    """Whether the cache accepts the bases of S, S_u and S_v at all samples, by their size."""
    (p, q), (ru, rv) = degree, resolution
    return 3 * (p + 1) * (q + 1) * (ru + 1) * (rv + 1) <= MAX_BASIS_NUMBERS
