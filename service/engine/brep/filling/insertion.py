"""Places for Delaunay insertion: one for each failing triangle, where cuts of edges do not help.

Candidates for a triangle are the cut of its furthest edge, its circumcentre in scaled places, and
its middle, in the order in which they are likely to help. A candidate may lie in a triangle near
by, but on no segment and not beyond one, by exact tests.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.borders.predicates import orient
from service.engine.brep.filling.corners import FaceCorners
from service.engine.brep.filling.splits import measure_edges
from service.engine.brep.filling.triangles import Mates, Triangles
from service.engine.trims.places import SIZE
from service.engine.vectors import NEXT

BENT = 0.25
"""An edge is cut if it deviates at least this share of the largest deviation of the triangle."""

STEPS = 3
"""A candidate is looked for in this many triangles, beginning with its own."""

TURNS = 6
"""How often the points that touch no better one are taken."""

NOWHERE = -1


def choose_places(
    corners: FaceCorners, triangles: Triangles, mates: Mates, rows: Ints
) -> tuple[Ints, Ints]:
    """Places to insert for failing triangles, the worst first.

    None is in a triangle that another one touches, so that all can be inserted at once.

    Returns
    -------
    faces : ndarray of int, shape (n,)
        In ascending order.
    places : ndarray of int, shape (n, 2)
    """
    rows = rows[np.argsort(-triangles.bounds[rows], kind="stable")]
    walk = _Walk(
        triangles.corners, corners.places, mates.beyond, corners.find_fixed(triangles.corners)
    )
    chosen = np.full((len(rows), 2), NOWHERE)
    # The triangles that a candidate lies in; two if it lies on an edge.
    touched = np.full((len(rows), 2), NOWHERE)
    for candidates in _list_candidates(corners, triangles, walk, rows):
        waiting = ((chosen[:, 0] < 0) & (candidates[:, 0] >= 0)).nonzero()[0]
        if len(waiting):
            found, inside, beside = walk.find(rows[waiting], candidates[waiting])
            at = waiting[found]
            chosen[at] = candidates[at]
            touched[at] = np.stack([inside[found], beside[found]], axis=1)
    has = (chosen[:, 0] >= 0).nonzero()[0]
    around = walk.beyond.take(touched[has, 0], axis=1).T
    touch = np.concatenate([rows[has, np.newaxis], touched[has], around], axis=1)
    taken = has[_choose_apart(touch, len(triangles))]
    faces = corners.faces[triangles.corners[0, rows[taken]]]
    order = np.argsort(faces, kind="stable")
    return faces[order], chosen[taken[order]]


def _list_candidates(
    corners: FaceCorners, triangles: Triangles, walk: "_Walk", rows: Ints
) -> tuple[Ints, Ints, Ints]:
    """First, second and last choice, (m, 2) each; −1 where there is none."""
    own, fixed = triangles.corners.take(rows, axis=1), walk.fixed.take(rows, axis=1)
    places, scales = corners.places[own], corners.scales[corners.faces[own[0]]]
    cuts, deviations = measure_edges(corners, own)
    stretch = np.stack([np.ones(len(rows)), scales], axis=1)
    lengths = np.sqrt(np.square((places[NEXT] - places) * stretch).sum(axis=2))
    column = np.arange(len(rows))
    free = np.where(fixed, -1.0, deviations)
    free_lengths = np.where(fixed, -1.0, lengths)
    most, longest = free.max(axis=0), free_lengths.argmax(axis=0)
    furthest = np.where(most > 0, free.argmax(axis=0), longest)
    none = np.all(fixed, axis=0, keepdims=True).T
    of_furthest = np.where(none, NOWHERE, cuts[furthest, column])
    of_longest = np.where(none, NOWHERE, cuts[longest, column])
    centres = _find_circumcentres(places, stretch)
    bent = (most >= BENT * deviations.max(axis=0))[:, np.newaxis] & ~none
    return (
        np.where(bent, of_furthest, centres),
        np.where(bent, centres, of_longest),
        places.sum(axis=0) // 3,
    )


def _find_circumcentres(places: Ints, stretch: FloatArray) -> Ints:
    """Circumcentres (m, 2) of triangles (3, m, 2) in scaled places; −1 if they are far away."""
    a, b, c = places * stretch
    b, c = b - a, c - a
    area = 2 * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
    area = np.where(area == 0, 1e-300, area)[:, np.newaxis]
    squares = np.square(b).sum(axis=1), np.square(c).sum(axis=1)
    u, v = c[:, 1] * squares[0] - b[:, 1] * squares[1], b[:, 0] * squares[1] - c[:, 0] * squares[0]
    centres = (a + np.stack([u, v], axis=1) / area) / stretch
    low, high = places.min(axis=0), places.max(axis=0)
    width = high - low
    near = (centres > low - width) & (centres < high + width) & (centres >= 0) & (centres <= SIZE)
    near = near.all(axis=1, keepdims=True)
    return np.where(near, np.rint(np.where(near, centres, 0)), NOWHERE).astype(np.intp)


class _Walk:
    """Looks for places in triangles (3, T), from triangle to triangle, but not across segments."""

    def __init__(self, triangles: Ints, places: Ints, beyond: Ints, fixed: Bools) -> None:
        self._triangles, self._places = triangles, places
        self.beyond, self.fixed = np.where(fixed, NOWHERE, beyond), fixed

    def find(self, start: Ints, places: Ints) -> tuple[Bools, Ints, Ints]:
        """Whether places (m, 2) are found, and the triangles (m,) they are in.

        The last result is the triangle beyond the edge on which the place lies; elsewhere the same
        triangle. Places at corners and on segments are not found.
        """
        inside, away, found = start.copy(), np.ones(len(start), bool), np.zeros(len(start), bool)
        for _ in range(STEPS):
            sides = self._measure_sides(inside, places)
            is_here = np.all(sides >= 0, axis=0) & away
            on_edge: Bools = sides == 0
            proper = (on_edge.sum(axis=0) < 2) & ~(on_edge & self.fixed[:, inside]).any(axis=0)
            found |= is_here & proper
            away &= ~is_here
            edge = sides.argmin(axis=0)
            step = self.beyond[edge, inside]
            away &= step >= 0
            inside = np.where(away, step, inside)
            if not away.any():
                break
        sides = self._measure_sides(inside, places)
        edge, is_on_edge = sides.argmin(axis=0), np.any(sides == 0, axis=0)
        return found, inside, np.where(is_on_edge, self.beyond[edge, inside], inside)

    def _measure_sides(self, triangles: Ints, places: Ints) -> Ints:
        """Twice the areas (3, m) of places with the edges of triangles: at least 0 inside."""
        corners = self._places[self._triangles.take(triangles, axis=1)]
        return orient(corners, corners[NEXT], places)


def _choose_apart(touch: Ints, count: int) -> Ints:
    """Rows of `touch` (m, k) that share no triangle with an earlier chosen one; −1 is shared."""
    chosen, live = [np.empty(0, np.intp)], np.arange(len(touch))
    taken = np.zeros(count + 1, bool)
    for _ in range(TURNS):
        if not len(live):
            break
        own = touch[live]
        best = np.full(count + 1, len(touch))
        np.minimum.at(best, own.ravel(), live.repeat(own.shape[1]))
        best[NOWHERE] = len(touch)
        wins = ((best[own] == live[:, np.newaxis]) | (own == NOWHERE)).all(axis=1)
        winners = live[wins]
        chosen.append(winners)
        taken[touch[winners].ravel()] = True
        taken[NOWHERE] = False
        live = live[~wins]
        live = live[~taken[touch[live]].any(axis=1)]
    return np.sort(np.concatenate(chosen))
