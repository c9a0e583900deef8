"""Proved bounds of the gaps between edges and their parameter curves on the surfaces.

Between two cuts, an edge E, a parameter curve c and a surface S are each one polynomial or rational
function, and so is E − S∘c = N / W. N is a polynomial of known degree n. It is evaluated at the
m + 1 nodes cos(πk/m), m = 2n, of the interval; between them |N| is at most √2 times larger, and W
is no less than its values show.

Proof in docs/proofs.md: "Polynomials between nodes", "Gaps of edges".

References
----------
Ehlich and Zeller, Schwankung von Polynomen zwischen Gitterpunkten, Mathematische Zeitschrift 86
(1964).
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import expand_runs, row_slices
from service.engine.nets.patch_nets import PatchNets
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.knot_cuts import SpanParts, cut_at_knots
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.engine.vectors import UNIT, length

FACTOR = 2.0
"""m / n: nodes for each degree."""

SAMPLES = 1 << 15
"""The most nodes that are evaluated at once."""


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
    nodes : float
        m / n > 1; with more nodes, bounds are closer.
    """
    spans = pcurves.list_spans()
    pieces = curves.cut(edge[spans.curve], spans.low, spans.high)
    origin = pieces.source
    intervals = Intervals(origin, spans.curve[origin], pieces.low, pieces.high, spans.span[origin])
    parts = cut_at_knots(surfaces, face, pcurves, intervals)
    degree, has_weights = _find_degrees(surfaces, curves, edge, pcurves, parts)
    count = (np.ceil(nodes * degree) + 1).astype(np.intp)
    bound, seen = np.zeros((2, len(parts.curve)))
    partials = bound_partials(surfaces.surfaces)
    ends = np.cumsum(count)
    first = 0
    while first < len(count):
        done = ends[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(ends, done + SAMPLES, side="right")))
        rows = slice(first, last)
        bound[rows], seen[rows] = _bound_parts(
            (surfaces.surfaces.nets, partials),
            (curves, edge, pcurves),
            parts.take(rows),
            pieces.span[parts.source[rows]],
            (degree[rows], count[rows], has_weights[rows]),
        )
        first = last
    bound += surfaces.surfaces.errors[face[parts.curve]]
    total = np.zeros((2, len(face)))
    begins = np.flatnonzero(np.diff(parts.curve, prepend=-1))
    if len(begins):
        total[:, parts.curve[begins]] = np.maximum.reduceat(np.stack([bound, seen]), begins, axis=1)
    return Gaps(total[0], total[1])


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


def _bound_parts(
    patches: tuple[PatchNets, FloatArray],
    splines: tuple[Splines, Ints, Splines],
    parts: SpanParts,
    edge_span: Ints,
    counts: tuple[Ints, Ints, Bools],
) -> tuple[FloatArray, FloatArray]:
    """Bounds of the gaps over parts, and the largest gaps at nodes."""
    curves, edge, pcurves = splines
    degree, count, has_weights = counts
    nets, partials = patches
    run, number = expand_runs(count)
    x = (1.0 - np.cos(pi * number / (count - 1)[run])) / 2
    t = parts.low[run] + (parts.high - parts.low)[run] * x
    curve, owner = parts.curve[run], edge[parts.curve[run]]
    place, place_weight = _evaluate_spans(pcurves, curve, parts.span[run], t)
    point, weight = _evaluate_spans(curves, owner, edge_span[run], t)
    width = parts.knots[:, 1] - parts.knots[:, 0]
    local = (place.T - parts.knots[:, 0][:, run]) / width[:, run]
    image, image_weight = _evaluate_patches(nets, parts.patch[run], local)
    gap = length(point - image, -1)
    begins = np.cumsum(count) - count
    seen = np.maximum.reduceat(gap, begins)
    factor = 1.0 / np.cos(pi * degree / (2.0 * (count - 1)))
    bound = factor * seen
    if has_weights.any():
        group = nets.group[parts.patch]
        total = np.array([sum(nets_.degree) for nets_ in nets.groups])[group]
        all_weights = weight * image_weight * place_weight ** total[run]
        least = np.minimum.reduceat(all_weights, begins)
        most = np.maximum.reduceat(all_weights, begins)
        lower = (least + most) / 2 - factor * (most - least) / 2
        rational = factor * np.maximum.reduceat(gap * all_weights, begins)
        # Where the weights vary too much for this, the patch, the edge and c are in their hulls.
        safe = np.where(lower > 0, lower, 1.0)
        rational = np.where(lower > 0, rational / safe, np.inf)
        bound = np.where(has_weights, rational, bound)
    # The rounding of points, and of the parameters at which the surface was evaluated; and the
    # surface beyond a knot, which is another patch.
    size = np.abs(point).max(axis=1) + np.abs(image).max(axis=1)
    rounding = 8.0 * (degree + 8.0) * UNIT * np.maximum.reduceat(size, begins)
    shift = np.maximum.reduceat(np.abs(place), begins, axis=0).T * 8.0 * UNIT * (degree + 8.0)
    beyond = 2.0 * parts.excess * partials[:, parts.around].max(axis=1)
    rounding += (shift * partials[:, parts.patch] + beyond).sum(axis=0)
    return bound + 2.0 * rounding, seen


