"""How near a mesh must be to its surface, as a document, a query or a command line says it."""

from dataclasses import fields
from math import pi
from typing import Annotated, Any, TypeAlias

from pydantic import BaseModel, Field

from service.bases.arrays import FloatArray
from service.engine.adaptive.accuracy import Accuracy, Camera
from service.errors import Issue
from service.schemas.arrays import NumberGrid
from service.schemas.fields import Omittable, StrictModel
from service.schemas.validation import refusal
from service.surface.checks import MAX_COORDINATE

MAX_COUNT = 2**53 - 1
"""The largest budget: what every reader of JSON holds exactly."""

MAX_PIXELS = 1 << 16
"""Height of a picture, and an error in it, beyond which a number is a mistake."""

POSITION = NumberGrid(
    ("coordinates",), width=3, width_rule="A camera stands at a point of three coordinates."
)

Tolerance: TypeAlias = Annotated[
    float | None,
    Omittable(),
    Field(
        gt=0,
        le=MAX_COORDINATE,
        description="Instead of a resolution: a distance in model units. No point of the surface "
        "is further than this from the mesh as it is written, which is proved and not sampled: the "
        "report has the bound. Patches are divided where the surface bends and in the direction "
        "in which it bends; shared edges by rules that depend on the edge alone. Below what the "
        "rounding of the written vertices allows it is refused (`tolerance_too_small`).",
        examples=[0.001],
    ),
]
RelativeTolerance: TypeAlias = Annotated[
    float | None,
    Omittable(),
    Field(
        gt=0,
        le=1,
        description="The tolerance as a share of the diagonal of the box about all control points; "
        "of a group, those of all members in their places. Not beside `tolerance`.",
        examples=[0.001],
    ),
]
AngleTolerance: TypeAlias = Annotated[
    float | None,
    Omittable(),
    Field(
        gt=0,
        le=pi,
        description="Radians: how far apart the normals at two vertices of one edge of the mesh "
        "may point. Sought and not proved: the report has the largest measured, `normal_angle`. "
        "Alone, or beside a tolerance.",
        examples=[0.2],
    ),
]
MaxTriangles: TypeAlias = Annotated[
    int | None,
    Omittable(),
    Field(
        ge=1,
        le=MAX_COUNT,
        description="Alone: the mesh of the least proved deviation that so many triangles allow; "
        "fewer than the surface needs at all are refused (`budget_too_small`). Beside a tolerance "
        "it is a limit, and a mesh that needs more is refused (`too_many_triangles`).",
        examples=[2000],
    ),
]
MaxBytes: TypeAlias = Annotated[
    int | None,
    Omittable(),
    Field(
        ge=1,
        le=MAX_COUNT,
        description="The same for the bytes of the answer in its format.",
        examples=[100_000],
    ),
]
TwoSided: TypeAlias = Annotated[
    bool,
    Field(
        description="Whether the other distance is bounded, too: no point of the mesh is further "
        "from the surface than twice the tolerance. The report has the bound, "
        "`mesh_deviation_bound`. Needs a tolerance or a budget.",
        examples=[True],
    ),
]
PixelTolerance: TypeAlias = Annotated[
    float | None,
    Omittable(),
    Field(
        gt=0,
        le=MAX_PIXELS,
        description="Pixels: how large an error may seem, seen from the `camera`, which must be "
        "there. What is far away is divided less; every part is as near as its least distance from "
        "the camera demands, and a `tolerance` holds beside it.",
        examples=[0.5],
    ),
]


class CameraDefinition(StrictModel):
    """A perspective camera: as much of it as tells how large an error looks.

    Where it looks to does not matter: what lies behind it may be seen next.
    """

    position: Annotated[FloatArray, POSITION] = Field(
        description="The point where it stands, in model coordinates.", examples=[[4, 3, 9]]
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


CameraField: TypeAlias = Annotated[
    CameraDefinition | None,
    Omittable(),
    Field(
        description="From where the mesh will be seen; with `pixel_tolerance`, which must be "
        "there. In bodies only, not in queries.",
        examples=[{"position": [4, 3, 9], "field_of_view": 0.8, "height": 1080}],
    ),
]

NAMES = tuple(field.name for field in fields(Accuracy))
"""What can be stated, by name; the fields of the models are called the same."""

SEEN = ("camera", "pixel_tolerance")
"""What only a body can state."""


def stated(options: BaseModel) -> dict[str, Any]:
    """What the options state of accuracy, by name: neither what is left out nor `false`."""
    given = {name: getattr(options, name, None) for name in NAMES}
    return {
        name: value for name, value in given.items() if value is not None and value is not False
    }


def accuracy_of(options: BaseModel) -> Accuracy | None:
    """The accuracy that the options state, None where they state none.

    Raises
    ------
    InvalidRequest
        With pointers `/name of the option`.
    """
    values = stated(options)
    if not values:
        return None
    if "camera" in values:
        values["camera"] = values["camera"].to_camera()
    return Accuracy(**values)


def refuse_conflict(options: BaseModel) -> None:
    """Refuses a resolution that is written out beside an accuracy: only one of them can hold."""
    others = list(stated(options))
    if "resolution" in options.model_fields_set and others:
        issue = Issue(
            "conflicting_options",
            "A mesh is divided as finely as its resolution says, or as its accuracy needs.",
            got=f"a resolution and {' and '.join(others)}",
            needed="one of the two",
        )
        raise refusal([(("resolution",), issue)])
