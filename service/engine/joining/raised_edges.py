"""Edges that are one curve in several degrees up to rounding: made one that raising shows.

`service.engine.mesh.degree_matching` joins edges whose nets are equal once they are raised to one
degree, up to the rounding of the raising. Nets of other systems differ by more: the side of higher
degree gets the net of the lower one, raised.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.polynomials import elevate
from service.engine.clustering import find_leaders
from service.engine.mesh.degree_matching import find_candidates
from service.engine.mesh.edge_patterns import EdgePattern
from service.surface.sides import BEGINS, ENDS


@dataclass(frozen=True, eq=False)
class BorderWeights:
    """Weights (B,) of border points, of which some are rational.

    Divided by e^`scale` (B,) those of one curve are equal
    (`service.engine.joining.common_factors`), or near: their logarithms differ by at most `near`.
    No scale stands for 0.
    """

    values: FloatArray
    scale: FloatArray | None
    near: float

    @cached_property
    def factors(self) -> FloatArray:
        """The factors e^scale, (B,)."""
        return np.ones(len(self.values)) if self.scale is None else np.exp(self.scale)


def raise_equal(
    pattern: EdgePattern, points: FloatArray, weights: BorderWeights | None, reach: float
) -> None:
    """Writes raised nets over border points (B, 3) that they differ from by at most `reach`.

    And over their weights, where these are near. Corners must be equal already.
    """
    comparable = None if weights is None else weights.values / weights.factors
    known = pattern.connectivity
    _, side = np.unique(known.edge, return_index=True)
    # Sides are directed as their edges: an edge begins where its first side does.
    against = known.backward.ravel()[side]
    ends = [known.corner[:, which].ravel()[side] for which in (BEGINS, ENDS)]
    begin, end = np.where(against, ends[1], ends[0]), np.where(against, ends[0], ends[1])
    degree = np.concatenate([np.full(len(rows), rows.shape[1] - 1) for rows in pattern.edges])
    first = np.cumsum([0, *(len(rows) for rows in pattern.edges)])
    pair, edges, highest = find_candidates(~known.collapsed.ravel()[side], degree, begin, end)
    is_line = begin[edges] != end[edges]
    pair, edges, highest = pair[is_line], edges[is_line], highest[is_line]
    for common in np.unique(highest).tolist():
        here = np.flatnonzero(highest == common)
        here = here[np.lexsort((edges[here], pair[here]))]
        nets = np.ones((len(here), common + 1, 4))
        back = begin[edges[here]] > end[edges[here]]
        for k, rows in enumerate(pattern.edges):
            mine = np.flatnonzero(degree[edges[here]] == rows.shape[1] - 1)
            if len(mine):
                own = rows[edges[here[mine]] - first[k]].T
                side_weights = None if comparable is None else comparable[own]
                raised, raised_weights = elevate((points[own], side_weights), common)
                nets[mine, :, :3] = raised.swapaxes(0, 1)
                if raised_weights is not None:
                    nets[mine, :, 3] = raised_weights.swapaxes(0, 1)
        nets[back] = nets[back, ::-1]
        _, lead, number = np.unique(pair[here], return_index=True, return_inverse=True)
        distance = reach * (common + 1) ** 0.5
        values = nets.copy()
        if weights is not None:
            values[..., 3] = np.log(nets[..., 3]) * (reach / weights.near)
        leader = find_leaders(lead[number.reshape(-1)], values.reshape(len(here), -1), distance)
        for row in np.flatnonzero(degree[edges[here[leader]]] < degree[edges[here]]).tolist():
            if degree[edges[here[row]]] < common:
                continue
            net = nets[leader[row]] if not back[row] else nets[leader[row], ::-1]
            which = int(np.searchsorted(first, edges[here[row]], side="right")) - 1
            sides, owner = pattern.sides[which]
            inner = sides[owner == edges[here[row]] - first[which], 1:-1]
            points[inner] = net[1:-1, :3]
            if weights is not None:
                weights.values[inner] = net[1:-1, 3] * weights.factors[inner]
