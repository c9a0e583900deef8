"""Curves of space from parameter curves: S(c(t)) as Bézier curves, span by span.

Let a patch have the degree (p, q) and a parameter curve c = (X, Y) / w the degree k. De Casteljau's
algorithm, with polynomials in place of parameters, gives S(c(t)) in homogeneous coordinates:

    P_ij ← (w − Y) P_ij + Y P_i,j+1   q times,   P_i ← (w − X) P_i + X P_i+1   p times

Every step is a product of polynomials in Bernstein form, whose factors are not negative where c is
inside of the patch. So it loses no digits. A coordinate that is constant adds no degree. On planes
the curve is the affine image of c. Curves of a high degree are interpolated instead, by pieces of
degree `DEGREE`.

References
----------
DeRose, Goldman, Hagen and Mann, Functional composition algorithms via blossoming, ACM TOG 12
(1993); Farouki and Rajan, Algorithms for polynomials in Bernstein form, CAGD 5 (1988).
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein, multiply
from service.bases.row_batches import find_begins
from service.cancellation import checkpoint
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.foot_pieces import DEGREE, list_checks, list_nodes, to_bezier
from service.engine.trims.knot_cuts import SpanParts, cut_at_knots
from service.engine.trims.piecewise import join_spans
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.vectors import length

MOST = 32
"""The highest degree of a composition, unless the caller says another."""

DEPTH = 12
"""No piece is divided that is shorter than 2^-DEPTH of its curve's domain."""


def compose_curves(
    surfaces: ClosedSurfaces, face: Ints, pcurves: Splines, goal: float, most: int = MOST
) -> Splines:
    """The curves S(c(t)) of space, n in all, with the parameters of the parameter curves.

    Parameters
    ----------
    face : ndarray of int, shape (n,)
        The face of each parameter curve.
    pcurves : Splines
        n curves, in parameters of the surfaces.
    goal : float
        The greatest error of curves that are interpolated. Model units.
    most : int
        Curves of a higher degree are interpolated.
    """
    degrees = np.array([group.degree for group in surfaces.surfaces.nets.groups]).sum(axis=1)
    group = surfaces.surfaces.nets.group[surfaces.surfaces.faces.first[face]]
    is_planar = surfaces.surfaces.is_planar[face]
    is_high = (degrees[group] * pcurves.degree > most) & ~is_planar
    parts = []
    kinds = (is_planar, _map_to_planes), (is_high, None), (~is_planar & ~is_high, _compose_exactly)
    order = []
    for chosen, compose in kinds:
        rows = chosen.nonzero()[0]
        if not len(rows):
            continue
        own = pcurves.take(rows)
        if compose is None:
            parts.append(_interpolate_curves(surfaces, face[rows], own, goal))
        else:
            parts.append(compose(surfaces, face[rows], own))
        order.append(rows)
    which = np.empty(len(face), np.intp)
    which[np.concatenate(order)] = np.arange(len(face))
    return Splines.join(parts).take(which)


def _map_to_planes(surfaces: ClosedSurfaces, face: Ints, pcurves: Splines) -> Splines:
    """The curves of parameter curves on planes."""
    corner = surfaces.low[face]
    origin, su, sv = surfaces.evaluate_partials(face, corner)
    spans = pcurves.list_spans()
    nets = []
    for rows, net in pcurves.restrict(spans):
        owner = spans.curve[rows]
        weights = net[..., 2:] if net.shape[-1] == 3 else np.ones((*net.shape[:2], 1))
        local = net[..., :2] - weights * corner[owner][:, np.newaxis]
        points = weights * origin[owner][:, np.newaxis]
        points = points + local[..., :1] * su[owner][:, np.newaxis]
        points += local[..., 1:] * sv[owner][:, np.newaxis]
        nets.append((rows, np.concatenate([points, weights], 2) if net.shape[-1] == 3 else points))
    return join_spans(3, spans, nets)


def _interpolate_curves(
    surfaces: ClosedSurfaces, face: Ints, pcurves: Splines, goal: float
) -> Splines:
    """Curves through points S(c(t)): pieces are halved until they are nearer than `goal`."""
    parts = cut_at_knots(surfaces, face, pcurves, pcurves.list_spans())
    parts = parts.take(parts.high > parts.low)
    curve, low, high = parts.curve, parts.low, parts.high
    least = (pcurves.end - pcurves.start) * 2.0**-DEPTH
    done: list[tuple[Ints, FloatArray, FloatArray, FloatArray]] = []
    while len(curve):
        checkpoint()
        shares = np.concatenate([list_nodes(), list_checks()])
        t = low + (high - low) * shares[:, np.newaxis]
        owner = np.tile(curve, len(shares))
        points = surfaces.evaluate(face[owner], pcurves.evaluate(owner, t.ravel()))
        points = points.reshape(len(shares), -1, 3)
        nets = np.einsum("ij,jmk->imk", to_bezier(), points[: DEGREE + 1])
        between = np.einsum("ij,jmk->imk", bernstein(DEGREE, list_checks()), nets)
        error = length(between - points[DEGREE + 1 :], -1).max(axis=0)
        is_done = (error <= goal) | (high - low <= least[curve])
        done.append((curve[is_done], low[is_done], high[is_done], nets[:, is_done]))
        curve, low, high = curve[~is_done], low[~is_done], high[~is_done]
        middle = (low + high) / 2
        curve = np.concatenate([curve, curve])
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    curve, low, high = (np.concatenate([each[k] for each in done]) for k in range(3))
    points = np.concatenate([each[3] for each in done], axis=1)
    order = np.lexsort((low, curve))
    spans = Intervals(
        curve[order], curve[order], low[order], high[order], np.zeros(len(order), np.intp)
    )
    return join_spans(3, spans, [(np.arange(len(order)), points[:, order].swapaxes(0, 1))])


def _compose_exactly(surfaces: ClosedSurfaces, face: Ints, pcurves: Splines) -> Splines:
    """Compositions of low degree."""
    parts = cut_at_knots(surfaces, face, pcurves, pcurves.list_spans())
    # Parts of no length, where a curve touches a knot line, are no spans.
    parts = parts.take(parts.high > parts.low)
    intervals = Intervals(parts.curve, parts.curve, parts.low, parts.high, parts.span)
    # A coordinate is constant only if it is so in all parts of a curve.
    begins = find_begins(parts.curve)
    constant = np.logical_and.reduceat(parts.is_constant, begins, axis=1)[:, parts.curve]
    constant[0] &= ~constant[1]  # a point is a curve of a degree above 0, too
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
