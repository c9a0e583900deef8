"""Crossings and touchings of the sides of polygons of places, found exactly, for all faces at once.

Two sides of one face are in conflict if they cross, if an end of one lies inside the other, or if
ends with different vertices of the mesh are at one place. Where no side is in conflict, a
constrained triangulation has every side as an edge, with the vertices of its own edge of the brep.

Proof in docs/proofs.md: "No crack between trimmed faces".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices, unique_values
from service.engine.brep.borders.border import Polygons
from service.engine.brep.borders.box_pairs import PAIRS, BoxTree
from service.engine.brep.borders.predicates import Segments, classify_pairs
from service.engine.trims.places import SIZE
from service.engine.vectors import normalize

STEPS = np.array([[1, 0], [0, 1], [-1, 0], [0, -1], [1, 1], [-1, 1], [-1, -1], [1, -1]])
"""The moves of a place to its neighbours."""


MOST_CONFLICTS = 1 << 15
"""A face with more conflicts in one list of pairs is invalid: the rest of its pairs is left out."""

REACH = 1.4
"""A corner may be moved to a place up to this number of units from the parameter curve, in both
directions; slack has room for it (`service.engine.trims.slack`)."""


@dataclass(frozen=True, eq=False, slots=True)
class Conflicts:
    """Which of M sides are in conflict with others; and where they only touch, the corners there.

    Attributes
    ----------
    crosses : ndarray of bool, shape (M,)
        Whether a side crosses another one at a point inside both.
    touches : ndarray of bool, shape (M,)
        Whether an end of one touches the other, or both its own ends are two vertices at one place.
    others : ndarray of int, shape (M,)
        A side with which each is in conflict, maybe itself; −1 for sides without a conflict.
    corners : ndarray of int, shape (t,)
        The sides that begin at a place that touches a side.
    """

    crosses: Bools
    touches: Bools
    others: Ints
    corners: Ints

    @property
    def sides(self) -> Ints:
        """The sides in conflict, in ascending order."""
        return (self.others >= 0).nonzero()[0]


def find_conflicts(polygons: Polygons) -> Conflicts:
    """All conflicts between sides of one face."""
    count, nexts = len(polygons.faces), polygons.nexts
    crosses, touches, is_corner = np.zeros((3, count), bool)
    others = np.full(count, -1)
    low = np.minimum(polygons.begins, polygons.ends)
    high = np.maximum(polygons.begins, polygons.ends)
    all_sides = _list_segments(polygons)
    is_hopeless = np.zeros(int(polygons.faces.max(initial=-1)) + 1, bool)
    for many in BoxTree.of(polygons.faces, low, high).list_own_pairs(is_hopeless):
        for run in row_slices(len(many[0]), 1, PAIRS):
            pairs = many[0][run], many[1][run]
            meetings = classify_pairs(all_sides.take(pairs[0]), all_sides.take(pairs[1]))
            rows = (meetings.crosses | meetings.touches.any(axis=0)).nonzero()[0]
            if not len(rows):
                continue
            first, second, found = pairs[0][rows], pairs[1][rows], meetings.take(rows)
            others[first], others[second] = second, first
            ends = np.array([first, nexts[first], second, nexts[second]])
            is_corner[ends[found.touches]] = True
            for sides in (first, second):
                crosses[sides[found.crosses]] = True
                touches[sides[~found.crosses]] = True
            counts = np.bincount(polygons.faces[first], minlength=len(is_hopeless))
            is_hopeless |= counts > MOST_CONFLICTS
    # Sides without a length between two vertices.
    short = (polygons.begins == polygons.ends).all(axis=1)
    short &= polygons.begin_vertices != polygons.end_vertices
    sides = short.nonzero()[0]
    touches[sides] = is_corner[sides] = is_corner[nexts[sides]] = True
    others[sides] = sides
    return Conflicts(crosses, touches, others, is_corner.nonzero()[0])


def find_steps(
    polygons: Polygons, corners: Ints, exact: FloatArray, is_fixed: Bools
) -> tuple[Ints, Ints]:
    """Moves of single corners by one unit, each of which ends all conflicts of the corner.

    Where several corners are at one place, only one of them moves. Moves of different corners may
    still be in conflict with each other.

    Parameters
    ----------
    corners : ndarray of int, shape (k,)
        Sides whose beginnings are in conflict.
    exact : ndarray of float64, shape (M, 2)
        The places at which sides begin, before they were rounded. Corners stay within `REACH`.
    is_fixed : ndarray of bool, shape (M,)
        Whether the beginning of each side must not move.

    Returns
    -------
    sides : ndarray of int, shape (m,)
        The sides whose beginnings move. All sides that begin at one place and vertex move together.
    steps : ndarray of int, shape (m, 2)
    """
    places = polygons.number_places()
    groups = unique_values(places << 32 | polygons.begin_vertices)[1]
    fixed = np.zeros(len(groups), bool)
    fixed[groups[is_fixed]] = True
    chosen = np.unique(groups[corners])
    chosen = chosen[~fixed[chosen]]
    number = np.full(len(groups), -1)
    number[chosen] = np.arange(len(chosen))
    begin_group = number[groups]
    fits = _try_steps(polygons, begin_group, len(chosen))
    moving = (begin_group >= 0).nonzero()[0]
    targets = polygons.begins[moving, np.newaxis] + STEPS
    outside = ((targets < 0) | (targets > SIZE)).any(axis=2)
    far = (np.abs(targets - exact[moving, np.newaxis]) > REACH).any(axis=2)
    np.logical_and.at(fits, begin_group[moving], ~(outside | far))
    preference = _find_left(polygons, begin_group, len(chosen)) @ STEPS.T
    best = np.where(fits, preference, -np.inf).argmax(axis=1)
    moves = np.logical_or.reduce(fits, axis=1)
    # One corner of each place.
    at = np.zeros(len(chosen), np.intp)
    at[begin_group[begin_group >= 0]] = places[begin_group >= 0]
    movable = moves.nonzero()[0]
    first = movable[np.unique(at[movable], return_index=True)[1]]
    moves[:] = False
    moves[first] = True
    sides = (begin_group >= 0).nonzero()[0]
    sides = sides[moves[begin_group[sides]]]
    return sides, STEPS[best[begin_group[sides]]]


def _try_steps(polygons: Polygons, begin_group: Ints, count: int) -> Bools:
    """Whether each of the moves of a group of corners ends all its conflicts: (count, 8).

    `begin_group` (M,) is the group of the beginning of each side, or −1.
    """
    end_group = begin_group[polygons.nexts]
    # The sides that move, once for each group; and all sides that are, or come, near.
    side = np.concatenate([(begin_group >= 0).nonzero()[0], (end_group >= 0).nonzero()[0]])
    group = np.concatenate([begin_group[begin_group >= 0], end_group[end_group >= 0]])
    low = np.minimum(polygons.begins, polygons.ends)
    high = np.maximum(polygons.begins, polygons.ends)
    tree = BoxTree.of(polygons.faces, low, high)
    pair, other = tree.find_pairs(polygons.faces[side], low[side] - 1, high[side] + 1)
    side, group = side[pair], group[pair]
    distinct = side != other
    side, group, other = side[distinct], group[distinct], other[distinct]
    sides = _list_segments(polygons)
    fits = np.ones((count, len(STEPS)), bool)
    for column, step in enumerate(STEPS):
        pairs = []
        for rows in (side, other):
            segments, move = sides.take(rows), step[:, np.newaxis]
            begins = segments.begins + move * (begin_group[rows] == group)
            ends = segments.ends + move * (end_group[rows] == group)
            vertices = segments.begin_vertices, segments.end_vertices
            pairs.append(Segments(begins, ends, *vertices))
        meetings = classify_pairs(pairs[0], pairs[1])
        fits[group[meetings.crosses | meetings.touches.any(axis=0)], column] = False
    return fits


def _find_left(polygons: Polygons, begin_group: Ints, count: int) -> FloatArray:
    """A direction (count, 2) from the corner of each group into the material."""
    along = normalize((polygons.ends - polygons.begins).astype(float), axis=-1)
    left = np.stack([-along[:, 1], along[:, 0]], axis=1)
    total = np.zeros((count, 2))
    for groups in (begin_group, begin_group[polygons.nexts]):
        rows = (groups >= 0).nonzero()[0]
        np.add.at(total, groups[rows], left[rows])
    return total


def _list_segments(polygons: Polygons) -> Segments:
    """All sides as segments."""
    return Segments(
        np.ascontiguousarray(polygons.begins.T),
        np.ascontiguousarray(polygons.ends.T),
        polygons.begin_vertices,
        polygons.end_vertices,
    )
