"""Finds edges of different degrees that are the same curve.

Each Bézier curve of degree n has also a net of degree n + 1 (`service.bases.polynomials.elevate`).
So a cubic patch may meet a quadratic patch along an edge although only the ends of their nets are
equal. Raising the degree rounds. So two curves count as the same curve if their nets, raised to the
higher degree, are equal up to rounding, and their ends are equal bit for bit.
"""

from collections.abc import Callable, Sequence

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.polynomials import elevate
from service.engine.clustering import find_leaders
from service.engine.connectivity.edges import EdgeCurves
from service.engine.connectivity.incidence import Connectivity

SAME_CURVE = 2.0**-44
"""The largest difference of two nets of the same curve, relative to the largest coordinate; for
weights, relative to the weight. No point of one curve is then further from the other curve than ten
times this difference: the nets contribute √3 + 1, the weights 4 √3, and the rounding errors of
raising degrees the rest."""


def find_lowest_degree_edges(
    curves: Sequence[EdgeCurves], connectivity: Connectivity
) -> tuple[Ints, Bools]:
    """For each edge, the edge of lowest degree that is the same curve up to rounding.

    The parameters and results are those of `match_degrees`.
    """
    return match_degrees(curves, connectivity, lambda nets: (_to_comparable_rows(nets), SAME_CURVE))


def has_near_edges(
    curves: Sequence[EdgeCurves], connectivity: Connectivity, distance: float, log_tolerance: float
) -> bool:
    """Whether two edges of different degrees are nearly the same curve.

    The parameters are those of `scale_nets`; `curves` are distinct edges, as after
    `find_lowest_degree_edges`.
    """

    def scale(nets: FloatArray) -> tuple[FloatArray, float]:
        nets[..., 3] /= nets[..., 3].max(axis=1, keepdims=True)
        return scale_nets(nets, distance, log_tolerance)

    leader, _ = match_degrees(curves, connectivity, scale)
    return bool((leader != np.arange(len(leader))).any())


def match_degrees(
    curves: Sequence[EdgeCurves],
    connectivity: Connectivity,
    scale: Callable[[FloatArray], tuple[FloatArray, float]],
) -> tuple[Ints, Bools]:
    """For each edge, the edge of lowest degree that is (nearly) the same curve.

    Parameters
    ----------
    curves : sequence of EdgeCurves
        All E distinct edges, one value for each degree, in ascending order.
    connectivity : Connectivity
    scale : callable
        From nets (m, n+1, 4), which may be overwritten, to m rows of numbers, and the largest
        distance of two rows of the same curve.

    Returns
    -------
    leader : ndarray of int, shape (E,)
        The edge itself, or an edge of lower degree.
    is_reversed : ndarray of bool, shape (E,)
        Whether the leader runs in the opposite direction.
    """
    begin, end = connectivity.ends
    leader, is_reversed = np.arange(len(begin)), np.zeros(len(begin), dtype=bool)
    degree = np.zeros(len(begin), dtype=np.intp)
    for group in curves:
        degree[group.ids] = group.points.shape[1] - 1
    pair, edges, highest_degree = find_candidates(connectivity, degree)
    for common_degree in np.unique(highest_degree).tolist():
        has_degree = highest_degree == common_degree
        edge, pair_of_edge = edges[has_degree], pair[has_degree]
        # Each edge is compared in the direction from the lower to the higher number of its corners.
        # An edge that ends at its beginning is compared in both directions.
        is_backward = begin[edge] > end[edge]
        loops = np.flatnonzero(begin[edge] == end[edge])
        edge, pair_of_edge = (
            np.concatenate([edge, edge[loops]]),
            np.concatenate([pair_of_edge, pair_of_edge[loops]]),
        )
        is_backward = np.concatenate([is_backward, ~is_backward[loops]])
        # Edges of low degree have low numbers, so they lead the groups.
        order = np.lexsort((is_backward, edge, pair_of_edge))
        edge, is_backward, pair_of_edge = edge[order], is_backward[order], pair_of_edge[order]
        _, first, number = np.unique(pair_of_edge, return_index=True, return_inverse=True)
        # For each row, the first row of the same curve. The key of a row, `first[number]`, is the
        # first row with the same two corners.
        nets = raise_nets(curves, edge, common_degree)
        nets[is_backward] = nets[is_backward, ::-1]
        lowest = find_leaders(first[number], *scale(nets))
        has_lower_degree = degree[edge[lowest]] < degree[edge]
        leader[edge[has_lower_degree]] = edge[lowest[has_lower_degree]]
        is_reversed[edge[has_lower_degree]] = (
            is_backward[has_lower_degree] != is_backward[lowest[has_lower_degree]]
        )
    return leader, is_reversed


