"""Curves as pieces, each the segment between two points and the radius of a hull around it.

A curve is split at its knots by blossoms into Bézier curves (Farin, Curves and Surfaces for CAGD,
5th ed., chapters 5 and 10), which are halved until their control points are near their chords.
"""

import numpy as np

from oracles.brep_documents import Array, Spline

MAX_HALVINGS = 24
"""Most halvings of a parameter curve."""


def flatten(curve: Spline, low: Array, size: Array, flatness: float) -> Array:
    """Pieces (n, 5) of a curve in unit coordinates: start, end, and the radius of the hull."""
    nets = _list_bezier_nets(curve, low, size)
    for _ in range(MAX_HALVINGS):
        radii = _measure_radii(nets)
        is_bent = radii > flatness
        if not is_bent.any():
            break
        counts = np.where(is_bent, 2, 1)
        halves = np.repeat(nets, counts, axis=0)
        first = (np.cumsum(counts) - counts)[is_bent]
        halves[first], halves[first + 1] = _halve(nets[is_bent])
        nets = halves
    points = nets[:, [0, -1], :2] / nets[:, [0, -1], 2:]
    return np.column_stack([points[:, 0], points[:, 1], _measure_radii(nets)])


def _measure_radii(nets: Array) -> Array:
    """Largest distances (m,) of the control points from the segments between their ends."""
    points = nets[..., :2] / nets[..., 2:]
    start, along = points[:, :1], points[:, -1:] - points[:, :1]
    square = (along * along).sum(axis=2)
    offset = points - start
    t = np.clip((offset * along).sum(axis=2) / np.where(square > 0, square, 1), 0, 1)
    rest = offset - t[..., np.newaxis] * along
    radii: Array = np.sqrt((rest * rest).sum(axis=2)).max(axis=1)
    return radii


def _halve(nets: Array) -> tuple[Array, Array]:
    left, right, rows = [], [], nets
    while rows.shape[1]:
        left.append(rows[:, 0])
        right.append(rows[:, -1])
        rows = (rows[:, :-1] + rows[:, 1:]) / 2
    return np.stack(left, axis=1), np.stack(right[::-1], axis=1)


def _list_bezier_nets(curve: Spline, low: Array, size: Array) -> Array:
    """Homogeneous Bézier points (spans, p + 1, 3), in unit coordinates, by blossoms."""
    p, knots = curve.degree, curve.knots.astype(np.longdouble)
    unit = (curve.points.astype(np.longdouble) - low) / size
    w = curve.weights.astype(np.longdouble)[:, np.newaxis]
    points = np.concatenate([unit * w, w], axis=1)
    nets = []
    for s in range(p, len(points)):
        if not knots[s] < knots[s + 1]:
            continue
        net = []
        for i in range(p + 1):
            arguments = [knots[s]] * (p - i) + [knots[s + 1]] * i
            rows = points[s - p : s + 1].copy()
            for r in range(1, p + 1):
                lows, highs = knots[s - p + r : s + 1], knots[s + 1 : s + p + 2 - r]
                share = ((arguments[r - 1] - lows) / (highs - lows))[:, np.newaxis]
                rows = rows[:-1] + share * (rows[1:] - rows[:-1])
            net.append(rows[0])
        nets.append(np.stack(net))
    return np.stack(nets).astype(np.float64)
