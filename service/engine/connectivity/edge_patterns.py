"""The connectivity that follows from a pattern of equal control points.

A pattern has a number for each control point on the borders of patches; equal points have equal
numbers. The pattern determines which sides are one edge, and which border points belong to each
edge and corner. So for other coordinates with the same pattern, only these points are read.

Rational sides are one edge only if their weights are also equal, up to a common factor. The pattern
is sufficient if, after division by the largest weight of each side, the weights of equal sides are
equal bit for bit. If not, `service.engine.connectivity.seams` compares all coordinates.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from service.bases import triangle
from service.bases.arrays import AnyArray, FloatArray, IndexArray, Ints
from service.bases.row_batches import find_first_rows, first_positions
from service.engine.connectivity.degree_matching import find_candidates
from service.engine.connectivity.edges import EdgeCurves, orient_edges
from service.engine.connectivity.equal_points import EqualPoints
from service.engine.connectivity.incidence import SAME_WEIGHT, Connectivity
from service.engine.connectivity.seams import Seams
from service.surface.batches import Patches, TensorPatches, TrianglePatches


@dataclass(frozen=True, eq=False)
class EdgePattern:
    """A connectivity, and the numbers of the border points at its corners and on its edges.

    Attributes
    ----------
    connectivity : Connectivity
    corners : ndarray of uint32, shape (C,)
        The border point at each corner.
    ids : tuple of ndarray of int, shape (E_n,)
        For each degree n, the numbers of its edges.
    edges : tuple of ndarray of uint32, shape (E_n, n+1)
        For each degree n, the border points of the first side of each edge.
    sides : tuple of (ndarray of uint32, shape (S_n, n+1), ndarray of uint32, shape (S_n,))
        For each degree n, the border points of all sides, in the directions of their edges, and the
        row of `edges` for each side.
    equal : EqualPoints
        Which border points are equal.
    """

    connectivity: Connectivity
    corners: IndexArray
    ids: tuple[Ints, ...]
    edges: tuple[IndexArray, ...]
    sides: tuple[tuple[IndexArray, IndexArray], ...]
    equal: EqualPoints

    @property
    def edge_degrees(self) -> Ints:
        """The degree of each edge, (E,)."""
        return np.concatenate([np.full(len(rows), rows.shape[1] - 1) for rows in self.edges])

    @cached_property
    def is_certain(self) -> bool:
        """Whether no lines of several degrees have the same two ends: these may be one curve."""
        # The only edges of degree 0 are fourth sides of triangles, which are points.
        if np.count_nonzero([rows.shape[1] > 1 for rows in self.edges]) < 2:
            return True
        return not len(find_candidates(self.connectivity, self.edge_degrees)[0])

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        arrays: list[AnyArray] = [self.corners, *self.ids, *self.edges]
        arrays += [array for pair in self.sides for array in pair]
        arrays += [self.equal.number, self.equal.leaders]
        return sum(array.nbytes for array in arrays) + self.connectivity.nbytes

    def build_seams(self, border: FloatArray, weights: FloatArray | None) -> Seams | None:
        """The seams of border points (B, 3) and their weights (B,).

        The result is None if two sides of an edge have different weights.
        """
        curves = []
        for ids, rows, (sides, number) in zip(self.ids, self.edges, self.sides, strict=True):
            side_weights = None
            if weights is not None:
                # A common factor of weights does not change a curve.
                side_weights = weights[sides]
                side_weights /= side_weights.max(axis=1, keepdims=True)
                first_weights = np.empty((len(rows), sides.shape[1]))
                # In reverse order, the first side of each edge is written last, and stays.
                first_weights[number[::-1]] = side_weights[::-1]
                if not np.array_equal(side_weights, first_weights[number]):
                    return None
                side_weights = first_weights
            curves.append(EdgeCurves(ids, border.take(rows, axis=0), side_weights))
        return Seams(self.connectivity, border.take(self.corners, axis=0), tuple(curves))

    def has_near_weights(self, weights: FloatArray, tolerance: float) -> bool:
        """Whether two sides of an edge may have near weights that do not differ by rounding alone.

        Weights (B,) are near if their logarithms differ by at most the tolerance. The factors 1/8
        and 4 are margins: in case of doubt, the result is True.
        """
        for sides, number in self.sides:
            side_weights = weights[sides]
            side_weights /= side_weights.max(axis=1, keepdims=True)
            first_weights = side_weights[np.unique(number, return_index=True)[1]]
            differences = np.abs(side_weights - first_weights[number]).max(axis=1)
            if ((differences > SAME_WEIGHT / 8) & (differences <= 4 * tolerance)).any():
                return True
        return False


def border_points(batch: Patches) -> FloatArray:
    """The control points on the borders of all patches, (P b, 3): b points for each patch."""
    border, _, _ = _border_rows(*_form(batch))
    points: FloatArray = batch.points.reshape(batch.count, -1, 3).take(border, axis=1)
    return points.reshape(-1, 3)


def border_weights(batch: Patches) -> FloatArray:
    """Weights of the control points on the borders, (P b,); 1 for polynomial patches."""
    border, _, _ = _border_rows(*_form(batch))
    if batch.weights is None:
        return np.ones(batch.count * len(border))
    weights: FloatArray = batch.weights.reshape(batch.count, -1).take(border, axis=1)
    return weights.ravel()


def replace_border(batch: Patches, points: FloatArray, weights: FloatArray | None) -> Patches:
    """The batch with other points (P b, 3) and weights (P b,) on the borders of its patches."""
    border, _, _ = _border_rows(*_form(batch))
    nets = batch.points.copy()
    nets.reshape(batch.count, -1, 3)[:, border] = points.reshape(batch.count, -1, 3)
    if batch.weights is None or weights is None:
        return replace(batch, points=nets)
    patch_weights = batch.weights.copy()
    patch_weights.reshape(batch.count, -1)[:, border] = weights.reshape(batch.count, -1)
    return replace(batch, points=nets, weights=patch_weights)


@lru_cache(maxsize=256)
def _border_rows(is_triangle: bool, p: int, q: int) -> tuple[Ints, tuple[Ints, ...], Ints]:
    """The control points of a net on its border, (b,), and which of these are on sides and corners.

    The second result has the border points on each of the four sides; the third result has those at
    the four corners.
    """
    if is_triangle:
        sides = [*triangle.side_rows(p), np.array([triangle.count_points(p) - 1])]
    else:
        number = np.arange((p + 1) * (q + 1)).reshape(p + 1, q + 1)
        sides = [number[0], number[-1], number[:, 0], number[:, -1]]
    border = np.unique(np.concatenate(sides))
    corners = [sides[0][0], sides[0][-1], sides[1][0], sides[1][-1]]
    if is_triangle:
        corners[1] = corners[3] = sides[3][0]  # the fourth side is one point
    rows = tuple(np.searchsorted(border, side) for side in sides)
    return border, rows, np.searchsorted(border, corners)


def _form(batch: Patches) -> tuple[bool, int, int]:
    """Whether the patches are triangles, and their degrees along u and v."""
    if isinstance(batch, TrianglePatches):
        return True, batch.degree, batch.degree
    return False, *batch.degree


def find_pattern(batches: Sequence[Patches], numbers: Ints, columns: int = 0) -> EdgePattern:
    """Finds the pattern from a number for each border point, (B,), equal for equal points.

    If the patches form a grid with `columns` patches along v, so that the numbers are those of
    `number_grid_points`, no sides are compared.
    """
    # For each degree, the numbers of sides (patch · 4 + side), and their border points.
    groups: dict[int, list[tuple[Ints, IndexArray]]] = {}
    corners: list[IndexArray] = []
    begin = patch_count = 0
    for batch in batches:
        border, sides, corner_points_of_net = _border_rows(*_form(batch))
        first_points = (begin + len(border) * np.arange(batch.count)).astype(np.uint32)[:, None]
        corners.append(first_points + corner_points_of_net.astype(np.uint32))
        patches = patch_count + np.arange(batch.count)
        for k, side in enumerate(sides):
            side_points = first_points + side.astype(np.uint32)
            groups.setdefault(len(side) - 1, []).append((4 * patches + k, side_points))
        # `begin` counts the border points of the batches so far.
        begin, patch_count = begin + len(border) * batch.count, patch_count + batch.count
    edge, backward = np.empty(4 * patch_count, np.intp), np.empty(4 * patch_count, np.bool_)
    collapsed = np.empty(4 * patch_count, np.bool_)
    ids: list[Ints] = []
    edges: list[IndexArray] = []
    sides_by_degree: list[tuple[IndexArray, IndexArray]] = []
    for degree in sorted(groups):
        side_numbers, side_rows = map(np.concatenate, zip(*groups[degree], strict=True))
        order = np.argsort(side_numbers)
        side_numbers, side_rows = side_numbers[order], side_rows[order]
        if columns:
            leader, number = _number_grid_sides(side_numbers, patch_count // columns, columns)
            is_reversed = collapsed[side_numbers] = np.zeros(len(number), dtype=bool)
        else:
            points = numbers[side_rows]
            collapsed[side_numbers] = (points == points[:, :1]).all(axis=1)
            # Sides are compared by the numbers of their points, as if these were points on a line.
            oriented, _, is_reversed = orient_edges(points[..., None].astype(np.float64), None)
            leader, number = find_first_rows(oriented[..., 0])
        first = sum(map(len, edges))
        ids.append(np.arange(first, first + len(leader)))
        edge[side_numbers] = first + number
        backward[side_numbers] = is_reversed ^ is_reversed[leader[number]]
        edges.append(side_rows[leader])
        is_backward = backward[side_numbers]
        side_rows[is_backward] = side_rows[is_backward, ::-1]
        sides_by_degree.append((side_rows, number.astype(np.uint32)))
    corner_points = np.concatenate(corners).ravel()
    number_at_corner = numbers[corner_points]
    first_corners = first_positions(number_at_corner, len(numbers))[number_at_corner]
    is_first = first_corners == np.arange(len(first_corners), dtype=np.uint32)
    corner = (np.cumsum(is_first) - 1)[first_corners]
    connectivity = Connectivity.of_patches(
        batches,
        edge=edge,
        backward=backward,
        collapsed=collapsed,
        corner=corner,
        corner_count=int(np.count_nonzero(is_first)),
    )
    return EdgePattern(
        connectivity,
        corner_points[is_first],
        tuple(ids),
        tuple(edges),
        tuple(sides_by_degree),
        EqualPoints.from_numbers(numbers),
    )


def _number_grid_sides(sides: Ints, rows: int, columns: int) -> tuple[Ints, Ints]:
    """The result of `find_first_rows` for sides (S,) of patches that form a grid.

    The sides are all, or those along one of both directions, in ascending order.
    """
    number = np.full((rows, columns, 4), -1)
    # A side u = 0 or v = 0 is an edge of a patch before, unless it is on the border of the grid.
    is_first = np.zeros(number.shape, dtype=bool)
    is_first[0, :, 0] = is_first[:, 0, 2] = is_first[..., 1::2] = True
    first_sides = is_first.ravel()[sides]
    number.ravel()[sides] = np.cumsum(first_sides) - 1
    number[1:, :, 0], number[:, 1:, 2] = number[:-1, :, 1], number[:, :-1, 3]
    return np.flatnonzero(first_sides), number.ravel()[sides]


def number_grid_points(batch: TensorPatches, columns: int) -> Ints:
    """The result of `find_equal_points` for the border points of patches that form a grid, (P b,).

    Neighbouring patches have equal points on the side between them; no other points are equal. The
    grid has `columns` patches along v.
    """
    (p, q), (border, _, _) = batch.degree, _border_rows(*_form(batch))
    along_u, along_v = np.divmod(border, q + 1)
    numbers = np.arange(batch.count * len(border)).reshape(-1, columns, len(border))
    # The points on the sides v = 0 and u = 0 are those of the patches before, on v = 1 and u = 1.
    numbers[:, 1:, along_v == 0] = numbers[:, :-1, along_v == q]
    numbers[1:, :, along_u == 0] = numbers[:-1, :, along_u == p]
    return numbers.ravel()
