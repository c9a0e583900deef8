"""The borders of faces, divided into runs: a run is one edge of the outline.

The border of a face is a loop of sides of patches, its *steps*: along v = least in the direction of
u, then along u = greatest, v = greatest and u = least, so that the face is on the left. Steps that
follow each other along one side of a face are one run, unless a corner or another face ends
between them. Steps are equal if they have the same edge in the connectivity of the patches
(`service.engine.connectivity`).
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.bases.row_batches import expand_runs
from service.engine.connectivity.seams import Seams
from service.engine.outlines.faces import OutlineFaces
from service.surface.sides import BEGINS, ENDS

PATCH_SIDES = np.array([2, 1, 3, 0])
"""The side of a patch that lies on each side of a face, in the order of the loop."""

IS_AGAINST = np.array([False, False, True, True])
"""Whether the loop runs against the parameter that increases along the side."""


@dataclass(frozen=True, eq=False, slots=True)
class Runs:
    """The K runs of all faces, face after face, in the order of the loops.

    Attributes
    ----------
    face, side : ndarray of int, shape (K,)
        The face, and the side of it in the order of the loop.
    begin, end : ndarray of int, shape (K,)
        The first and last span of the run along the side, counted along the increasing parameter:
        it covers the spans [begin, end).
    is_pole : ndarray of bool, shape (K,)
        Whether the run is one point.
    corners : ndarray of int, shape (K, 2)
        The distinct corners at which the run begins and ends, along the loop.
    edge : ndarray of int, shape (K,)
        Runs with the same number are the same curve. Poles have numbers of their own.
    is_backward : ndarray of bool, shape (K,)
        Whether the loop runs against the curve that the runs of this number have in common.
    """

    face: Ints
    side: Ints
    begin: Ints
    end: Ints
    is_pole: Bools
    corners: Ints
    edge: Ints
    is_backward: Bools


@dataclass(frozen=True, eq=False, slots=True)
class _Steps:
    """N steps: their face, side, span along the side, edge, direction, pole, and end corners."""

    face: Ints
    side: Ints
    span: Ints
    edge: Ints
    backward: Bools
    is_pole: Bools
    corners: Ints
    is_first: Bools


def find_runs(faces: OutlineFaces, seams: Seams) -> Runs:
    """The runs of the borders of all faces."""
    steps = _list_steps(faces, seams)
    begins = _find_begins(steps)
    runs = _join(steps, begins)
    if runs is None:
        # Faces pass the same edges in different orders: each step is an edge of its own.
        runs = _join(steps, np.arange(len(steps.face)))
        assert runs is not None
    return runs


def _list_steps(faces: OutlineFaces, seams: Seams) -> _Steps:
    """All steps, face after face, in the order of the loops."""
    rows, columns = faces.rows, faces.columns
    counts = np.stack([rows, columns, rows, columns], axis=1).ravel()
    owner, position = expand_runs(counts)
    face, side = np.divmod(owner, 4)
    last = counts[owner] - 1
    span = np.where(IS_AGAINST[side], last - position, position)
    row = np.where(side % 2 == 0, span, np.where(side == 1, rows[face] - 1, 0))
    column = np.where(side % 2 == 1, span, np.where(side == 2, columns[face] - 1, 0))
    patch = faces.first[face] + row * columns[face] + column
    patch_side, is_against = PATCH_SIDES[side], IS_AGAINST[side]
    ends = np.stack([BEGINS[patch_side], ENDS[patch_side]], axis=1)
    ends[is_against] = ends[is_against, ::-1]
    return _Steps(
        face,
        side,
        span,
        seams.edge[patch, patch_side],
        seams.backward[patch, patch_side] ^ is_against,
        seams.collapsed[patch, patch_side],
        seams.corner[patch[:, np.newaxis], ends],
        position == 0,
    )


def _find_begins(steps: _Steps) -> Ints:
    """The first step of each run."""
    # For each edge, which sides of faces have it: the sum of a mixed number of each.
    mixed = (4 * steps.face + steps.side + 1).astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    mixed = (mixed ^ (mixed >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
    users = np.zeros(int(steps.edge.max()) + 1, np.uint64)
    np.add.at(users, steps.edge[~steps.is_pole], mixed[~steps.is_pole])
    users_of = users[steps.edge]
    is_other = users_of[1:] != users_of[:-1]
    # A pole and a line are never one run; a side that is one point is always one.
    is_change = steps.is_pole[1:] != steps.is_pole[:-1]
    are_poles = steps.is_pole[1:] & steps.is_pole[:-1]
    is_break = steps.is_first.copy()
    is_break[1:] |= (is_other & ~are_poles) | is_change
    is_end = np.zeros(int(steps.corners.max()) + 1, bool)
    is_end[steps.corners[is_break, 0]] = True
    is_begin = steps.is_first.copy()
    is_begin[1:] |= (is_end[steps.corners[1:, 0]] & ~are_poles) | is_change
    return np.flatnonzero(is_begin)


def _join(steps: _Steps, begins: Ints) -> Runs | None:
    """The runs that begin at these steps; None if runs have some edges in common, but not all."""
    ends = np.append(begins[1:], len(steps.face))
    lengths = ends - begins
    key = np.minimum.reduceat(steps.edge, begins)
    total = np.add.reduceat(steps.edge, begins)
    is_pole = steps.is_pole[begins]
    lines = np.flatnonzero(~is_pole)
    _, representative, number = np.unique(key[lines], return_index=True, return_inverse=True)
    first = lines[representative][number]
    if (lengths[lines] != lengths[first]).any() or (total[lines] != total[first]).any():
        return None
    edge = np.full(len(begins), -1)
    edge[lines] = number
    edge[is_pole] = len(representative) + np.arange(np.count_nonzero(is_pole))
    # The step that has the least number of an edge tells the direction.
    run_of = np.repeat(np.arange(len(begins)), lengths)
    least = np.flatnonzero(steps.edge == key[run_of])[::-1]
    least_step = np.empty(len(begins), np.intp)
    least_step[run_of[least]] = least
    one, other = steps.span[begins], steps.span[ends - 1]
    return Runs(
        steps.face[begins],
        steps.side[begins],
        np.minimum(one, other),
        np.maximum(one, other) + 1,
        is_pole,
        np.stack([steps.corners[begins, 0], steps.corners[ends - 1, 1]], axis=1),
        edge,
        steps.backward[least_step],
    )