def _evaluate_spans(
    splines: Splines, curve: Ints, span: Ints, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points (m, D) of given spans of curves, and their weights (m,)."""
    at = splines.first_break[curve] + span
    low = splines.breaks[at]
    x = (t - low) / (splines.breaks[at + 1] - low)
    column = splines.row[curve] + span
    points, weights = np.empty((len(curve), splines.dimension)), np.ones(len(curve))
    for nets, rows in splines.split(curve):
        basis = bernstein(nets.degree, x[rows]).T[:, np.newaxis]
        value = (nets.values.take(column[rows], axis=2) * basis).sum(axis=0)
        if nets.is_rational:
            weights[rows] = value[-1]
            value = value[:-1] / value[-1]
        points[rows] = value.T
    return points, weights


def _evaluate_patches(
    nets: PatchNets, patch: Ints, local: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points (m, 3) of patches, also a little beyond [0, 1]², and their weights (m,)."""
    points, weights = np.empty((len(patch), 3)), np.ones(len(patch))
    for group, indices in nets.split_by_group(patch):
        p, q = group.degree
        for chunk in row_slices(len(indices), group.values[..., 0].size, 1 << 17):
            rows = indices[chunk]
            value = group.values.take(nets.row[patch[rows]], axis=3)
            value = (value * bernstein(q, local[1, rows]).T[:, np.newaxis]).sum(axis=1)
            value = (value * bernstein(p, local[0, rows]).T[:, np.newaxis]).sum(axis=0)
            if group.is_rational:
                weights[rows] = value[3]
                value = value[:3] / value[3]
            points[rows] = (value + nets.middles[:, patch[rows]]).T
    return points, weights


def bound_partials(surfaces: FaceSurfaces) -> FloatArray:
    """Bounds (2, P) of |S_u| and |S_v| over each patch, for parameters of the surface.

    With homogeneous points (A, w) about the middle of a net and |P| ≤ R,
    S_u = (A_u − w_u S) / w is at most p (max |ΔA| + R max |Δw|) / min w.
    """
    nets, faces, breaks = surfaces.nets, surfaces.faces, surfaces.breaks
    bounds = np.empty((2, len(nets.row)))
    for group in nets.groups:
        values = group.values
        for axis in range(2):
            steps = np.diff(values, axis=axis)
            longest = length(steps[:, :, :3]).max(axis=(0, 1), initial=0.0)
            if group.is_rational:
                weights = values[:, :, 3]
                reach = (length(values[:, :, :3]) / weights).max(axis=(0, 1))
                longest += reach * np.abs(steps[:, :, 3]).max(axis=(0, 1), initial=0.0)
                longest /= weights.min(axis=(0, 1))
            bounds[axis, group.patches] = group.degree[axis] * longest
    # The widths of the spans of each patch.
    face, number = expand_runs(faces.spans.prod(axis=0))
    patch = faces.first[face] + number
    for axis, span in enumerate(np.divmod(number, faces.spans[1, face])):
        at = breaks.first[2 * face + axis] + span
        bounds[axis, patch] /= breaks.values[at + 1] - breaks.values[at]
    return bounds
