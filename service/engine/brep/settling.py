"""Polygons of loops made valid: sides in conflict are halved, corners that touch move by a unit.

What is still in conflict then belongs to loops that cross or touch, whatever the tolerance.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.cancellation import checkpoint
from service.engine.brep.border import Border, Polygons, build_border, renew_border, shift_corners
from service.engine.brep.crossings import Conflicts, find_conflicts, find_steps
from service.engine.brep.edges import EdgeSamples
from service.engine.brep.prepared import PreparedBrep
from service.engine.brep.sampling import halve_pieces, sample_edges
from service.engine.brep.windings import find_reversed_loops
from service.engine.vectors import Items

ROUNDS = 24
"""The most rounds of halving and moving. Halving a curve quarters its height over the chord, and
places have 30 bits."""

LEAST = 4
"""Sides shorter than this number of units are not halved."""

CHECKED_SHARE = 1e-3
"""Loops are checked on polygons with this tolerance, as a share of the diagonal of the part."""


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
    """Halve the pieces of sides in conflict, and move corners that touch, until none is left.

    Sides that changed have unknown bounds.
    """
    conflicts = find_conflicts(border)
    for _ in range(ROUNDS):
        if not len(conflicts):
            break
        checkpoint()
        border, moved = _separate_corners(border, conflicts)
        sides = _choose_sides(border, conflicts, moved)
        edges = prepared.coedge_edges[border.coedges[sides]]
        sides = sides[~samples.is_point[edges]]
        samples, source = halve_pieces(prepared, samples, border.samples[sides])
        is_halved = (source < 0).any()
        if is_halved:
            border = renew_border(prepared, samples, border, source)
        if not is_halved and not moved.any():
            break
        conflicts = find_conflicts(border)
    return samples, border, _list_faults(border, conflicts)


def check_loops(prepared: PreparedBrep) -> LoopFaults:
    """Faults of all loops, whatever the tolerance of a mesh."""
    samples = sample_edges(prepared, CHECKED_SHARE * prepared.diagonal)
    return settle_border(prepared, samples, build_border(prepared, samples))[2]


def _separate_corners(border: Border, conflicts: Conflicts) -> tuple[Border, Bools]:
    """Move corners that touch by a unit, each once; which sides (M,) changed."""
    is_moved = np.zeros(len(border.faces), bool)
    if not len(conflicts.corners):
        return border, is_moved
    is_fixed = (border.shifts[border.rows] != 0).any(axis=1)
    sides, steps = find_steps(border, conflicts.corners, is_fixed)
    if not len(sides):
        return border, is_moved
    is_moved[sides] = True
    return shift_corners(border, sides, steps), is_moved | is_moved[border.nexts]


def _choose_sides(border: Border, conflicts: Conflicts, moved: Bools) -> Ints:
    """Sides to be halved: those in conflict that no move has changed, and that are long enough."""
    settled = moved[conflicts.first] | moved[conflicts.second]
    sides = np.concatenate([conflicts.first[~settled], conflicts.second[~settled]])
    lengths = np.abs(border.ends - border.begins).max(axis=1)
    chosen: Ints = np.unique(sides[lengths[sides] >= LEAST])
    return chosen


def _list_faults(polygons: Polygons, conflicts: Conflicts) -> LoopFaults:
    """The faults of loops whose sides are in conflict, or that are on the wrong side."""
    bad_faces = np.unique(polygons.faces[conflicts.first])
    sides = np.concatenate([conflicts.first, conflicts.second])
    others = np.concatenate([conflicts.second, conflicts.first])
    crosses = np.tile(conflicts.crosses, 2)
    # Crossings first; then one row for each loop.
    order = np.lexsort((sides, ~crosses, polygons.loops[sides]))
    order = order[np.diff(polygons.loops[sides[order]], prepend=-1) != 0]
    codes = np.where(crosses[order], "loops_cross", "loops_touch")
    found = _build_faults(polygons, sides[order], codes, polygons.loops[others[order]])
    rest = (~np.isin(polygons.faces, bad_faces)).nonzero()[0]
    if not len(rest):
        return found
    reversed_sides, whole = find_reversed_loops(take_faces(polygons, rest))
    codes = np.where(whole, "loop_reversed", "loops_cross")
    none = np.where(whole, -1, polygons.loops[rest[reversed_sides]])
    found = LoopFaults.join([found, _build_faults(polygons, rest[reversed_sides], codes, none)])
    return found.take(found.loops.argsort(kind="stable"))


def _build_faults(
    polygons: Polygons,
    sides: Ints,
    codes: np.ndarray[tuple[int], np.dtype[np.str_]],
    others: Ints,
) -> LoopFaults:
    """Faults at the beginnings of sides (k,)."""
    return LoopFaults(
        polygons.loops[sides], codes, others, polygons.faces[sides], polygons.begins[sides].T
    )


def take_faces(polygons: Polygons, sides: Ints) -> Polygons:
    """The polygons of some faces: `sides` are all sides of these, in ascending order."""
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
