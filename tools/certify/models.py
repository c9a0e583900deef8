"""Random models of many patches that share edges.

Patches may be reversed and rotated, have a raised degree, and be rational.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import cos, pi, sin
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from oracles import triangles
from oracles.sheets import Array
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import Part, PatchModel

Loop: TypeAlias = tuple[int, ...]
Pair: TypeAlias = tuple[int, int]
HomogeneousCurve: TypeAlias = list[list[Fraction]]
"""Control points (wx, wy, wz, w) of a Bézier curve, exact."""

Random: TypeAlias = np.random.Generator


@dataclass(frozen=True)
class Body:
    """Corners (C, 3), and faces as loops of three or four numbers of corners, counter-clockwise."""

    corners: Array
    faces: tuple[Loop, ...]


@dataclass(frozen=True, eq=False)
class Complex:
    """A model of patches, with the corners (C, 3) that patches share.

    `nets` and `weights` have one array for each patch. Patch k has the corners with the numbers
    `loops[k]`, in the order of its border: of a grid the corners at (u, v) = (0, 0), (1, 0), (1, 1)
    and (0, 1), and of a triangle those with the barycentric coordinate r = 1, s = 1 and t = 1.
    `alike` are the edges, as pairs of corners, whose control points and weights are equal in all
    their patches.
    """

    nets: tuple[Array, ...]
    weights: tuple[Array, ...] | None
    loops: tuple[Loop, ...]
    corners: Array
    alike: frozenset[Pair]

    def model(self, order: Sequence[int], *, together: bool = True) -> PatchModel:
        """The patches with these numbers, in this order, each of them a part.

        With `together`, consecutive patches of the same shape are one batch.
        """
        batches: list[Patches] = []
        numbers: list[int] = []
        for number, next_number in pairwise([*order, None]):
            assert number is not None
            numbers.append(number)
            is_same_shape = (
                next_number is not None and self.nets[next_number].shape == self.nets[number].shape
            )
            if not (is_same_shape and together):
                batches.append(self._batch(numbers))
                numbers = []
        parts = tuple(Part(f"patch {k}", row, row + 1) for row, k in enumerate(order))
        return PatchModel("model", tuple(batches), parts)

    def _batch(self, numbers: Sequence[int]) -> Patches:
        """The batch of the patches with these numbers, which have the same shape."""
        points = np.stack([self.nets[k] for k in numbers])
        weights = None if self.weights is None else np.stack([self.weights[k] for k in numbers])
        return (TrianglePatches if points.ndim == 3 else TensorPatches)(points, weights)

    def edges(self) -> dict[Pair, list[int]]:
        """The numbers of the patches at every edge, which is a pair of corners, the lower first."""
        patches_by_edge: dict[Pair, list[int]] = {}
        for number, loop in enumerate(self.loops):
            for a, b in pairwise([*loop, loop[0]]):
                patches_by_edge.setdefault((min(a, b), max(a, b)), []).append(number)
        return patches_by_edge


def _build_lattice(rng: Random, rows: int, columns: int, *, wrap: int = 0) -> Body:
    """Rows of quads, half of them divided into two triangles.

    The lattice is open (`wrap` = 0), or its last row is joined to the first (1), or also its last
    column to the first (2).
    """
    i, j = np.meshgrid(np.arange(rows + (wrap < 1)), np.arange(columns + (wrap < 2)), indexing="ij")
    x, y = i.astype(np.float64), j.astype(np.float64)
    across = 2 * pi * y / columns
    corners = [
        np.stack([x, y, 0 * x], axis=-1),
        _convert_cylindrical(x / rows, 1.5 + 0 * x, y),
        _convert_cylindrical(x / rows, 2.5 + np.cos(across), np.sin(across)),
    ][wrap]
    length = i.shape[1]

    def number_corner(k: int, m: int) -> int:
        return (k % i.shape[0]) * length + m % length

    faces: list[Loop] = []
    for k in range(rows):
        for m in range(columns):
            a, b = number_corner(k, m), number_corner(k + 1, m)
            c, d = number_corner(k + 1, m + 1), number_corner(k, m + 1)
            is_quad = rng.integers(4) < 2
            faces += [(a, b, c, d)] if is_quad else [(a, b, c), (a, c, d)]
    return Body(corners.reshape(-1, 3), tuple(faces))


def _convert_cylindrical(turn: Array, radius: Array, height: Array) -> Array:
    """Points (…, 3) in Cartesian coordinates; `turn` is the angle in full turns."""
    angle = 2 * pi * turn
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1)


def _build_body(corners: Sequence[Sequence[float]], faces: Sequence[Loop]) -> Body:
    """A body with these corners and faces."""
    return Body(np.array(corners, dtype=float), tuple(faces))


def _list_circle(count: int, height: float) -> list[list[float]]:
    """The corners of a regular polygon on the unit circle at this height."""
    return [[cos(2 * pi * k / count), sin(2 * pi * k / count), height] for k in range(count)]


def _build_pyramid(count: int) -> Body:
    """A closed pyramid: triangles around an apex, over a base of three or four corners."""
    sides: list[Loop] = [(k, (k + 1) % count, count) for k in range(count)]
    return _build_body([*_list_circle(count, 0), [0, 0, 1.2]], [tuple(range(count))[::-1], *sides])


def _build_prism(count: int) -> Body:
    """A closed prism over a regular polygon of `count` corners."""
    sides: list[Loop] = [
        (k, (k + 1) % count, count + (k + 1) % count, count + k) for k in range(count)
    ]
    ends: list[Loop] = [tuple(range(count))[::-1], tuple(range(count, 2 * count))]
    return _build_body(_list_circle(count, 0) + _list_circle(count, 1.3), [*sides, *ends])


def _build_double_pyramid(count: int) -> Body:
    """A closed body of two pyramids with a common base of `count` corners."""
    upper_faces: list[Loop] = [(k, (k + 1) % count, count) for k in range(count)]
    lower_faces: list[Loop] = [((k + 1) % count, k, count + 1) for k in range(count)]
    apexes = [[0, 0, 1.2], [0, 0, -1.0]]
    return _build_body([*_list_circle(count, 0), *apexes], [*upper_faces, *lower_faces])


def _build_fan(count: int) -> Body:
    """Triangles around one corner, with a gap between the last and the first."""
    faces: list[Loop] = [(k, k + 1, count) for k in range(count - 1)]
    return _build_body([*_list_circle(count, 0), [0, 0, 0.4]], faces)


def _build_moebius(count: int) -> Body:
    """A Möbius strip of quads."""
    angles = 2 * pi * np.arange(count) / count
    low, high = (
        np.stack(
            [
                (2 + s * np.cos(angles / 2)) * np.cos(angles),
                (2 + s * np.cos(angles / 2)) * np.sin(angles),
                s * np.sin(angles / 2),
            ],
            axis=-1,
        )
        for s in (-1, 1)
    )
    faces: list[Loop] = [(k, k + 1, count + k + 1, count + k) for k in range(count - 1)]
    return Body(np.concatenate([low, high]), (*faces, (count - 1, count, 0, 2 * count - 1)))


def _draw_count(rng: Random, minimum: int, maximum: int) -> int:
    """A random integer from `minimum` to `maximum`, both included."""
    return int(rng.integers(minimum, maximum, endpoint=True))


BODIES: Mapping[str, tuple[int, Callable[[Random], Body]]] = MappingProxyType(
    {
        "sheets": (
            50,
            lambda rng: _build_lattice(rng, _draw_count(rng, 1, 3), _draw_count(rng, 1, 3)),
        ),
        "rings": (
            30,
            lambda rng: _build_lattice(rng, _draw_count(rng, 3, 4), _draw_count(rng, 1, 2), wrap=1),
        ),
        "tori": (15, lambda rng: _build_lattice(rng, 3, 3, wrap=2)),
        "pyramids": (25, lambda rng: _build_pyramid(_draw_count(rng, 3, 4))),
        "prisms": (30, lambda rng: _build_prism(_draw_count(rng, 3, 4))),
        "double pyramids": (20, lambda rng: _build_double_pyramid(_draw_count(rng, 3, 4))),
        "fans": (15, lambda rng: _build_fan(_draw_count(rng, 3, 6))),
        "Moebius strips": (15, lambda rng: _build_moebius(_draw_count(rng, 3, 5))),
    }
)
"""For each kind, the number of its models, and the function that builds a random body."""


def build_complex(kind: str, seed: int) -> Complex:
    """A random model, in which every patch begins at a random corner of its loop.

    For odd seeds all degrees are equal. For even seeds every edge is a curve of its own degree,
    which is raised to the degrees of its patches in exact arithmetic and rounded once. A third of
    the models is rational; in half of these, the weights of each patch have a factor of their own.
    """
    rng = np.random.default_rng(seed)
    body = BODIES[kind][1](rng)
    corners = body.corners + rng.uniform(-0.1, 0.1, body.corners.shape)
    rational = rng.integers(3) == 0
    has_factors = bool(rng.integers(2))
    corner_weights = rng.uniform(0.5, 2, len(corners)) if rational else np.ones(len(corners))
    loops = [_rotate_loop(rng, loop) for loop in body.faces]
    common = int(rng.integers(1, 4)) if seed % 2 else None
    curves = _draw_curves(
        rng, corners, corner_weights, loops, rational=bool(rational), degree=common
    )
    nets: list[Array] = []
    weights: list[Array] = []
    forms_by_edge: dict[Pair, set[tuple[int, float]]] = {}
    for loop in loops:
        factor = 2.0 ** int(rng.integers(-2, 3)) if rational and has_factors else 1.0
        net, net_weights = (_build_quad if len(loop) == 4 else _build_triangle)(
            rng, loop, curves, rational=bool(rational), raised=common is None
        )
        nets.append(net)
        weights.append(net_weights * factor)
        degrees = _list_degrees(net, len(loop))
        for (a, b), degree in zip(pairwise([*loop, loop[0]]), degrees, strict=True):
            forms_by_edge.setdefault((min(a, b), max(a, b)), set()).add((degree, factor))
    alike = frozenset(edge for edge, forms in forms_by_edge.items() if len(forms) == 1)
    return Complex(tuple(nets), tuple(weights) if rational else None, tuple(loops), corners, alike)


def _list_degrees(net: Array, sides: int) -> list[int]:
    """The degree of each side of a patch, in the order of its loop."""
    if sides == 3:
        return [triangles.find_degree(len(net))] * 3
    p, q = net.shape[0] - 1, net.shape[1] - 1
    return [p, q, p, q]


def _rotate_loop(rng: Random, loop: Loop) -> Loop:
    """The loop, beginning at a random corner; a third of the loops is also reversed."""
    first = int(rng.integers(len(loop)))
    rotated = loop[first:] + loop[:first]
    return rotated[::-1] if rng.integers(3) == 0 else rotated


def _draw_curves(
    rng: Random,
    corners: Array,
    corner_weights: Array,
    loops: Sequence[Loop],
    *,
    rational: bool,
    degree: int | None,
) -> dict[Pair, HomogeneousCurve]:
    """A homogeneous curve for every edge, from its lower corner to its higher.

    All have the degree `degree`; if it is None, each has a random degree from 1 to 3.
    """
    curves: dict[Pair, HomogeneousCurve] = {}
    for loop in loops:
        for pair in pairwise([*loop, loop[0]]):
            a, b = min(pair), max(pair)
            if (a, b) in curves:
                continue
            n = degree or int(rng.integers(1, 4))
            t = np.arange(n + 1)[:, np.newaxis] / n
            points = (1 - t) * corners[a] + t * corners[b]
            points[1:-1] += rng.uniform(-0.3, 0.3, points[1:-1].shape)
            points[0], points[-1] = corners[a], corners[b]
            weights = rng.uniform(0.4, 2.5, n + 1) if rational else np.ones(n + 1)
            weights[0], weights[-1] = corner_weights[a], corner_weights[b]
            curves[a, b] = [
                [*(Fraction(w) * Fraction(x) for x in point), Fraction(w)]
                for point, w in zip(points.tolist(), weights.tolist(), strict=True)
            ]
    return curves


def _elevate(curve: HomogeneousCurve, degree: int) -> Array:
    """Points and weights (degree + 1, 4) of a curve in this degree, rounded once."""
    while len(curve) - 1 < degree:
        n = len(curve)
        curve = [
            [
                Fraction(i, n) * x + (1 - Fraction(i, n)) * y
                # Where an index is beyond an end, its factor is 0.
                for x, y in zip(curve[max(i - 1, 0)], curve[min(i, n - 1)], strict=True)
            ]
            for i in range(n + 1)
        ]
    return np.array([[*(float(x / h[3]) for x in h[:3]), float(h[3])] for h in curve])


def _read_edge(curves: Mapping[Pair, HomogeneousCurve], a: int, b: int, degree: int) -> Array:
    """Points and weights (degree + 1, 4) of the edge from corner a to corner b."""
    rows = _elevate(curves[min(a, b), max(a, b)], degree)
    return rows if a < b else rows[::-1]


def _build_quad(
    rng: Random,
    loop: Loop,
    curves: Mapping[Pair, HomogeneousCurve],
    *,
    rational: bool,
    raised: bool,
) -> tuple[Array, Array]:
    """Net and weights of a grid whose borders are the four edges of the loop.

    Inner points are those of a Coons patch, with noise. With `raised`, a degree may be higher by 1
    than that of the edges.
    """
    a, b, c, d = loop
    p, q = (
        max(len(curves[min(pair), max(pair)]) - 1 for pair in pairs)
        + int(raised and rng.integers(5) == 0)
        for pairs in (((a, b), (d, c)), ((a, d), (b, c)))
    )
    low, high = _read_edge(curves, a, b, p), _read_edge(curves, d, c, p)
    left, right = _read_edge(curves, a, d, q), _read_edge(curves, b, c, q)
    u = np.linspace(0, 1, p + 1)[:, np.newaxis, np.newaxis]
    v = np.linspace(0, 1, q + 1)[:, np.newaxis]
    blend = (1 - v) * low[:, np.newaxis] + v * high[:, np.newaxis] + (1 - u) * left + u * right
    blend = blend - (1 - u) * ((1 - v) * low[0] + v * high[0])
    net = blend - u * ((1 - v) * low[-1] + v * high[-1])
    net[..., :3] += rng.uniform(-0.4, 0.4, net[..., :3].shape)
    net[..., 3] = rng.uniform(0.5, 2, net.shape[:2]) if rational else 1.0
    net[:, 0], net[:, -1], net[0], net[-1] = low, high, left, right
    return net[..., :3].copy(), net[..., 3].copy()


def _build_triangle(
    rng: Random,
    loop: Loop,
    curves: Mapping[Pair, HomogeneousCurve],
    *,
    rational: bool,
    raised: bool,
) -> tuple[Array, Array]:
    """Net and weights of a triangle whose borders are the three edges of the loop.

    Inner points are near those of a flat triangle. With `raised`, the degree may be higher by 1
    than that of the edges.
    """
    pairs = list(pairwise([*loop, loop[0]]))
    n = max(len(curves[min(pair), max(pair)]) - 1 for pair in pairs) + int(
        raised and rng.integers(5) == 0
    )
    sides = [_read_edge(curves, a, b, n) for a, b in pairs]
    net = np.empty((len(triangles.keys(n)), 4))
    # Row by row, the exponents of r, s and t in the Bernstein polynomial of the control point.
    for row, (i, j, k) in enumerate(triangles.keys(n)):
        if k == 0:
            net[row] = sides[0][j]
        elif i == 0:
            net[row] = sides[1][k]
        elif j == 0:
            net[row] = sides[2][i]
        else:
            net[row] = (i * sides[0][0] + j * sides[1][0] + k * sides[2][0]) / n
            net[row, :3] += rng.uniform(-0.4, 0.4, 3)
            net[row, 3] = rng.uniform(0.5, 2) if rational else 1.0
    return net[:, :3].copy(), net[:, 3].copy()
