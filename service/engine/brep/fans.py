"""Edges at which more than two triangles of one shell meet: pairs of triangles by angle.

Around such a *crowded* edge, material and void alternate. A triangle that runs along the edge in
its direction, *forwards*, has its material on the side of smaller angles; one that runs backwards,
on the side of larger angles. So a forward triangle and the one before it, if that one runs
backwards, bound the same material: they are a pair. If the triangles at an edge form pairs, and
their angles differ by more than their rounding, each pair gets an edge with vertices of its own, at
the same positions.

The triangles at a point that are connected by edges and by pairs are a *fan*; if the point is at
the end of an edge with pairs, each fan gets a vertex of its own.

Proof in docs/proofs.md: "Pairs of triangles at an edge".
"""

from dataclasses import dataclass, replace
from math import pi

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.brep_triangulation import BrepTriangulation
from service.engine.clustering import find_components
from service.engine.vectors import UNIT, cross, dot, length

LEAST_ANGLE = 1e-9
"""Angles that differ by less than this, in radians, prove no order."""

ROUNDINGS = 16
"""The rounding of an angle, in units of the largest coordinate divided by the height of the
triangle over its edge."""


@dataclass(frozen=True, eq=False, slots=True)
class _Sides:
    """The sides of triangles, edge after edge; sides of different shells have different edges.

    Corner k of triangle t has the number 3 t + k, and so has the side from it to the next corner.

    Attributes
    ----------
    sides : ndarray of int, shape (n,)
    low, high : ndarray of int, shape (n,)
        The corners at the lower and at the higher point of the edge.
    counts : ndarray of int, shape (m,)
        The number of sides of each edge.
    """

    sides: Ints
    low: Ints
    high: Ints
    counts: Ints

    @property
    def first(self) -> Ints:
        """The row of the first side of each edge, (m,)."""
        first: Ints = np.cumsum(self.counts) - self.counts
        return first

    def take(self, is_chosen: Bools) -> "_Sides":
        """The sides of some edges, (m,), only."""
        rows = np.repeat(is_chosen, self.counts)
        return _Sides(self.sides[rows], self.low[rows], self.high[rows], self.counts[is_chosen])

    def order(self, order: Ints) -> "_Sides":
        """The sides in another order, each still at its edge."""
        return _Sides(self.sides[order], self.low[order], self.high[order], self.counts)

    def list_previous(self) -> Ints:
        """For each side the row of the one before it at its edge; of the first, the last one."""
        previous = np.arange(-1, len(self.sides) - 1)
        previous[self.first] += self.counts
        return previous

    def link(self, rows: Ints, others: Ints) -> tuple[Ints, Ints]:
        """Pairs of corners at both ends of edges: those of the sides `rows` and of `others`."""
        return (
            np.concatenate([self.low[rows], self.high[rows]]),
            np.concatenate([self.low[others], self.high[others]]),
        )


def separate_fans(triangulation: BrepTriangulation, shells: Ints) -> tuple[BrepTriangulation, Ints]:
    """The triangulation with separate vertices for triangles that are in different pairs.

    Parameters
    ----------
    triangulation : BrepTriangulation
    shells : ndarray of int, shape (F,)
        The shell of each face.

    Returns
    -------
    triangulation : BrepTriangulation
        The same, if no edge is crowded.
    unpaired : ndarray of int, shape (k, 2)
        The ends of edges that are still crowded, the lower point first: their triangles form no
        pairs, or the pairs are connected around both ends.
    """
    points = triangulation.points[triangulation.triangles]
    following = points[:, [1, 2, 0]]
    low, high = np.minimum(points, following), np.maximum(points, following)
    keys = (low * len(triangulation.positions) + high).ravel()
    ordered = np.sort(keys)
    if not (ordered[2:] == ordered[:-2]).any():
        return triangulation, np.empty((0, 2), np.intp)
    shell_of_side = np.repeat(shells[triangulation.faces], 3)
    edges = _group_sides(points, keys, shell_of_side)
    crowded, is_paired = _sort_by_angle(
        edges.take(edges.counts > 2), points, triangulation.positions
    )
    paired, unpaired = crowded.take(is_paired), crowded.take(~is_paired)
    forward = (paired.sides == paired.low).nonzero()[0]
    flat = points.ravel()
    if not len(forward):
        return triangulation, _list_ends(unpaired, flat)
    # Plain edges and pairs connect two triangles, crowded edges without pairs all of them.
    links = [
        paired.link(forward, paired.list_previous()[forward]),
        *(
            each.link(np.arange(len(each.sides)), each.list_previous())
            for each in (edges.take(edges.counts == 2), unpaired)
        ),
    ]
    first, second = (np.concatenate(ends) for ends in zip(*links, strict=True))
    fans = find_components(flat.size, first, second)
    at_pairs = np.unique(flat[np.concatenate([paired.low, paired.high])])
    separated, source = _give_vertices(triangulation, flat, fans, at_pairs)
    points = separated.points[separated.triangles]
    following = points[:, [1, 2, 0]]
    keys = np.minimum(points, following) * len(source) + np.maximum(points, following)
    edges = _group_sides(points, keys.ravel(), shell_of_side)
    return separated, _list_ends(edges.take(edges.counts > 2), source[points.ravel()])


