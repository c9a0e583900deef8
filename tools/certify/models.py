"""Random models of many patches that share edges: reversed, rotated, raised in degree, weighted."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import cos, pi, sin
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import Part, PatchModel
from tests.oracles import triangles
from tests.strategies import Array

Loop: TypeAlias = tuple[int, ...]
Pair: TypeAlias = tuple[int, int]
Line: TypeAlias = list[list[Fraction]]
Random: TypeAlias = np.random.Generator


@dataclass(frozen=True)
class Body:
    """Corners, and faces that name three or four of them counter-clockwise."""

    corners: Array
    faces: tuple[Loop, ...]


@dataclass(frozen=True, eq=False)
class Complex:
    """A model whose shared edges are known.

    Patch k has the corners `loops[k]`, in the order in which its border runs: of a grid (0, 0),
    (1, 0), (1, 1), (0, 1), of a triangle r, s, t. `alike` are the edges whose control points are
    the same numbers in all patches.
    """

    nets: tuple[Array, ...]
    weights: tuple[Array, ...] | None
    loops: tuple[Loop, ...]
    corners: Array
    alike: frozenset[Pair]

    def model(self, order: Sequence[int], *, together: bool = True) -> PatchModel:
        """Some of the patches in this order, each a part; consecutive patches of one kind form a
        batch."""
        batches: list[Patches] = []
        run: list[int] = []
        for number, following in pairwise([*order, None]):
            assert number is not None
            run.append(number)
            same = following is not None and self.nets[following].shape == self.nets[number].shape
            if not (same and together):
                batches.append(self._batch(run))
                run = []
        parts = tuple(Part(f"patch {k}", row, row + 1) for row, k in enumerate(order))
        return PatchModel("model", tuple(batches), parts)

    def _batch(self, run: Sequence[int]) -> Patches:
        points = np.stack([self.nets[k] for k in run])
        weights = None if self.weights is None else np.stack([self.weights[k] for k in run])
        return (TrianglePatches if points.ndim == 3 else TensorPatches)(points, weights)

    def edges(self) -> dict[Pair, list[int]]:
        """The patches at every edge."""
        patches_by_edge: dict[Pair, list[int]] = {}
        for number, loop in enumerate(self.loops):
            for a, b in pairwise([*loop, loop[0]]):
                patches_by_edge.setdefault((min(a, b), max(a, b)), []).append(number)
        return patches_by_edge


def _lattice(rng: Random, rows: int, columns: int, *, wrap: int = 0) -> Body:
    """Quads in rows, open, closed along u, or along both; some cut into two triangles."""
    i, j = np.meshgrid(np.arange(rows + (wrap < 1)), np.arange(columns + (wrap < 2)), indexing="ij")
    x, y = i.astype(np.float64), j.astype(np.float64)
    across = 2 * pi * y / columns
    places = [
        np.stack([x, y, 0 * x], axis=-1),
        _rotate(x / rows, 1.5 + 0 * x, y),
        _rotate(x / rows, 2.5 + np.cos(across), np.sin(across)),
    ][wrap]
    length = i.shape[1]

    def at(k: int, m: int) -> int:
        return (k % i.shape[0]) * length + m % length

    faces: list[Loop] = []
    for k in range(rows):
        for m in range(columns):
            a, b, c, d = at(k, m), at(k + 1, m), at(k + 1, m + 1), at(k, m + 1)
            cut = rng.integers(4)
            faces += [(a, b, c, d)] if cut < 2 else [(a, b, c), (a, c, d)]
    return Body(places.reshape(-1, 3), tuple(faces))


def _rotate(turn: Array, radius: Array, height: Array) -> Array:
    angle = 2 * pi * turn
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1)


def _solid(corners: Sequence[Sequence[float]], faces: Sequence[Loop]) -> Body:
    return Body(np.array(corners, dtype=float), tuple(faces))


def _circle(count: int, height: float) -> list[list[float]]:
    return [[cos(2 * pi * k / count), sin(2 * pi * k / count), height] for k in range(count)]


def _pyramid(count: int) -> Body:
    """Triangles about an apex over a polygon of three or four corners: closed."""
    sides: list[Loop] = [(k, (k + 1) % count, count) for k in range(count)]
    return _solid([*_circle(count, 0), [0, 0, 1.2]], [tuple(range(count))[::-1], *sides])


def _prism(count: int) -> Body:
    sides: list[Loop] = [
        (k, (k + 1) % count, count + (k + 1) % count, count + k) for k in range(count)
    ]
    ends: list[Loop] = [tuple(range(count))[::-1], tuple(range(count, 2 * count))]
    return _solid(_circle(count, 0) + _circle(count, 1.3), [*sides, *ends])


def _double_pyramid(count: int) -> Body:
    up: list[Loop] = [(k, (k + 1) % count, count) for k in range(count)]
    down: list[Loop] = [((k + 1) % count, k, count + 1) for k in range(count)]
    return _solid([*_circle(count, 0), [0, 0, 1.2], [0, 0, -1]], [*up, *down])


def _fan(count: int) -> Body:
    """Patches about a corner, a gap between the last and the first."""
    faces: list[Loop] = [(k, k + 1, count) for k in range(count - 1)]
    return _solid([*_circle(count, 0), [0, 0, 0.4]], faces)


def _moebius(count: int) -> Body:
    """A strip that is closed with half a turn."""
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


def _draw_count(rng: Random, least: int, most: int) -> int:
    return int(rng.integers(least, most, endpoint=True))


BODIES: Mapping[str, tuple[int, Callable[[Random], Body]]] = MappingProxyType(
    {
        "sheets": (50, lambda rng: _lattice(rng, _draw_count(rng, 1, 3), _draw_count(rng, 1, 3))),
        "rings": (
            30,
            lambda rng: _lattice(rng, _draw_count(rng, 3, 4), _draw_count(rng, 1, 2), wrap=1),
        ),
        "tori": (15, lambda rng: _lattice(rng, 3, 3, wrap=2)),
        "pyramids": (25, lambda rng: _pyramid(_draw_count(rng, 3, 4))),
        "prisms": (30, lambda rng: _prism(_draw_count(rng, 3, 4))),
        "double pyramids": (20, lambda rng: _double_pyramid(_draw_count(rng, 3, 4))),
        "fans": (15, lambda rng: _fan(_draw_count(rng, 3, 6))),
        "Moebius strips": (15, lambda rng: _moebius(_draw_count(rng, 3, 5))),
    }
)
"""For each kind the number of its models, and the function that makes its body."""


def build_complex(kind: str, seed: int) -> Complex:
    """A random model: every edge is a curve of its own degree, every patch begins at a random
    corner.

    In every other model all degrees are equal; in the others, edges are raised to the degrees of
    their patches, in exact arithmetic and rounded once. A third of the models is rational; in half
    of these the weights of each patch have a factor of their own.
    """
    rng = np.random.default_rng(seed)
    body = BODIES[kind][1](rng)
    corners = body.corners + rng.uniform(-0.1, 0.1, body.corners.shape)
    rational = rng.integers(3) == 0
    factors = bool(rng.integers(2))
    heavy = rng.uniform(0.5, 2, len(corners)) if rational else np.ones(len(corners))
    loops = [_rotate_loop(rng, loop) for loop in body.faces]
    common = int(rng.integers(1, 4)) if seed % 2 else None
    curves = _curves(rng, corners, heavy, loops, rational=bool(rational), degree=common)
    nets: list[Array] = []
    weights: list[Array] = []
    named: dict[Pair, set[tuple[int, float]]] = {}
    for loop in loops:
        factor = 2.0 ** int(rng.integers(-2, 3)) if rational and factors else 1.0
        net, load = (_quad if len(loop) == 4 else _triangle)(
            rng, loop, curves, rational=bool(rational), raised=common is None
        )
        nets.append(net)
        weights.append(load * factor)
        degrees = _degrees(net, len(loop))
        for (a, b), degree in zip(pairwise([*loop, loop[0]]), degrees, strict=True):
            named.setdefault((min(a, b), max(a, b)), set()).add((degree, factor))
    alike = frozenset(edge for edge, ways in named.items() if len(ways) == 1)
    return Complex(tuple(nets), tuple(weights) if rational else None, tuple(loops), corners, alike)


def _degrees(net: Array, sides: int) -> list[int]:
    """Degree of each side in the order of the loop."""
    if sides == 3:
        return [triangles.find_degree(len(net))] * 3
    p, q = net.shape[0] - 1, net.shape[1] - 1
    return [p, q, p, q]


def _rotate_loop(rng: Random, loop: Loop) -> Loop:
    """The loop from a random corner, sometimes in the other direction."""
    first = int(rng.integers(len(loop)))
    turned = loop[first:] + loop[:first]
    return turned[::-1] if rng.integers(3) == 0 else turned


def _curves(
    rng: Random,
    corners: Array,
    heavy: Array,
    loops: Sequence[Loop],
    *,
    rational: bool,
    degree: int | None,
) -> dict[Pair, Line]:
    """A homogeneous curve for every edge, from its lower corner to its higher.

    All have the degree `degree`; if it is None, each has a random degree from 1 to 3.
    """
    curves: dict[Pair, Line] = {}
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
            loads = rng.uniform(0.4, 2.5, n + 1) if rational else np.ones(n + 1)
            loads[0], loads[-1] = heavy[a], heavy[b]
            curves[a, b] = [
                [*(Fraction(w) * Fraction(x) for x in point), Fraction(w)]
                for point, w in zip(points.tolist(), loads.tolist(), strict=True)
            ]
    return curves


def _elevate(line: Line, degree: int) -> Array:
    """The curve in a higher degree, rounded once: points and weights (n+1, 4)."""
    while len(line) - 1 < degree:
        n = len(line)
        line = [
            [
                Fraction(i, n) * x + (1 - Fraction(i, n)) * y
                for x, y in zip(line[max(i - 1, 0)], line[min(i, n - 1)], strict=True)
            ]
            for i in range(n + 1)
        ]
    return np.array([[*(float(x / h[3]) for x in h[:3]), float(h[3])] for h in line])


def _read_edge(curves: Mapping[Pair, Line], a: int, b: int, degree: int) -> Array:
    """The edge from corner a to corner b in this degree."""
    line = _elevate(curves[min(a, b), max(a, b)], degree)
    return line if a < b else line[::-1]


def _quad(
    rng: Random, loop: Loop, curves: Mapping[Pair, Line], *, rational: bool, raised: bool
) -> tuple[Array, Array]:
    """A net whose borders are the four edges; its inside is blended from these, with noise."""
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


def _triangle(
    rng: Random, loop: Loop, curves: Mapping[Pair, Line], *, rational: bool, raised: bool
) -> tuple[Array, Array]:
    """A triangular net whose borders are the three edges."""
    pairs = list(pairwise([*loop, loop[0]]))
    n = max(len(curves[min(pair), max(pair)]) - 1 for pair in pairs) + int(
        raised and rng.integers(5) == 0
    )
    sides = [_read_edge(curves, a, b, n) for a, b in pairs]
    net = np.empty((len(triangles.keys(n)), 4))
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
