"""Proved bounds of the gaps between edges and their parameter curves on the surfaces.

Between two cuts, an edge E, a parameter curve c and a surface S are each one polynomial or rational
function, and so is E − S∘c = N / W. N is a polynomial of known degree n. It is evaluated at the
m + 1 nodes cos(πk/m) of the interval; between them |N| is at most 1 / cos(πn/2m) times larger, and
W is no less than its values show. Few nodes are enough where the gap is small anyway.

Proof in docs/proofs.md: "Polynomials between nodes", "Gaps of edges".

References
----------
Ehlich and Zeller, Schwankung von Polynomen zwischen Gitterpunkten, Mathematische Zeitschrift 86
(1964).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.nets.patch_nets import PatchNets
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.homogeneous import (
    bound_partials,
    bound_speeds,
    evaluate_patches,
    evaluate_spans,
    find_least_patch_weights,
    find_least_weights,
)
from service.engine.trims.knot_cuts import SpanParts, cut_at_knots
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.vectors import UNIT, length

FACTOR, COARSE = 2.0, 1.25
"""m / n, nodes for each degree; and how many are tried first: with them |N| may be 3.3 times larger
between nodes, and 1.5 times with the others."""

ENOUGH = 1e-8
"""Gaps below this share of the diagonal of a part need no close bound."""

SAMPLES = 1 << 15
"""The most nodes that are evaluated at once."""

MORE = 1.5
"""Parts that need up to this many times as many nodes are evaluated together."""

FEW = 1 << 12
"""Up to this number of nodes, all parts are evaluated together."""


LOOSE = 8.0
"""A part is halved where its bound may be more than this factor too large: weights vary there."""

LEAST = 2.0**-20
"""No part is halved that is shorter than this share of the domain."""


@dataclass(frozen=True, eq=False, slots=True)
class Gaps:
    """Bounds of the gaps of n parameter curves, and the largest gaps that were seen, (n,) each."""

    bound: FloatArray
    seen: FloatArray


def bound_gaps(
    surfaces: ClosedSurfaces,
    face: Ints,
    curves: Splines,
    edge: Ints,
    pcurves: Splines,
    *,
    enough: float = 0.0,
    nodes: float = FACTOR,
) -> Gaps:
    """Bounds of sup |E(t) − S(c(t))| for parameter curves c and edges E at equal parameters.

    Parameters
    ----------
    face : ndarray of int, shape (n,)
        The face of each parameter curve.
    curves : Splines
        Curves of space.
    edge : ndarray of int, shape (n,)
        The number in `curves` of each edge.
    pcurves : Splines
        n curves, in parameters of the surfaces, with the same ranges as the edges.
    enough : float
        Bounds below this need not be close. Model units.
    nodes : float
        m / n > 1; with more nodes, bounds are closer.
    """
    spans = pcurves.list_spans()
    pieces = curves.cut(edge[spans.curve], spans.low, spans.high)
    origin = pieces.source
    intervals = Intervals(origin, spans.curve[origin], pieces.low, pieces.high, spans.span[origin])
    parts = cut_at_knots(surfaces, face, pcurves, intervals)
    patches = surfaces.surfaces.nets, bound_partials(surfaces.surfaces)
    splines = curves, edge, pcurves
    least = LEAST * (pcurves.end - pcurves.start)
    total = np.zeros((2, len(face)))
    density = min(nodes, COARSE) if enough > 0.0 else nodes
    while len(parts.curve):
        edge_span = pieces.span[parts.source]
        degree, has_weights = _find_degrees(surfaces, curves, edge, pcurves, parts)
        count = (np.ceil(density * degree) + 1).astype(np.intp)
        bound, seen, growth = np.zeros((3, len(parts.curve)))
        for rows, size in _list_batches(count):
            checkpoint()
            bound[rows], seen[rows], growth[rows] = _bound_parts(
                patches,
                splines,
                parts.take(rows),
                edge_span[rows],
                (degree[rows], size, has_weights[rows]),
            )
        bound += surfaces.surfaces.errors[face[parts.curve]]
        if density < nodes:
            is_left = bound > enough
        else:
            is_left = (growth > LOOSE) & (parts.high - parts.low > least[parts.curve])
        bound[is_left] = 0.0
        for row, values in zip(total, (bound, seen), strict=True):
            np.maximum.at(row, parts.curve, values)
        if not is_left.any():
            break
        parts = parts.take(is_left)
        if density == nodes:
            parts = _halve(parts)
        density = nodes
    return Gaps(total[0], total[1])


def _halve(parts: SpanParts) -> SpanParts:
    """Both halves of parts."""
    middle = (parts.low + parts.high) / 2
    halves = [replace(parts, high=middle), replace(parts, low=middle)]
    return SpanParts.join(halves)


def _find_degrees(
    surfaces: ClosedSurfaces, curves: Splines, edge: Ints, pcurves: Splines, parts: SpanParts
) -> tuple[Ints, Bools]:
    """The degree n ≥ 1 of the numerator over each part, and whether any of its factors is rational.

    The composition has the degree p a + q b, with the degrees a and b of the coordinates of the
    parameter curve, or 0 where they are constant.
    """
    nets = surfaces.surfaces.nets
    group = nets.group[parts.patch]
    degrees = np.array([nets_.degree for nets_ in nets.groups]).reshape(-1, 2)[group].T
    is_rational = np.array([nets_.is_rational for nets_ in nets.groups])[group]
    is_rational |= pcurves.is_rational[parts.curve] | curves.is_rational[edge[parts.curve]]
    # The weights of a rational parameter curve are a factor even where a coordinate is constant.
    varies = ~parts.is_constant | pcurves.is_rational[parts.curve]
    composed = (degrees * varies).sum(axis=0) * pcurves.degree[parts.curve]
    own = curves.degree[edge[parts.curve]]
    degree = np.where(is_rational, composed + own, np.maximum(composed, own))
    return np.maximum(degree, 1), is_rational


def _list_batches(count: Ints) -> Iterator[tuple[Ints, int]]:
    """Parts in batches, each with the number of nodes for all of its parts: enough, not many more.

    `count` (m,) is the least number of nodes of each part.
    """
    if len(count) * int(count.max(initial=0)) <= FEW:
        yield np.arange(len(count)), int(count.max(initial=0))
        return
    order = np.argsort(count, kind="stable")
    sizes = count[order]
    first = 0
    while first < len(order):
        last = len(order)
        if (last - first) * sizes[-1] > FEW:
            last = int(np.searchsorted(sizes, MORE * sizes[first], side="right"))
        size = int(sizes[last - 1])
        last = min(last, first + max(1, SAMPLES // size))
        yield order[first:last], size
        first = last


def _bound_parts(
    patches: tuple[PatchNets, FloatArray],
    splines: tuple[Splines, Ints, Splines],
    parts: SpanParts,
    edge_span: Ints,
    counts: tuple[Ints, int, Bools],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds of the gaps over parts, the largest gaps at nodes, and by how much rounding grows."""
    curves, edge, pcurves = splines
    degree, count, has_weights = counts
    nets, partials = patches
    x = (1.0 - np.cos(pi * np.arange(count) / (count - 1))) / 2
    t = parts.low[:, np.newaxis] + (parts.high - parts.low)[:, np.newaxis] * x
    owner = edge[parts.curve]
    place, place_weight = evaluate_spans(pcurves, parts.curve, parts.span, t)
    point, weight = evaluate_spans(curves, owner, edge_span, t)
    begin = parts.knots[:, 0, :, np.newaxis]
    width = parts.knots[:, 1, :, np.newaxis] - begin
    places = np.ascontiguousarray(place.transpose(2, 0, 1))
    local = (places - begin) / width
    image, image_weight = evaluate_patches(nets, parts.patch, local)
    gap = length(point - image, -1)
    seen = gap.max(axis=1)
    factor = 1.0 / np.cos(pi * degree / (2.0 * (count - 1)))
    bound, growth = factor * seen, factor
    if has_weights.any():
        group = nets.group[parts.patch]
        total = np.array([sum(nets_.degree) for nets_ in nets.groups])[group]
        all_weights = weight * image_weight * place_weight ** total[:, np.newaxis]
        least, most = all_weights.min(axis=1), all_weights.max(axis=1)
        lower = (least + most) / 2 - factor * (most - least) / 2
        rational = factor * (gap * all_weights).max(axis=1)
        if (lower <= 0).any():  # the weights vary much: hulls of nets have lower bounds
            hull = find_least_patch_weights(nets, parts.patch)
            hull *= find_least_weights(pcurves, parts.curve, parts.span) ** total
            hull *= find_least_weights(curves, owner, edge_span)
            lower = np.maximum(lower, hull)
        bound = np.where(has_weights, rational / lower, bound)
        growth = np.where(has_weights, factor * most / lower, growth)
    # The rounding of points; of the parameters at which the surface was evaluated; of the nodes;
    # and the surface beyond a knot, which is another patch.
    flat = point.reshape(len(point), -1), image.reshape(len(image), -1)
    size = np.abs(flat[0]).max(axis=1) + np.abs(flat[1]).max(axis=1)
    unit = 8.0 * (degree + 8.0) * UNIT
    rounding = unit * size
    place_speed = bound_speeds(pcurves, parts.curve, parts.span)
    late = 8.0 * UNIT * np.maximum(np.abs(parts.low), np.abs(parts.high))
    shift = unit * np.abs(places).max(axis=2) + late * place_speed
    beyond = 2.0 * parts.excess * partials[:, parts.around].max(axis=1)
    rounding += (shift * partials[:, parts.patch] + beyond).sum(axis=0)
    rounding += late * length(bound_speeds(curves, owner, edge_span))
    return bound + growth * rounding, seen, growth
