"""On which side of its nearest loop a place is, if pieces of loops are too coarse to tell.

The region of a face is on the left of its loops. A place whose nearest point of all loops is not
at a corner is inside if it is on the left of the loop there. Coedges that do not meet are joined by
lines, which may run backwards: curves that are nearly as near as a join count as nearest, too.
Seams and poles are no borders: the region is on both sides of a seam. Parameter curves that were
traced are only near their edges; then the side is that of the edge in space, seen along the normal
of the surface.
"""

from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from oracles.brep_documents import Array, Long, Net, Spline, read_line
from oracles.brep_partials import evaluate_curve, evaluate_surface
from oracles.coedges import iterate_coedges, read_edge
from oracles.descent import Domain, descend
from oracles.regions import Bools

SAMPLES = 48
"""Samples of each span of a curve."""

TIE = 1e-6
"""Two curves are equally near if their distances differ by less than this share."""

FLATNESS = 1e-4
"""Flatness of traced curves, in units of the box of the loops."""

REACH = 10 * FLATNESS
"""Places are asked for that are nearer than this to a loop, in the same units."""

LEAST = 1e-14
"""Places that are nearer to a loop, in units of the box of the loops, have no side."""


@dataclass(frozen=True, eq=False)
class Side:
    """One coedge: its parameter curve in unit coordinates, and its edge if the curve was traced."""

    curve: Spline
    is_reversed: bool
    space: Spline | None

    @cached_property
    def samples(self) -> tuple[Array, cKDTree]:
        """Parameters (n,) of samples, and a tree of their points."""
        first, last = self.curve.domain
        knots = np.unique(
            self.curve.knots[(self.curve.knots >= first) & (self.curve.knots <= last)]
        )
        per_span = max(2, min(SAMPLES, 20_000 // len(knots)))
        share = np.arange(per_span) / per_span
        t = np.append((knots[:-1, np.newaxis] + np.diff(knots)[:, np.newaxis] * share), last)
        return t, cKDTree(self.curve.at(t).astype(np.float64))

    def measure(self, points: Array) -> tuple[Array, Array]:
        """Distances (m,) of points (m, 2) in unit coordinates, and parameters (m,) there."""
        t, tree = self.samples
        _, rows = tree.query(points, min(2, len(t)))
        rows = rows.reshape(len(points), -1)
        count = rows.shape[1]
        low, high = (np.array([x]) for x in self.curve.domain)
        domain = Domain(low, high, lambda t: np.clip(t, low, high))
        target = np.repeat(points, count, axis=0).astype(np.longdouble)
        found, places = descend(
            lambda t: self.curve.at(t[:, 0]), target, t[rows.ravel()][:, np.newaxis], domain
        )
        found, places = found.reshape(-1, count), places.reshape(-1, count)
        best, every = found.argmin(axis=1), np.arange(len(points))
        return found[every, best].astype(np.float64), places[every, best]


@dataclass(frozen=True, eq=False)
class LoopSides:
    """The coedges of a face; unit coordinates are (place − low) / size.

    `joined` is the length of the longest line that joins two coedges. `has_seams`: coedges run
    along all seams, in both directions.
    """

    net: Net
    sides: list[Side]
    joined: float
    has_seams: bool
    low: Array
    size: Array
    periods: Array

    def find_left(self, places: Array) -> tuple[Bools, Bools]:
        """Whether places (m, 2) are on the left of their nearest loop, and whether this is sure."""
        if not self.sides:
            return np.ones(len(places), bool), np.ones(len(places), bool)
        every = [
            self._measure(side, places, turns)
            for side in self.sides
            for turns in self._list_turns()
        ]
        distances, lefts = (np.array(each) for each in zip(*every, strict=True))
        least = distances.min(axis=0)
        is_near = distances <= least * (1 + TIE) + self.joined
        is_left = (lefts | ~is_near).all(axis=0)
        is_right = (~lefts | ~is_near).all(axis=0)
        is_sure = (is_left | is_right) & (least > LEAST)
        # The side of a traced curve is known only near it.
        if self.has_seams or any(side.space is not None for side in self.sides):
            is_far = least > REACH
            # Where no border is near, there is only a seam or a pole.
            is_left |= is_far & self.has_seams
            is_sure = np.where(is_far, self.has_seams, is_sure)
        return is_left, is_sure

    def _list_turns(self) -> list[Array]:
        u, v = ((-1, 0, 1) if period > 0 else (0,) for period in self.periods)
        return [np.array([a, b]) for a in u for b in v]

    def _measure(self, side: Side, places: Array, turns: Array) -> tuple[Array, Bools]:
        """Distances (m,) of places from a curve, and whether they are on the left of it."""
        moved = places + turns * self.periods
        points = (moved - self.low) / self.size
        distances, t = side.measure(points)
        if side.space is None:
            on_curve, along = evaluate_curve(side.curve, t)
            offset = points - on_curve
            turn = along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0]
        else:
            turn = self._look_along_normal(side, places, t)
        return distances, (turn > 0) != side.is_reversed

    def _look_along_normal(self, side: Side, places: Array, t: Array) -> Long:
        """Positive where places (m, 2) are on the left of an edge near its parameters t (m,)."""
        space = side.space
        assert space is not None
        points, partials = evaluate_surface(self.net, places)
        low, high = (np.array([x]) for x in space.domain)
        domain = Domain(low, high, lambda t: np.clip(t, low, high))
        _, feet = descend(lambda t: space.at(t[:, 0]), points, t[:, np.newaxis], domain)
        on_edge, along = evaluate_curve(space, feet[:, 0])
        normal = np.cross(partials[:, 0], partials[:, 1])
        result: Long = (np.cross(along, points - on_edge) * normal).sum(axis=1)
        return result


def build_sides(
    brep: dict[str, Any], number: int, net: Net, *, low: Array, size: Array, periods: Array
) -> LoopSides:
    """The coedges of a face, with the straight lines that join them where they do not meet."""
    entry = brep["faces"][number]
    sides, joined = [], 0.0
    uses = Counter(edge for loop in entry["loops"] for edge in loop.get("edges") or [])
    no_borders = {
        edge
        for edge, count in uses.items()
        if (count > 1 and (periods > 0).any()) or brep["edges"][edge].get("degenerate")
    }
    for loop in entry["loops"]:
        coedges = list(iterate_coedges(brep, entry, loop, net, FLATNESS))
        edges = loop.get("edges") or [None] * len(coedges)
        ends = []
        for coedge, edge in zip(coedges, edges, strict=True):
            space = read_edge(brep, edge) if coedge.is_traced else None
            curve = _move(coedge.curve, low, size)
            if edge not in no_borders:
                sides.append(Side(curve, coedge.is_reversed, space))
            points = curve.at(np.array(curve.domain)).astype(np.float64)
            ends.append(points[::-1] if coedge.is_reversed else points)
        for (_, end), (start, _) in zip(ends, [*ends[1:], ends[0]], strict=True):
            turns = np.abs(start - end) * size / np.where(periods > 0, periods, np.inf)
            if np.abs(end - start).max() > LEAST and turns.max() < 0.5:
                joined = max(joined, float(np.hypot(*(end - start))))
                sides.append(Side(read_line(end.tolist(), start.tolist()), False, None))
    return LoopSides(net, sides, joined, bool(no_borders), low, size, periods)


def _move(curve: Spline, low: Array, size: Array) -> Spline:
    return Spline(curve.degree, curve.knots, (curve.points - low) / size, curve.weights)
