"""Closest points on a surface or a curve, with intervals that contain the distances, as JSON."""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Ints
from service.encoders.text import FLOAT64_CHARS, json_document
from service.engine.closest.project import ProjectQuery, project_on_curve, project_on_surface
from service.engine.models import to_patches
from service.errors import InvalidRequest, Issue
from service.measuring import Measured
from service.pipeline.checks import check_surface
from service.pipeline.cost import Cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_count
from service.pipeline.query_costs import project_cost
from service.surface.curve import BezierCurve, BsplineCurve, Curve
from service.surface.lowered import GroupModel, PatchModel
from service.surface.sizes import SurfaceKind

MAX_POINTS = 100_000
"""The most points of a query."""

POINT_NUMBERS = 16
"""The most numbers that a response has for each point."""


@dataclass(frozen=True, eq=False, slots=True)
class ProjectWork:
    """The work of a query for closest points, and its cost."""

    shape: SurfaceKind | Curve
    query: ProjectQuery
    cost: Cost

    def run(self) -> bytes:
        """Find the closest points, and write the response as JSON.

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
    """All patches of a surface as one model, which has the patch numbers of the request.

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
        model = replace(model, request_numbers=_list_request_numbers(lowered))
    return model


def _list_request_numbers(group: GroupModel) -> Ints:
    """For each patch of a group, its number in the request: shape (P,)."""
    request_numbers, first = [], 0
    for member in group.members:
        model = group.models[member.model]
        assert isinstance(model, PatchModel)  # `to_patches` refuses tubes and ribbons
        numbers = (
            np.arange(model.patch_count) if model.request_numbers is None else model.request_numbers
        )
        request_numbers.append(first + numbers)
        first += model.patch_count
    return np.concatenate(request_numbers)


def plan_project(
    shape: SurfaceKind | Curve, query: ProjectQuery, limits: Limits = DEFAULT_LIMITS
) -> ProjectWork:
    """Plan a query for closest points: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The shape or the query exceeds a limit.
    """
    count, where = len(query.points), "/points"
    message = "The query has more points than this service computes at once."
    max_points = min(MAX_POINTS, limits.max_points)
    check_count(count, max_points, "points", Issue("too_many_points", message, where))
    file_bytes = 1000 + count * POINT_NUMBERS * (FLOAT64_CHARS + 2)
    limits.check_bytes(file_bytes, "The response could become too large.", where)
    if isinstance(shape, BezierCurve | BsplineCurve):
        pieces = shape.lower()  # takes no time: the curve was lowered when it was created
        patches, degree, memory = pieces.count, (pieces.degree, 0), pieces.points.nbytes
    else:
        size = shape.stored_size()
        check_surface(size, limits)
        # A triangular patch may become three nets.
        patches, degree, memory = 3 * size.patches, size.degree, size.peak_bytes
    cost = project_cost(patches, degree, memory, count, file_bytes, sign=query.sign)
    limits.check_memory(
        cost.memory, "The response", where, "a smaller surface, fewer points at once"
    )
    return ProjectWork(shape, query, cost)
