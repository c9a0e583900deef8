"""Plane curves from which parts are made: loops of one or several splines.

A loop is a list of splines, each of which begins where the one before ends. Outer loops run
counter-clockwise; `reverse_loop` turns a loop around.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from oracles.brep_documents import Array, Spline

Random: TypeAlias = np.random.Generator
Loop: TypeAlias = list[Spline]

KINDS = ("circle", "arcs", "ellipse", "star", "slot", "polygon", "smooth", "drop", "rounded")
"""Shapes that `draw_shape` knows."""


WIDE_KINDS = ("circle", "arcs", "slot", "polygon", "smooth", "rounded")
"""Shapes whose curvature is at most some tens of their radius, and that have no narrow tips."""


def draw_segments(points: Array) -> Loop:
    """A polygon (n, 2) as n lines."""
    ends = np.roll(points, -1, axis=0)
    return [
        Spline(1, np.array([0.0, 0, 1, 1]), np.stack([a, b]), np.ones(2))
        for a, b in zip(points, ends, strict=True)
    ]


def draw_arc(middle: Array, radii: Array, start: float, end: float) -> Spline:
    """An arc of an ellipse from an angle to a larger one, by rational quadratic spans."""
    spans = max(1, int(np.ceil((end - start) / (np.pi / 2) - 1e-9)))
    angle = np.linspace(start, end, 2 * spans + 1)
    weights = np.ones(2 * spans + 1)
    weights[1::2] = np.cos((end - start) / (2 * spans))
    points = np.column_stack([np.cos(angle), np.sin(angle)]) / weights[:, np.newaxis]
    if abs(end - start - 2 * np.pi) < 1e-12:
        points[-1] = points[0]
    return Spline(2, _repeat_knots(2, spans), middle + radii * points, weights)


def draw_smooth(points: Array, pieces: int) -> Loop:
    """A closed cubic curve through points (n, 2), with continuous tangents, as `pieces` splines."""
    tangents = (np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)) / 6
    ends, end_tangents = np.roll(points, -1, axis=0), np.roll(tangents, -1, axis=0)
    spans = np.stack([points, points + tangents, ends - end_tangents, ends], axis=1)
    groups = np.array_split(spans, pieces)
    return [
        Spline(
            3,
            _repeat_knots(3, len(group)),
            np.concatenate([group[:, :3].reshape(-1, 2), group[-1, 3:]]),
            np.ones(3 * len(group) + 1),
        )
        for group in groups
    ]


def _repeat_knots(degree: int, spans: int) -> Array:
    """Knots 0, 1, … spans, each `degree` times, the ends once more."""
    inner = np.repeat(np.arange(spans + 1.0), degree)
    return np.concatenate([[0.0], inner, [float(spans)]])


def draw_shape(rng: Random, kind: str, middle: Array, radius: float) -> Loop:
    """A closed curve that touches the circle of this radius from inside, counter-clockwise."""
    turn = rng.uniform(0, 2 * np.pi)
    both = np.array([radius, radius])
    if kind == "circle":
        return [draw_arc(middle, both, turn, turn + 2 * np.pi)]
    if kind == "arcs":
        cuts = turn + 2 * np.pi * np.sort(rng.uniform(0, 1, int(rng.integers(2, 5))))
        cuts = np.append(cuts, cuts[0] + 2 * np.pi)
        return join_ends([draw_arc(middle, both, a, b) for a, b in pairwise(cuts)])
    if kind == "ellipse":
        flat = both * (np.array([1.0, 10 ** rng.uniform(-2, 0)]))
        return [draw_arc(middle, flat, 0.0, 2 * np.pi)]
    if kind == "slot":
        half = radius * rng.uniform(0.05, 0.9)
        reach, ends = np.array([radius - half, 0.0]), np.array([half, half])
        right, left = middle + reach, middle - reach
        first = draw_arc(right, ends, -np.pi / 2, np.pi / 2)
        second = draw_arc(left, ends, np.pi / 2, 3 * np.pi / 2)
        return join_ends([first, _draw_line(first, second), second, _draw_line(second, first)])
    return _draw_corners(rng, kind, middle, radius)


def _draw_corners(rng: Random, kind: str, middle: Array, radius: float) -> Loop:
    """A shape that is given by points around its middle."""
    turn = rng.uniform(0, 2 * np.pi)
    count = int(rng.integers(3, 9))
    angle = turn + 2 * np.pi * (np.arange(count) + rng.uniform(0, 0.6, count)) / count
    reach = np.ones(count)
    if kind == "star":
        count *= 2
        angle = turn + 2 * np.pi * np.arange(count) / count
        reach = np.where(np.arange(count) % 2, rng.uniform(0.1, 0.8), 1.0)
    if kind in ("smooth", "drop"):
        angle = turn + 2 * np.pi * np.arange(8) / 8
        # Tangents of the cubic leave the polygon by less than a quarter of its size.
        reach = rng.uniform(0.4, 0.75, 8)
    points = middle + radius * reach[:, np.newaxis] * np.column_stack(
        [np.cos(angle), np.sin(angle)]
    )
    if kind == "smooth":
        return draw_smooth(points, int(rng.integers(1, 4)))
    if kind == "drop":
        # The first corner is a kink: the curve begins and ends there with other tangents.
        (curve,) = draw_smooth(points, 1)
        net = curve.points.copy()
        net[1] = net[0] + (net[3] - net[0]) / 3
        net[-2] = net[-1] + (net[-4] - net[-1]) / 3
        return [Spline(3, curve.knots, net, curve.weights)]
    if kind == "rounded":
        return _round_corners(points, rng.uniform(0.05, 0.3))
    return draw_segments(points)


def _round_corners(points: Array, share: float) -> Loop:
    """A polygon whose corners are replaced by parabolas over a share of their sides."""
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    begins, ends = points + share * (before - points), points + share * (after - points)
    pieces = []
    for k in range(len(points)):
        arc = np.stack([begins[k], points[k], ends[k]])
        pieces.append(Spline(2, _repeat_knots(2, 1), arc, np.ones(3)))
        line = np.stack([ends[k], begins[(k + 1) % len(points)]])
        pieces.append(Spline(1, _repeat_knots(1, 1), line, np.ones(2)))
    return pieces


def _draw_line(first: Spline, second: Spline) -> Spline:
    points = np.stack([first.points[-1], second.points[0]])
    return Spline(1, _repeat_knots(1, 1), points, np.ones(2))


def join_ends(loop: Loop) -> Loop:
    """The loop with each spline ending exactly where the next begins."""
    joined = []
    for curve, following in zip(loop, [*loop[1:], loop[0]], strict=True):
        points = curve.points.copy()
        points[-1] = following.points[0]
        joined.append(Spline(curve.degree, curve.knots, points, curve.weights))
    return joined


def reverse_loop(loop: Loop) -> Loop:
    """The loop in the other direction."""
    return [
        Spline(
            curve.degree,
            (curve.knots[0] + curve.knots[-1]) - curve.knots[::-1],
            curve.points[::-1],
            curve.weights[::-1],
        )
        for curve in loop[::-1]
    ]


def draw_plate(
    rng: Random, *, holes: int, nearest: float, kinds: Sequence[str] = KINDS
) -> list[Loop]:
    """An outer loop around the square from 0 to `holes`, and `holes`² holes in its cells.

    A hole is 0.1 to `nearest` of a cell away from the walls of its cell.
    """
    loops = [draw_segments(np.array([[0.0, 0], [holes, 0], [holes, holes], [0, holes]]))]
    if rng.random() < 0.3:
        corners = np.array([[0.0, 0], [holes, 0], [holes, holes], [0, holes]])
        loops = [_round_corners(corners, 0.1 / holes)]
    for i in range(holes):
        for j in range(holes):
            gap = 10 ** rng.uniform(np.log10(nearest), -1)
            kind = str(rng.choice(kinds))
            middle = np.array([i + 0.5, j + 0.5])
            if len(loops[0]) > 4 and {i, j} <= {0, holes - 1}:
                gap = 0.2  # away from the rounded corners
            loops.append(reverse_loop(draw_shape(rng, kind, middle, 0.5 - gap)))
    return loops
