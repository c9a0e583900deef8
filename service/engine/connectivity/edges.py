"""Distinct edges as curves, and their samples.

Each distinct edge is sampled once, by operations that depend on the edge alone, and not on its
direction; all patches of the edge copy these samples. So meshes have no cracks, in any order of the
patches, and also between patches that are computed separately.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import sample_basis
from service.bases.cache import BASES
from service.bases.row_batches import row_slices
from service.engine.evaluation import de_casteljau, forward_difference
from service.engine.options import Method
from service.engine.vectors import project


@dataclass(frozen=True, eq=False, slots=True)
class EdgeCurves:
    """E distinct edges of one degree n: Bézier curves.

    `ids` (E,) are the numbers of the edges, `points` (E, n+1, 3) their control points, and
    `weights` (E, n+1) their weights, or None. The largest weight of each edge is 1.
    """

    ids: Ints
    points: FloatArray
    weights: FloatArray | None

    def take(self, is_chosen: Bools) -> "EdgeCurves":
        """The edges with a number k for which `is_chosen[k]` is true."""
        is_taken = is_chosen[self.ids]
        if is_taken.all():
            return self
        weights = None if self.weights is None else self.weights[is_taken]
        return EdgeCurves(self.ids[is_taken], self.points[is_taken], weights)


def join_curves(parts: Sequence[EdgeCurves]) -> EdgeCurves:
    """One value with the curves of all parts, which have one degree."""
    weights = None
    if any(part.weights is not None for part in parts):
        weights = np.concatenate(
            [np.ones(p.points.shape[:2]) if p.weights is None else p.weights for p in parts]
        )
    points = np.concatenate([part.points for part in parts])
    return EdgeCurves(np.concatenate([part.ids for part in parts]), points, weights)


RUN_TERMS = 1 << 16
"""Edges are sampled in runs with at most this number of terms, or one edge, so that these stay in
the processor's cache: each sample is a sum of n + 1 terms in three coordinates."""

METHODS: Mapping[Method, Callable[[FloatArray, int], FloatArray]] = MappingProxyType(
    {
        "de_casteljau": de_casteljau.evaluate_curves,
        "forward_difference": forward_difference.evaluate_curves,
    }
)
"""The methods other than `matrix`, for curves."""


def sample_edges(
    curves: Sequence[EdgeCurves], is_chosen: Bools | None, divisions: int, method: Method = "matrix"
) -> FloatArray:
    """Points at R equal divisions of the chosen edges, in the order of their numbers.

        C(k/R) = Σ_i B_i^n(k/R) w_i P_i / Σ_i B_i^n(k/R) w_i

    The bits of a sample depend on the edge alone, and not on its direction or on other edges. The
    order of additions in a matrix product depends on its shape and on the machine. So the method
    `matrix` adds term by term: first the first and the last term, then the second and the
    second-last term, and so on. The other methods compute each number separately, in the direction
    that `orient_edges` chooses. The ends are the control points themselves.

    Parameters
    ----------
    is_chosen : ndarray of bool, shape (E,), or None
        None for all edges.

    Returns
    -------
    ndarray of float64, shape (R+1, chosen edges, 3)
    """
    samples = []
    for group in curves:
        chosen_edges = group if is_chosen is None else group.take(is_chosen)
        if method == "matrix":
            samples.append(_sample_by_matrix(chosen_edges.points, chosen_edges.weights, divisions))
        else:
            samples.append(
                _sample_by_method(
                    METHODS[method], chosen_edges.points, chosen_edges.weights, divisions
                )
            )
    return samples[0] if len(samples) == 1 else np.concatenate(samples, axis=1)


