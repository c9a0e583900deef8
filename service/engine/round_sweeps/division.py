"""Divides the path of a sweep into cells whose lines are within a tolerance of their chords."""

from dataclasses import dataclass
from math import inf, pi

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.goal import build_tolerance_error
from service.engine.round_sweeps.bends import (
    NO_BOUND,
    Bends,
    Crossbars,
    bound_bends,
    bound_crossbars,
    bound_ribbon_lines,
    bound_tube_lines,
    estimate_ribbon_strips,
)
from service.engine.round_sweeps.path_nets import Lines, PathNets, build_path_nets, find_unit
from service.errors import InvalidRequest, Issue
from service.surface.curve_model import SweepModel, Tube

FINEST = 40
"""Pieces are halved at most this number of times. Where the direction still has no bound, the path
has a cusp."""

LARGEST_TURN = pi / 2
"""The largest turn of the path on one cell, in radians, whatever the tolerance."""

SMOOTHER = "curves that meet there, each with a sweep of its own; or a mesh by resolution"

CHUNK = 1 << 17
"""About the numbers in the nets of one block of cells."""


@dataclass(frozen=True, eq=False, slots=True)
class Leaves:
    """The cells into which a path is divided, in order along it.

    `piece` and `first`, shape (M,), say where each begins; `is_ruled` whether lines of the sweep
    are straight on it, except for `error`, also in units of the model.
    """

    piece: Ints
    first: FloatArray
    is_ruled: Bools
    error: FloatArray
    bends: Bends
    crossbars: Crossbars

    def take(self, index: Ints | Bools) -> "Leaves":
        """The cells with these numbers, or those that a mask marks."""
        return Leaves(
            self.piece[index],
            self.first[index],
            self.is_ruled[index],
            self.error[index],
            self.bends.take(index),
            self.crossbars.take(index),
        )


@dataclass(frozen=True, slots=True)
class DivisionGoal:
    """The requirements of the cells of a path.

    Attributes
    ----------
    tolerance : float
        Largest distance of the lines from their chords, model units.
    turn : float
        Largest turn of the path on a cell, radians.
    length : float
        Largest length of a cell, model units.
    """

    tolerance: float
    turn: float = inf
    length: float = inf


def divide_path(
    model: SweepModel,
    lines: Lines,
    goal: DivisionGoal,
    *,
    columns: int,
    limits: MeshLimits,
) -> Leaves:
    """The cells of a path, each as large as halving of pieces allows.

    Parameters
    ----------
    columns : int
        Quads of the mesh on each cell.

    Raises
    ------
    InvalidRequest
        `sharp_path`: inside a piece, the direction of the path, or of crossbars, has no bound; or
        `tolerance_too_small`.
    TooLarge
        `too_many_triangles`, `too_costly`.
    """
    pieces = model.pieces
    # Numbers in the nets of one piece, about.
    width = 32 * pieces.degree + len(model.profile.spread) ** 2 + 32
    parts: list[Leaves] = []
    count = 0
    for chosen in row_slices(pieces.count, width, CHUNK):
        open_cells, done = [build_path_nets(model, lines, chosen)], []
        while open_cells:
            cells = open_cells.pop()
            limits.spend(len(cells.piece) * width)
            leaves, is_done = _measure(model, lines, cells, goal)
            done.append(leaves.take(is_done))
            count += int(is_done.sum())
            # Where a tube is pointed, a quad is one triangle.
            limits.count(columns * (count + len(is_done) - int(is_done.sum())))
            cells = cells.take(~is_done)
            if not len(cells.piece):
                continue
            if cells.width.min() <= 2.0**-FINEST:
                _refuse(cells)
            cells = cells.halve()
            # In blocks, so that memory does not grow with the number of cells.
            rows = np.arange(len(cells.piece))
            blocks = row_slices(len(rows), width, CHUNK)
            open_cells += [cells.take(rows[block]) for block in blocks]
        leaves = _join(done)
        parts.append(leaves.take(np.lexsort([leaves.first, leaves.piece])))
    return _join(parts)


def _measure(
    model: SweepModel, lines: Lines, cells: PathNets, goal: DivisionGoal
) -> tuple[Leaves, Bools]:
    """The cells with their bounds, and whether each meets the goal."""
    unit, is_ruled = find_unit(model), lines.is_ruled[cells.piece]
    bends, crossbars = bound_bends(cells), bound_crossbars(cells)
    if isinstance(model.profile, Tube):
        bound = bound_tube_lines(bends)
    else:
        bound = bound_ribbon_lines(bends, crossbars) + estimate_ribbon_strips(bends, crossbars)
    largest_turn = min(goal.turn, LARGEST_TURN)
    is_done = (bends.turn <= largest_turn) & (crossbars.turn <= largest_turn)
    is_done &= unit * bends.speed <= goal.length
    is_done &= is_ruled | (unit * bound <= goal.tolerance)
    error = lines.error[cells.piece]
    return Leaves(cells.piece, cells.first, is_ruled, error, bends, crossbars), is_done


def _join(parts: list[Leaves]) -> Leaves:
    bends = Bends.join([part.bends for part in parts])
    crossbars = Crossbars.join([part.crossbars for part in parts])
    piece, first, is_ruled, error = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("piece", "first", "is_ruled", "error")
    )
    return Leaves(piece, first, is_ruled, error, bends, crossbars)


def _refuse(cells: PathNets) -> None:
    """Refuse a path that has a cusp inside a piece, or a tolerance that is too small."""
    has_direction = bound_bends(cells).turn < NO_BOUND
    has_crossbar = bound_crossbars(cells).turn < NO_BOUND
    for has_bound, message in (
        (has_direction, "Inside a Bézier piece, the curve has a cusp: its direction has no bound."),
        (has_crossbar, "Inside a Bézier piece, the curve runs in the direction that it faces."),
    ):
        if not has_bound.all():
            number = int(np.flatnonzero(~has_bound)[0])
            place = f"piece {cells.piece[number]} at t = {cells.first[number]:.6g}"
            raise InvalidRequest(Issue("sharp_path", message, "/tolerance", place, SMOOTHER))
    raise build_tolerance_error("a smaller tolerance", "a greater tolerance")
