"""Meshes of one tube or ribbon by tolerance.

The path is divided where it bends, and rings are divided evenly; then the distance of the mesh from
the round tube is bounded. If what only the mesh shows (twists, strips that are not flat) takes more
than is left of the tolerance, the path is divided again, more finely.

Proof in docs/proofs.md: "Round tubes".
"""

from dataclasses import dataclass, replace
from math import acos, ceil, inf, pi

import numpy as np

from service.bases.arrays import FloatArray
from service.cancellation import checkpoint
from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.adaptive.tolerances import LARGEST_TOLERANCE, move_goal
from service.engine.bounds.goal import Goal, build_tolerance_error
from service.engine.mesh.mesh import Mesh, find_largest_angle
from service.engine.options import MeshOptions
from service.engine.round_sweeps.bends import (
    MARGIN,
    bound_ribbon_lines,
    bound_ruled_lines,
    bound_tube_lines,
)
from service.engine.round_sweeps.certificate import (
    find_sagitta,
    measure_strips,
    measure_twists,
)
from service.engine.round_sweeps.crossings import divide_folds, find_crossings
from service.engine.round_sweeps.division import LARGEST_TURN, DivisionGoal, Leaves, divide_path
from service.engine.round_sweeps.frames_of_cells import (
    CellFrames,
    bound_row_count,
    build_frames,
    find_round_step,
)
from service.engine.round_sweeps.path_nets import (
    bound_lowering,
    find_lines,
    find_unit,
)
from service.engine.round_sweeps.ribbon_frames import choose_crossbars
from service.engine.round_sweeps.slants import find_slants, find_widths
from service.engine.scenes.scene import round_to_single
from service.engine.stored_positions import Storage, bound_origin_error
from service.engine.sweeps.profiles import arrange_ribbons, arrange_tubes
from service.engine.sweeps.rows import Rows, SweptGrids, join_rows
from service.engine.sweeps.sweep import EFFORT as LENGTH_EFFORT
from service.engine.sweeps.sweep import build_swept_mesh, evaluate_spread, find_slopes
from service.engine.vectors import UNIT, length
from service.errors import TooLarge
from service.surface.curve_model import Ribbon, SweepModel, Tube

SHARES = 0.9, 0.5
"""Shares of the tolerance that polygons of rings may take; that with fewer triangles is taken."""

ATTEMPTS, LESS, LEFT = 12, 0.6, 0.9
"""Most attempts to divide the path; the factor of its tolerance from each to the next; and the
share of what rings leave of the tolerance that its first division may take."""

DIAGONAL = 1.5
"""Normals turn along diagonals too: by √2 times the largest turn along and around, and a twist."""

MIN_SIDES, ROW_EFFORT = 3, 200.0
"""The fewest sides; and multiplications for one vertex: placing it, and comparing its strips."""


@dataclass(frozen=True, eq=False, slots=True)
class _Attempt:
    """One mesh as rows, with its bound, and the largest twist of rings for each length."""

    grids: SweptGrids
    bound: float
    twist_rate: float


@dataclass(frozen=True, eq=False, slots=True)
class _Rings:
    """The rows of rings or crossbars at m frames.

    Attributes
    ----------
    rows : Rows
        Those of frames begin at row `first`.
    radii : ndarray of float64, shape (m,)
        Radii of rings, or half the widths of crossbars.
    twists : ndarray of float64, shape (m−1,)
        How far each ring is turned against the next.
    sagitta : float
        How far polygons are from rings of radius 1.
    errors : ndarray of float64, shape (m,)
        Bounds of the errors of unit crossbars.
    """

    rows: Rows
    first: int
    radii: FloatArray
    twists: FloatArray
    sagitta: float
    errors: FloatArray


