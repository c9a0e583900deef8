"""The JSON language of planes that cut a surface."""

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from service.bases.arrays import FloatArray
from service.engine.sections.planes import Planes
from service.errors import InvalidRequest
from service.schemas.arrays import NumberGrid
from service.schemas.fields import RequestModel, conflict_error, optional
from service.schemas.validation import to_invalid
from service.schemas.vectors import VECTORS, pair_rows, validate_directions
from service.surface.checks import check_finite, check_stored, validate_points

OFFSETS = NumberGrid(("offsets",))


class PlaneSet(RequestModel):
    """Planes n · p = d, n a unit normal; row k of both fields belongs to plane k."""

    normals: Annotated[FloatArray, VECTORS] = Field(
        description="Normals of the planes, [x, y, z], of any length but 0; or one of all.",
        examples=[[[0, 0, 1]]],
    )
    offsets: Annotated[FloatArray | None, OFFSETS] = optional(
        "Distances d of the planes from zero, in the direction of their normals, at most 1,000; or "
        "one of all.",
        [0.5, 1, 1.5],
    )
    points: Annotated[FloatArray | None, VECTORS] = optional(
        "Instead of offsets: a point [x, y, z] of each plane, or one of all.", [[0, 0, 0.5]]
    )

    @model_validator(mode="after")
    def _check_one_form(self) -> Self:
        if (self.offsets is None) == (self.points is None):
            message = "A plane has a normal, and an offset or a point."
            is_neither = self.offsets is None
            raise to_invalid(conflict_error("offsets", "points", message, is_neither=is_neither))
        return self

    def to_planes(self) -> Planes:
        """The planes, with a row for each.

        Raises
        ------
        InvalidRequest
            `conflicting_options`: the numbers of normals and of offsets or points differ;
            `zero_direction`.
        """
        try:
            return self._planes()
        except InvalidRequest as error:
            raise error.within("/planes") from None

    def _planes(self) -> Planes:
        normals = validate_directions(self.normals, "normals")
        normals = normals / np.abs(normals).max(axis=1, keepdims=True)
        normals /= np.sqrt((normals * normals).sum(axis=1, keepdims=True))
        if self.points is not None:
            name, places = "points", validate_points(self.points, "points", axes=2)
        else:
            name, places = "offsets", np.asarray(self.offsets, np.float64) + 0.0
            check_finite(places, "/offsets")
            check_stored(places, "/offsets")
        normals, places = pair_rows(normals, "normals", places, name)
        if places.ndim == 2:
            places = (normals * places).sum(axis=1)
        return Planes(normals, places)
