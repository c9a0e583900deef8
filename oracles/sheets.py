"""Surfaces for sampling, evaluated by their own definitions, without lowering.

A sheet is one tensor-product or triangular surface. Bases are computed by the recursions that
define them: B_i^n = (1 − t) B_i^{n−1} + t B_{i−1}^{n−1}, the corresponding recursion over
triangles, and the recursion of Cox and de Boor. Points are relative to an origin near the surface,
so that a surface far from zero loses no digits.

A place is a pair of parameters (u, v).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracles import triangles
from service.surface.batches import TensorPatches
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.lowered import PatchModel
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface

Array: TypeAlias = NDArray[np.float64]
Basis: TypeAlias = Callable[[Array], Array]

CHUNK = 1 << 20
"""The approximate number of floats of the bases that are computed at a time."""


class Sheet(Protocol):
    """One surface over a rectangle, or over the triangle u, v ≥ 0, u + v ≤ 1."""

    @property
    def origin(self) -> Array:
        """The point (3,) from which points of the sheet are measured."""
        ...

    def at(self, places: Array) -> Array:
        """Points (m, 3), relative to the origin, at places (m, 2)."""
        ...

    def samples(self, count: int) -> Array:
        """About `count` places (m, 2), equally spaced between neighbouring knots.

        There are more on the border of the domain, and at least `count`/4 more whose points have
        about equal distances in space. Knots are among the places.
        """
        ...

    def clip_to_domain(self, places: Array) -> Array:
        """The places (m, 2); those outside of the domain are moved to its border."""
        ...

    def step(self, count: int) -> Array:
        """The largest distances (2,), in u and in v, of neighbours among the `count` places."""
        ...


@dataclass(frozen=True, eq=False)
class TensorSheet:
    """Σ_ij M_i(u) N_j(v) H_ij, projected; `net` (n, m, 4) is H, homogeneous about the origin.

    `bases` compute M and N; `breaks` are the distinct knots of the domain, in u and in v.
    """

    net: Array
    bases: tuple[Basis, Basis]
    breaks: tuple[Array, Array]
    origin: Array

    def at(self, places: Array) -> Array:
        rows, columns, _ = self.net.shape
        size = max(1, CHUNK // (columns * 4 + rows))
        return np.concatenate(
            [self._at(places[k : k + size]) for k in range(0, len(places), size)]
            or [np.zeros((0, 3))]
        )

    def _at(self, places: Array) -> Array:
        rows, columns, _ = self.net.shape
        along_u, along_v = (basis(places[:, k]) for k, basis in enumerate(self.bases))
        curves = (along_u @ self.net.reshape(rows, -1)).reshape(-1, columns, 4)
        points: Array = (along_v[:, :, np.newaxis] * curves).sum(axis=1)
        return points[:, :3] / points[:, 3:]

    def samples(self, count: int) -> Array:
        per_span = self._divisions_per_span(count)
        lines = [_divide(breaks, per_span) for breaks in self.breaks]
        fine = [_divide(breaks, 4 * per_span) for breaks in self.breaks]
        ends = [breaks[[0, -1]] for breaks in self.breaks]
        grids = [lines, [fine[0], ends[1]], [ends[0], fine[1]]]
        coarse = [_divide(breaks, max(1, per_span // 6)) for breaks in self.breaks]
        even = _choose_even_places(self, _split_cells(coarse[0], coarse[1]), count // 4)
        return np.concatenate([*(_grid(u, v) for u, v in grids), even])

    def _divisions_per_span(self, count: int) -> int:
        spans = (len(self.breaks[0]) - 1) * (len(self.breaks[1]) - 1)
        return max(4, int(np.sqrt(count / spans)))

    def clip_to_domain(self, places: Array) -> Array:
        return np.stack(
            [np.clip(places[:, k], b[0], b[-1]) for k, b in enumerate(self.breaks)], axis=1
        )

    def step(self, count: int) -> Array:
        return np.array([np.diff(b).max() / self._divisions_per_span(count) for b in self.breaks])


@dataclass(frozen=True, eq=False)
class TriangleSheet:
    """Σ B_ijk(s, t) H_ijk, projected; `net` (points, 4) is H, homogeneous about the origin."""

    net: Array
    origin: Array

    def at(self, places: Array) -> Array:
        degree = triangles.find_degree(len(self.net))
        points = triangle_bernstein(degree, places) @ self.net
        return points[:, :3] / points[:, 3:]

    def samples(self, count: int) -> Array:
        n = self._divisions(count)
        inner = np.array([(j, k) for _, j, k in triangles.keys(n)]) / n
        t = np.linspace(0.0, 1.0, 4 * n + 1)
        zero = np.zeros_like(t)
        sides = [(zero, t), (t, zero), (t, 1 - t)]
        corners = np.array([[[0.0, 0], [1, 0], [0, 1]]])
        even = _choose_even_places(self, corners, count // 4)
        return np.concatenate([inner, *(np.stack(side, axis=1) for side in sides), even])

    def _divisions(self, count: int) -> int:
        return max(4, int(np.sqrt(2 * count)))

    def clip_to_domain(self, places: Array) -> Array:
        places = np.clip(places, 0.0, 1.0)
        total = places.sum(axis=1, keepdims=True)
        return np.where(total > 1, places / np.maximum(total, 1.0), places)

    def step(self, count: int) -> Array:
        return np.full(2, 1 / self._divisions(count))


@dataclass(frozen=True, eq=False)
class PlacedSheet:
    """Another sheet after an affine map; `matrix` (4, 4) acts on columns (x, y, z, 1)."""

    sheet: Sheet
    matrix: Array

    @property
    def origin(self) -> Array:
        origin: Array = self.matrix[:3, :3] @ self.sheet.origin + self.matrix[:3, 3]
        return origin

    def at(self, places: Array) -> Array:
        points: Array = self.sheet.at(places) @ self.matrix[:3, :3].T
        return points

    def samples(self, count: int) -> Array:
        return self.sheet.samples(count)

    def clip_to_domain(self, places: Array) -> Array:
        return self.sheet.clip_to_domain(places)

    def step(self, count: int) -> Array:
        return self.sheet.step(count)


def _divide(breaks: Array, per_span: int) -> Array:
    """Parameters that divide every span into `per_span` equal parts; they include the breaks."""
    t = np.arange(per_span) / per_span
    starts = breaks[:-1, np.newaxis] + np.diff(breaks)[:, np.newaxis] * t
    return np.append(starts.ravel(), breaks[-1])


def _grid(u: Array, v: Array) -> Array:
    return np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)


def _split_cells(u: Array, v: Array) -> Array:
    """Two triangles of places for each cell of a grid, (T, 3, 2)."""
    cells = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    a, b, c, d = cells[:-1, :-1], cells[1:, :-1], cells[1:, 1:], cells[:-1, 1:]
    triangles_of_cells = [
        np.stack(corners, axis=2).reshape(-1, 3, 2) for corners in ((a, b, c), (a, c, d))
    ]
    return np.concatenate(triangles_of_cells)


def _choose_even_places(sheet: Sheet, cells: Array, count: int) -> Array:
    """Centres (m, 2) of triangles of places that are about equally large in space; m ≥ `count`.

    `cells` (T, 3, 2) are divided: triangles at least half as large as the largest are halved at the
    middle of their longest side, until `count` triangles exist.
    """
    sizes, sides = _measure_cells(sheet, cells)
    while len(cells) < count:
        is_halved = sizes >= sizes.max() / 2
        large_cells = np.flatnonzero(is_halved)[: count - len(cells)]
        is_halved[large_cells[-1] + 1 :] = False  # not more than `count` cells
        rows, begin = np.arange(len(large_cells)), sides[large_cells]
        end = (begin + 1) % 3
        halves = [cells[large_cells], cells[large_cells]]
        middle = (halves[0][rows, begin] + halves[0][rows, end]) / 2
        halves[0][rows, end] = halves[1][rows, begin] = middle
        new_cells = np.concatenate(halves)
        new_sizes, new_sides = _measure_cells(sheet, new_cells)
        cells = np.concatenate([cells[~is_halved], new_cells])
        sizes = np.concatenate([sizes[~is_halved], new_sizes])
        sides = np.concatenate([sides[~is_halved], new_sides])
    centres: Array = cells.mean(axis=1)
    return centres


def _measure_cells(sheet: Sheet, cells: Array) -> tuple[Array, NDArray[np.intp]]:
    """The sizes (T,) in space of triangles of places, and the numbers (T,) of their longest sides.

    The length of a side is the sum of two chords that meet at the middle of the side, so that a
    bulge makes the side longer. The size is the length of the longest side, or twice the largest
    distance from the centre to the middle of a side, whichever is larger.
    """
    next_corners = cells[:, [1, 2, 0]]
    middles = (cells + next_corners) / 2
    places = np.concatenate([cells, middles, cells.mean(axis=1, keepdims=True)], axis=1)
    points = sheet.at(places.reshape(-1, 2)).reshape(-1, 7, 3)
    corners, middle_points, centre = points[:, :3], points[:, 3:6], points[:, 6:]
    lengths = _norm(middle_points - corners) + _norm(points[:, [1, 2, 0]] - middle_points)
    # All corners may be one point. Then the sides are compared by their lengths in parameters.
    lengths += 1e-9 * _norm(next_corners - cells)
    sizes = np.maximum(lengths.max(axis=1), 2 * _norm(centre - middle_points).max(axis=1))
    return sizes, lengths.argmax(axis=1)


def _norm(vectors: Array) -> Array:
    lengths: Array = np.sqrt((vectors * vectors).sum(axis=-1))
    return lengths


def bernstein(degree: int) -> Basis:
    """A function that computes all Bernstein polynomials of a degree n, (m, n+1), at t (m,)."""

    def values(t: Array) -> Array:
        row = np.ones((len(t), 1))
        for _ in range(degree):
            longer = np.zeros((len(t), row.shape[1] + 1))
            longer[:, :-1] = (1 - t)[:, np.newaxis] * row
            longer[:, 1:] += t[:, np.newaxis] * row
            row = longer
        return row

    return values


def triangle_bernstein(degree: int, places: Array) -> Array:
    """Values (m, (n+1)(n+2)/2) of the Bernstein polynomials over a triangle, by k, then by j."""
    s, t = places[:, 0], places[:, 1]
    weights = {(1, 0, 0): 1 - s - t, (0, 1, 0): s, (0, 0, 1): t}
    values = {(0, 0, 0): np.ones(len(places))}
    for n in range(1, degree + 1):
        longer = {key: np.zeros(len(places)) for key in triangles.keys(n)}
        for (i, j, k), value in values.items():
            for (a, b, c), weight in weights.items():
                longer[i + a, j + b, k + c] += weight * value
        values = longer
    return np.stack([values[key] for key in triangles.keys(degree)], axis=1)


def spline_basis(knots: Array, degree: int) -> Basis:
    """A function that computes all B-splines of a knot vector at t (m,); The NURBS Book, 2.5."""
    last = len(knots) - degree - 2
    spans = np.array([s for s in range(degree, last + 1) if knots[s] < knots[s + 1]])

    def values(t: Array) -> Array:
        # The spans are half open: at a knot the functions are their limits from the right.
        number = np.searchsorted(knots[spans], t, side="right") - 1
        row = np.zeros((len(t), len(knots) - 1))
        row[np.arange(len(t)), spans[np.maximum(number, 0)]] = 1.0
        for p in range(1, degree + 1):
            n = row.shape[1] - 1
            low, high = knots[p : p + n] - knots[:n], knots[p + 1 : p + 1 + n] - knots[1 : 1 + n]
            rise = (t[:, np.newaxis] - knots[:n]) * _invert(low)
            fall = (knots[p + 1 : p + 1 + n] - t[:, np.newaxis]) * _invert(high)
            row = rise * row[:, :-1] + fall * row[:, 1:]
        return row

    return values


def _invert(length: Array) -> Array:
    """1/x, and 0 where x = 0."""
    return np.where(length > 0, 1 / np.where(length > 0, length, 1.0), 0.0)


def build_sheets(surface: object) -> list[Sheet]:
    """The sheets that a surface consists of."""
    match surface:
        case BezierSurface():
            return [build_bezier_sheet(surface.control_net, surface.weights)]
        case TriangleSurface():
            return [build_triangle_sheet(surface.control_net, surface.weights)]
        case BsplineSurface():
            return [_build_spline_sheet(surface)]
        case PatchSurface():
            return _build_patch_sheets(surface)
        case MultipatchSurface():
            return [sheet for member in surface.surfaces for sheet in build_sheets(member)]
        case PatchModel():
            return _build_model_sheets(surface)
    raise TypeError(type(surface).__name__)


def build_bezier_sheet(net: Array, weights: Array | None = None) -> TensorSheet:
    """One tensor-product Bézier patch."""
    unit = np.array([0.0, 1.0])
    homogeneous, origin = _to_homogeneous(net, weights)
    bases = bernstein(net.shape[0] - 1), bernstein(net.shape[1] - 1)
    return TensorSheet(homogeneous, bases, (unit, unit), origin)


def build_triangle_sheet(net: Array, weights: Array | None = None) -> TriangleSheet:
    """One triangular Bézier patch."""
    return TriangleSheet(*_to_homogeneous(net, weights))


def _build_spline_sheet(surface: BsplineSurface) -> TensorSheet:
    net, origin = _to_homogeneous(surface.control_net, surface.weights)
    bases: list[Basis] = []
    breaks: list[Array] = []
    for axis, (knots_or_name, degree) in enumerate(zip(surface.knots, surface.degree, strict=True)):
        if isinstance(knots_or_name, str) and knots_or_name == "periodic":
            head = np.take(net, range(degree), axis=axis)
            net = np.concatenate([net, head], axis=axis)
        knots = _build_knots(knots_or_name, net.shape[axis], degree)
        bases.append(spline_basis(knots, degree))
        breaks.append(np.unique(knots[degree : len(knots) - degree]))
    return TensorSheet(net, (bases[0], bases[1]), (breaks[0], breaks[1]), origin)


def _build_knots(knots_or_name: str | Array, count: int, degree: int) -> Array:
    """The knots: as they are, or with spans of length 1 from 0 for "clamped" and "periodic"."""
    if not isinstance(knots_or_name, str):
        return np.asarray(knots_or_name)
    steps = np.arange(-degree, count + 1.0)
    return np.clip(steps, 0, count - degree) if knots_or_name == "clamped" else steps


def _build_patch_sheets(surface: PatchSurface) -> list[Sheet]:
    points, weights = surface.vertices, surface.weights

    def select_weights(rows: NDArray[np.int64]) -> Array | None:
        return None if weights is None else weights[rows]

    patches: list[Sheet] = [
        build_bezier_sheet(points[rows], select_weights(rows)) for rows in surface.patches
    ]
    return patches + [
        build_triangle_sheet(points[rows], select_weights(rows)) for rows in surface.triangles
    ]


def _build_model_sheets(model: PatchModel) -> list[Sheet]:
    result: list[Sheet] = []
    for batch in model.batches:
        point_weights: Sequence[Array | None] = (
            [None] * batch.count if batch.weights is None else list(batch.weights)
        )
        build = build_bezier_sheet if isinstance(batch, TensorPatches) else build_triangle_sheet
        result += [build(net, w) for net, w in zip(batch.points, point_weights, strict=True)]
    return result


def _to_homogeneous(net: Array, weights: Array | None) -> tuple[Array, Array]:
    """The net as (wx, wy, wz, w), relative to the middle of its bounding box, and that middle."""
    flat = net.reshape(-1, 3)
    origin = flat.min(axis=0) + (flat.max(axis=0) - flat.min(axis=0)) / 2
    point_weights = np.ones(net.shape[:-1]) if weights is None else weights / weights.max()
    factors = point_weights[..., np.newaxis]
    return np.concatenate([(net - origin) * factors, factors], -1), origin