class SweepMesher:
    """Builds meshes of one tube or ribbon."""

    def __init__(self, model: SweepModel, options: MeshOptions, storage: Storage) -> None:
        self._options, self._storage = options, storage
        # Where control points repeat, only a profile that changes has more than one shape.
        is_constant = len(model.profile.spread) == 1
        pieces = model.pieces.drop_single() if is_constant else model.pieces
        self.model = model
        self._path = replace(model, pieces=pieces)
        self._lines, self._unit = find_lines(self._path), find_unit(self._path)

    def build_mesh(self, goal: Goal, most: int, effort: Effort | None = None) -> Mesh:
        """The mesh that meets a goal; see `service.engine.meshers.Mesher`.

        A view becomes the tolerance that it allows at the point of the box that is nearest to the
        eye.
        """
        model, storage = self.model, self._storage
        low, high = model.bounds
        origin = storage.choose_origin(low, high)
        nearest = np.array([goal.find_nearest_distance(low, high)])
        allowed = min(float(goal.find_allowed(nearest)[0]), LARGEST_TOLERANCE * model.diagonal)
        goal = replace(goal, tolerance=allowed, view=None)
        # The model is not placed here: this only subtracts the rounding of adding the origin.
        goal = move_goal(goal, None, (low, high), bound_origin_error(origin, low, high))
        storing = storage.bound_storage_rounding(origin, low, high)
        least = 4 * self._bound_rounding() + 2 * storing
        if goal.tolerance < least:
            raise build_tolerance_error(
                f"{goal.tolerance:.6g}", f"at least {least:.3g} for this surface in this format"
            )
        limits = MeshLimits(most, effort or Effort())
        attempt = self._search(goal.tolerance - storing, goal.angle, limits)
        return self._finish(attempt, goal, storing, origin)

    def _bound_rounding(self) -> float:
        """How far computed vertices are from their places on the rings of their frames."""
        pieces = self._path.pieces
        far = float(np.abs(pieces.points).max())
        units = 4 * pieces.degree + 32
        reach, degree = self._path.profile.reach, len(self._path.profile.spread)
        rounding = units * UNIT * far + (64 + 8 * degree * degree) * UNIT * reach
        return rounding + 2 * bound_lowering(pieces)

    def _search(self, tolerance: float, angle: float, limits: MeshLimits) -> _Attempt:
        """The rows of a mesh within the tolerance.

        Raises
        ------
        InvalidRequest
            `cusp`; or `tolerance_too_small` if no attempt meets the tolerance.
        """
        coarsest = self._divide(DivisionGoal(inf), MIN_SIDES, limits)
        slants = find_slants(build_frames(self._path, coarsest).paths)
        reach = float(self._path.profile.spread.max() * find_widths(slants).max())
        sides, goal = self._choose_plan(tolerance, angle, reach, limits)
        best, twist = inf, pi / (2 * sides)  # an eighth of a side takes a small share
        for _ in range(ATTEMPTS):
            attempt = self._attempt(goal, sides, limits)
            if attempt.bound <= tolerance:
                limits.count(len(attempt.grids.triangles))
                return attempt
            best, twist = min(best, attempt.bound), twist * LESS
            length = twist / attempt.twist_rate if attempt.twist_rate else inf
            goal = replace(goal, tolerance=goal.tolerance * LESS, length=min(length, goal.length))
        raise build_tolerance_error(f"{tolerance:.6g}", f"at least {best:.3g} for this surface")

    def _choose_plan(
        self, tolerance: float, angle: float, reach: float, limits: MeshLimits
    ) -> tuple[int, DivisionGoal]:
        """The sides of rings, and the goal of the path: those with the fewest triangles."""
        plans: list[tuple[int, int, DivisionGoal]] = []
        for number, share in enumerate(SHARES):
            sides, rest = 1, tolerance
            if isinstance(self._path.profile, Tube):
                sides = _count_sides(share * tolerance, reach, angle)
                rest = max(tolerance - reach * find_sagitta(sides), tolerance / 64)
            goal = DivisionGoal(LEFT * rest, min(angle / DIAGONAL, LARGEST_TURN))
            try:
                leaves = self._divide(goal, sides, limits)
            except TooLarge:
                if number == len(SHARES) - 1 and not plans:
                    raise
                continue  # the other share may need fewer
            step = find_round_step(goal.tolerance, reach, goal.turn)
            rows = bound_row_count(leaves, closed=self.model.closed, round_step=step)
            plans.append((rows * sides, sides, goal))
        return min(plans, key=lambda plan: plan[0])[1:]

    def _divide(self, goal: DivisionGoal, sides: int, limits: MeshLimits) -> Leaves:
        return divide_path(self._path, self._lines, goal, columns=sides, limits=limits)

    def _attempt(self, goal: DivisionGoal, sides: int, limits: MeshLimits) -> _Attempt:
        """One mesh as rows; whether it is within the tolerance, its bound says."""
        path = self._path
        leaves = self._divide(goal, sides, limits)
        step = find_round_step(goal.tolerance, path.profile.reach, goal.turn)
        frames = build_frames(path, leaves, round_step=step)
        count = frames.paths.points.shape[1]
        limits.count(2 * sides * int((~frames.paths.is_mitred[1:]).sum()) // 2)
        limits.spend(count * (ROW_EFFORT * sides + LENGTH_EFFORT * (path.pieces.degree + 1) ** 2))
        rings = self._arrange(frames, leaves, sides)
        grids = join_rows(rings.rows, "triangles")
        checkpoint()
        positions = grids.positions.reshape(rings.rows.positions.shape)
        moved = float(length(positions - rings.rows.positions, -1).max(initial=0.0))
        own, between = (
            slice(rings.first, rings.first + count),
            slice(rings.first, rings.first + count - 1),
        )
        folds, crossings = find_crossings(frames, positions[0, own])
        strips = measure_strips(positions[0, own], rings.rows.has_faces[between], folds)
        lines = self._bound_rings(frames, leaves, rings)
        bound = (float((lines + strips).max()) + moved + self._bound_rounding()) * MARGIN
        lengths = self._unit * leaves.bends.speed[frames.leaf]
        rates = rings.twists / np.where((frames.leaf >= 0) & (lengths > 0), lengths, inf)
        grids = divide_folds(grids, crossings, folds, positions[0].shape[1], rings.first)
        return _Attempt(grids, bound, float(rates.max(initial=0.0)))

    def _arrange(self, frames: CellFrames, leaves: Leaves, sides: int) -> _Rings:
        """The rows of rings, or of crossbars, at all frames."""
        profile, paths = self._path.profile, frames.paths
        spread = evaluate_spread(profile.spread, paths.parameters)
        if isinstance(profile, Ribbon):
            crossbars, errors = choose_crossbars(frames, leaves)
            rows = arrange_ribbons(paths, spread, crossbars[np.newaxis])
            return _Rings(rows, 0, spread / 2, np.zeros(len(frames.leaf)), 0.0, errors)
        slopes, caps = find_slopes(profile, paths), profile.caps
        rows = arrange_tubes(paths, spread, sides, slopes=slopes, caps=caps)
        # The rows of the cap at the begin are before those of the frames.
        first = 2 * (caps and not paths.closed and spread[0] > 0)
        no_errors = np.zeros(len(spread))
        sagitta = find_sagitta(sides)
        return _Rings(rows, first, spread, measure_twists(frames), sagitta, no_errors)

    def _bound_rings(self, frames: CellFrames, leaves: Leaves, rings: _Rings) -> FloatArray:
        """Bounds (m−1,) of the distance of the surface from the strips between rings."""
        leaf, slants, unit = frames.leaf, find_slants(frames.paths), self._unit
        on_leaf, radii = leaf >= 0, rings.radii
        bends, is_ruled = leaves.bends.take(leaf), leaves.is_ruled[leaf] & on_leaf
        crossbars = leaves.crossbars.take(leaf)
        # Beyond what was measured, rotation-minimising frames turn by this at most.
        twists = rings.twists + bends.turn * np.tan(bends.turn / 2) * on_leaf
        radius = np.maximum(radii[1:], radii[:-1])
        lines = radius * (frames.turn + twists) ** 2 / 8  # of corners
        curved = (
            bound_ribbon_lines(bends, crossbars)
            if isinstance(self._path.profile, Ribbon)
            else bound_tube_lines(bends, twists)
        )
        lines[on_leaf] = unit * curved[on_leaf]
        slides = radii[:, None] * slants / unit
        slide, change = length(slides, -1), length(np.diff(slides, axis=0), -1)
        slide = np.maximum(slide[1:], slide[:-1])
        ruled = unit * bound_ruled_lines(bends, twists, slide, change) + leaves.error[leaf]
        lines[is_ruled] = ruled[is_ruled]
        error = np.where(on_leaf, bends.error, leaves.bends.error.max())
        error = error + np.where(on_leaf, crossbars.error, leaves.crossbars.error.max())
        ends = radii * (find_widths(slants) * rings.sagitta + frames.tilt + rings.errors)
        total: FloatArray = lines + np.maximum(ends[1:], ends[:-1]) + 2 * radius * error
        return total

    def _finish(self, attempt: _Attempt, goal: Goal, storing: float, origin: FloatArray) -> Mesh:
        """The mesh of rows, in the numbers of the file, with its report."""
        model, options, storage = self.model, self._options, self._storage
        has_angle = goal.angle < pi
        with_normals = replace(options, normals=options.normals or has_angle)
        mesh = build_swept_mesh(
            model.name, attempt.grids, with_normals, up=model.up, polygon=model.polygon
        )
        angle = None
        if has_angle and mesh.normals is not None:
            angle = find_largest_angle(mesh.triangles, mesh.normals)
        if not options.normals:
            mesh = replace(mesh, normals=None)
        if storage.is_float32:
            mesh = round_to_single(mesh, origin, storage.step)
        origin_error = bound_origin_error(origin, *(np.array(b) for b in model.bounds))
        bound = (attempt.bound + storing) * MARGIN + origin_error
        report = replace(
            mesh.report,
            deviation_bound=bound,
            mesh_deviation_bound=bound if goal.two_sided else None,
            normal_angle=angle,
        )
        parts = tuple(replace(part, deviation_bound=bound) for part in mesh.parts)
        return replace(mesh, report=report, parts=parts, grids=())


def _count_sides(tolerance: float, reach: float, angle: float) -> int:
    """The sides of polygons of rings of this radius that are within the tolerance of the rings."""
    count = MIN_SIDES
    if tolerance < reach:
        count = max(count, ceil(pi / acos(max(1 - tolerance / reach, -1.0))))
    return max(count, ceil(2 * pi * DIAGONAL / angle)) if angle < pi else count
