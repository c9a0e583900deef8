"""The seams of a model by a connectivity that is found once for each pattern of equal points.

Polynomial sides of one degree are one edge if their control points are equal, in one direction or
the other. Which are equal is a pattern of whole numbers: of it the connectivity follows, and where
in the nets the points of every edge and corner stand. With that in a cache, seams are a few
gathers. Rational sides may be equal up to a factor of their weights, and sides of several degrees
equal after raising; where there are such, `find_seams` looks at the coordinates each time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from service.bases import triangle
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.cache import MESH_PLANS
from service.bases.distinct import distinct_rows
from service.engine.mesh.connectivity import (
    FEW_POINTS,
    Connectivity,
    digest,
    equal_points,
    triangular_patches,
)
from service.engine.mesh.degree_matching import candidates
from service.engine.mesh.edges import EdgeCurves
from service.engine.mesh.seams import Seams, find_seams
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import Domain, PatchModel
from service.surface.sides import BEGINS, ENDS


def connect(model: PatchModel) -> Seams:
    """Distinct edges and corners of all patches of a model.

    As `find_seams` finds them; but numbered, and directed, by the patches that come first, so that
    nothing of the connectivity depends on coordinates.
    """
    batches = model.batches
    if all(batch.weights is None for batch in batches):
        points = [_border_points(batch) for batch in batches]
        border = points[0] if len(points) == 1 else np.concatenate(points)
        forms = tuple((isinstance(b, TrianglePatches), b.side_degrees, b.count) for b in batches)
        columns = 0
        if model.domain is not None and len(border) > FEW_POINTS:
            columns = _plain_columns(batches[0], model.domain)
        numbers = None if columns else equal_points(border)
        sources = MESH_PLANS.get(
            ("sources", forms, columns, b"" if numbers is None else digest(numbers)),
            lambda: _sources(batches, equal_points(border) if numbers is None else numbers),
        )
        assert isinstance(sources, _Sources)
        if sources.is_certain:
            return sources.seams(border)
    return _renumbered(find_seams(batches))


@dataclass(frozen=True, eq=False, slots=True)
class _Sources:
    """A connectivity, and the rows of the border points that its corners and edges are.

    `corners` (C,); of each degree `edges` (E_n, n+1). It is not certain where edges of several
    degrees may be one curve.
    """

    connectivity: Connectivity
    corners: Ints
    edges: tuple[Ints, ...]
    is_certain: bool

    @property
    def nbytes(self) -> int:
        """Bytes held."""
        return self.corners.nbytes + sum(r.nbytes for r in self.edges) + self.connectivity.nbytes

    def seams(self, border: FloatArray) -> Seams:
        """The seams whose points these are, (B, 3)."""
        curves, first = [], 0
        for rows in self.edges:
            ids = np.arange(first, first + len(rows))
            points, turned = _canonical(border[rows])
            curves.append(EdgeCurves(ids, points, None, turned))
            first += len(rows)
        return Seams(self.connectivity, border[self.corners], tuple(curves))


def _plain_columns(batch: Patches, domain: Domain) -> int:
    """M_v, the patches along v, where patches meet as the cells of a grid do, and only so; else 0.

    Neighbours have the same control points on the side between them; and all corners of the grid
    differ, so that no two other sides have both ends in common.
    """
    if not isinstance(batch, TensorPatches):
        return 0
    grid = len(domain.u) - 1, len(domain.v) - 1
    nets = batch.points.reshape(*grid, *batch.points.shape[1:])
    meet = np.array_equal(nets[:-1, :, -1], nets[1:, :, 0])
    if not (meet and np.array_equal(nets[:, :-1, :, -1], nets[:, 1:, :, 0])):
        return 0
    corners = np.empty((grid[0] + 1, grid[1] + 1, 3))
    corners[:-1, :-1], corners[-1, :-1] = nets[:, :, 0, 0], nets[-1, :, -1, 0]
    corners[:-1, -1], corners[-1, -1] = nets[:, -1, 0, -1], nets[-1, -1, -1, -1]
    number = equal_points(corners.reshape(-1, 3))
    return grid[1] if (number == np.arange(len(number))).all() else 0


def _canonical(points: FloatArray) -> tuple[FloatArray, Bools]:
    """Edges (E, n+1, d) in the direction in which their numbers come first in dictionary order.

    Written over them; and which were turned. For most edges their first numbers decide.
    """
    first, last = points[:, 0, 0], points[:, -1, 0]
    turn = first > last
    tied = np.flatnonzero(first == last)
    if len(tied):
        own = points[tied]
        rows, turned = own.reshape(len(own), -1), own[:, ::-1].reshape(len(own), -1)
        at = np.arange(len(rows)), (rows != turned).argmax(axis=1)
        turn[tied] = rows[at] > turned[at]
    points[turn] = points[turn, ::-1]
    return points, turn


@lru_cache(maxsize=256)
def _border_rows(triangular: bool, p: int, q: int) -> tuple[Ints, tuple[Ints, ...], Ints]:
    """Which points of a net lie on its border, and among these its sides and its corners."""
    if triangular:
        sides = [*triangle.side_rows(p), np.array([triangle.size(p) - 1])]
    else:
        number = np.arange((p + 1) * (q + 1)).reshape(p + 1, q + 1)
        sides = [number[0], number[-1], number[:, 0], number[:, -1]]
    border = np.unique(np.concatenate(sides))
    begins = [sides[0][0], sides[0][-1], sides[1][0], sides[1][-1]]
    if triangular:
        begins[1] = begins[3] = sides[3][0]
    rows = tuple(np.searchsorted(border, side) for side in sides)
    return border, rows, np.searchsorted(border, begins)


def _form(batch: Patches) -> tuple[bool, int, int]:
    if isinstance(batch, TrianglePatches):
        return True, batch.degree, batch.degree
    return False, *batch.degree


def _border_points(batch: Patches) -> FloatArray:
    """Control points on the borders of all patches, in one run: (P b, 3)."""
    border, _, _ = _border_rows(*_form(batch))
    return batch.points.reshape(batch.count, -1, 3).take(border, axis=1).reshape(-1, 3)


def _sources(batches: Sequence[Patches], numbers: Ints) -> _Sources:
    """The connectivity of border points of which equal ones have equal numbers."""
    places: dict[int, list[Ints]] = {}
    rows: dict[int, list[Ints]] = {}
    corners: list[Ints] = []
    begin = patches = 0
    for batch in batches:
        border, sides, ends = _border_rows(*_form(batch))
        nets = begin + len(border) * np.arange(batch.count)[:, None]
        corners.append(nets + ends)
        for k, side in enumerate(sides):
            degree = len(side) - 1
            places.setdefault(degree, []).append(4 * (patches + np.arange(batch.count)) + k)
            rows.setdefault(degree, []).append(nets + side)
        begin, patches = begin + len(border) * batch.count, patches + batch.count
    edge, backward = np.empty(4 * patches, np.intp), np.empty(4 * patches, np.bool_)
    collapsed = np.empty(4 * patches, np.bool_)
    edges: list[Ints] = []
    for degree in sorted(places):
        place, own = np.concatenate(places[degree]), np.concatenate(rows[degree])
        order = np.argsort(place)
        place, own = place[order], own[order]
        points = numbers[own]
        collapsed[place] = (points == points[:, :1]).all(axis=1)
        canonical, turned = _canonical(points[..., None].astype(np.float64))
        leader, number = _first_of(canonical[..., 0])
        edge[place] = sum(map(len, edges)) + number
        backward[place] = turned ^ turned[leader[number]]
        edges.append(own[leader])
    at_corners = np.concatenate(corners)
    stand_in, corner = _first_of(numbers[at_corners].reshape(-1, 1).astype(np.float64))
    connectivity = Connectivity(
        counts=tuple(batch.count for batch in batches),
        triangular=triangular_patches(batches),
        edge=edge.reshape(-1, 4),
        backward=backward.reshape(-1, 4),
        collapsed=collapsed.reshape(-1, 4),
        corner=corner.reshape(-1, 4),
        users=np.bincount(edge),
        corners=len(stand_in),
    )
    is_certain = not _may_be_raised(connectivity, edges)
    return _Sources(connectivity, at_corners.ravel()[stand_in], tuple(edges), is_certain)


def _first_of(rows: FloatArray) -> tuple[Ints, Ints]:
    """First place of every distinct row, ascending; and the number of each row among them."""
    first, number = distinct_rows(rows)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[number]


def _may_be_raised(connectivity: Connectivity, edges: Sequence[Ints]) -> bool:
    """Whether two corners have lines of several degrees between them."""
    if np.count_nonzero([rows.shape[1] > 1 for rows in edges]) < 2:
        return False
    _, side = np.unique(connectivity.edge, return_index=True)
    begin, end = (connectivity.corner[:, which].ravel()[side] for which in (BEGINS, ENDS))
    degree = np.concatenate([np.full(len(rows), rows.shape[1] - 1) for rows in edges])
    lines = ~connectivity.collapsed.ravel()[side]
    return len(candidates(lines, degree, begin, end)[0]) > 0


def _renumbered(seams: Seams) -> Seams:
    """The seams with edges and corners in the order, and the direction, of their first sides."""
    connectivity = seams.connectivity
    _, side = np.unique(connectivity.edge, return_index=True)
    against = connectivity.backward.ravel()[side]
    curves, first = [], 0
    rank = np.empty(len(side), np.intp)
    for group in seams.curves:
        order = np.argsort(side[group.ids])
        old, new = group.ids[order], np.arange(first, first + len(order))
        rank[old] = new
        weights = None if group.weights is None else group.weights[order]
        curves.append(EdgeCurves(new, group.points[order], weights, against[old]))
        first += len(order)
    stand_in, number = _first_of(connectivity.corner.reshape(-1, 1).astype(np.float64))
    renumbered = Connectivity(
        counts=connectivity.counts,
        triangular=connectivity.triangular,
        edge=rank[connectivity.edge],
        backward=connectivity.backward ^ against[connectivity.edge],
        collapsed=connectivity.collapsed,
        corner=number.reshape(-1, 4),
        users=np.bincount(rank[connectivity.edge].ravel()),
        corners=connectivity.corners,
    )
    return Seams(
        renumbered,
        seams.corner_points[connectivity.corner.ravel()[stand_in]],
        tuple(curves),
    )
