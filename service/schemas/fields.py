"""What the models of the language share: strictness, names, pairs, fields that may be left out."""

import operator
from functools import reduce
from typing import Annotated, Any, ClassVar, TypeAlias, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    StringConstraints,
    WithJsonSchema,
)
from pydantic_core import core_schema

from service.engine.options import MAX_ISOCURVES, MAX_RESOLUTION, OverlayName
from service.errors import Issue
from service.schemas.arrays import PATCH_NUMBERS, Array
from service.schemas.refusals import refusal, wrong_type
from service.surface.lowered import Up


class StrictModel(BaseModel):
    """No conversions, no unknown fields, no change after birth."""

    model_config: ClassVar[ConfigDict] = ConfigDict(
        strict=True, extra="forbid", frozen=True, arbitrary_types_allowed=True
    )


class Omittable:
    """Marks a field that may be left out, but not be null; its value is None when left out."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """The schema of the type without its None."""
        types = [member for member in get_args(source) if member is not type(None)]
        return handler.generate_schema(reduce(operator.or_, types))


MAX_NAME = 100

Name: TypeAlias = Annotated[
    str,
    # No control characters and no line separators: names end up in files made of lines.
    StringConstraints(
        min_length=1, max_length=MAX_NAME, pattern=r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029]*$"
    ),
]

Divisions: TypeAlias = Annotated[int, Field(ge=1, le=MAX_RESOLUTION)]


def _pair(least: int, most: int) -> BeforeValidator:
    """An int from `least` to `most` stands for both directions."""

    def pair(value: object) -> object:
        if type(value) is int:
            if not least <= value <= most:
                needed = f"{least} to {most}"
                issue = Issue("out_of_range", "The number is out of range.", "", str(value), needed)
                raise refusal([((), issue)])
            return [value, value]
        if not isinstance(value, list):
            raise refusal([((), wrong_type(value, "a whole number or a list of two"))])
        if len(value) != 2:
            issue = Issue(
                "wrong_length",
                "A list has one number of divisions for u and one for v.",
                got=f"{len(value)} numbers",
                needed="two numbers",
            )
            raise refusal([((), issue)])
        return value

    return BeforeValidator(pair)


def _pair_schema(least: int, most: int) -> WithJsonSchema:
    one = {"type": "integer", "minimum": least, "maximum": most}
    pair = {"type": "array", "items": one, "minItems": 2, "maxItems": 2}
    return WithJsonSchema({"oneOf": [one, pair]})


Resolution: TypeAlias = Annotated[
    tuple[Divisions, Divisions],
    Field(strict=False),
    _pair(1, MAX_RESOLUTION),
    _pair_schema(1, MAX_RESOLUTION),
]

Pieces: TypeAlias = Annotated[int, Field(ge=0, le=MAX_ISOCURVES)]

IsoCurves: TypeAlias = Annotated[
    tuple[Pieces, Pieces],
    Field(strict=False),
    _pair(0, MAX_ISOCURVES),
    _pair_schema(0, MAX_ISOCURVES),
]


def _distinct(values: tuple[str, ...]) -> tuple[str, ...]:
    if len(set(values)) < len(values):
        issue = Issue(
            "repeated_value",
            "The list has a name twice.",
            got="a repeated name",
            needed="each once",
        )
        raise refusal([((), issue)])
    return values


Overlays: TypeAlias = Annotated[
    tuple[OverlayName, ...],
    Field(strict=False, max_length=len(get_args(OverlayName)), fail_fast=True),
    AfterValidator(_distinct),
]

Parts: TypeAlias = Annotated[
    dict[Name, Annotated[Array, PATCH_NUMBERS]],
    # Each list may report faults of its own; the first bad one is enough.
    Field(fail_fast=True),
]

UpField: TypeAlias = Annotated[
    Up,
    Field(
        description="The model's vertical axis. With `z` the root node of a glTF file turns the "
        "model upright; the coordinates stay as they are.",
        examples=["z"],
    ),
]
NameField: TypeAlias = Annotated[
    Name,
    Field(
        description="Name of the surface: of its part, its glTF node, its OOGL comment.",
        examples=["sail"],
    ),
]
