"""The JSON language of conversions: a surface, and the operations to apply to it.

To add an operation, add its value to `service.surface.convert.operations`, and to
`service.surface.convert.table` the functions that apply it. Then add to this file its model, its
line in `OPERATIONS` and its line in `OperationDefinition`. If it adds control points, add it to
`service.pipeline.conversion_costs.conversion_points`.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Field, Tag, WithJsonSchema
from typing_extensions import TypeAliasType

from service.engine.measures.values import WELD_TOLERANCE
from service.engine.options import MAX_WELD_TOLERANCE
from service.errors import InvalidRequest, Issue, pointer
from service.schemas.arrays import tuple_schema
from service.schemas.fields import (
    Omittable,
    StrictModel,
    length_issue,
    one_of_kinds,
    optional,
    whole_numbers,
)
from service.schemas.request import SurfaceRequest
from service.schemas.validation import to_invalid
from service.surface.checks import MAX_DEGREE
from service.surface.convert import operations as values

Degree: TypeAlias = Annotated[int, Field(ge=1, le=MAX_DEGREE)]
Number: TypeAlias = Annotated[float, Field(allow_inf_nan=False)]


def _limit_length(min_length: int, max_length: int, items: str) -> BeforeValidator:
    """An annotation that refuses a list of another length, before its items are checked.

    `items` is the plural noun for the items, for the error.
    """
    needed = (
        f"{min_length} {items}"
        if min_length == max_length
        else f"{min_length} to {max_length} {items}"
    )

    def check_length(value: object) -> object:
        if isinstance(value, list) and not min_length <= len(value) <= max_length:
            raise to_invalid(length_issue(f"{len(value)} {items}", needed))
        return value

    return BeforeValidator(check_length)


Degrees: TypeAlias = Annotated[
    tuple[Degree, Degree], Field(strict=False), *whole_numbers(1, MAX_DEGREE)
]
Interval: TypeAlias = Annotated[
    tuple[Number, Number],
    Field(strict=False),
    _limit_length(2, 2, "numbers"),
    WithJsonSchema(tuple_schema({"type": "number"}, 2)),
]
Barycentric: TypeAlias = Annotated[
    tuple[Number, Number, Number],
    Field(strict=False),
    _limit_length(3, 3, "numbers"),
    WithJsonSchema(tuple_schema({"type": "number"}, 3)),
]


FaceNumber: TypeAlias = Annotated[int, Field(ge=0)]
PatchNumber: TypeAlias = Annotated[FaceNumber | None, Omittable()]


def _patch_field(what: str) -> Any:
    """The field `patch` of an operation; `what` says what happens without it."""
    return optional(
        "For `patches`, `multipatch` and `group`: the number of the patch that is changed, from 0, "
        "as POST /v1/points counts it. Its surface or member keeps its place, its name and its "
        f"placement; a B-spline in a group is changed as a whole. {what}",
        0,
    )


_ALL = "By default all are changed."
_ONE = "Needed if there are several."


class ElevateDefinition(StrictModel):
    """Raises the degree without changing the points of the surface. Degrees cannot be lowered.

    For formats that require p = q, raise a patch to [n, n]. A B-spline keeps its continuity,
    because the multiplicity of each knot increases as much as the degree; the result is clamped.
    """

    op: Literal["elevate"] = Field(description="The operation.")
    degree: Degrees = Field(
        description="The new degree, [p, q] or one number for both; of triangles one number.",
        examples=[[3, 3], 4],
    )
    patch: PatchNumber = _patch_field(_ALL)


class SplitDefinition(StrictModel):
    """Splits one patch or a B-spline into two or four pieces, or a triangle into three.

    A patch becomes `patches` over shared vertices. A B-spline becomes a `group` of B-splines that
    keep their parameters; as a member of a group, a `multipatch` of them. Piece k along u and l
    along v has the number k · (number of pieces along v) + l. A triangle is split at a point into
    three triangles, each between the point and one side: the point replaces the corner r = 1 in the
    first, s = 1 in the second, t = 1 in the third.
    """

    op: Literal["split"] = Field(description="The operation.")
    u: Annotated[Number | None, Omittable()] = optional(
        "Where to cut across u: inside the surface's domain.", 0.5
    )
    v: Annotated[Number | None, Omittable()] = optional(
        "Where to cut across v: inside the surface's domain.", 0.25
    )
    at: Annotated[Barycentric | None, Omittable()] = optional(
        "Where to cut a triangle: barycentric coordinates [r, s, t] of a point inside.",
        [0.25, 0.25, 0.5],
    )
    patch: PatchNumber = _patch_field(_ONE)


class RestrictDefinition(StrictModel):
    """Cuts a piece out of one patch or a B-spline.

    The piece of a patch is a patch with parameters from 0 to 1. The piece of a B-spline keeps its
    parameters and its knots inside the piece; a direction that is cut is clamped. Of a periodic
    B-spline, a piece may go over the seam: it begins at most one period below the domain, and is at
    most one period long.
    """

    op: Literal["restrict"] = Field(description="The operation.")
    u: Annotated[Interval | None, Omittable()] = optional(
        "First and last u of the piece; by default the whole range.", [0.25, 0.75]
    )
    v: Annotated[Interval | None, Omittable()] = optional(
        "First and last v of the piece; by default the whole range.", [0, 0.5]
    )
    patch: PatchNumber = _patch_field(_ONE)


class InsertDefinition(StrictModel):
    """Inserts a knot into a B-spline: one more row or column of control points, the same points.

    At a knot that is there already, its multiplicity increases, up to the degree. The direction
    becomes clamped. For several knots, repeat the operation.
    """

    op: Literal["insert"] = Field(description="The operation.")
    u: Annotated[Number | None, Omittable()] = optional(
        "The new knot along u: inside the surface's domain. It adds a row of control points.", 0.5
    )
    v: Annotated[Number | None, Omittable()] = optional(
        "The new knot along v: inside the surface's domain. It adds a column of control points.",
        0.25,
    )
    patch: PatchNumber = _patch_field(_ONE)


class TransposeDefinition(StrictModel):
    """Exchanges u and v of every patch, or s and t of a triangle. Normals change their sign."""

    op: Literal["transpose"] = Field(description="The operation.")
    patch: PatchNumber = _patch_field(_ALL)


class ReverseDefinition(StrictModel):
    """Reverses u or v of every patch. Normals change their sign.

    In a triangle, `u` exchanges r and s, and `v` exchanges r and t. Knots that are numbers over [a,
    b] become numbers over [−b, −a], without rounding; named knots do not change. Reversing a
    surface twice gives the same surface.
    """

    op: Literal["reverse"] = Field(description="The operation.")
    direction: values.Direction = Field(
        description="The parameter that runs backwards.", examples=["u"]
    )
    patch: PatchNumber = _patch_field(_ALL)


class BezierConversion(StrictModel):
    """Converts a B-spline to `patches`: one Bézier patch for each span, over shared vertices.

    Surfaces that already consist of Bézier patches do not change.
    """

    op: Literal["bezier"] = Field(description="The operation.")
    patch: PatchNumber = _patch_field(_ALL)


class TriangleConversion(StrictModel):
    """Converts half of a patch of degree (p, q) to a triangular patch of degree p + q.

    The corners r = 1, s = 1 and t = 1 of the triangle are at (u, v) = (0, 0), (1, 0) and (0, 1) for
    the `lower` half, and at (1, 1), (0, 1) and (1, 0) for the `upper` half. The conversion is
    exact.
    """

    op: Literal["triangle"] = Field(description="The operation.")
    half: values.Half = Field(
        description="Which half: `lower` or `upper` of the diagonal from (1, 0) to (0, 1).",
        examples=["lower"],
    )
    patch: PatchNumber = _patch_field(_ONE)


_MEMBER = (
    "Of a group, the number of the member, from 0, which is a brep; the result has no placement."
)


class UntrimDefinition(StrictModel):
    """Answers with the whole surface of one face of a brep: a patch or a B-spline.

    Its parameters are those of the face, also if the face is reversed. It has the name of the face,
    or else of the brep.
    """

    op: Literal["untrim"] = Field(description="The operation.")
    face: Annotated[FaceNumber | None, Omittable()] = optional(
        "The number of the face, from 0. Needed without `patch`.", 0
    )
    member: Annotated[FaceNumber | None, Omittable()] = optional(_MEMBER, 0)
    patch: PatchNumber = optional(
        "In place of both: the number of the face among all faces and patches, as POST /v1/points "
        "counts them.",
        0,
    )


class SelectDefinition(StrictModel):
    """Answers with a brep of some faces, with their edges and vertices.

    Faces, edges and vertices get new numbers: faces in the order of the operation, the others in
    their own order. A shell stays closed only if all its faces are chosen.
    """

    op: Literal["select"] = Field(description="The operation.")
    faces: Annotated[tuple[FaceNumber, ...], Field(strict=False, min_length=1)] = Field(
        description="The numbers of the faces, from 0, each once.", examples=[[0]]
    )
    member: Annotated[FaceNumber | None, Omittable()] = optional(_MEMBER, 0)


class OrientDefinition(StrictModel):
    """Turns patches so that neighbours agree, and closed surfaces have a positive volume.

    Neighbours are found as in a mesh. A turned patch has u and v exchanged. Of an open surface the
    side stays on which most patches are, or else that of the first. A surface inside another one
    points outwards, too. What has no consistent orientation, such as a Möbius strip, is not turned.
    Breps, tubes and ribbons stay as they are. The response lists the patches (`orientation`).
    """

    op: Literal["orient"] = Field(description="The operation.")
    weld_tolerance: Annotated[float, Field(ge=0, le=MAX_WELD_TOLERANCE)] = Field(
        default=WELD_TOLERANCE,
        description="A share of the diagonal of the bounding box of the control points: control "
        "points on borders that are nearer than this count as one, as in a mesh.",
        examples=[1e-9],
    )


OPERATIONS: Mapping[str, Callable[..., values.Operation]] = MappingProxyType(
    {
        "elevate": values.Elevate,
        "split": values.Split,
        "restrict": values.Restrict,
        "insert": values.Insert,
        "transpose": values.Transpose,
        "reverse": values.Reverse,
        "bezier": values.ToBezier,
        "triangle": values.ToTriangle,
        "untrim": values.Untrim,
        "select": values.Select,
        "orient": values.Orient,
    }
)
"""For each name of an operation, the class of its value. Except for `op`, its model has the fields
of this class, in the same order."""

OperationDefinition = TypeAliasType(
    "OperationDefinition",
    Annotated[
        Annotated[ElevateDefinition, Tag("elevate")]
        | Annotated[SplitDefinition, Tag("split")]
        | Annotated[RestrictDefinition, Tag("restrict")]
        | Annotated[InsertDefinition, Tag("insert")]
        | Annotated[TransposeDefinition, Tag("transpose")]
        | Annotated[ReverseDefinition, Tag("reverse")]
        | Annotated[BezierConversion, Tag("bezier")]
        | Annotated[TriangleConversion, Tag("triangle")]
        | Annotated[UntrimDefinition, Tag("untrim")]
        | Annotated[SelectDefinition, Tag("select")]
        | Annotated[OrientDefinition, Tag("orient")],
        *one_of_kinds(
            tuple(OPERATIONS),
            Issue("unknown_operation", "No operation has this name."),
            "A step of a conversion: `op` names its kind.",
            "op",
        ),
    ],
)


class ConvertRequest(SurfaceRequest):
    """A surface, and the operations to apply to it, one after the other.

    Without operations, the response has the surface itself: it is the way to look at what a file
    contains.
    """

    operations: Annotated[
        tuple[OperationDefinition, ...] | None,
        Omittable(),
        Field(strict=False),
        _limit_length(1, values.MAX_OPERATIONS, "operations"),
    ] = Field(
        default=None,
        description="The operations; each is applied to the result of the one before. Left out, "
        "the surface stays as it is.",
        examples=[[{"op": "elevate", "degree": [3, 3]}, {"op": "split", "u": 0.5}]],
        json_schema_extra={"minItems": 1, "maxItems": values.MAX_OPERATIONS},
    )

    def to_operations(self) -> tuple[values.Operation, ...]:
        """The operations; raises `InvalidRequest` with pointers into the whole request."""
        operations: list[values.Operation] = []
        for number, definition in enumerate(self.operations or ()):
            try:
                fields = (field for name, field in definition if name != "op")
                operations.append(OPERATIONS[definition.op](*fields))
            except InvalidRequest as error:
                raise error.within(pointer(("operations", number))) from None
        return tuple(operations)
