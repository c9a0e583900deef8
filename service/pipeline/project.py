"""Closest points of a surface or a curve, with intervals of distances."""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Ints
from service.encoders.text import FLOAT64_CHARS, json_document
from service.engine.models import to_patches
from service.engine.queries.project import ProjectQuery, project_on_curve, project_on_surface
from service.errors import InvalidRequest, Issue
from service.measuring import Measured
from service.pipeline.checks import check_surface
from service.pipeline.cost import Cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_count
from service.pipeline.query_costs import project_cost
from service.surface.curve import BezierCurve, BsplineCurve, Curve
from service.surface.lowered import GroupModel, PatchModel
from service.surface.sizes import SurfaceKind

MOST_POINTS = 100_000

COLUMNS = 16
"""The most numbers of a point in a response."""


@dataclass(frozen=True, eq=False, slots=True)
class ProjectWork:
    """The work of a query of closest points, within the limits, and its cost."""

    shape: SurfaceKind | Curve
    query: ProjectQuery
    cost: Cost

    def run(self) -> bytes:
        """The response as JSON.

        Raises
        ------
        InvalidRequest
            `not_parametric`: a tube or a ribbon has no patches.
        """
        if isinstance(self.shape, BezierCurve | BsplineCurve):
            with Measured("project"):
                return json_document(project_on_curve(self.shape.lower(), self.query))
        model = query_patches(self.shape)
        with Measured("project"):
            return json_document(project_on_surface(model, self.query))


def query_patches(surface: SurfaceKind) -> PatchModel:
    """All patches of a surface, in the numbering of the request.

    Raises
    ------
    InvalidRequest
        `not_parametric`: a tube or a ribbon has no patches.
    """
    try:
        lowered = surface.lower()
        model = to_patches(lowered)
    except InvalidRequest as error:
        raise error.within("/surface") from None
    if isinstance(lowered, GroupModel):
        model = replace(model, order=_list_order(lowered))
    return model


def _list_order(group: GroupModel) -> Ints:
    """The number of each patch of a group in the order of the request."""
    order, first = [], 0
    for member in group.members:
        model = group.models[member.model]
        assert isinstance(model, PatchModel)  # `to_patches` has refused tubes and ribbons
        numbers = np.arange(model.patch_count) if model.order is None else model.order
        order.append(first + numbers)
        first += model.patch_count
    return np.concatenate(order)


def plan_project(
    shape: SurfaceKind | Curve, query: ProjectQuery, limits: Limits = DEFAULT_LIMITS
) -> ProjectWork:
    """Plans a query of closest points; checks limits by the shapes of the arrays.

    Raises
    ------
    TooLarge
    """
    count, where = len(query.points), "/points"
    message = "The query has more points than this service computes at once."
    most = min(MOST_POINTS, limits.max_points)
    check_count(count, most, "points", Issue("too_many_points", message, where))
    file = 1000 + count * COLUMNS * (FLOAT64_CHARS + 2)
    limits.check_bytes(file, "The response could become too large.", where)
    if isinstance(shape, BezierCurve | BsplineCurve):
        pieces = shape.lower()  # cached since the curve was built
        patches, degree, memory = pieces.count, (pieces.degree, 0), pieces.points.nbytes
    else:
        size = shape.stored_size()
        check_surface(size, limits)
        patches, degree, memory = 3 * size.patches, size.degree, size.peak
    cost = project_cost(patches, degree, memory, count, file, sign=query.sign)
    limits.check_memory(
        cost.memory, "The response", where, "a smaller surface, fewer points at once"
    )
    return ProjectWork(shape, query, cost)
