"""The accuracy of a mesh in a document, a query or on a command line: how near to its surface."""

from dataclasses import fields
from math import pi
from typing import Annotated, Any

from pydantic import BaseModel, Field

from service.bases.arrays import FloatArray
from service.engine.adaptive.tolerance_spec import Accuracy, Camera
from service.errors import Issue
from service.schemas.arrays import NumberGrid
from service.schemas.fields import StrictModel
from service.schemas.validation import to_invalid

MAX_COUNT = 2**53 - 1
"""The largest budget: readers of JSON represent whole numbers up to this one exactly."""

MAX_PIXELS = 1 << 16
"""Largest height of a picture, and largest error in it: a greater number is a mistake."""

POSITION = NumberGrid(
    ("coordinates",), width=3, width_rule="A camera stands at a point of three coordinates."
)


class CameraDefinition(StrictModel):
    """A perspective camera: its position, and how large an error appears in its picture.

    Its direction does not matter, because the camera may turn.
    """

    position: Annotated[FloatArray, POSITION] = Field(
        description="The position of the camera, in model coordinates.", examples=[[4, 3, 9]]
    )
    field_of_view: Annotated[float, Field(gt=0, lt=pi)] = Field(
        description="Vertical field of view: the angle, in radians, between the upper and the "
        "lower border of the picture.",
        examples=[0.8],
    )
    height: Annotated[int, Field(ge=1, le=MAX_PIXELS)] = Field(
        description="Height of the picture in pixels.", examples=[1080]
    )

    def to_camera(self) -> Camera:
        """The camera itself; raises `InvalidRequest` with pointers into the whole request."""
        x, y, z = self.position.tolist()
        return Camera((x, y, z), self.field_of_view, self.height)


NAMES = tuple(field.name for field in fields(Accuracy))
"""Names of the options of accuracy, which are also names of the models' fields."""

ACCURACY = frozenset(NAMES)
"""Names of all options that ask for an accuracy, as a set."""

SEEN = ("camera", "pixel_tolerance")
"""Options that only a body can have."""


def given_fields(options: BaseModel) -> dict[str, Any]:
    """The given options of accuracy, by name; without those left out or `false`."""
    return {name: value for name in NAMES if (value := getattr(options, name, None))}


def build_accuracy(options: BaseModel) -> Accuracy | None:
    """The accuracy that the options state; None if they state none.

    Raises
    ------
    InvalidRequest
        Pointers are `/` and the name of the option.
    """
    values = given_fields(options)
    if not values:
        return None
    if "camera" in values:
        values["camera"] = values["camera"].to_camera()
    return Accuracy(**values)


def refuse_conflict(options: BaseModel) -> None:
    """Refuses a resolution that is written out beside an accuracy: only one of them can hold."""
    others = list(given_fields(options))
    if "resolution" in options.model_fields_set and others:
        message = "A request has either a resolution or a tolerance or budget."
        got, needed = f"resolution and {' and '.join(others)}", "one of them"
        raise to_invalid(Issue("conflicting_options", message, "/resolution", got, needed))
