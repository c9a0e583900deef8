"""A surface or a curve and points in, their closest points with intervals of distances out."""

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
    """Closest points that may be looked for."""

    shape: SurfaceKind | Curve
    query: ProjectQuery
    cost: Cost

    def run(self) -> bytes:
        """The response as JSON.

        Raises
        ------
        InvalidRequest
            `not_parametric`, of tubes and ribbons.
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
        `not_parametric`, of tubes and ribbons.
    """
    try:
        lowered = surface.lower()
        model = to_patches(lowered)
    except InvalidRequest as error:
        raise error.within("/surface") from None
    if isinstance(lowered, GroupModel):
        model = replace(model, order=_listed_order(lowered))
    return model


def _listed_order(group: GroupModel) -> Ints:
    """Which of all patches that the members list, one after another, each of a group's is."""
    order, first = [], 0
    for member in group.members:
        own = group.models[member.model]
        assert isinstance(own, PatchModel)  # else it would not have become patches
        numbers = np.arange(own.patch_count) if own.order is None else own.order
        order.append(first + numbers)
        first += own.patch_count
    return np.concatenate(order)


def plan_project(
    shape: SurfaceKind | Curve, query: ProjectQuery, limits: Limits = DEFAULT_LIMITS
) -> ProjectWork:
    """Plan the closest points, which are checked against the limits by the shapes of the arrays.

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
        pieces = shape.lower()  # which was done when it was born
        patches, degree, own = pieces.count, (pieces.degree, 0), pieces.points.nbytes
    else:
        size = shape.stored_size()
        check_surface(size, limits)
        patches, degree, own = 3 * size.patches, size.degree, size.peak
    cost = project_cost(patches, degree, own, count, file, sign=query.sign)
    limits.check_memory(
        cost.memory, "The response", where, "a smaller surface, fewer points at once"
    )
    return ProjectWork(shape, query, cost)
