"""Which borders of patches are one and the same, decided by their control points alone.

Two sides are one edge if their control points are equal, in either direction, and their weights
are, up to a common factor; or if they are so when the one of lower degree is raised to the other's
(`service.engine.raised`), and then the edge is that of lower degree. Every distinct edge is sampled
once, in a direction and by operations that depend on nothing but the edge, and all its patches copy
those samples. Hence no crack, whatever the order of the patches and whichever of them are computed
together.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import sampled
from service.bases.distinct import distinct_rows
from service.bases.homogeneous import homogeneous
from service.engine.connectivity import Connectivity, triangular_patches
from service.engine.edge_curves import EdgeCurves
from service.engine.evaluation import de_casteljau, forward_difference
from service.engine.near import leaders
from service.engine.options import Method
from service.engine.raised import lowest
from service.stopping import checkpoint
from service.surface.batches import Patches
from service.surface.sides import BEGINS, ENDS

SAME_WEIGHT = 2.0**-44
"""How far the weights of one edge, their largest made 1, may differ on two sides of it: a common
factor changes their last digits."""


@dataclass(frozen=True, eq=False, slots=True)
class Seams:
    """The edges and corners of a model: a connectivity, and where they lie.

    Attributes
    ----------
    connectivity : Connectivity
    corner_points : ndarray of float64, shape (C, 3)
        The distinct points at corners.
    curves : tuple of EdgeCurves
        The distinct edges, by degree.
    """

    connectivity: Connectivity
    corner_points: FloatArray
    curves: tuple[EdgeCurves, ...]

    @property
    def edge(self) -> Ints:
        """Number of the distinct edge that each side is, shape (P, 4)."""
        return self.connectivity.edge

    @property
    def backward(self) -> Bools:
        """Whether each side runs against the direction of its edge, shape (P, 4)."""
        return self.connectivity.backward

    @property
    def collapsed(self) -> Bools:
        """Whether each side is one point, shape (P, 4)."""
        return self.connectivity.collapsed

    @property
    def corner(self) -> Ints:
        """Number of the distinct point at each corner, shape (P, 4)."""
        return self.connectivity.corner

    @property
    def users(self) -> Ints:
        """How many sides each edge has, shape (E,)."""
        return self.connectivity.users


def find_seams(batches: Sequence[Patches]) -> Seams:
    """Distinct edges and corners of all patches of a model."""
    total = sum(batch.count for batch in batches)
    edge = np.empty(total * 4, dtype=np.intp)
    backward = np.empty(total * 4, dtype=bool)
    curves: list[EdgeCurves] = []
    found = 0
    for sides in _sides_by_degree(batches):
        checkpoint()
        points, weights, turned = _canonical(sides)
        place = sides.place
        if weights is not None:
            # Of weights that differ in rounding the least stand for all, not the first to come.
            order = np.lexsort(weights.T)
            place, turned = place[order], turned[order]
            points, weights = points[order], weights[order]
        distinct, number = distinct_rows(points.reshape(len(points), -1))
        if weights is not None:
            leader = leaders(distinct[number], weights, SAME_WEIGHT)
            distinct, number = np.unique(leader, return_inverse=True)
        edge[place] = number + found
        backward[place] = turned
        ids = np.arange(found, found + len(distinct))
        curves.append(
            EdgeCurves(ids, points[distinct], None if weights is None else weights[distinct])
        )
        found += len(distinct)
    checkpoint()
    corners = np.concatenate([batch.corners for batch in batches]).reshape(-1, 3)
    distinct, number = distinct_rows(corners)
    collapsed = np.concatenate([batch.collapsed for batch in batches])
    corner = number.reshape(-1, 4)
    if np.count_nonzero([group.points.shape[1] > 1 for group in curves]) > 1:
        edge, backward, curves = _across_degrees(edge, backward, curves, collapsed, corner)
    connectivity = Connectivity(
        counts=tuple(batch.count for batch in batches),
        triangular=triangular_patches(batches),
        edge=edge.reshape(-1, 4),
        backward=backward.reshape(-1, 4),
        collapsed=collapsed,
        corner=corner,
        users=np.bincount(edge),
        corners=len(distinct),
    )
    return Seams(connectivity, corners[distinct], tuple(curves))


def _across_degrees(
    edge: Ints, backward: Bools, curves: list[EdgeCurves], collapsed: Bools, corner: Ints
) -> tuple[Ints, Bools, list[EdgeCurves]]:
    """Sides (P · 4,) and edges anew, those that are one curve in several degrees joined."""
    _, side = np.unique(edge, return_index=True)
    against = backward[side]
    begin, end = (corner[:, which].ravel()[side] for which in (BEGINS, ENDS))
    begin, end = np.where(against, end, begin), np.where(against, begin, end)
    leader, turned = lowest(curves, ~collapsed.ravel()[side], begin, end)
    kept = leader == np.arange(len(leader))
    number = np.cumsum(kept) - 1
    left = []
    for group in curves:
        rows = kept[group.ids]
        weights = None if group.weights is None else group.weights[rows]
        left.append(EdgeCurves(number[group.ids[rows]], group.points[rows], weights))
    return number[leader[edge]], backward ^ turned[edge], left


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
    every number by itself. The ends are the control
    points themselves.

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
    degree = points.shape[1] - 1
    basis = sampled(degree, divisions)
    # The edges are the innermost axis: every sum runs over long contiguous rows.
    place = np.zeros((divisions + 1, len(points) * 3))
    total = np.zeros((divisions + 1, len(points)))
    for i in range(degree + 1):
        share = basis[:, i, None]
        if weights is not None:
            weighted = share * weights[:, i]
            total += weighted
            share = np.repeat(weighted, 3, axis=1)
        place += share * points[:, i].reshape(-1)
    samples = place.reshape(divisions + 1, -1, 3).swapaxes(0, 1)
    if weights is not None:
        total[:, _plain(weights)] = 1.0
        return samples / total.T[:, :, None]
    return samples


def _plain(weights: FloatArray) -> Bools:
    """Edges that are polynomial, though others are not: their points are, to the last bit."""
    plain: Bools = (weights == 1.0).all(axis=1)
    return plain


@dataclass(frozen=True, eq=False, slots=True)
class _Sides:
    """All sides of one degree: where they belong (patch · 4 + side) and their control points."""

    place: Ints
    points: FloatArray
    weights: FloatArray | None


def _sides_by_degree(batches: Sequence[Patches]) -> list[_Sides]:
    """Sides of all patches, those of one degree together, whatever batch they come from."""
    groups: dict[int, list[_Sides]] = {}
    first = 0
    for batch in batches:
        patches = 4 * (first + np.arange(batch.count))
        first += batch.count
        for side, degree in enumerate(batch.side_degrees):
            groups.setdefault(degree, []).append(_Sides(patches + side, *batch.side(side)))
    return [_joined(groups[degree]) for degree in sorted(groups)]


def _joined(parts: list[_Sides]) -> _Sides:
    points = np.concatenate([part.points for part in parts])
    weights = None
    if any(part.weights is not None for part in parts):
        weights = np.concatenate(
            [np.ones(p.points.shape[:2]) if p.weights is None else p.weights for p in parts]
        )
        # Only the ratio of weights matters.
        weights = weights / weights.max(axis=1, keepdims=True)
    return _Sides(np.concatenate([part.place for part in parts]), points, weights)


def _canonical(sides: _Sides) -> tuple[FloatArray, FloatArray | None, Bools]:
    """Each side in the direction in which its numbers come first in dictionary order."""
    rows = sides.points.reshape(len(sides.points), -1)
    turned = sides.points[:, ::-1].reshape(rows.shape)
    if sides.weights is not None:
        rows = np.concatenate([rows, sides.weights], axis=1)
        turned = np.concatenate([turned, sides.weights[:, ::-1]], axis=1)
    differs = rows != turned
    at = np.arange(len(rows)), differs.argmax(axis=1)
    turn = rows[at] > turned[at]
    points = np.where(turn[:, None, None], sides.points[:, ::-1], sides.points)
    if sides.weights is None:
        return points, None, turn
    return points, np.where(turn[:, None], sides.weights[:, ::-1], sides.weights), turn
