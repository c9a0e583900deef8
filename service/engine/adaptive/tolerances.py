"""The goal of each model of a request, in the model's own units.

If a mesh is within ε of its model, and both are placed by x ↦ L x + t, then the placed mesh is
within S ε + δ of the placed surface. S is the largest scaling of L, and δ the rounding of placing.
So, for a tolerance ε of the group, the tolerance of a model is the least (ε − δ)/S of its copies.
"""

from dataclasses import replace
from math import inf, tan
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.accuracy import Accuracy
from service.engine.bounds.goal import Goal, View, build_tolerance_error
from service.engine.scenes.copies import (
    bound_placing_errors,
    find_distance,
    stack_placements,
)
from service.engine.scenes.placing import bound_placing_error, scalings
from service.surface.lowered import Chain, GroupModel, Model
from service.surface.placement import place_box

Box: TypeAlias = tuple[FloatArray, FloatArray]
"""Least and greatest coordinates, shape (3,) each."""

LARGEST_TOLERANCE = 4.0
"""Tolerance of requests without tolerance, in diagonals of the model: no point of the mesh is
further than this from any point of the model."""

NEAR = 1e-3
"""Least distance to the eye that counts, as a share of the model's diagonal: anything nearer fills
the whole picture, and at the eye itself the allowed deviation would be 0."""

LEAST_ROUNDINGS = 2.0
"""A tolerance must be at least this many times the rounding of placing and storing."""

LEAST_REST = 0.96
"""Edges are divided until they meet the full tolerance, if rounding leaves at least this share of
it."""

LEAST_ANGLE = 2.0**-24
"""Least angle of goals, in radians; normals that turn by less are equal in float32."""

LESS = 1 - 2.0**-40
"""Factor for a tolerance that is divided by a scaling, so that the product with the scaling is not
larger than before, in spite of rounding."""


def build_goal(accuracy: Accuracy, model: Model) -> Goal:
    """The goal of the mesh of a model or group, in its coordinates.

    Let φ be the camera's field of view, and n the height of the picture in pixels. At the distance
    d one pixel is 2 d tan(φ/2) / n high.
    """
    diagonal = model.diagonal
    tolerance = LARGEST_TOLERANCE * diagonal or inf
    if accuracy.tolerance is not None:
        tolerance = accuracy.tolerance
    if accuracy.relative_tolerance is not None:
        tolerance = accuracy.relative_tolerance * diagonal
    view = None
    if accuracy.camera is not None and accuracy.pixel_tolerance is not None:
        eye, camera = np.array(accuracy.camera.position), accuracy.camera
        pixel = 2 * tan(camera.field_of_view / 2) / camera.height
        near = max(NEAR * diagonal, camera.nearest)
        view = View(eye, accuracy.pixel_tolerance * pixel, near)
    angle = inf
    if accuracy.angle_tolerance is not None:
        angle = max(accuracy.angle_tolerance, LEAST_ANGLE)
    return Goal(tolerance, angle, accuracy.two_sided, view)


def build_model_goals(goal: Goal, group: GroupModel, error: float) -> tuple[Goal, ...]:
    """The goal of each model of a group: if the mesh meets it, all copies meet the group's goal.

    Parameters
    ----------
    goal : Goal
        In the coordinates of the group.
    group : GroupModel
        With a view, every copy must be a model of its own (`separate_copies`).
    error : float
        Bound of the rounding after copies are placed.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small` if rounding is most of the tolerance; without a pointer.
    """
    boxes = [model.bounds for model in group.models]
    if goal.view is not None:
        return tuple(
            move_goal(goal, member.matrix, boxes[member.model], error, member.chain)
            for member in group.members
        )
    placements = stack_placements(group.members)
    distances = [find_distance(*box) for box in boxes]
    roundings = bound_placing_errors(group.members, placements, distances) + error
    tolerances = np.where(roundings > 0, goal.tolerance - roundings, goal.tolerance)
    wrong = np.flatnonzero(goal.tolerance < LEAST_ROUNDINGS * roundings)
    if len(wrong):
        subtract_rounding(goal, roundings.item(wrong[0]), boxes[0])  # raises the error
    tolerances = tolerances / placements.most * LESS
    least = np.full(len(boxes), inf)
    np.minimum.at(least, [member.model for member in group.members], tolerances)
    return tuple(replace(goal, tolerance=tolerance) for tolerance in least.tolist())