def orient_edges(
    points: FloatArray, weights: FloatArray | None
) -> tuple[FloatArray, FloatArray | None, Bools]:
    """Reverses the edges (E, n+1, d) whose reversed points come first in dictionary order.

    The points and weights (E, n+1) are overwritten; the third result (E,) says which edges were
    reversed. For most edges the first coordinates of both ends decide; weights are compared last.
    """
    first_x, last_x = points[:, 0, 0], points[:, -1, 0]
    is_reversed = first_x > last_x
    undecided_rows = np.flatnonzero(first_x == last_x)
    if len(undecided_rows):
        undecided_points = points[undecided_rows]
        rows, reversed_rows = (
            undecided_points.reshape(len(undecided_points), -1),
            undecided_points[:, ::-1].reshape(len(undecided_points), -1),
        )
        if weights is not None:
            rows = np.concatenate([rows, weights[undecided_rows]], axis=1)
            reversed_rows = np.concatenate([reversed_rows, weights[undecided_rows, ::-1]], axis=1)
        first_difference = np.arange(len(rows)), (rows != reversed_rows).argmax(axis=1)
        is_reversed[undecided_rows] = rows[first_difference] > reversed_rows[first_difference]
    points[is_reversed] = points[is_reversed, ::-1]
    if weights is not None:
        weights[is_reversed] = weights[is_reversed, ::-1]
    return points, weights, is_reversed


def _sample_by_method(
    method: Callable[[FloatArray, int], FloatArray],
    points: FloatArray,
    weights: FloatArray | None,
    divisions: int,
) -> FloatArray:
    """Samples (R+1, E, 3) of edges by a method that depends on the direction.

    Each edge is sampled in the direction of `orient_edges`, so that its samples do not depend on
    the direction in which it is given.
    """
    points, weights, is_reversed = orient_edges(
        points.copy(), None if weights is None else weights.copy()
    )
    if weights is None:
        values = method(points, divisions)
    else:
        values = method(to_homogeneous(points, weights), divisions)
        values[_find_polynomial(weights), :, 3] = 1.0
        values = project(values, -1)
    values[:, 0], values[:, -1] = points[:, 0], points[:, -1]
    values[is_reversed] = values[is_reversed, ::-1]
    return values.swapaxes(0, 1)


def _sample_by_matrix(points: FloatArray, weights: FloatArray | None, divisions: int) -> FloatArray:
    """Samples (R+1, E, 3) of edges, in runs of at most `RUN_TERMS` terms."""
    count, terms = points.shape[:2]
    runs = [*row_slices(count, 3 * terms * (divisions + 1), RUN_TERMS)]
    if len(runs) <= 1:
        return _sample_run(points, weights, divisions)
    samples = np.empty((divisions + 1, count, 3))
    for run in runs:
        run_weights = None if weights is None else weights[run]
        samples[:, run] = _sample_run(points[run], run_weights, divisions)
    return samples


def _sample_run(points: FloatArray, weights: FloatArray | None, divisions: int) -> FloatArray:
    """Samples (R+1, E, 3) of a run of edges, by operations on long contiguous rows."""
    count, terms = points.shape[:2]
    # The basis has shape (n+1, R+1, 1); the rows, (n+1, 1, 3E), have the coordinates of all edges.
    basis = BASES.array(
        ("edges", terms, divisions), lambda: sample_basis(terms - 1, divisions).T[:, :, np.newaxis]
    )
    rows = points.transpose(1, 0, 2).reshape(terms, 1, -1)
    if weights is None:
        return _sum_pairs(basis * rows).reshape(divisions + 1, count, 3)
    weighted_basis = basis * weights.T[:, np.newaxis]
    scaled = weighted_basis.repeat(3, axis=2)
    scaled *= rows
    samples = _sum_pairs(scaled).reshape(divisions + 1, count, 3)
    total = _sum_pairs(weighted_basis)
    total[:, _find_polynomial(weights)] = 1.0
    samples /= total[:, :, np.newaxis]
    samples[0], samples[-1] = points[:, 0], points[:, -1]
    return samples


def _sum_pairs(terms: FloatArray) -> FloatArray:
    """The sum of n+1 terms, (n+1, …), which are overwritten.

    The terms in opposite order give the same sum, bit for bit.
    """
    half_count = len(terms) // 2
    # The last terms, in reverse order, are added to the first terms.
    terms[:half_count] += terms[: -half_count - 1 : -1]
    total: FloatArray = terms[0]
    # If the number of terms is odd, the middle one is the last of these.
    for pair in terms[1 : len(terms) - half_count]:
        total += pair
    return total


def _find_polynomial(weights: FloatArray) -> Bools:
    """Which edges have only weights 1: they get the same bits as polynomial edges."""
    is_polynomial: Bools = (weights == 1.0).all(axis=1)
    return is_polynomial
