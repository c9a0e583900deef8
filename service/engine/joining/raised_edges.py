"""Makes edges equal that are nearly the same curve in different degrees.

`service.engine.connectivity.degree_matching` joins edges whose nets are equal after both are raised
to the same degree, up to the rounding errors of raising. Nets from other systems may differ by
more. Then this module replaces the net of the higher degree by the raised net of the lower degree.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.polynomials import elevate
from service.engine.clustering import find_leaders
from service.engine.connectivity.degree_matching import find_candidates
from service.engine.connectivity.edge_patterns import EdgePattern


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
    pattern: EdgePattern, points: FloatArray, weights: BorderWeights | None, reach: float
) -> None:
    """Replaces points and weights of borders by the raised net of the same curve in a lower degree.

    The points (B, 3) of an edge are overwritten if an edge of lower degree has nearly the same net
    after raising: the mean square of the distances of the points in units of `reach`, plus that of
    the differences of the logarithms of weights in units of `log_tolerance`, is at most 1. Both
    edges must already have equal corners.
    """
    comparable_weights = None if weights is None else weights.values / weights.factors
    connectivity = pattern.connectivity
    begin, end = connectivity.ends
    degree = np.concatenate([np.full(len(rows), rows.shape[1] - 1) for rows in pattern.edges])
    # Edges are numbered by ascending degree: `first[k]` is the first edge of `pattern.edges[k]`.
    first = np.cumsum([0, *(len(rows) for rows in pattern.edges)])
    # The edges whose corners are also those of an edge of another degree, a number for the corners
    # of each, and the highest degree between these corners.
    pair, edges, higher_degree = find_candidates(connectivity, degree)
    # Corners give an edge a direction; an edge that ends at its beginning has none, and stays.
    has_two_ends = begin[edges] != end[edges]
    pair, edges = pair[has_two_ends], edges[has_two_ends]
    higher_degree = higher_degree[has_two_ends]
    for common_degree in np.unique(higher_degree).tolist():
        rows = np.flatnonzero(higher_degree == common_degree)
        # Of the edges between the same corners, one of the lowest degree comes first and leads.
        rows = rows[np.lexsort((edges[rows], pair[rows]))]
        edge, degrees = edges[rows], degree[edges[rows]]
        nets = np.ones((len(rows), common_degree + 1, 4))
        is_reversed = begin[edge] > end[edge]
        for k, borders in enumerate(pattern.edges):
            has_degree = np.flatnonzero(degrees == borders.shape[1] - 1)
            if len(has_degree):
                net_points = borders[edge[has_degree] - first[k]].T
                net_weights = None if comparable_weights is None else comparable_weights[net_points]
                raised, raised_weights = elevate((points[net_points], net_weights), common_degree)
                nets[has_degree, :, :3] = raised.swapaxes(0, 1)
                if raised_weights is not None:
                    nets[has_degree, :, 3] = raised_weights.swapaxes(0, 1)
        nets[is_reversed] = nets[is_reversed, ::-1]
        _, first_of_pair, number = np.unique(pair[rows], return_index=True, return_inverse=True)
        # The squares of n + 1 points add up to at most (n + 1) `reach`², so their mean is at most
        # `reach`².
        distance = reach * (common_degree + 1) ** 0.5
        values = nets.copy()
        if weights is not None:
            values[..., 3] = np.log(nets[..., 3]) * (reach / weights.log_tolerance)
        key = first_of_pair[number.reshape(-1)]
        leader = find_leaders(key, values.reshape(len(rows), -1), distance)
        for row in np.flatnonzero(degrees[leader] < degrees).tolist():
            # An edge between the lowest and the highest degree would get too many points.
            if degrees[row] < common_degree:
                continue
            net = nets[leader[row]] if not is_reversed[row] else nets[leader[row], ::-1]
            batch = int(np.searchsorted(first, edge[row], side="right")) - 1
            sides, owner = pattern.sides[batch]
            inner = sides[owner == edge[row] - first[batch], 1:-1]
            points[inner] = net[1:-1, :3]
            if weights is not None:
                weights.values[inner] = net[1:-1, 3] * weights.factors[inner]
