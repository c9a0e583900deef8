"""Rays that shall hit a surface, as a document says it."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from service.bases.arrays import FloatArray
from service.engine.queries.intersect import RELATIVE_THICKNESS, RayQuery
from service.errors import InvalidRequest, Issue
from service.schemas.arrays import NumberGrid
from service.schemas.fields import RequestModel
from service.schemas.request import SurfaceRequest
from service.surface.checks import validate_points

VECTORS = NumberGrid(
    ("vectors", "coordinates"), width=3, width_rule="A ray is in space: three numbers [x, y, z]."
)

LEAST_THICKNESS = 1e-12
"""Thinner rays would hit nothing but rounding."""

SHORTEST = 1e-100
"""A vector of smaller numbers is no direction: their squares vanish."""


class Rays(RequestModel):
    """Half-lines origin + t · direction, t ≥ 0; row k of both belongs to ray k."""

    origins: Annotated[FloatArray, VECTORS] = Field(
        description="Where the rays begin, [x, y, z], at most 100,000; or one point of all.",
        examples=[[[0, 0, 9], [1, 0, 9]]],
    )
    directions: Annotated[FloatArray, VECTORS] = Field(
        description="Where they go, [x, y, z], of any length but 0; or one direction of all.",
        examples=[[[0, 0, -1]]],
    )


class IntersectRequest(SurfaceRequest):
    """A surface, and rays whose hits are looked for."""

    rays: Rays = Field(description="The rays.")
    hits: Literal["first", "all"] = Field(
        default="first", description="Whether the first hit of each ray is answered, or all."
    )
    relative_thickness: Annotated[float, Field(ge=LEAST_THICKNESS, le=1e-3)] = Field(
        default=RELATIVE_THICKNESS,
        description="How near to the surface a ray may be taken to hit it, as a part of the "
        "diagonal of the box of the control points: at borders, and where it touches.",
        examples=[1e-6],
    )

    def to_query(self) -> RayQuery:
        """The rays, with a row for each.

        Raises
        ------
        InvalidRequest
            `conflicting_options`, of other counts of origins and directions; `zero_direction`.
        """
        try:
            origins = validate_points(self.rays.origins, "origins", axes=2)
            directions = validate_points(self.rays.directions, "directions", axes=2)
        except InvalidRequest as error:
            raise error.within("/rays") from None
        count = max(len(origins), len(directions))
        if not {len(origins), len(directions)} <= {1, count}:
            message = "There must be a direction for each origin, or one of all."
            got = f"{len(origins)} origins, {len(directions)} directions"
            needed = f"{len(origins)} directions, or 1"
            issue = Issue("conflicting_options", message, "/rays/directions", got, needed)
            raise InvalidRequest(issue)
        zero = np.flatnonzero(np.abs(directions).max(axis=1) < SHORTEST)
        if len(zero):
            message = "A direction of length 0 leads nowhere."
            where = f"/rays/directions/{zero[0]}"
            raise InvalidRequest(Issue("zero_direction", message, where, "about 0", "a vector"))
        origins, directions = (np.broadcast_to(rows, (count, 3)) for rows in (origins, directions))
        return RayQuery(origins, directions, self.hits == "first", self.relative_thickness)
