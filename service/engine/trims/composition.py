"""Curves of space from parameter curves: S(c(t)) as exact Bézier curves, span by span.

Let a patch have the degree (p, q) and a parameter curve c = (X, Y) / w the degree k. De Casteljau's
algorithm, with polynomials in place of parameters, gives S(c(t)) in homogeneous coordinates:

    P_ij ← (w − Y) P_ij + Y P_i,j+1   q times,   P_i ← (w − X) P_i + X P_i+1   p times

Every step is a product of polynomials in Bernstein form, whose factors are not negative where c is
inside of the patch. So it loses no digits. A coordinate that is constant adds no degree.

References
----------
DeRose, Goldman, Hagen and Mann, Functional composition algorithms via blossoming, ACM TOG 12
(1993); Farouki and Rajan, Algorithms for polynomials in Bernstein form, CAGD 5 (1988).
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import multiply
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.knot_cuts import SpanParts, cut_at_knots
from service.engine.trims.piecewise import join_spans
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines


def compose_curves(surfaces: ClosedSurfaces, face: Ints, pcurves: Splines) -> Splines:
    """The curves S(c(t)) of space, n in all, with the parameters of the parameter curves.

    Parameters
    ----------
    face : ndarray of int, shape (n,)
        The face of each parameter curve.
    pcurves : Splines
        n curves, in parameters of the surfaces.
    """
    parts = cut_at_knots(surfaces, face, pcurves, pcurves.list_spans())
    # Parts of no length, where a curve touches a knot line, are no spans.
    parts = parts.take(parts.high > parts.low)
    intervals = Intervals(parts.curve, parts.curve, parts.low, parts.high, parts.span)
    # A coordinate is constant only if it is so in all parts of a curve.
    begins = np.flatnonzero(np.diff(parts.curve, prepend=-1))
    constant = np.logical_and.reduceat(parts.is_constant, begins, axis=1)[:, parts.curve]
    patches = surfaces.surfaces.nets
    nets = []
    for rows, places in pcurves.restrict(intervals):
        code = (2 * constant[0, rows] + constant[1, rows]) * len(patches.groups)
        code += patches.group[parts.patch[rows]]
        for key in np.unique(code).tolist():
            kind, number = divmod(key, len(patches.groups))
            chosen = rows[code == key]
            group = patches.groups[number]
            patch = parts.patch[chosen]
            items = group.items[patches.row[patch]]
            middle = patches.middles[:, patch].T
            x, y, w = _localize(parts.take(chosen), places[code == key], kind)
            nets.append((chosen, _compose(items, (x, y, w), middle)))
    return join_spans(3, intervals, nets)


def _localize(
    parts: SpanParts, places: FloatArray, kind: int
) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Coordinates (m, k+1) of pieces of c in their patches, times the weights; and the weights.

    A constant coordinate of a polynomial curve has the degree 0: shape (m, 1).
    """
    weights = places[..., 2] if places.shape[-1] == 3 else None
    width = parts.knots[:, 1] - parts.knots[:, 0]
    local = []
    for axis in range(2):
        origin = parts.knots[axis, 0][:, np.newaxis]
        origin = origin if weights is None else origin * weights
        value = (places[..., axis] - origin) / width[axis][:, np.newaxis]
        is_constant = weights is None and kind & (2 >> axis)
        local.append(value[:, :1] if is_constant else value)
    return local[0], local[1], weights


def _compose(
    items: FloatArray,
    local: tuple[FloatArray, FloatArray, FloatArray | None],
    middle: FloatArray,
) -> FloatArray:
    """Nets (m, n+1, D) of the compositions of patches (m, D, p+1, q+1) and pieces of c."""
    x, y, weights = local
    if weights is not None and items.shape[1] == 3:
        items = np.concatenate([items, np.ones_like(items[:, :1])], axis=1)
    nets = items[..., np.newaxis]  # the last axis counts the coefficients of polynomials in t
    nets = _interpolate(nets.swapaxes(2, 3), y, weights)
    nets = _interpolate(nets[:, :, np.newaxis].swapaxes(2, 3), x, weights)[:, :, 0]
    nets = nets.swapaxes(1, 2)
    if nets.shape[2] == 4:
        return np.concatenate(
            [nets[..., :3] + middle[:, np.newaxis] * nets[..., 3:], nets[..., 3:]], 2
        )
    result: FloatArray = nets + middle[:, np.newaxis]
    return result


def _interpolate(nets: FloatArray, x: FloatArray, weights: FloatArray | None) -> FloatArray:
    """De Casteljau's algorithm along axis 2 of nets (m, D, n+1, r, coefficients)."""
    ones = np.ones_like(x) if weights is None else weights
    low, high = ((z[:, np.newaxis, np.newaxis, np.newaxis, np.newaxis]) for z in (ones - x, x))
    while nets.shape[2] > 1:
        first, second = nets[:, :, :-1, :, np.newaxis], nets[:, :, 1:, :, np.newaxis]
        nets = (multiply(first, low) + multiply(second, high))[..., 0, :]
    result: FloatArray = nets[:, :, 0]
    return result
