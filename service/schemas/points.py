"""The JSON language of points: a surface, and parameters at which it is evaluated."""

from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, WithJsonSchema, WrapValidator, model_validator
from pydantic_core.core_schema import ValidatorFunctionWrapHandler

from service.bases.arrays import FloatArray, Ints
from service.engine.points.places import PointsQuery
from service.schemas.arrays import NumberGrid
from service.schemas.fields import conflict_issue, optional
from service.schemas.request import SurfaceRequest
from service.schemas.validation import MAX_INDEX, index_too_large, to_invalid, wrong_type

UV = NumberGrid(
    ("points", "parameters"), width=2, width_rule="A point of a surface has two parameters [u, v]."
)
BARYCENTRIC = NumberGrid(
    ("places", "coordinates"),
    width=3,
    width_rule="A place on a triangle has three barycentric coordinates [r, s, t].",
)
NUMBERS = NumberGrid(("patch numbers",), integers=True)


def _parse_patch_numbers(value: object, handler: ValidatorFunctionWrapHandler) -> Any:
    """Parse the field `patch`: a list of patch numbers, or one number for all points."""
    if type(value) is int:
        if abs(value) > MAX_INDEX:
            raise to_invalid(index_too_large())
        return np.array(value, dtype=np.int64)
    if not isinstance(value, list | np.ndarray):
        raise to_invalid(wrong_type(value, "a whole number or a list of them"))
    return handler(value)


_INDEX = {"type": "integer", "minimum": 0}

PatchChoice = Annotated[
    Ints | None,
    NUMBERS,
    WrapValidator(_parse_patch_numbers),
    WithJsonSchema({"oneOf": [_INDEX, {"type": "array", "items": _INDEX, "minItems": 1}]}),
]


class PointsRequest(SurfaceRequest):
    """Parameters at which a surface is evaluated, and the derivatives to return."""

    uv: Annotated[FloatArray | None, UV] = optional(
        "Parameters [u, v], one pair for each point, in the domain of the surface; for a patch, "
        "both are from 0 to 1. A knot belongs to the span that begins at it, and the end of the "
        "domain belongs to the last span.",
        [[0.5, 0.5], [0, 1]],
    )
    barycentric: Annotated[FloatArray | None, BARYCENTRIC] = optional(
        "For triangles, in place of `uv`: barycentric coordinates [r, s, t], none negative, with "
        "the sum 1. `du` is then the derivative in the direction (−1, 1, 0), and `dv` in the "
        "direction (−1, 0, 1).",
        [[0.5, 0.25, 0.25], [1, 0, 0]],
    )
    patch: PatchChoice = optional(
        "For `patches` and `multipatch` with more than one patch or surface: the number of the "
        "patch or surface on which the points are, from 0 in the order of the request. One number "
        "for all points, or a list with one number for each point. Required for these surfaces, "
        "and only for these.",
        0,
    )
    derivatives: Annotated[int, Field(ge=0, le=2)] = Field(
        default=1,
        description="Order of the partials. 0 returns `positions` alone; 1 adds `du`, `dv`, "
        "`normals` and `degenerate`; 2 adds `duu`, `duv`, `dvv` and the curvatures.",
        examples=[2],
    )

    @model_validator(mode="after")
    def _check_one_form(self) -> Self:
        if (self.uv is None) == (self.barycentric is None):
            message = "There must be one list of places: `uv`, or on triangles `barycentric`."
            is_neither = self.uv is None
            raise to_invalid(conflict_issue("uv", "barycentric", message, is_neither=is_neither))
        return self

    def to_query(self) -> PointsQuery:
        """The parameters, the patch numbers and the order of derivatives, for the engine."""
        places = self.barycentric if self.uv is None else self.uv
        if places is None:
            raise ValueError("a request without places was not validated")
        return PointsQuery(places, self.patch, self.derivatives)
