"""Polygons of loops made valid: sides in conflict are halved, corners that touch move by a unit.

What is still in conflict then belongs to loops that cross or touch, whatever the tolerance.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.cancellation import checkpoint
from service.engine.brep.borders.border import (
    Border,
    Polygons,
    build_border,
    renew_border,
    shift_corners,
)
from service.engine.brep.borders.crossings import Conflicts, find_conflicts, find_steps
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.borders.halving import halve_pieces
from service.engine.brep.borders.sampling import sample_evenly
from service.engine.brep.borders.slivers import measure_heights
from service.engine.brep.borders.windings import count_windings, find_reversed_loops
from service.engine.brep.prepared import PreparedBrep
from service.engine.vectors import Items

ROUNDS = 24
"""The most rounds of halving and moving. Halving a curve quarters its height over the chord, and
places have 30 bits."""

MOST_SIDES, GROWTH = 8192, 8
"""Halving ends beyond this number of sides, or beyond `GROWTH` times the sides at first: loops that
coincide over a length are in conflict at every side, however short."""

MOST_MOVES = 256
"""The most corners that are moved in one round, unless there are many sides: a corner takes longer
than a side, and loops that coincide touch everywhere."""

LEAST = 0.5
"""Sides with a parameter curve nearer than this, in units, are straight: halving does not help."""

CHECKED_PARTS = 8
"""Loops are checked on polygons of this number of sides for each span of a curve, at least."""


@dataclass(frozen=True, eq=False, slots=True)
class LoopFaults(Items):
    """Loops that make their faces invalid; a loop occurs once.

    Attributes
    ----------
    loops : ndarray of int, shape (k,)
        In ascending order.
    codes : ndarray of str, shape (k,)
        `loops_cross`, `loops_touch` or `loop_reversed`.
    others : ndarray of int, shape (k,)
        The loop that is crossed or touched, maybe the same one; −1 for `loop_reversed`.
    faces : ndarray of int, shape (k,)
    places : ndarray of int, shape (2, k)
        A place of the loop near the fault.
    """

    loops: Ints
    codes: np.ndarray[tuple[int], np.dtype[np.str_]]
    others: Ints
    faces: Ints
    places: Ints


def settle_border(
    prepared: PreparedBrep, samples: EdgeSamples, border: Border
) -> tuple[EdgeSamples, Border, LoopFaults]:
    """Halve curved sides in conflict, and move corners that touch, until no conflict is left.

    Sides that changed have unknown bounds.
    """
    conflicts = find_conflicts(border)
    most_sides = max(MOST_SIDES, GROWTH * len(border.faces))
    is_stuck = False
    for _ in range(ROUNDS):
        if not len(conflicts.sides) or len(border.faces) > most_sides:
            break
        checkpoint()
        is_moved = np.zeros(len(border.faces), bool)
        if not is_stuck:
            border, is_moved = _separate_corners(border, conflicts)
            # Many corners of which none can move are those of loops that coincide.
            is_stuck = len(conflicts.corners) >= MOST_MOVES and not is_moved.any()
        pieces = _choose_pieces(prepared, samples, border, conflicts, is_moved)
        samples, source = halve_pieces(prepared, samples, pieces)
        if (source < 0).any():
            border = renew_border(prepared, samples, border, source)
        elif not is_moved.any():
            break
        conflicts = find_conflicts(border)
    return samples, border, find_faults(border, conflicts)


def check_loops(prepared: PreparedBrep) -> LoopFaults:
    """Faults of all loops, whatever the tolerance of a mesh."""
    samples = sample_evenly(prepared, CHECKED_PARTS)
    return settle_border(prepared, samples, build_border(prepared, samples))[2]


def _separate_corners(border: Border, conflicts: Conflicts) -> tuple[Border, Bools]:
    """Move corners that touch by a unit, each once; which sides (M,) changed."""
    is_moved = np.zeros(len(border.faces), bool)
    if not len(conflicts.corners):
        return border, is_moved
    is_fixed = (border.shifts[border.rows] != 0).any(axis=1)
    corners = conflicts.corners[~is_fixed[conflicts.corners]]
    corners = corners[: max(MOST_MOVES, len(border.faces) // 16)]
    sides, steps = find_steps(border, corners, border.places[border.rows], is_fixed)
    if not len(sides):
        return border, is_moved
    is_moved[sides] = True
    return shift_corners(border, sides, steps), is_moved | is_moved[border.nexts]


def _choose_pieces(
    prepared: PreparedBrep,
    samples: EdgeSamples,
    border: Border,
    conflicts: Conflicts,
    is_moved: Bools,
) -> Ints:
    """Pieces to be halved: of curved sides whose conflicts are left after corners were moved."""
    sides = conflicts.sides
    sides = sides[~is_moved[sides] & ~is_moved[conflicts.others[sides]]]
    sides = sides[~samples.is_point[prepared.coedge_edges[border.coedges[sides]]]]
    heights = measure_heights(prepared, samples, border, sides)
    return border.samples[sides[heights > LEAST]]


def find_faults(polygons: Polygons, conflicts: Conflicts) -> LoopFaults:
    """The loops whose sides are in conflict, or that have the material on the wrong side."""
    if not len(conflicts.sides):
        return _find_reversed(polygons, np.arange(len(polygons.faces)))
    is_bad = np.zeros(int(polygons.faces.max()) + 1, bool)
    is_bad[polygons.faces[conflicts.sides]] = True
    is_bad = is_bad[polygons.faces]
    found = _find_meeting_loops(polygons, conflicts, is_bad)
    more = _find_reversed(polygons, (~is_bad).nonzero()[0])
    found = LoopFaults.join([found, more])
    return found.take(found.loops.argsort(kind="stable"))


def _find_meeting_loops(polygons: Polygons, conflicts: Conflicts, is_bad: Bools) -> LoopFaults:
    """The loops of bad faces, those of sides (M,), that cross or touch others."""
    sides = conflicts.sides
    crosses = np.zeros(int(polygons.loops.max()) + 1, bool)
    crosses[polygons.loops[conflicts.crosses]] = True
    # Loops that touch in a few places may cross there.
    is_tested = is_bad & ~crosses[polygons.loops] & (polygons.begins != polygons.ends).any(axis=1)
    tested = is_tested.nonzero()[0]
    crosses[polygons.loops[tested[count_windings(polygons, tested) != 1]]] = True
    first = sides[np.diff(polygons.loops[sides], prepend=-1) != 0]
    loops, others = polygons.loops[first], polygons.loops[conflicts.others[first]]
    codes = np.where(crosses[loops] | crosses[others], "loops_cross", "loops_touch")
    places = _find_meetings(polygons, first, conflicts.others[first])
    return LoopFaults(loops, codes, others, polygons.faces[first], places)


def _find_reversed(polygons: Polygons, sides: Ints) -> LoopFaults:
    """Loops with the material on the wrong side, of faces without conflicts that have `sides`."""
    wrong, is_whole = find_reversed_loops(take_faces(polygons, sides))
    wrong = sides[wrong]
    loops, places = polygons.loops[wrong], polygons.begins[wrong].T
    codes = np.where(is_whole, "loop_reversed", "loops_cross")
    others = np.where(is_whole, -1, loops)
    return LoopFaults(loops, codes, others, polygons.faces[wrong], places)


def _find_meetings(polygons: Polygons, sides: Ints, others: Ints) -> Ints:
    """Places (2, k) where sides meet others, approximately, for messages."""
    begins, run = (
        polygons.begins[sides].astype(float),
        polygons.ends[sides] - polygons.begins[sides],
    )
    other_run = polygons.ends[others] - polygons.begins[others]
    between = polygons.begins[others] - polygons.begins[sides]
    determinant = (run[:, 0] * other_run[:, 1] - run[:, 1] * other_run[:, 0]).astype(float)
    offset = (between[:, 0] * other_run[:, 1] - between[:, 1] * other_run[:, 0]).astype(float)
    share = np.clip(offset / np.where(determinant != 0, determinant, 1.0), 0.0, 1.0)
    places: Ints = np.rint(begins + share[:, np.newaxis] * run).astype(np.intp).T
    return places


def take_faces(polygons: Polygons, sides: Ints) -> Polygons:
    """The polygons of some faces: `sides` are all sides of these, in ascending order."""
    if len(sides) == len(polygons.faces):
        return polygons
    number = np.full(len(polygons.faces), -1)
    number[sides] = np.arange(len(sides))
    return Polygons(
        polygons.faces[sides],
        polygons.loops[sides],
        number[polygons.nexts[sides]],
        polygons.begins[sides],
        polygons.ends[sides],
        polygons.begin_vertices[sides],
        polygons.end_vertices[sides],
    )
