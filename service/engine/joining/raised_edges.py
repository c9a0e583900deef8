"""Makes edges equal that are nearly the same curve in different degrees.

`service.engine.connectivity.degree_matching` joins edges whose nets are equal after both are raised
to the same degree, up to the rounding errors of raising. Nets from other systems may differ by
more. Then this module replaces the net of the higher degree by the raised net of the lower degree.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.connectivity.degree_matching import match_degrees, raise_nets, scale_nets
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
    after raising (`scale_nets`, with the distance `radius`). Both edges must already have equal
    corners.
    """
    comparable_weights = None if weights is None else weights.values / weights.factors
    curves = [
        EdgeCurves(
            ids, points[rows], None if comparable_weights is None else comparable_weights[rows]
        )
        for ids, rows in zip(pattern.ids, pattern.edges, strict=True)
    ]
    log_tolerance = 0.0 if weights is None else weights.log_tolerance
    leader, is_reversed = match_degrees(
        curves, pattern.connectivity, lambda nets: scale_nets(nets, radius, log_tolerance)
    )
    is_raised = leader != np.arange(len(leader))
    for ids, rows, (sides, owner) in zip(pattern.ids, pattern.edges, pattern.sides, strict=True):
        edge = ids[is_raised[ids]]
        if not len(edge):
            continue
        nets = raise_nets(curves, leader[edge], rows.shape[1] - 1)
        nets[is_reversed[edge]] = nets[is_reversed[edge], ::-1]
        row_of_edge = np.full(len(ids), -1)
        row_of_edge[edge - ids[0]] = np.arange(len(edge))
        row_of_side = row_of_edge[owner]
        inner, net = sides[row_of_side >= 0, 1:-1], nets[row_of_side[row_of_side >= 0], 1:-1]
        points[inner] = net[..., :3]
        if weights is not None:
            weights.values[inner] = net[..., 3] * weights.factors[inner]
