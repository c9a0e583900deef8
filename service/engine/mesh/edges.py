"""Distinct edges as curves, and their samples.

Every distinct edge is sampled once, in a direction and by operations that depend on nothing but the
edge, and all its patches copy those samples. Hence no crack, whatever the order of the patches and
whichever of them are computed together.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import sampled
from service.bases.homogeneous import homogeneous
from service.engine.evaluation import de_casteljau, forward_difference
from service.engine.options import Method


@dataclass(frozen=True, eq=False, slots=True)
class EdgeCurves:
    """Distinct edges of one degree n: Bézier curves in their canonical direction.

    `ids` (E,), `points` (E, n+1, 3), `weights` (E, n+1) or None; the largest weight of each is 1.
    `turned` (E,) tells which edges count their samples against that direction; None if none does.
    """

    ids: Ints
    points: FloatArray
    weights: FloatArray | None
    turned: Bools | None = None

    def take(self, chosen: Bools) -> "EdgeCurves":
        """Some of the edges, as `chosen` (E,) tells; mostly all."""
        if chosen.all():
            return self
        weights = None if self.weights is None else self.weights[chosen]
        turned = None if self.turned is None else self.turned[chosen]
        return EdgeCurves(self.ids[chosen], self.points[chosen], weights, turned)


METHODS: Mapping[Method, Callable[[FloatArray, int], FloatArray]] = MappingProxyType(
    {"de_casteljau": de_casteljau.curves, "forward_difference": forward_difference.curves}
)
"""The methods beside `matrix`, on curves."""


def sample_edges(
    curves: Sequence[EdgeCurves], wanted: Bools, divisions: int, method: Method = "matrix"
) -> FloatArray:
    """Points at R equal divisions of the wanted edges, in the order of their numbers.

        C(k/R) = Σ_i B_i^n(k/R) w_i P_i / Σ_i B_i^n(k/R) w_i

    Bit for bit the same wherever an edge turns up: summed term by term, because the order of a
    matrix product's additions depends on its shape and on the machine; the other methods compute
    every number by itself. The ends are the control points themselves.

    Parameters
    ----------
    wanted : ndarray of bool, shape (E,)

    Returns
    -------
    ndarray of float64, shape (edges wanted, R+1, 3)
    """
    parts = []
    for group in curves:
        chosen = group.take(wanted[group.ids])
        points, weights = chosen.points, chosen.weights
        if method == "matrix":
            place = _sample(points, weights, divisions)
        else:
            place = _sample_by(METHODS[method], points, weights, divisions)
        place[:, 0], place[:, -1] = points[:, 0], points[:, -1]
        if chosen.turned is not None:
            place[chosen.turned] = place[chosen.turned, ::-1]
        parts.append(place)
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _sample_by(
    method: Callable[[FloatArray, int], FloatArray],
    points: FloatArray,
    weights: FloatArray | None,
    divisions: int,
) -> FloatArray:
    if weights is None:
        return method(points, divisions)
    values = method(homogeneous(points, weights), divisions)
    values[_plain(weights), :, 3] = 1.0
    return values[..., :3] / values[..., 3:]


def _sample(points: FloatArray, weights: FloatArray | None, divisions: int) -> FloatArray:
    """Samples (E, R+1, 3) of all edges: term by term, over long contiguous rows."""
    basis = sampled(points.shape[1] - 1, divisions)
    rows = points.transpose(1, 0, 2).reshape(points.shape[1], -1)
    if weights is None:
        place = basis[:, :1] * rows[0]
        for i in range(1, len(rows)):
            place += basis[:, i : i + 1] * rows[i]
        place += 0.0  # turns −0 into 0
        plain: FloatArray = place.reshape(divisions + 1, -1, 3).swapaxes(0, 1)
        return plain
    place = np.zeros((divisions + 1, rows.shape[1]))
    total = np.zeros((divisions + 1, len(points)))
    for i in range(len(rows)):
        weighted = basis[:, i : i + 1] * weights[:, i]
        total += weighted
        place += np.repeat(weighted, 3, axis=1) * rows[i]
    total[:, _plain(weights)] = 1.0
    samples: FloatArray = place.reshape(divisions + 1, -1, 3).swapaxes(0, 1)
    return samples / total.T[:, :, None]


def _plain(weights: FloatArray) -> Bools:
    """Edges that are polynomial, though others are not: their points are, to the last bit."""
    plain: Bools = (weights == 1.0).all(axis=1)
    return plain
