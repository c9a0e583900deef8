"""The JSON language of points: a surface, and parameters at which it is evaluated."""

from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, WithJsonSchema, WrapValidator, model_validator
from pydantic_core.core_schema import ValidatorFunctionWrapHandler

from service.bases.arrays import FloatArray, Ints
from service.engine.points.places import PointsQuery
from service.schemas.arrays import NumberGrid
from service.schemas.fields import conflict_error, optional
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


def _one_or_many(value: object, handler: ValidatorFunctionWrapHandler) -> Any:
    """The numbers of patches, one for each point, or one whole number for all points."""
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
    WrapValidator(_one_or_many),
    WithJsonSchema({"oneOf": [_INDEX, {"type": "array", "items": _INDEX, "minItems": 1}]}),
]


class PointsRequest(SurfaceRequest):
    """Parameters at which a surface is evaluated, and the derivatives to return."""

    uv: Annotated[FloatArray | None, UV] = optional(
        "Parameters [u, v], one pair a point, within the surface's own domain: from 0 "
        "to 1 for a patch. At a knot the span that begins there counts, at the end the last one.",
        [[0.5, 0.5], [0, 1]],
    )
    barycentric: Annotated[FloatArray | None, BARYCENTRIC] = optional(
        "On triangles, instead of `uv`: barycentric coordinates [r, s, t], none below "
        "0, with a sum of 1. `du` is then the partial along (−1, 1, 0), `dv` along (−1, 0, 1).",
        [[0.5, 0.25, 0.25], [1, 0, 0]],
    )
    patch: PatchChoice = optional(
        "For a list of patches, or for the surfaces of a `multipatch`: the number "
        "(from 0, in the order of the request) of that on which the points lie, or one number for "
        "every point. Needed where there are several, and only there.",
        0,
    )
    derivatives: Annotated[int, Field(ge=0, le=2)] = Field(
        default=1,
        description="Order of the partials. 0 returns `positions` alone; 1 adds `du`, `dv`, "
        "`normals` and `degenerate`; 2 adds `duu`, `duv`, `dvv` and the curvatures.",
        examples=[2],
    )

    @model_validator(mode="after")
    def _has_places(self) -> Self:
        if (self.uv is None) == (self.barycentric is None):
            message = "There must be one list of places: `uv`, or on triangles `barycentric`."
            is_neither = self.uv is None
            raise to_invalid(conflict_error("uv", "barycentric", message, is_neither=is_neither))
        return self

    def to_query(self) -> PointsQuery:
        """The query: the parameters and the order of derivatives."""
        places = self.barycentric if self.uv is None else self.uv
        if places is None:
            raise ValueError("a request without places was not validated")
        return PointsQuery(places, self.patch, self.derivatives)
