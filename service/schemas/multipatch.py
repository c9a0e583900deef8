"""The JSON form of one surface that consists of several patches and splines."""

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, Tag, ValidationInfo, model_validator

from service.cancellation import checkpoint
from service.errors import InvalidRequest, Issue, pointer
from service.schemas import bezier, bspline
from service.schemas.arrays import check_total
from service.schemas.fields import NameField, StrictModel, UpField, one_of_kinds
from service.surface.multipatch import MAX_SURFACES, MultipatchSurface, Single

PartDefinition: TypeAlias = Annotated[
    Annotated[bezier.BezierDefinition, Tag("bezier")]
    | Annotated[bspline.BsplineDefinition, Tag("bspline")]
    | Annotated[bezier.TriangleDefinition, Tag("triangle")],
    *one_of_kinds(
        ("bezier", "bspline", "triangle"),
        Issue("unknown_type", "A multipatch cannot contain a surface of this type."),
        "A part of a multipatch.",
    ),
]


class MultipatchDefinition(StrictModel):
    """Bézier patches, B-splines and triangles that form one surface.

    Each of these surfaces is a part, with its own degrees, knots and parameters; its `name` is the
    name of the part. Where the borders of two parts are equal, the parts share vertices. The
    library G+Smo has such surfaces.
    """

    type: Literal["multipatch"] = Field(description="The kind of surface.")
    surfaces: Annotated[
        tuple[PartDefinition, ...],
        Field(strict=False, min_length=1, max_length=MAX_SURFACES, fail_fast=True),
    ] = Field(
        description="The patches and splines. If one of them has `colors`, `uvs` or `attributes`, "
        "all must have them. Their own `up` has no effect. The limit of control points is for all "
        "of them together.",
        examples=[
            [
                {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]], "name": "left"},
                {
                    "type": "bspline",
                    "control_net": [[[1, 0, 0], [1, 1, 1]], [[2, 0, 1], [2, 1, 0]]],
                    "degree": 1,
                    "name": "right",
                },
            ]
        ],
    )
    up: UpField = "y"
    name: NameField = "surface"

    @model_validator(mode="after")
    def _check_size(self, info: ValidationInfo) -> "MultipatchDefinition":
        check_total(self.surfaces, "/surfaces", info)
        return self

    def to_surface(self) -> MultipatchSurface:
        """The surface as a value; raises `InvalidRequest` with pointers relative to the surface."""
        surfaces: list[Single] = []
        for index, definition in enumerate(self.surfaces):
            checkpoint()
            try:
                surfaces.append(definition.to_surface())
            except InvalidRequest as error:
                raise error.within(pointer(("surfaces", index))) from None
        return MultipatchSurface(tuple(surfaces), self.up, self.name)
