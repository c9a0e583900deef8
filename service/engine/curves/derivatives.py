"""Derivatives, curvatures and torsions of a curve at its samples, as columns.

Of a rational curve, C − C(t) = X / w with X_i = w_i (P_i − C(t)). As X(t) = 0, the quotient rule is

    w C' = X',  w C'' = X'' − 2 w' C',  w C''' = X''' − 3 w' C'' − 3 w'' C'

and, because C'' − X'' / w is along C', the formulas of Frenet need X alone:

    κ = w |X' × X''| / |X'|³,  τ = w (X' × X'') · X''' / |X' × X''|²

Where C' vanishes, both are limits (`service.engine.curves.curvature_limits`).

References
----------
Piegl and Tiller, The NURBS Book, 2nd ed., section 4.3; do Carmo, Differential Geometry of Curves
and Surfaces, section 1.5.
"""

from math import perm
from typing import NamedTuple, TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.curves.curvature_limits import find_limits
from service.engine.curves.evaluation import CurveSamples, LocalPieces, evaluate_nets
from service.engine.vectors import cross, dot, length
from service.surface.curve_model import CurvePieces, to_space

MAX_ORDER = 3
"""The highest order of derivatives."""

Columns: TypeAlias = dict[str, FloatArray | Bools]


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def evaluate_derivatives(pieces: CurvePieces, samples: CurveSamples, order: int) -> Columns:
    """The columns up to an order of derivatives, from 0 to 3, with one row for each sample.

    Order 1 has `dt` (N, d), the derivative by the parameter of the curve, and `degenerate` (N,),
    whether it vanishes; 2 adds `dtt` and `curvature` (N,); 3 adds `dttt` and, of curves in space,
    `torsion` (N,). The curvature of a curve in the plane is signed: positive where the curve turns
    left. At a joint of two pieces the numbers are limits from the right.

    Curvature and torsion are NaN where they have no finite limit, and on pieces that are one point;
    the torsion also where the curve is straight. Values that float64 cannot store are infinite.
    """
    count, dimension = len(samples), pieces.dimension
    derivatives = np.empty((order, count, dimension))
    is_degenerate, curvature, torsion = np.empty(count, bool), np.empty(count), np.empty(count)
    local = LocalPieces(pieces)
    widths = np.diff(pieces.breaks)
    for rows in samples.chunks(4 * (pieces.degree + 1) * (dimension + 1)) if order else ():
        piece, t = samples.piece[rows], samples.t[rows]
        jets = _Jets.of(pieces, piece, t, order)
        for number, derivative in enumerate(jets.divide()):
            scaled = derivative[:, :dimension]
            for _ in range(number + 1):
                scaled = scaled / widths[piece, np.newaxis]
            derivatives[number, rows] = scaled
        steps, scale = jets.numerators * local.scale[piece, np.newaxis], local.scale[piece]
        speed, zero_limit = length(steps[0], -1), local.zero_limit[piece]
        is_degenerate[rows] = is_slow = speed <= pieces.degree * zero_limit
        if order == 1:
            continue
        along, bend = steps[0] / speed[:, np.newaxis], steps[1] / speed[:, np.newaxis]
        binormal = cross(along, bend, -1)
        turn, weight = length(binormal, -1), jets.weights[0]
        curvature[rows] = weight * (binormal[:, 2] if dimension == 2 else turn) / speed * scale
        is_limit = is_slow
        if order == 3:
            third = steps[2] / speed[:, np.newaxis]
            torsion[rows] = weight * dot(binormal, third, -1) / turn / turn / speed * scale
            # Rounding hides a second derivative that is (almost) along the first.
            noise = perm(pieces.degree, 2) * 2 + length(bend, -1) * pieces.degree
            is_limit = is_slow | (turn <= zero_limit * noise / speed)
        which = np.flatnonzero(is_limit)
        if len(which):
            limits = find_limits(local, piece[which], t[which])
            scale = scale[which]
            slow = is_slow[which]
            curvature[rows][which[slow]] = (limits[0] * scale)[slow]
            torsion[rows][which] = limits[1] * scale
    columns: Columns = {}
    for number in range(order):
        columns["d" + "t" * (number + 1)] = derivatives[number] + 0.0  # turns −0 into 0
        if number == 0:
            columns["degenerate"] = is_degenerate
        elif number == 1:
            columns["curvature"] = curvature + 0.0
        elif dimension == 3:
            columns["torsion"] = torsion + 0.0
    return columns


class _Jets(NamedTuple):
    """X', X'', X''' (order, m, 3), and w, w', w'' (order, m), by the local parameter."""

    numerators: FloatArray
    weights: FloatArray

    @classmethod
    def of(cls, pieces: CurvePieces, piece: Ints, t: FloatArray, order: int) -> "_Jets":
        """The derivatives at parameters t (m,) of pieces (m,); polynomial curves have w = 1."""
        net = points = to_space(pieces.points[piece])
        weights = np.zeros((order, len(t)))
        weights[0] = 1.0
        if pieces.weights is not None:
            weight_net = pieces.weights[piece]
            weight_net = weight_net / weight_net.max(axis=1, keepdims=True)
            centre = evaluate_nets(points, weight_net, bernstein(pieces.degree, t))
            net = weight_net[:, :, np.newaxis] * (points - centre[:, np.newaxis])
            for number in range(order):
                weights[number] = _differentiate(weight_net[..., np.newaxis], t, number)[:, 0]
        numerators = [_differentiate(net, t, number + 1) for number in range(order)]
        return cls(np.stack(numerators), weights)

    def divide(self) -> list[FloatArray]:
        """C', C'', C''' as far as the order goes, (m, 3) each."""
        weights = self.weights[..., np.newaxis]
        results: list[FloatArray] = []
        for number, numerator in enumerate(self.numerators):
            value = numerator
            if number == 1:
                value = numerator - 2 * weights[1] * results[0]
            elif number == 2:
                value = numerator - 3 * (weights[1] * results[1] + weights[2] * results[0])
            results.append(value / weights[0])
        return results


def _differentiate(net: FloatArray, t: FloatArray, order: int) -> FloatArray:
    """The derivative of nets (m, n+1, d) at parameters (m,): the differences, then their sum."""
    degree = net.shape[1] - 1
    if order > degree:
        return np.zeros((len(net), net.shape[2]))
    differences = np.diff(net, order, axis=1)
    basis = bernstein(degree - order, t)[:, :, np.newaxis]
    return perm(degree, order) * dot(basis, differences)