def _list_ends(edges: _Sides, points: Ints) -> Ints:
    """The ends (m, 2) of edges, the lower point first; `points` (3 T,) has that of each corner."""
    ends = np.stack([points[edges.low], points[edges.high]], axis=1)[edges.first]
    return np.sort(ends, axis=1)


def _group_sides(points: Ints, keys: Ints, shells: Ints) -> _Sides:
    """All sides, edge after edge; `keys` and `shells` (3 T,) tell edges apart."""
    order = np.lexsort((shells, keys))
    is_first = np.ones(len(order), bool)
    is_first[1:] = (keys[order[1:]] != keys[order[:-1]]) | (shells[order[1:]] != shells[order[:-1]])
    following = order - order % 3 + (order + 1) % 3
    flat = points.ravel()
    is_forward = flat[order] < flat[following]
    return _Sides(
        order,
        np.where(is_forward, order, following),
        np.where(is_forward, following, order),
        np.diff(is_first.nonzero()[0], append=len(order)),
    )


def _sort_by_angle(crowded: _Sides, points: Ints, positions: FloatArray) -> tuple[_Sides, Bools]:
    """The sides of crowded edges by angle, and whether those of each edge, (m,), form pairs."""
    flat, sides = points.ravel(), crowded.sides
    begin, end = positions[flat[crowded.low]], positions[flat[crowded.high]]
    third = positions[flat[sides - sides % 3 + (sides + 2) % 3]]
    along = end - begin
    across = third - begin
    across -= along * (dot(across, along, -1) / dot(along, along, -1))[:, np.newaxis]
    edge = np.repeat(np.arange(len(crowded.counts)), crowded.counts)
    zero = across[crowded.first][edge]
    turned = cross(along, zero, -1) / length(along, -1)[:, np.newaxis]
    with np.errstate(invalid="ignore"):
        angle = np.arctan2(dot(across, turned, -1), dot(across, zero, -1))
    with np.errstate(divide="ignore"):
        error = ROUNDINGS * UNIT * np.abs(positions).max() / length(across, -1)
    order = np.lexsort((angle, edge))
    crowded, angle, error = crowded.order(order), angle[order], error[order] + LEAST_ANGLE
    previous, is_forward = crowded.list_previous(), crowded.sides == crowded.low
    step = (angle - angle[previous]) % (2 * pi)
    fits = (is_forward != is_forward[previous]) & (step > error + error[previous])
    return crowded, np.logical_and.reduceat(fits, crowded.first) if len(fits) else fits


def _give_vertices(
    triangulation: BrepTriangulation, points: Ints, fans: Ints, chosen: Ints
) -> tuple[BrepTriangulation, Ints]:
    """The triangulation with a vertex for each fan at some points, and the source of each point.

    Parameters
    ----------
    triangulation : BrepTriangulation
    points, fans : ndarray of int, shape (3 T,)
        The point and the fan of each corner of a triangle.
    chosen : ndarray of int, shape (k,)
        Points, ascending.
    """
    is_chosen = np.zeros(len(triangulation.positions), bool)
    is_chosen[chosen] = True
    rows = is_chosen[points].nonzero()[0]
    classes, number = np.unique(
        np.stack([points[rows], fans[rows]], axis=1), axis=0, return_inverse=True
    )
    # The first fan at a point keeps the vertex.
    is_new = np.zeros(len(classes), bool)
    is_new[1:] = classes[1:, 0] == classes[:-1, 0]
    vertex = np.where(is_new, len(triangulation.positions) - 1 + np.cumsum(is_new), classes[:, 0])
    # Corners of triangles with new vertices become corners of their own.
    moved = rows[is_new[number.reshape(-1)]]
    new_points = vertex[number.reshape(-1)][is_new[number.reshape(-1)]]
    flat = triangulation.triangles.ravel().copy()
    corners, corner_number = np.unique(
        np.stack([flat[moved], new_points], axis=1), axis=0, return_inverse=True
    )
    flat[moved] = len(triangulation.points) + corner_number.reshape(-1)
    old = corners[:, 0]
    source = np.concatenate([np.arange(len(triangulation.positions)), classes[is_new, 0]])
    separated = replace(
        triangulation,
        positions=triangulation.positions[source],
        triangles=flat.reshape(-1, 3),
        points=np.concatenate([triangulation.points, corners[:, 1]]),
        corner_faces=np.concatenate([triangulation.corner_faces, triangulation.corner_faces[old]]),
        places=np.concatenate([triangulation.places, triangulation.places[old]]),
    )
    return separated, source
