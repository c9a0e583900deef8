"""The options of accuracy: the largest error of a mesh, or its most triangles or bytes."""

from dataclasses import fields
from math import pi
from typing import Annotated, Any

from pydantic import BaseModel, Field

from service.bases.arrays import FloatArray
from service.engine.accuracy import Accuracy, Camera
from service.errors import Issue
from service.schemas.arrays import NumberGrid
from service.schemas.fields import StrictModel
from service.schemas.validation import to_invalid

MAX_COUNT = 2**53 - 1
"""The largest number of triangles or bytes that a request may allow. JSON readers represent whole
numbers exactly up to this one."""

MAX_PIXELS = 1 << 16
"""The largest height of a picture, and the largest error in a picture, in pixels: no screen is
larger."""

CAMERA_POSITION = NumberGrid(
    ("coordinates",), width=3, width_rule="A camera stands at a point of three coordinates."
)


class CameraDefinition(StrictModel):
    """A perspective camera: its position, and how large an error appears in its picture.

    The direction of the camera is not needed, because the mesh must be near enough for every
    direction.
    """

    position: Annotated[FloatArray, CAMERA_POSITION] = Field(
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
        """The camera as a value; raises `InvalidRequest` with pointers into the whole request."""
        x, y, z = self.position.tolist()
        return Camera((x, y, z), self.field_of_view, self.height)


ACCURACY_FIELDS = tuple(field.name for field in fields(Accuracy))
"""The names of all options that ask for an accuracy; the models have fields of these names."""

CAMERA_FIELDS = ("camera", "pixel_tolerance")
"""Options of a camera, which only the body of a request can have, not its query string."""


def accuracy_values(options: BaseModel) -> dict[str, Any]:
    """The options of accuracy that a request has, by name; without those that are `false`."""
    return {name: value for name in ACCURACY_FIELDS if (value := getattr(options, name, None))}


def build_accuracy(options: BaseModel) -> Accuracy | None:
    """The accuracy that the options ask for; None if they ask for none.

    Raises
    ------
    InvalidRequest
        The pointer of each issue is `/` and the name of the option.
    """
    values = accuracy_values(options)
    if not values:
        return None
    if "camera" in values:
        values["camera"] = values["camera"].to_camera()
    return Accuracy(**values)


def refuse_conflict(options: BaseModel) -> None:
    """Refuse a request that has both a resolution and an option of accuracy."""
    accuracy_names = list(accuracy_values(options))
    if "resolution" in options.model_fields_set and accuracy_names:
        raise to_invalid(
            Issue(
                "conflicting_options",
                "A request has either a resolution or a tolerance or budget.",
                "/resolution",
                f"resolution and {' and '.join(accuracy_names)}",
                "one of them",
            )
        )
