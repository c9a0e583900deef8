"""What the models of the language share: strictness, names, fields that may be left out."""

import operator
from functools import reduce
from typing import Annotated, Any, ClassVar, TypeAlias, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    StringConstraints,
)
from pydantic_core import core_schema

from service.engine.options import MAX_ISOCURVES, MAX_RESOLUTION, OverlayName
from service.errors import Issue
from service.schemas.arrays import PATCH_NUMBERS, Array
from service.schemas.pairs import one_or_two, one_or_two_numbers, whole_number
from service.schemas.validation import refusal
from service.surface.checks import Up


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


Resolution: TypeAlias = Annotated[
    tuple[Divisions, Divisions],
    Field(strict=False),
    one_or_two_numbers(1, MAX_RESOLUTION),
    one_or_two(whole_number(1, MAX_RESOLUTION)),
]

Pieces: TypeAlias = Annotated[int, Field(ge=0, le=MAX_ISOCURVES)]

IsoCurves: TypeAlias = Annotated[
    tuple[Pieces, Pieces],
    Field(strict=False),
    one_or_two_numbers(0, MAX_ISOCURVES),
    one_or_two(whole_number(0, MAX_ISOCURVES)),
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
