"""Makes edges equal that are nearly the same curve in different degrees.

`service.engine.connectivity.degree_matching` joins edges whose nets are equal after both are raised
to the same degree, up to the rounding errors of raising. Nets from other systems may differ by
more. Then this module replaces the net of the higher degree by the raised net of the lower degree.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.clustering import find_leaders
from service.engine.connectivity.degree_matching import find_candidates, raise_nets
from service.engine.connectivity.edge_patterns import EdgePattern
from service.engine.connectivity.edges import EdgeCurves


@dataclass(frozen=True, eq=False)
class BorderWeights:
    """The weights of the border points of a model with rational patches.

    Attributes
    ----------
    values : ndarray of float64, shape (B,)
    scale : ndarray of float64, shape (B,), or None
        Logarithms of the common factors of weights (`service.engine.joining.common_factors`): equal
        curves have equal values after division by e^scale. None if all logarithms are 0.
    log_tolerance : float
        The largest difference of the logarithms of two weights that count as equal.
    """

    values: FloatArray
    scale: FloatArray | None
    log_tolerance: float

    @cached_property
    def factors(self) -> FloatArray:
        """The factors e^scale, (B,)."""
        return np.ones(len(self.values)) if self.scale is None else np.exp(self.scale)


def replace_by_raised_nets(
    pattern: EdgePattern, points: FloatArray, weights: BorderWeights | None, radius: float
) -> None:
    """Replaces points and weights of borders by the raised net of the same curve in a lower degree.

    The points (B, 3) of an edge are overwritten if an edge of lower degree has nearly the same net
    after raising: the mean square of the distances of the points in units of `radius`, plus that of
    the differences of the logarithms of weights in units of `log_tolerance`, is at most 1. Both
    edges must already have equal corners.
    """
    comparable_weights = None if weights is None else weights.values / weights.factors
    curves = [
        EdgeCurves(
            ids, points[rows], None if comparable_weights is None else comparable_weights[rows]
        )
        for ids, rows in zip(pattern.ids, pattern.edges, strict=True)
    ]
    begin, end = pattern.connectivity.ends
    degree = pattern.edge_degrees
    # The edges whose corners are also those of an edge of another degree, a number for the corners
    # of each, and the highest degree between these corners.
    pair, edges, higher_degree = find_candidates(pattern.connectivity, degree)
    # Corners give an edge a direction; an edge that ends at its beginning has none, and stays.
    has_two_ends = begin[edges] != end[edges]
    pair, edges = pair[has_two_ends], edges[has_two_ends]
    higher_degree = higher_degree[has_two_ends]
    for ids, rows, (sides, owner) in zip(pattern.ids, pattern.edges, pattern.sides, strict=True):
        common_degree = rows.shape[1] - 1
        compared = np.flatnonzero(higher_degree == common_degree)
        if not len(compared):
            continue
        # Of the edges between the same corners, one of the lowest degree comes first and leads.
        compared = compared[np.lexsort((edges[compared], pair[compared]))]
        edge = edges[compared]
        is_reversed = begin[edge] > end[edge]
        nets = raise_nets(curves, edge, common_degree)
        nets[is_reversed] = nets[is_reversed, ::-1]
        _, first, number = np.unique(pair[compared], return_index=True, return_inverse=True)
        # The squares of n + 1 points add up to at most (n + 1) `radius`², so their mean is at most
        # `radius`².
        distance = radius * (common_degree + 1) ** 0.5
        values = nets.copy()
        if weights is not None:
            values[..., 3] = np.log(nets[..., 3]) * (radius / weights.log_tolerance)
        leader = find_leaders(first[number], values.reshape(len(edge), -1), distance)
        # Only the nets of the highest degree are replaced: an edge between the lowest and the
        # highest degree would get too many points.
        is_replaced = (degree[edge] == common_degree) & (degree[edge[leader]] < common_degree)
        nets = nets[leader]
        nets[is_reversed] = nets[is_reversed, ::-1]
        row_of_edge = np.full(len(ids), -1)
        row_of_edge[edge[is_replaced] - ids[0]] = np.flatnonzero(is_replaced)
        row_of_side = row_of_edge[owner]
        inner, net = sides[row_of_side >= 0, 1:-1], nets[row_of_side[row_of_side >= 0], 1:-1]
        points[inner] = net[..., :3]
        if weights is not None:
            weights.values[inner] = net[..., 3] * weights.factors[inner]
