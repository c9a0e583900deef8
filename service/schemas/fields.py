"""Common parts of the models of requests: base classes, pairs for u and v, unions, field types."""

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from typing import Annotated, Any, ClassVar, TypeAlias, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    StringConstraints,
    WithJsonSchema,
)
from pydantic_core import core_schema

from service.engine.options import MAX_ISOCURVES, MAX_RESOLUTION, OverlayName
from service.errors import Issue
from service.schemas.arrays import Array, NumberGrid, tuple_schema
from service.schemas.field_names import sort_nearest_first
from service.schemas.validation import to_invalid, wrong_type
from service.surface.checks import MAX_METRES_PER_UNIT, Up

MAX_NAME = 100


class StrictModel(BaseModel):
    """The base of all models: no conversion of types, no unknown fields, no later change."""

    model_config: ClassVar[ConfigDict] = ConfigDict(
        strict=True, extra="forbid", frozen=True, arbitrary_types_allowed=True
    )


class RequestModel(StrictModel):
    """The base of the models of whole requests."""

    def build(self) -> object:
        """Build the surface or curve, and keep it in the model; raises `InvalidRequest`.

        Models of requests with a surface or a curve override this method, which does nothing.
        """


class Omittable:
    """Marks a field that a request may omit, and whose value is then None; null is refused."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """The schema of the annotated type, but without None."""
        types = [member for member in get_args(source) if member is not type(None)]
        return handler.generate_schema(reduce(operator.or_, types))


def length_issue(got: str, needed: str, message: str = "The list has another length.") -> Issue:
    """The issue for a list that is too long or too short."""
    return Issue("wrong_length", message, "", got, needed)


def conflict_issue(first_name: str, second_name: str, message: str, *, is_neither: bool) -> Issue:
    """The issue for a request with both, or with neither, of two fields: it needs exactly one."""
    code, got = ("missing_field", "neither") if is_neither else ("conflicting_options", "both")
    return Issue(
        code, message, f"/{first_name if is_neither else second_name}", got, "one of the two"
    )


def check_exactly_one(request: BaseModel, first_name: str, second_name: str, message: str) -> None:
    """Refuse a request that has both, or neither, of two fields whose default is None."""
    is_neither = getattr(request, first_name) is None
    if is_neither == (getattr(request, second_name) is None):
        raise to_invalid(conflict_issue(first_name, second_name, message, is_neither=is_neither))


# A value for u and a value for v: a list of two, or one value that stands for both.


def list_of_two(value: object, needed: str) -> list[Any]:
    """Check that a value is a list of two; `needed` is the text of the error for other types."""
    if not isinstance(value, list):
        raise to_invalid(wrong_type(value, needed))
    if len(value) != 2:
        message = "A list has one value for u and one for v."
        raise to_invalid(length_issue(f"a list of {len(value)}", "a list of two", message))
    return value


def range_issue(number: int, min_value: int, max_value: int) -> Issue:
    """The issue for a number that is not from `min_value` to `max_value`."""
    return Issue(
        "out_of_range",
        "The number is out of range.",
        "",
        str(number),
        f"{min_value} to {max_value}",
    )


def whole_numbers(
    min_value: int, max_value: int, build_issue: Callable[[int, int, int], Issue] = range_issue
) -> tuple[BeforeValidator, WithJsonSchema]:
    """The annotations for a pair of whole numbers that may also be written as one number.

    `build_issue` makes the issue for a single number that is not from `min_value` to `max_value`.
    Numbers in a list are checked by the type of the field.
    """

    def parse_pair(value: object) -> object:
        if type(value) is not int:
            return list_of_two(value, "a whole number or a list of two")
        if not min_value <= value <= max_value:
            raise to_invalid(build_issue(value, min_value, max_value))
        return [value, value]

    return BeforeValidator(parse_pair), one_or_two(
        {"type": "integer", "minimum": min_value, "maximum": max_value}
    )


def one_or_two(value: dict[str, Any], item: dict[str, Any] | None = None) -> WithJsonSchema:
    """The JSON Schema of one value, or of a list of two items (by default like the value)."""
    return WithJsonSchema({"oneOf": [value, tuple_schema(item or value, 2)]})


# An object of one of several kinds; its field `type` or `op` names the kind.


def one_of_kinds(
    kinds: Sequence[str], unknown_issue: Issue, description: str, key: str = "type"
) -> tuple[Discriminator, BeforeValidator, Any]:
    """The annotations for a union of models, one of which is chosen by the field `key`.

    If the field is missing, the first kind is chosen; only the field `op` is required. An unknown
    kind is refused with `unknown_issue` and a list of the kinds, the most similar name first.
    """
    needed, where = "one of " + ", ".join(kinds), f"/{key}"

    def tag_of(value: object) -> str | None:
        return str(value.get(key, kinds[0])) if isinstance(value, dict) else None

    def check_kind(value: object) -> object:
        if not isinstance(value, dict):
            raise to_invalid(wrong_type(value, "an object"))
        if key == "op" and key not in value:
            raise to_invalid(
                Issue("missing_field", "A required field is missing.", where, "nothing", needed)
            )
        name = value.get(key, kinds[0])
        if not isinstance(name, str):
            raise to_invalid(replace(wrong_type(name, needed), pointer=where))
        if name not in kinds:
            nearest = "one of " + ", ".join(sort_nearest_first(name, kinds))
            raise to_invalid(
                replace(unknown_issue, pointer=where, got="an unknown name", needed=nearest)
            )
        return value

    return Discriminator(tag_of), BeforeValidator(check_kind), Field(description=description)


def optional(description: str, *examples: object) -> Any:
    """A field that a request may omit; its value is then None."""
    return Field(default=None, description=description, examples=list(examples) or None)


# Types of fields that several models have.

Name: TypeAlias = Annotated[
    str,
    # No control characters and no line separators: formats write names into lines of text.
    StringConstraints(
        min_length=1, max_length=MAX_NAME, pattern=r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029]*$"
    ),
]

Divisions: TypeAlias = Annotated[int, Field(ge=1, le=MAX_RESOLUTION)]
Resolution: TypeAlias = Annotated[
    tuple[Divisions, Divisions], Field(strict=False), *whole_numbers(1, MAX_RESOLUTION)
]

IsoDivisions: TypeAlias = Annotated[int, Field(ge=0, le=MAX_ISOCURVES)]
IsoCurves: TypeAlias = Annotated[
    tuple[IsoDivisions, IsoDivisions], Field(strict=False), *whole_numbers(0, MAX_ISOCURVES)
]


def _check_distinct(values: tuple[str, ...]) -> tuple[str, ...]:
    if len(set(values)) < len(values):
        raise to_invalid(
            Issue(
                "repeated_value", "The list has a name twice.", "", "a repeated name", "each once"
            )
        )
    return values


Overlays: TypeAlias = Annotated[
    tuple[OverlayName, ...],
    Field(strict=False, max_length=len(get_args(OverlayName)), fail_fast=True),
    AfterValidator(_check_distinct),
]

Parts: TypeAlias = Annotated[
    # `point_levels=1`: a part may list at most as many patches as the limit of control points.
    dict[Name, Annotated[Array, NumberGrid(("patch numbers",), integers=True, point_levels=1)]],
    # Stop at the first invalid list: each list may report many errors.
    Field(fail_fast=True),
]

Color: TypeAlias = Annotated[
    tuple[Annotated[float, Field(ge=0, le=1)], ...],
    Field(strict=False, min_length=3, max_length=4, fail_fast=True),
]
"""Red, green, blue and, as an optional fourth number, opacity; sRGB."""

SURFACE_WEIGHTS = Field(
    description="One weight for every control point, in the same rows: positive, or 0 for a point "
    "that does not pull and is no corner. Left out, the surface is polynomial."
)
CURVE_WEIGHTS = Field(
    description="One weight for every control point: positive, or 0 for one that does not pull and "
    "is no end. Left out, the curve is polynomial."
)

MetresPerUnit: TypeAlias = Annotated[
    Annotated[float, Field(gt=0, le=MAX_METRES_PER_UNIT)] | None,
    Omittable(),
    Field(
        description="The unit of the coordinates in metres: 0.001 for millimetres. It is the scale "
        "of the root node of a glTF file, which is in metres, and reports of meshes repeat it. "
        "Tolerances, reports and other formats stay in the unit of the coordinates. That of a "
        "member of a group has no effect.",
        examples=[0.001],
    ),
]

UpField: TypeAlias = Annotated[
    Up,
    Field(
        description="The model's vertical axis. With `z`, the root node of a glTF file rotates the "
        "model, since y is up in glTF; the coordinates do not change.",
        examples=["z"],
    ),
]
NameField: TypeAlias = Annotated[
    Name,
    Field(
        description="Name of the surface or curve. Its part, its node in glTF and a comment in "
        "OOGL have this name.",
        examples=["sail"],
    ),
]


def _ignore(_: object) -> None:
    """The value of a field that every request may have, and that no call reads."""


IgnoredReading: TypeAlias = Annotated[
    Mapping[str, Any] | None,
    BeforeValidator(_ignore),
    WithJsonSchema({"type": "object"}),
    Field(
        description="The report of reading a file, as a response of `POST /v1/convert` has it "
        "beside the surface. It is ignored, so that the response can be sent as it is.",
        examples=[{"format": "step", "faces": 300, "skipped_faces": []}],
    ),
]
IgnoredOrientation: TypeAlias = Annotated[
    Mapping[str, Any] | None,
    BeforeValidator(_ignore),
    WithJsonSchema({"type": "object"}),
    Field(
        description="The report of the operation `orient`, as a response of `POST /v1/convert` has "
        "it beside the surface. It is ignored, so that the response can be sent as it is.",
        examples=[{"turned": [2], "not_orientable": []}],
    ),
]
IGNORED = ("reading", "orientation")
"""Names of the fields that no call reads."""
