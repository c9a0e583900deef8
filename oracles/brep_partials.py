"""Partials of the curves and surfaces of a brep's document, with 64 bits of mantissa."""

from typing import Any

import numpy as np

from oracles.brep_documents import Array, Long, Net, Spline, evaluate_basis


def evaluate_curve(curve: Spline, t: Array) -> tuple[Long, Long]:
    """Points and derivatives (m, D) of a curve at t (m,)."""
    weights = curve.weights[:, np.newaxis].astype(np.longdouble)
    net = np.concatenate([curve.points * weights, weights], axis=1)
    values = []
    for order in range(2):
        knots, points, degree = curve.knots, net, curve.degree
        if order:
            knots, points, degree = _derive(knots, points, degree)
        rows, basis = evaluate_basis(knots, degree, t)
        values.append(np.einsum("mi,mij->mj", basis, points[rows]))
    point = values[0][:, :-1] / values[0][:, -1:]
    return point, (values[1][:, :-1] - values[1][:, -1:] * point) / values[0][:, -1:]


def _derive(knots: Array, points: Long, degree: int) -> tuple[Array, Long, int]:
    """The derivative of a spline with control points (n, …) (The NURBS Book, section 3.3)."""
    u = knots.astype(np.longdouble)
    length = u[degree + 1 : -1] - u[1 : -degree - 1]
    length = np.where(length > 0, length, 1.0).reshape(-1, *(1,) * (points.ndim - 1))
    return knots[1:-1], degree * np.diff(points, axis=0) / length, degree - 1


def evaluate_surface(net: Net, places: Array, *, is_long: bool = True) -> tuple[Long, Long]:
    """Points (m, 3) and partials (m, 2, 3) of a surface at places (m, 2).

    Without `is_long` sums have 53 bits of mantissa, which is five times faster.
    """
    weights = net.weights[..., np.newaxis].astype(np.longdouble)
    points = np.concatenate([net.points * weights, weights], axis=2)
    kind: Any = np.longdouble if is_long else np.float64
    bases = [
        [
            (rows, values.astype(kind))
            for rows, values in (
                evaluate_basis(knots, degree, at),
                evaluate_basis(knots[1:-1], degree - 1, at),
            )
        ]
        for knots, degree, at in zip(net.knots, net.degree, places.T, strict=True)
    ]
    values = []
    for i, j in ((0, 0), (1, 0), (0, 1)):
        grid = points
        if i:
            grid = _derive(net.knots[0], grid, net.degree[0])[1]
        if j:
            grid = _derive(net.knots[1], grid.transpose(1, 0, 2), net.degree[1])[1]
            grid = grid.transpose(1, 0, 2)
        (rows, u), (columns, v) = bases[0][i], bases[1][j]
        nets = grid.astype(kind)[rows[:, :, np.newaxis], columns[:, np.newaxis, :]]
        sums = (u[:, :, np.newaxis, np.newaxis] * nets).sum(axis=1)
        values.append((v[:, :, np.newaxis] * sums).sum(axis=1))
    w = values[0][:, 3:]
    point = values[0][:, :3] / w
    return point, np.stack([(each[:, :3] - each[:, 3:] * point) / w for each in values[1:]], axis=1)