def find_candidates(connectivity: Connectivity, degree: Ints) -> tuple[Ints, Ints, Ints]:
    """Edges that may be the same curve: edges of several degrees join the same two corners.

    `degree` (E,) is the degree of each edge.

    Returns
    -------
    pair : ndarray of int, shape (m,)
        A number for the two corners of each edge.
    edges : ndarray of int, shape (m,)
        The numbers of the edges.
    highest : ndarray of int, shape (m,)
        The highest degree of the edges between the same corners.
    """
    edges, (begin, end) = np.flatnonzero(connectivity.is_line), connectivity.ends
    low, high = np.minimum(begin, end)[edges], np.maximum(begin, end)[edges]
    _, pair = np.unique(low * (high.max(initial=0) + 1) + high, return_inverse=True)
    # The lowest and the highest degree for each pair; before, numbers beyond all degrees.
    min_degree, max_degree = np.full(len(pair), 1 << 30), np.zeros(len(pair), dtype=np.intp)
    np.minimum.at(min_degree, pair, degree[edges])
    np.maximum.at(max_degree, pair, degree[edges])
    has_several_degrees = (min_degree < max_degree)[pair]
    return (
        pair[has_several_degrees],
        edges[has_several_degrees],
        max_degree[pair[has_several_degrees]],
    )


def raise_nets(curves: Sequence[EdgeCurves], edge: Ints, degree: int) -> FloatArray:
    """The nets of edges raised to a degree n: points and weights, shape (m, n+1, 4).

    `edge` (m,) are numbers of edges; polynomial edges have weights 1.
    """
    nets = np.ones((len(edge), degree + 1, 4))
    for group in curves:
        row_of_edge = np.searchsorted(group.ids, edge).clip(max=len(group.ids) - 1)
        rows = np.flatnonzero(group.ids[row_of_edge] == edge)
        if not len(rows):
            continue
        weights = None if group.weights is None else group.weights[row_of_edge[rows]].T
        points, weights = elevate((group.points[row_of_edge[rows]].swapaxes(0, 1), weights), degree)
        nets[rows, :, :3] = points.swapaxes(0, 1)
        if weights is not None:
            nets[rows, :, 3] = weights.T
    return nets


def scale_nets(nets: FloatArray, distance: float, log_tolerance: float) -> tuple[FloatArray, float]:
    """Rows of numbers for nets (m, n+1, 4), and the largest distance of rows of the same curve.

    Two nets are nearly the same curve if the mean square of the distances of their points in units
    of `distance`, plus that of the differences of the logarithms of their weights in units of
    `log_tolerance`, is at most 1. The squares of n + 1 points then add up to at most n + 1.
    """
    rows = nets.copy()
    rows[..., 3] = np.log(nets[..., 3]) * (distance / log_tolerance) if log_tolerance else 0.0
    return rows.reshape(len(nets), -1), distance * nets.shape[1] ** 0.5


def _to_comparable_rows(nets: FloatArray) -> FloatArray:
    """A row of numbers for each net (m, n+1, 4); the rows of nearly equal curves are nearly equal.

    A row has the control points in units of the largest coordinate, the logarithms of the weights,
    and the logarithm of the largest coordinate.
    """
    size = np.abs(nets[..., :3]).max(axis=(1, 2))
    nets[..., :3] /= size[:, None, None]
    nets[..., 3] = np.log(nets[..., 3] / nets[..., 3].max(axis=1, keepdims=True))
    return np.concatenate([nets.reshape(len(nets), -1), np.log(size)[:, None]], axis=1)
