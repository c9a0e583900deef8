"""Parameter curves of edges by nearest points, for faces whose own ones are missing or wrong.

The parameter curve is the polyline through the parameters of the points of the surface nearest to
points of the edge. Steps of Gauss and Newton find them, with differences for the partials. The
samples are made denser until the parameters of the middle of each piece are near its chord.
"""

import numpy as np

from oracles.brep_documents import Array, Long, Net, Spline

FIRST, MOST = 17, 4000
"""Samples of a curve at first, and at most."""

STEPS, DIFFERENCE = 12, 1e-7
"""Most steps for each point; difference of parameters for partials, as a share of the domain."""

ENOUGH = 1e-13
"""A step that moves no place by more than this share of the domain is the last."""


def trace_edge(net: Net, space: Spline, guess: Spline, flatness: float, size: Array) -> Spline:
    """The parameter curve of the edge `space`, a polyline whose parameters are those of the edge.

    `guess` is a curve of parameters near it. A middle of a piece is within `flatness` of its chord,
    where parameters are divided by `size` (2,).
    """
    first, last = space.domain
    inner = space.knots[(space.knots > first) & (space.knots < last)]
    ends = np.unique(np.concatenate([[first, last], inner]))
    steps = np.arange(FIRST - 1) / (FIRST - 1)
    t = np.append((ends[:-1, np.newaxis] + np.diff(ends)[:, np.newaxis] * steps).ravel(), last)
    places = _find_feet(net, space, guess, t)
    while len(t) < MOST:
        middle = (t[1:] + t[:-1]) / 2
        between = _find_feet(net, space, guess, middle)
        offset = (between - (places[1:] + places[:-1]) / 2) / size
        chord = (places[1:] - places[:-1]) / size
        length = np.maximum(np.hypot(*chord.T), 1e-300)
        height = np.abs(chord[:, 0] * offset[:, 1] - chord[:, 1] * offset[:, 0]) / length
        is_far = (height > flatness) | (np.hypot(*offset.T) > length)
        if not is_far.any():
            break
        rows = np.flatnonzero(is_far)
        t = np.insert(t, rows + 1, middle[rows])
        places = np.insert(places, rows + 1, between[rows], axis=0)
    knots = np.concatenate([t[:1], t, t[-1:]])
    return Spline(1, knots, places, np.ones(len(t)))


def _find_feet(net: Net, space: Spline, guess: Spline, t: Array) -> Array:
    """Parameters (m, 2) of the points of the surface nearest to the edge at t (m,)."""
    first, last = guess.domain
    share = (t - space.domain[0]) / (space.domain[1] - space.domain[0])
    places = guess.at(np.clip(first + share * (last - first), first, last)).astype(np.float64)
    return find_nearest_places(net, space.at(t), places)


def find_nearest_places(net: Net, points: Long, places: Array) -> Array:
    """Parameters (m, 2) of points of the surface nearest to points (m, 3), from first guesses."""
    low, high = net.domain.T
    step = DIFFERENCE * (high - low)
    places = np.clip(places, low, high)
    for _ in range(STEPS):
        offset = points - net.at(places)
        partials = []
        for axis in range(2):
            shift = step * (np.arange(2) == axis)
            ahead, behind = np.minimum(places + shift, high), np.maximum(places - shift, low)
            width = (ahead - behind)[:, axis, np.newaxis]
            partials.append((net.at(ahead) - net.at(behind)) / width)
        a, b = partials
        aa, ab, bb = ((x * y).sum(axis=1) for x, y in ((a, a), (a, b), (b, b)))
        pa, pb = ((offset * x).sum(axis=1) for x in (a, b))
        # A little more on the diagonal, so that places at a pole do not move along it.
        damping = 1e-18 * (net.diagonal / (high - low)) ** 2
        aa, bb = aa + damping[0], bb + damping[1]
        determinant = aa * bb - ab * ab
        du, dv = (pa * bb - pb * ab) / determinant, (pb * aa - pa * ab) / determinant
        move = np.stack([du, dv], axis=1).astype(np.float64)
        limit = 0.1 * (high - low)
        begin, places = places, np.clip(places + np.clip(move, -limit, limit), low, high)
        if (np.abs(places - begin) <= ENOUGH * (high - low)).all():
            break
    return places
