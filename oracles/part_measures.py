"""Areas, volumes and first moments of parts, by Green's theorem on loops and the rule of Gauss.

    ∬ g du dv = −∮ H du,   H(u, v) = ∫ g(u, s) ds, from the lowest v of the region,

and the same with u and v exchanged where only v is closed, so that seams, along which the outer
parameter does not change, need not be in the loops. Where a parameter curve is further from its
edge than the uncertainty of the document, the loop runs along the points of the surface that are
nearest to the edge.

The errors are those of the rule: all is computed with pieces and with halves of pieces.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from oracles.brep_documents import Array, Long, Spline
from oracles.brep_partials import evaluate_curve, evaluate_surface
from oracles.coedges import Coedge, iterate_coedges, read_edge
from oracles.feet import find_nearest_places
from oracles.parts import Document, Face, Part

NODES = 16
"""Nodes of the rule of Gauss in each piece."""

PIECES = 2
"""Pieces of a span, at first."""

SAMPLES = 30
"""Samples of a span of a curve; between two of them it crosses a knot line of the surface once."""

BISECTIONS = 30
"""Halvings of the step in which a curve crosses a knot line."""

GUESS = 1e-3
"""Flatness of traced parameter curves, from which the nearest points are searched."""

AT_A_TIME = 40_000
"""Points of a surface that are evaluated together."""


class Measured(NamedTuple):
    """Area, volume and first moments (x, y, z) about an origin, (5,), and errors (5,).

    An open part has the volumes of the cones from the origin to its faces.
    """

    values: Array
    errors: Array


def measure_part(part: Part, origin: Array) -> Measured:
    """The measures of all faces of a part together."""
    coarse, fine = (
        sum(_measure_face(face, origin, pieces) for face in part.faces)
        for pieces in (PIECES, 2 * PIECES)
    )
    return Measured(np.asarray(fine), np.abs(fine - coarse))


def _measure_face(face: Face, origin: Array, pieces: int) -> Array:
    """Measures (5,) of a face."""
    entry: Document = {} if face.document is None else face.document["faces"][face.number]
    outer = 1 if face.periods[1] > 0 and not face.periods[0] > 0 else 0
    # Outer loops run counter-clockwise: towards greater v where u is greatest.
    sign = -1.0 if outer == 0 else 1.0
    total, turns = np.zeros(5, np.longdouble), 0.0
    for nodes, weights in _list_nodes(face, entry, outer, pieces):
        total += sign * _integrate(face, (nodes, weights), outer, origin, pieces)
        turns += float(weights.sum())
    low, high = face.domain
    # A loop around the surface has its material up to the next one, or to the border.
    is_open_above = -sign * turns > 0.5 * (high - low)[outer]
    if is_open_above or total[0] < 0 or not entry.get("loops"):
        ends = np.stack([low, high])
        ends[:, 1 - outer] = high[1 - outer]
        knots = face.net.knots[outer]
        degree = face.net.degree[outer]
        inner = knots[degree : len(knots) - degree]
        places = ends[0] + ((inner - low[outer]) / np.ptp(face.domain[:, outer]))[:, np.newaxis] * (
            ends[1] - ends[0]
        )
        spline = Spline(
            1, np.concatenate([inner[:1], inner, inner[-1:]]), places, np.ones(len(inner))
        )
        nodes, rates, steps = _divide(face, spline, pieces)
        weights = rates[:, outer] * steps
        total += _integrate(face, (nodes, weights), outer, origin, pieces)
    flips = bool(entry.get("reversed")) + (np.linalg.det(face.matrix[:3, :3]) < 0)
    if flips % 2:
        total[1:] *= -1
    return total.astype(np.float64)


def _list_nodes(
    face: Face, entry: Document, outer: int, pieces: int
) -> Iterator[tuple[Array, Long]]:
    """Places (m, 2) along each coedge of a face, and their weights (m,) of the outer integral."""
    for loop in entry.get("loops") or []:
        assert face.document is not None
        coedges = list(iterate_coedges(face.document, entry, loop, face.net, GUESS))
        edges = loop.get("edges") or [None] * len(coedges)
        ends = []
        for coedge, edge in zip(coedges, edges, strict=True):
            if coedge.is_traced:
                places, rates, steps = _trace(face, coedge, read_edge(face.document, edge), pieces)
            else:
                places, rates, steps = _divide(face, coedge.curve, pieces)
            sign = -1.0 if coedge.is_reversed else 1.0
            yield face.move_inside(places), sign * rates[:, outer] * steps
            t = np.array(coedge.curve.domain)
            ends.append(coedge.curve.at(t[::-1] if coedge.is_reversed else t).astype(np.float64))
        for (_, end), (start, _) in zip(ends, [*ends[1:], ends[0]], strict=True):
            turns = np.abs(start - end) / np.where(face.periods > 0, face.periods, np.inf)
            if (end != start).any() and turns.max() < 0.5:
                spline = Spline(1, np.array([0.0, 0, 1, 1]), np.stack([end, start]), np.ones(2))
                places, rates, steps = _divide(face, spline, 1)
                yield face.move_inside(places), rates[:, outer] * steps


def _divide(face: Face, curve: Spline, pieces: int) -> tuple[Array, Long, Long]:
    """Nodes of a parameter curve: places (m, 2), derivatives (m, 2), and weights (m,)."""

    def evaluate(t: Array) -> Array:
        return curve.at(t).astype(np.float64)

    t, steps = _list_parameters(face, curve, evaluate, pieces)
    places, rates = evaluate_curve(curve, t)
    return places.astype(np.float64), rates, steps


def _list_parameters(
    face: Face, curve: Spline, evaluate: Callable[[Array], Array], pieces: int
) -> tuple[Array, Long]:
    """Nodes and weights between the knots of a curve, and where it crosses knots of the surface."""
    first, last = curve.domain
    knots = np.unique(curve.knots[(curve.knots >= first) & (curve.knots <= last)])
    share = np.linspace(0, 1, SAMPLES)[:-1]
    t = np.append((knots[:-1, np.newaxis] + np.diff(knots)[:, np.newaxis] * share).ravel(), last)
    places = evaluate(t)
    breaks = [knots]
    for axis in range(2):
        period = face.periods[axis]
        turns = (-1, 0, 1) if period > 0 else (0,)
        for knot in np.unique(face.net.knots[axis]):
            for turn in turns:
                value = knot + turn * period
                side = places[:, axis] < value
                row = np.flatnonzero(side[1:] != side[:-1])
                if not len(row):
                    continue
                low, high, is_below = t[row], t[row + 1], side[row]
                for _ in range(BISECTIONS):
                    middle = (low + high) / 2
                    is_first = (evaluate(middle)[:, axis] < value) == is_below
                    low, high = np.where(is_first, middle, low), np.where(is_first, high, middle)
                breaks.append(high)
    ends = np.unique(np.concatenate(breaks))
    # Crossings at knots of the curve are found up to rounding.
    kept = np.append(True, np.diff(ends) > 1e-12 * (last - first))
    kept[-1] = True
    return _place_nodes(ends[kept], pieces)


def _place_nodes(knots: Array, pieces: int) -> tuple[Array, Long]:
    """Nodes and weights of the rule of Gauss in pieces of all spans between knots."""
    x, w = np.polynomial.legendre.leggauss(NODES)
    share = np.linspace(0, 1, pieces + 1)[:-1]
    starts = (knots[:-1, np.newaxis] + np.diff(knots)[:, np.newaxis] * share).ravel()
    halves = np.repeat(np.diff(knots) / (2 * pieces), pieces)
    t = starts[:, np.newaxis] + halves[:, np.newaxis] * (1 + x)
    return t.ravel(), (halves[:, np.newaxis] * w).ravel().astype(np.longdouble)


def _trace(face: Face, coedge: Coedge, space: Spline, pieces: int) -> tuple[Array, Long, Long]:
    """Places (m, 2) of the surface nearest to an edge, their derivatives, and weights (m,)."""
    guess = coedge.curve

    def evaluate(t: Array) -> Array:
        return find_nearest_places(face.net, space.at(t), guess.at(t).astype(np.float64))

    t, steps = _list_parameters(face, space, evaluate, pieces)
    _, rates = evaluate_curve(space, t)
    places = evaluate(t)
    _, partials = evaluate_surface(face.net, places)
    # The foot moves as the part of the derivative along the surface says, up to the gap.
    gram = np.einsum("mki,mli->mkl", partials, partials)
    right = np.einsum("mki,mi->mk", partials, rates)
    determinant = gram[:, 0, 0] * gram[:, 1, 1] - gram[:, 0, 1] ** 2
    solution = np.stack(
        [
            gram[:, 1, 1] * right[:, 0] - gram[:, 0, 1] * right[:, 1],
            gram[:, 0, 0] * right[:, 1] - gram[:, 0, 1] * right[:, 0],
        ],
        axis=1,
    )
    return places, solution / determinant[:, np.newaxis], steps


def _integrate(
    face: Face, nodes: tuple[Array, Long], outer: int, origin: Array, pieces: int
) -> Long:
    """Σ weights · H (5,) at nodes: places (m, 2) and weights (m,). H are the inner integrals."""
    (places, weights), inner = nodes, 1 - outer
    low = face.box[0, inner]
    knots = face.net.knots[inner]
    breaks = np.unique(np.append(knots[(knots > low) & (knots < places[:, inner].max())], low))
    total = np.zeros(5, np.longdouble)
    for begin, end in zip(breaks, [*breaks[1:], np.inf], strict=True):
        rows = np.flatnonzero(places[:, inner] > begin)
        x, w = _place_nodes(np.array([0.0, 1.0]), pieces)
        for first in range(0, len(rows), max(1, AT_A_TIME // len(x))):
            some = rows[first : first + max(1, AT_A_TIME // len(x))]
            length = np.minimum(places[some, inner], end) - begin
            at = np.empty((len(some), len(x), 2))
            at[..., outer] = places[some, outer][:, np.newaxis]
            at[..., inner] = begin + length[:, np.newaxis] * x
            values = _list_integrands(face, at.reshape(-1, 2), origin).reshape(*at.shape[:2], 5)
            lines = np.einsum("mnk,n->mk", values, w) * length[:, np.newaxis]
            total += (weights[some, np.newaxis] * lines).sum(axis=0)
    return total


def _list_integrands(face: Face, places: Array, origin: Array) -> Long:
    """The integrands (m, 5): |N|, (S − o) · N / 3, (S − o)² N / 2, where N = S_u × S_v."""
    point, partials = evaluate_surface(face.net, places)
    turn = face.matrix[:3, :3].T.astype(np.longdouble)
    offset = point @ turn + face.matrix[:3, 3] - origin
    normal = np.cross(partials[:, 0] @ turn, partials[:, 1] @ turn)
    area = np.sqrt((normal * normal).sum(axis=1, keepdims=True))
    volume = (offset * normal).sum(axis=1, keepdims=True) / 3
    return np.concatenate([area, volume, offset**2 * normal / 2], axis=1)
