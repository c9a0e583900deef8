"""How many triangles a mesh by tolerance has at most, before any is made.

Every triangle in a cell of a grid that is `enough` for ε is within ε of its part of the surface
(`service.engine.deviation.beforehand`). Estimates and certificates go by nets, which are further
away than the surface, but hardly twice as far: cells of the grid that is enough for ε/2 are not
cut. So no more cells come out of a patch than it has.

A cut adds at most two vertices to the inside of a face. A face with V_i vertices inside and V_b on
its border has 2 V_i + V_b − 2 triangles; so of n cells with b pieces around them come at most
2 n + b vertices and 4 n + b triangles. A tenth of that is the rule.
"""

from dataclasses import dataclass

import numpy as np

from service.engine.adaptive.accuracy import Accuracy
from service.engine.adaptive.aims import each_alone, goal_of, goals_of_models, without
from service.engine.adaptive.goal import Goal, View
from service.engine.deviation.beforehand import enough
from service.surface.lowered import GroupModel, PatchModel

PART = 0.5
"""Of the tolerance, what the grid is enough for."""

FEWEST = 4
"""Pieces of a side, even if it is short: a closed one has no fewer."""


@dataclass(frozen=True, slots=True)
class Most:
    """Upper bounds: vertices, triangles, and pieces of the borders of patches."""

    vertices: int
    triangles: int
    pieces: int

    def __add__(self, other: "Most") -> "Most":
        """The bounds of two meshes together."""
        return Most(
            self.vertices + other.vertices,
            self.triangles + other.triangles,
            self.pieces + other.pieces,
        )


def most_of(
    model: PatchModel | GroupModel, accuracy: Accuracy, moved: float = 0.0
) -> tuple[Most, Most]:
    """Bounds for what is stored once, and for all copies.

    Vertices that several patches have are counted once for each of them. What is cut for the sake
    of angles is not counted. Vertices are `moved` by so much at most when they are stored; what
    float32 does to them is less than counts here.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small` if placing takes most of the tolerance; without a pointer.
    """
    goal = goal_of(accuracy, model)
    if isinstance(model, PatchModel):
        alone = _most(model, without(goal, moved, model.bounds))
        return alone, alone
    group = model if goal.view is None else each_alone(model)
    goals = goals_of_models(goal, group, moved)
    found = [
        _most(own, aim)
        for own, aim in zip(group.models, goals, strict=True)
        if isinstance(own, PatchModel)
    ]
    nothing = Most(0, 0, 0)
    return sum(found, nothing), sum((found[m.model] for m in group.members), nothing)


def _most(model: PatchModel, goal: Goal) -> Most:
    """Bounds for a model that is no group."""
    nearest = np.array([0.0 if goal.view is None else _distance(model, goal.view)])
    tolerance = PART * float(goal.allowed(nearest)[0])
    grids = enough(model, max(tolerance, float(np.finfo(np.float64).tiny)))
    cells = int(grids.cells.sum())
    sides = (np.exp2(depth) for depth in (grids.depth_u, grids.depth_v))
    pieces = int(sum(2 * np.maximum(side, FEWEST).sum() for side in sides))
    return Most(2 * cells + pieces, 4 * cells + pieces, pieces)


def _distance(model: PatchModel, view: View) -> float:
    """Least distance from the eye to the box about the control points."""
    low, high = model.bounds
    outside = np.maximum(np.maximum(low - view.eye, view.eye - high), 0.0)
    return float(np.linalg.norm(outside))
