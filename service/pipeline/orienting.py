"""Surfaces after their patches were turned so that neighbours agree and volumes are positive."""

from typing import cast

import numpy as np

from service.bases.arrays import Ints
from service.engine.measures.orientation import BUDGET, find_turns
from service.engine.mesh.mesh import Orientation
from service.engine.numbering import Numbering
from service.measuring import Measured
from service.pipeline.cost import Cost
from service.pipeline.limits import Limits
from service.pipeline.query_costs import measure_cost, measure_effort
from service.surface.convert.operations import Orient
from service.surface.convert.table import apply
from service.surface.convert.units import turn_patches_of
from service.surface.kinds import Surface
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sizes import SurfaceKind, SurfaceSize


def plan_orientation(size: SurfaceSize, limits: Limits, where: str) -> Cost:
    """The cost of orienting a surface of this size; `where` is the pointer of a refusal.

    Raises
    ------
    TooLarge
        `too_costly`.
    """
    message = "The surface has more patches than this service orients at once."
    effort = size.patches * measure_effort(size.degree)
    limits.check_effort(effort, message, where, "fewer patches, or patches of a lower degree")
    return measure_cost(size, BUDGET, 0)


def orient(surface: SurfaceKind, weld_tolerance: float) -> tuple[SurfaceKind, Orientation]:
    """The surface with patches turned, and the numbers of these patches.

    Numbers are those that a request names as `patch` (`service.engine.numbering`); of a B-spline
    in a group its first.
    """
    with Measured("orient"):
        model = surface.lower()
        turns = find_turns(model, weld_tolerance)
        number = _number(model, turns.member, turns.number)
        chosen = turns.is_turned
        turned = turn_patches_of(surface, turns.member[chosen], turns.number[chosen], apply)
        return turned, Orientation(
            tuple(np.sort(number[chosen]).tolist()),
            tuple(np.sort(number[~turns.is_orientable]).tolist()),
        )


class Orienter:
    """Does the operation `Orient` in a conversion, and keeps the last report."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self.orientation: Orientation | None = None

    def orient(self, surface: Surface, operation: Orient) -> Surface:
        """The surface with patches turned; raises `TooLarge` if it has too many patches."""
        plan_orientation(surface.size(), self._limits, "")
        oriented, self.orientation = orient(surface, operation.weld_tolerance)
        return cast(Surface, oriented)


def _number(model: Model, member: Ints, own: Ints) -> Ints:
    """The numbers in a request of patches and surfaces with numbers of their own in members."""
    if not isinstance(model, GroupModel):
        return own
    starts = Numbering.of(model).starts
    first = np.zeros(len(own), np.intp)
    copies = {model.find_number(copy): copy for copy in range(len(model.members))}
    for place in np.unique(member).tolist():
        copy, rows = copies[place], np.flatnonzero(member == place)
        each = model.models[model.members[copy].model]
        first[rows] = own[rows]
        if isinstance(each, PatchModel) and each.domains:
            first[rows] = np.array([domain.first for domain in each.domains])[own[rows]]
        first[rows] += starts[copy]
    return first
