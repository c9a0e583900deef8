"""The JSON language of many patches: Bézier patches over shared vertices, and multipatches."""

from math import prod
from typing import Annotated, Any, Literal, Self, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, Tag, ValidationError, ValidationInfo, WrapValidator, model_validator
from pydantic_core.core_schema import ValidatorFunctionWrapHandler

from service.bases.arrays import FloatArray
from service.cancellation import checkpoint
from service.errors import InvalidRequest, Issue, pointer
from service.schemas import bezier, bspline
from service.schemas.arrays import NumberGrid, check_total
from service.schemas.bezier import TRIANGLE_RULE, point_to_rows
from service.schemas.channels import VERTEX, build_channels
from service.schemas.document import DocumentLimits
from service.schemas.fields import NameField, Parts, StrictModel, UpField, one_of_kinds
from service.schemas.homogeneous import Homogeneous, PlannedModel, divide, find_weights, lift
from service.schemas.raised_patches import RaisedPatches, plan_patches
from service.schemas.validation import limits_of, to_refusal
from service.surface.grids import NO_GRIDS, Grids
from service.surface.multipatch import MAX_SURFACES, MultipatchSurface, Single
from service.surface.patches import NO_TRIANGLES, PatchSurface

VERTICES = NumberGrid(
    ("vertices", "coordinates"),
    width=3,
    may_be_planar=True,
    may_be_homogeneous=True,
    point_levels=1,
)
VERTEX_WEIGHTS = NumberGrid(("weights",), is_weight=True, point_levels=1)
PATCHES = NumberGrid(
    ("patches", "rows", "indices"), integers=True, point_levels=3, degree_levels=(1, 2)
)
PATCH = NumberGrid(("rows", "indices"), integers=True, degree_levels=(0, 1))
TRIANGLES = NumberGrid(
    ("triangles", "rows", "indices"),
    integers=True,
    point_levels=3,
    degree_levels=(1,),
    degree_rule=TRIANGLE_RULE,
    triangle_level=2,
)


def _parse_grids(
    value: object, handler: ValidatorFunctionWrapHandler, info: ValidationInfo
) -> Grids:
    """Parse the field `patches`: to one array, or to one array for each grid if shapes differ."""
    try:
        return cast(Grids, handler(value))
    except ValidationError:
        if not isinstance(value, list) or len(set(map(_shape, value))) < 2:
            raise
    limits = limits_of(info)
    # Of all grids together only the number of control points is limited, at level 2 of the lists;
    # `PATCH` checks degrees, grid by grid.
    index_count = sum(prod(_shape(grid)) for grid in value)
    PATCHES.check_size(2, total=index_count, longest=0, limits=limits)
    try:
        return tuple(PATCH.array(grid, limits).astype(np.int64, copy=False) for grid in value)
    except ValidationError:
        faults = ((k, fault) for k, grid in enumerate(value) for fault in PATCH.find_faults(grid))
        raise to_refusal(((k, *path), issue) for k, (path, issue) in faults) from None


def _shape(grid: object) -> tuple[int, ...]:
    """The numbers of rows and columns of a grid, by its first row; () if the value is no grid."""
    if isinstance(grid, np.ndarray):
        return tuple(grid.shape)
    if not (isinstance(grid, list) and grid and isinstance(grid[0], list)):
        return ()
    return len(grid), len(grid[0])


class PatchesDefinition(PlannedModel):
    """Many Bézier patches over shared vertices, as in the files of the teapot.

    Patches are grids of one degree or of several, triangles of one degree, or both. If neighbouring
    patches list the same vertices, or vertices with equal coordinates, their common edge has no
    gap.
    """

    type: Literal["patches"] = Field(description="The kind of surface.")
    homogeneous: Homogeneous = False
    vertices: Annotated[FloatArray, VERTICES] = Field(
        description="Control points [x, y, z], or [x, y] in the plane z = 0, that the patches "
        "share; [w x, w y, w z, w] if they are `homogeneous`.",
        examples=[[[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1], [2, 0, 0], [2, 1, 0]]],
    )
    weights: Annotated[FloatArray | None, VERTEX_WEIGHTS] = Field(
        default=None,
        description="One weight for every vertex, positive, or 0 for a point that does not pull; "
        "that of a corner is positive.",
        examples=[[1, 1, 0.5, 0.5, 1, 1]],
    )
    patches: Annotated[Any, PATCHES, WrapValidator(_parse_grids)] = Field(
        default_factory=lambda: NO_GRIDS,
        description="For each patch a grid of vertex numbers (from 0), whose rows follow each "
        "other along u: 4 × 4 numbers for a bicubic patch. Grids may have different shapes. May be "
        "left out if there are `triangles`.",
        examples=[[[[0, 1], [2, 3]], [[2, 3], [4, 5]]]],
    )
    triangles: Annotated[NDArray[np.int64], TRIANGLES] = Field(
        default_factory=lambda: NO_TRIANGLES,
        description="For each triangular patch, vertex numbers (from 0) in rows of n + 1, n, … 1 "
        "numbers as in the control net of a `triangle`. All triangles have one degree n, "
        "which may differ from that of the grids. For triangles of several degrees use a "
        "`multipatch`.",
        examples=[[[[2, 1], [0]]]],
    )
    parts: Parts = Field(
        default_factory=dict,
        description="For the name of each part, the numbers of its patches, from 0: numbers count "
        "the grids first, then the triangles. A patch belongs to at most one part. All other "
        "patches form a part with the surface's name. Parts are sorted by the first patch number "
        "in their lists.",
        examples=[{"left": [0], "right": [1]}],
    )
    colors: Annotated[FloatArray | None, *VERTEX.colors()] = None
    uvs: Annotated[FloatArray | None, *VERTEX.uvs()] = None
    attributes: Annotated[
        dict[str, Annotated[FloatArray, VERTEX.values()]], *VERTEX.attributes()
    ] = Field(default_factory=dict)
    up: UpField = "y"
    name: NameField = "surface"

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        return self.prepare(info) if self.homogeneous or self.weights is not None else self

    def _plan(self, limits: DocumentLimits) -> RaisedPatches | None:
        weights = find_weights(self.vertices, self.weights, is_homogeneous=self.homogeneous)
        if weights is None:
            return None
        field = "vertices" if self.homogeneous else "weights"
        return plan_patches(weights, self.patches, self.triangles, field, limits)

    def to_surface(self) -> PatchSurface:
        """The surface as a value; raises `InvalidRequest` with pointers relative to the surface."""
        parts = tuple((name, tuple(members.tolist())) for name, members in self.parts.items())
        channels = build_channels(self.colors, self.uvs, self.attributes)
        vertices, weights, patches, triangles = (
            self.vertices, self.weights, self.patches, self.triangles,
        )  # fmt: skip
        if self.raising is not None:
            values = lift(vertices, weights, is_homogeneous=self.homogeneous)
            values, patches, triangles, channels = self.raising.apply(values, channels)
            vertices, weights = divide(values)
        if not len(self.patches) + len(self.triangles):
            raise InvalidRequest(
                Issue(
                    "missing_field",
                    "A required field is missing.",
                    "/patches",
                    "nothing",
                    "grids of vertex numbers; or `triangles`, or both",
                )
            )
        try:
            return PatchSurface(
                vertices, patches, weights, parts, self.up, self.name, channels, triangles
            )
        except InvalidRequest as error:
            raise point_to_rows(error, r"/triangles/\d+", self.triangles.shape[1]) from None


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
