"""Curves and surfaces of a brep's JSON document, evaluated with 64 bits of mantissa.

The evaluation is the sum of B-splines times control points, where the B-splines come from the
recursion of Cox and de Boor (The NURBS Book, 2nd ed., equation 2.5). `numpy.longdouble` has 64 bits
of mantissa on x86.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Long: TypeAlias = NDArray[np.longdouble]
Index: TypeAlias = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Spline:
    """A curve: points (n, D), weights (n,), and all knots (n + degree + 1,), in float64."""

    degree: int
    knots: Array
    points: Array
    weights: Array

    @property
    def domain(self) -> tuple[float, float]:
        """The first and the last parameter."""
        return float(self.knots[self.degree]), float(self.knots[-self.degree - 1])

    def at(self, t: Array) -> Long:
        """Points (m, D) at the parameters t (m,)."""
        rows, basis = evaluate_basis(self.knots, self.degree, t)
        w = basis * self.weights[rows]
        points: Long = (w[..., np.newaxis] * self.points[rows]).sum(axis=1)
        points /= w.sum(axis=1, keepdims=True)
        return points


@dataclass(frozen=True, eq=False)
class Net:
    """A surface: points (n, m, 3), weights (n, m), and the knots and degrees along u and v."""

    degree: tuple[int, int]
    knots: tuple[Array, Array]
    points: Array
    weights: Array

    @property
    def domain(self) -> Array:
        """The rectangle of parameters: rows u and v, columns first and last."""
        ends = [(k[p], k[-p - 1]) for k, p in zip(self.knots, self.degree, strict=True)]
        return np.array(ends, dtype=np.float64)

    @property
    def diagonal(self) -> float:
        """The diagonal of the box of the control points."""
        return float(np.linalg.norm(np.ptp(self.points.reshape(-1, 3), axis=0)))

    def at(self, places: Array) -> Long:
        """Points (m, 3) at the parameters (m, 2)."""
        (rows, u), (columns, v) = (
            evaluate_basis(self.knots[k], self.degree[k], places[:, k]) for k in range(2)
        )
        at = rows[:, :, np.newaxis], columns[:, np.newaxis, :]
        w = u[:, :, np.newaxis] * v[:, np.newaxis, :] * self.weights[at]
        points: Long = (w[..., np.newaxis] * self.points[at]).sum(axis=(1, 2))
        points /= w.sum(axis=(1, 2))[:, np.newaxis]
        return points


def evaluate_basis(knots: Array, degree: int, t: Array) -> tuple[Index, Long]:
    """The B-splines that are not zero at the parameters t (m,), which are in the domain.

    Returns their numbers (m, degree + 1) and their values.
    """
    u, x = knots.astype(np.longdouble), np.asarray(t, dtype=np.longdouble)[:, np.newaxis]
    spans = np.arange(degree, len(u) - degree - 1)
    spans = spans[u[spans] < u[spans + 1]]
    span = spans[np.searchsorted(u[spans[1:]], x[:, 0], side="right")]
    values = np.ones((len(x), 1), dtype=np.longdouble)
    for p in range(1, degree + 1):
        # Of the p functions of degree p − 1, number k begins at knot span − p + 1 + k.
        begins = span[:, np.newaxis] + np.arange(1 - p, 1)
        share = (x - u[begins]) / (u[begins + p] - u[begins])
        higher = np.zeros((len(x), p + 1), dtype=np.longdouble)
        higher[:, 1:] += share * values
        higher[:, :-1] += (1 - share) * values
        values = higher
    return span[:, np.newaxis] + np.arange(-degree, 1), values


def read_curve(document: dict[str, Any]) -> Spline:
    """A `bezier` or `bspline` curve of a document, of two or three coordinates."""
    points = np.array(document["control_points"], dtype=np.float64)
    weights = np.array(document.get("weights") or np.ones(len(points)), dtype=np.float64)
    if document.get("type", "bezier") == "bezier":
        degree = len(points) - 1
        return Spline(degree, _write_clamped(len(points), degree), points, weights)
    degree = int(document["degree"])
    knots, take = _read_knots(document.get("knots", "clamped"), len(points), degree)
    return Spline(degree, knots, points[take], weights[take])


def read_line(start: Sequence[float], end: Sequence[float]) -> Spline:
    """The line between two points."""
    points = np.array([start, end], dtype=np.float64)
    return Spline(1, np.array([0.0, 0, 1, 1]), points, np.ones(2))


def read_surface(document: dict[str, Any]) -> Net:
    """A `bezier` or `bspline` surface of a document."""
    points = np.array(document["control_net"], dtype=np.float64)
    weights = np.array(document.get("weights") or np.ones(points.shape[:2]), dtype=np.float64)
    if document.get("type", "bezier") == "bezier":
        p, q = (n - 1 for n in points.shape[:2])
        knots = _write_clamped(p + 1, p), _write_clamped(q + 1, q)
        return Net((p, q), knots, points, weights)
    p, q = document["degree"]
    given = document.get("knots", "clamped")
    pair = [given, given] if isinstance(given, str) else given
    u, rows = _read_knots(pair[0], points.shape[0], p)
    v, columns = _read_knots(pair[1], points.shape[1], q)
    return Net((p, q), (u, v), points[rows][:, columns], weights[rows][:, columns])


def _write_clamped(count: int, degree: int) -> Array:
    inner = np.arange(count - degree + 1, dtype=np.float64)
    return np.concatenate([[0.0] * degree, inner, [float(count - degree)] * degree])


def _read_knots(given: Any, count: int, degree: int) -> tuple[Array, Index]:
    """All knots, and the numbers of the control points; a periodic spline repeats its first."""
    rows = np.arange(count)
    if isinstance(given, str):
        if given == "clamped":
            return _write_clamped(count, degree), rows
        if given == "periodic":
            rows = np.arange(count + degree) % count
        return np.arange(len(rows) + degree + 1, dtype=np.float64) - degree, rows
    knots = np.array(given, dtype=np.float64)
    if len(knots) == count + degree - 1:  # the first and the last, which have no effect
        knots = np.concatenate([knots[:1], knots, knots[-1:]])
    return knots, rows
