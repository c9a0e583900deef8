"""Surfaces of revolution and loops around them, from which families of parts are made."""

from dataclasses import replace

import numpy as np

from oracles.brep_documents import Array, Spline
from tools.certify.part_curves import KINDS, Loop, Random, draw_arc, draw_shape, reverse_loop
from tools.certify.part_documents import Document, draw_line


def draw_tolerance(rng: Random, least: float) -> float:
    """A relative tolerance between `least` and 0.1; in one of ten cases up to 10 diagonals."""
    if rng.random() < 0.1:
        return float(10 ** rng.uniform(-1, 1))
    return float(10 ** rng.uniform(np.log10(least), -1))


QUARTERS = np.array([0.0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4])


def revolve(profile: Spline) -> Document:
    """The surface of a profile (n, 2) of radii and heights around z; u is 0 to 4, four quarters."""
    arc = draw_arc(np.zeros(2), np.ones(2), 0.0, 2 * np.pi)
    net = np.concatenate(
        [
            arc.points[:, np.newaxis] * profile.points[:, :1],
            np.tile(profile.points[:, 1:], (9, 1, 1)),
        ],
        axis=2,
    )
    return {
        "type": "bspline", "degree": [2, profile.degree],
        "knots": [QUARTERS.tolist(), profile.knots.tolist()], "control_net": net.tolist(),
        "weights": np.outer(arc.weights, profile.weights).tolist(),
    }  # fmt: skip


def draw_wave(rng: Random, low: float, high: float) -> Spline:
    """A parameter curve once around u, from 0 to 4, with v between two values."""
    count = int(rng.integers(3, 7))
    heights = rng.uniform(low, high, count)
    points = np.column_stack([np.linspace(0, 4, count + 1), np.append(heights, heights[0])])
    if rng.random() < 0.3:
        knots = np.concatenate([[0.0], np.linspace(0, 4, count + 1), [4.0]])
        return Spline(1, knots, points, np.ones(count + 1))
    curve = draw_line([0, low], [4, low])
    ends = np.concatenate([[0.0] * 4, np.linspace(0, 4, count - 1)[1:-1], [4.0] * 4])
    return (
        replace(curve, degree=3, knots=ends, points=points, weights=np.ones(count + 1))
        if count >= 4
        else replace(curve, points=np.array([[0, heights[0]], [4, heights[0]]]))
    )


def draw_windows(rng: Random, low: Array, high: Array, count: int) -> list[Loop]:
    """A row of `count` holes along u between two corners of parameters."""
    width, height = (high - low) / np.array([max(count, 1), 1])
    loops = []
    for k in range(count):
        gap = 10 ** rng.uniform(-5, -1)
        shape = draw_shape(rng, str(rng.choice(KINDS)), np.zeros(2), 0.5 - gap)
        middle = low + np.array([(k + 0.5) * width, 0.5 * height])
        scaled = [replace(c, points=middle + c.points * [width, height]) for c in shape]
        loops.append(reverse_loop(scaled))
    return loops