def move_goal(
    goal: Goal, matrix: FloatArray | None, bounds: Box, error: float, chain: Chain | None = None
) -> Goal:
    """The goal of a model between these bounds: if the mesh meets it, the placed copy meets `goal`.

    `matrix` (4, 4) is the placement, None if there is none. `error` bounds the rounding that
    follows it. `chain` is `PlacedModel.chain`.

    Let s and S be the least and the largest scaling, and r the rate of the goal's view: it allows
    the deviation r d at the distance d from the eye. A point of the model at the distance d from
    the eye is, when placed, at least s d from the eye, where r s d is allowed. Placing makes a
    deviation at most S times as large. So the rate of the model's view is r s / S.
    """
    (least, most), rounding = scalings(matrix), bound_placing_error(matrix, *bounds, chain) + error
    goal = subtract_rounding(goal, rounding, place_box(bounds, matrix))
    view = goal.view
    if view is not None:
        eye = view.eye
        if matrix is not None:
            eye = np.linalg.solve(matrix[:3, :3], eye - matrix[:3, 3]).astype(np.float64)
        view = View(eye, view.rate * least / most * LESS, view.near / least)
    return replace(goal, tolerance=goal.tolerance / most * LESS, view=view)


def subtract_rounding(goal: Goal, rounding: float, bounds: Box) -> Goal:
    """The goal for points between these bounds, less `rounding`.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small` if rounding is most of the tolerance; without a pointer.
    """
    if not rounding:
        return goal
    tolerance, view = _subtract(goal.tolerance, rounding), goal.view
    if view is not None:
        nearest = view.rate * max(view.near, goal.find_nearest_distance(*bounds))
        view = replace(view, rate=view.rate * (_subtract(nearest, rounding) / nearest))
    return replace(goal, tolerance=tolerance, view=view)


def _subtract(tolerance: float, rounding: float) -> float:
    """The tolerance less `rounding`; an error if rounding is most of it."""
    if tolerance < LEAST_ROUNDINGS * rounding:
        needed = f"at least {LEAST_ROUNDINGS * rounding:.3g} for this surface in this format"
        raise build_tolerance_error(f"a distance of {tolerance:.6g}", needed)
    return tolerance - rounding


def tighten_for_border(goal: Goal, rounding: float, bounds: Box) -> Goal:
    """The goal by which edges are divided, if storing moves vertices by up to `rounding`.

    Edges are divided until they are within 0.95 tolerances of their chords. Rounding moves the
    chords, for which 0.05 tolerances remain. If rounding may be more than 0.04 tolerances
    (1 − `LEAST_REST` is 0.04), the tolerance for edges is reduced. Otherwise edges are divided
    until they meet the full goal, so that the division of an edge does not depend on the model that
    contains it.
    """
    less = subtract_rounding(goal, rounding, bounds)
    tight = less.tolerance < LEAST_REST * goal.tolerance
    if goal.view is not None and less.view is not None:
        tight |= less.view.rate < LEAST_REST * goal.view.rate
    return less if tight else goal


def limit_tolerance(goal: Goal, diagonal: float, least: float) -> Goal:
    """The goal with a tolerance of at most `LARGEST_TOLERANCE` diagonals, which changes no mesh.

    All edges are nearer to their chords than the limit, so they are divided in the same way. The
    limit is not below `least`, the least tolerance of the surface in its format.
    """
    limit = max(LARGEST_TOLERANCE * diagonal, least) if diagonal else inf
    return replace(goal, tolerance=min(goal.tolerance, limit))


def separate_copies(group: GroupModel) -> GroupModel:
    """The group with a separate model for every copy, because distances to the eye differ."""
    models = tuple(group.models[member.model] for member in group.members)
    members = tuple(replace(member, model=k) for k, member in enumerate(group.members))
    return replace(group, models=models, members=members)
