"""Nodes of the rule of Gauss along the loops of a face.

Pieces end at knots of curves, and where these cross knot lines of the surface.
"""

from collections.abc import Callable, Iterator

import numpy as np

from oracles.brep_documents import Array, Long, Spline
from oracles.brep_partials import evaluate_curve, evaluate_surface
from oracles.coedges import Coedge, iterate_coedges, read_edge
from oracles.feet import find_nearest_places
from oracles.parts import Document, Face

NODES = 16
"""Nodes of the rule of Gauss in each piece."""

SAMPLES = 30
"""Samples of a span of a curve; between two of them it crosses a knot line of the surface once."""

BISECTIONS = 30
"""Halvings of the step in which a curve crosses a knot line."""

GUESS = 1e-3
"""Flatness of traced parameter curves, from which the nearest points are searched."""


def list_nodes(
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
                places, rates, steps = divide_curve(face, coedge.curve, pieces)
            sign = -1.0 if coedge.is_reversed else 1.0
            yield face.move_inside(places), sign * rates[:, outer] * steps
            t = np.array(coedge.curve.domain)
            ends.append(coedge.curve.at(t[::-1] if coedge.is_reversed else t).astype(np.float64))
        for (_, end), (start, _) in zip(ends, [*ends[1:], ends[0]], strict=True):
            turns = np.abs(start - end) / np.where(face.periods > 0, face.periods, np.inf)
            if (end != start).any() and turns.max() < 0.5:
                spline = Spline(1, np.array([0.0, 0, 1, 1]), np.stack([end, start]), np.ones(2))
                places, rates, steps = divide_curve(face, spline, 1)
                yield face.move_inside(places), rates[:, outer] * steps


def divide_curve(face: Face, curve: Spline, pieces: int) -> tuple[Array, Long, Long]:
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
    return place_nodes(ends[kept], pieces)


def place_nodes(knots: Array, pieces: int) -> tuple[Array, Long]:
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
