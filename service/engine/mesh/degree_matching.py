"""Finds edges of different degrees that are the same curve.

Every Bézier curve of degree n is one of degree n + 1 too (`service.bases.polynomials.elevate`), so
a cubic patch may meet a quadratic patch along an edge although only the end points are the same.
Raising the degree rounds. So curves count as one if their nets in the highest degree are equal up
to rounding, and their ends bit for bit.
"""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.polynomials import elevate
from service.engine.clustering import find_leaders
from service.engine.mesh.edges import EdgeCurves

SAME_CURVE = 2.0**-44
"""The largest difference of nets of one curve, relative to the largest coordinate; for weights,
relative to the weight. No point of one curve is then further from the other than ten times this
difference: √3 + 1 comes from the nets, 4 √3 from the weights, and the rest from the rounding when
degrees are raised."""


def find_lowest(
    curves: Sequence[EdgeCurves], lines: Bools, begin: Ints, end: Ints
) -> tuple[Ints, Bools]:
    """For each edge the edge of lowest degree that is the same curve, and their directions.

    Parameters
    ----------
    curves : sequence of EdgeCurves
        All distinct edges, E of them, by degree.
    lines : ndarray of bool, shape (E,)
        Which edges are not points.
    begin, end : ndarray of int, shape (E,)
        Corners at which the edges begin and end.

    Returns
    -------
    leader : ndarray of int, shape (E,)
        The edge itself, or an edge of lower degree.
    is_reversed : ndarray of bool, shape (E,)
        Whether the leader runs in the opposite direction.
    """
    leader, is_reversed = np.arange(len(lines)), np.zeros(len(lines), dtype=bool)
    degree = np.zeros(len(lines), dtype=np.intp)
    for group in curves:
        degree[group.ids] = group.points.shape[1] - 1
    pair, edges, highest = find_candidates(lines, degree, begin, end)
    for common in np.unique(highest).tolist():
        has_degree = highest == common
        edge, place = edges[has_degree], pair[has_degree]
        # Every edge in the direction from one corner of its pair to the other; closed edges in both
        # directions.
        back = begin[edge] > end[edge]
        loops = np.flatnonzero(begin[edge] == end[edge])
        edge, place = np.concatenate([edge, edge[loops]]), np.concatenate([place, place[loops]])
        back = np.concatenate([back, ~back[loops]])
        # Edges of low degree have low numbers, so they lead the groups.
        order = np.lexsort((back, edge, place))
        edge, back, place = edge[order], back[order], place[order]
        _, first, number = np.unique(place, return_index=True, return_inverse=True)
        lowest = find_leaders(first[number], _values(curves, edge, back, common), SAME_CURVE)
        joins = degree[edge[lowest]] < degree[edge]
        leader[edge[joins]] = edge[lowest[joins]]
        is_reversed[edge[joins]] = back[joins] != back[lowest[joins]]
    return leader, is_reversed


def find_candidates(lines: Bools, degree: Ints, begin: Ints, end: Ints) -> tuple[Ints, Ints, Ints]:
    """Edges between pairs of corners with edges of several degrees.

    Returns
    -------
    pair, edges, highest : ndarray of int, shape (m,)
        A number for the two corners, the edge, and the highest degree of the edges between the
        corners.
    """
    edges = np.flatnonzero(lines)
    low, high = np.minimum(begin, end)[edges], np.maximum(begin, end)[edges]
    _, pair = np.unique(low * (high.max(initial=0) + 1) + high, return_inverse=True)
    least, most = np.full(len(pair), 1 << 30), np.zeros(len(pair), dtype=np.intp)
    np.minimum.at(least, pair, degree[edges])
    np.maximum.at(most, pair, degree[edges])
    several = (least < most)[pair]
    return pair[several], edges[several], most[pair[several]]


def _values(curves: Sequence[EdgeCurves], edge: Ints, back: Bools, degree: int) -> FloatArray:
    """Edges raised to one degree as rows of numbers; nearly equal curves have nearly equal rows.

    A row has the net in units of its largest coordinate, and the logarithms of that coordinate and
    of the weights.
    """
    nets = np.zeros((len(edge), degree + 1, 4))
    for group in curves:
        place = np.searchsorted(group.ids, edge).clip(max=len(group.ids) - 1)
        rows = np.flatnonzero(group.ids[place] == edge)
        if not len(rows):
            continue
        weights = None if group.weights is None else group.weights[place[rows]].T
        points, weights = elevate((group.points[place[rows]].swapaxes(0, 1), weights), degree)
        nets[rows, :, :3] = points.swapaxes(0, 1)
        if weights is not None:
            nets[rows, :, 3] = np.log(weights / weights.max(axis=0)).T
    nets[back] = nets[back, ::-1]
    size = np.abs(nets[..., :3]).max(axis=(1, 2))
    nets[..., :3] /= size[:, None, None]
    return np.concatenate([nets.reshape(len(edge), -1), np.log(size)[:, None]], axis=1)
