"""The options of a picture: the model is the same for bodies and for queries."""

from math import pi
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import AfterValidator, Field, StringConstraints, model_validator

from service.bases.arrays import FloatArray
from service.engine.pictures.options import PictureOptions, PictureStyle, Viewpoint
from service.errors import Issue
from service.schemas.accuracy import CAMERA_POSITION
from service.schemas.arrays import NumberGrid
from service.schemas.fields import IsoCurves, Omittable, StrictModel, optional
from service.schemas.request import SurfaceRequest
from service.schemas.validation import to_invalid

MAX_SIZE = 2048
"""The largest width and height of a picture, in pixels."""

MAX_ZOOM = 1000.0
"""The largest zoom; its inverse is the least."""

Size: TypeAlias = Annotated[int, Field(ge=1, le=MAX_SIZE)]
Background: TypeAlias = Annotated[
    str,
    StringConstraints(pattern=r"^(transparent|#?[0-9a-f]{6})$", max_length=11),
    # In a canonical URL, `#` would begin the fragment.
    AfterValidator(lambda text: text.removeprefix("#")),
]

TARGET = NumberGrid(("coordinates",), width=3, width_rule="A target has three coordinates.")

_VIEW, _STYLE = Viewpoint(), PictureStyle()


class PictureFields(StrictModel):
    """The options of a picture. All of them have defaults."""

    width: Size = Field(default=_VIEW.width, description="Pixels.", examples=[800])
    height: Size = Field(default=_VIEW.height, description="Pixels.", examples=[600])
    azimuth: Annotated[float, Field(ge=-360, le=360)] = Field(
        default=_VIEW.azimuth,
        description="Degrees about the vertical axis: with 0 the camera looks along −z, with 90 "
        "along −x, in the frame that is turned y-up.",
        examples=[90],
    )
    elevation: Annotated[float, Field(ge=-90, le=90)] = Field(
        default=_VIEW.elevation,
        description="Degrees: with 90 the camera looks straight down.",
        examples=[0],
    )
    zoom: Annotated[float, Field(ge=1 / MAX_ZOOM, le=MAX_ZOOM)] = Field(
        default=_VIEW.zoom,
        description="How much larger the surface is than in a picture that shows all of it; with a "
        "`position`, than with the field of view.",
        examples=[2],
    )
    position: Annotated[FloatArray | None, Omittable(), CAMERA_POSITION] = optional(
        "The position of the camera, in model units and in the frame that is turned y-up: from a "
        "surface with `up: z`, (x, y, z) is (x, z, −y) there. Needs `target`, and replaces "
        "`azimuth` and `elevation`. A camera on the surface is refused (`camera_on_surface`).",
        [4, 3, 9],
    )
    target: Annotated[FloatArray | None, Omittable(), TARGET] = optional(
        "The point in the middle of the picture; needs `position`.", [0, 1, 0]
    )
    field_of_view: Annotated[float, Field(gt=0, lt=pi)] = Field(
        default=_VIEW.field_of_view,
        description="Vertical field of view: the angle, in radians, between the upper and the "
        "lower border of the picture.",
        examples=[0.8],
    )
    orthographic: bool = Field(
        default=_VIEW.orthographic,
        description="Whether parallel lines stay parallel. With a `position`, the picture shows as "
        "much of the target as with perspective.",
        examples=[True],
    )
    background: Background = Field(
        default="transparent",
        description="`transparent`, or an sRGB colour as `rrggbb` with small letters; it may begin "
        "with `#`.",
        examples=["ffffff"],
    )
    look: Literal["shaded", "gaussian", "mean"] = Field(
        default=_STYLE.look,
        description="`shaded` in the colours of the surface, or the Gaussian or the mean curvature "
        "as colours: blue below 0, orange above; nine tenths of the picture are in their range.",
        examples=["mean"],
    )
    edges: bool = Field(
        default=False,
        description="Whether the borders of patches, and of a part its edges, are drawn.",
        examples=[True],
    )
    isocurves: IsoCurves = Field(
        default=(0, 0),
        description="Draws the curves u = i/n and v = j/n of every patch: one n, or [n_u, n_v].",
        examples=[4, [4, 0]],
    )
    control_net: bool = Field(
        default=False, description="Whether the control net is drawn.", examples=[True]
    )

    @model_validator(mode="after")
    def _check_place(self) -> Self:
        given = [name for name in ("position", "target") if getattr(self, name) is not None]
        if len(given) == 1:
            missing = "target" if given == ["position"] else "position"
            raise to_invalid(
                Issue(
                    "missing_field",
                    "A camera has a position and a target, or neither.",
                    f"/{missing}",
                    given[0],
                    "both",
                )
            )
        if self.position is not None and (self.position == self.target).all():
            raise to_invalid(
                Issue(
                    "out_of_range",
                    "The camera looks from its position to its target.",
                    "/target",
                    "the position itself",
                    "another point",
                )
            )
        return self

    def picture_options(self) -> PictureOptions:
        """The options as values."""
        viewpoint = Viewpoint(
            self.width,
            self.height,
            self.field_of_view,
            self.orthographic,
            self.azimuth,
            self.elevation,
            self.zoom,
            _to_place(self.position),
            _to_place(self.target),
        )
        names: dict[Any, bool] = {"boundary": self.edges, "control_net": self.control_net}
        return PictureOptions(
            viewpoint,
            PictureStyle(self.look, _read_color(self.background)),
            tuple(name for name, is_drawn in names.items() if is_drawn),
            self.isocurves,
        )


class PictureRequest(SurfaceRequest, PictureFields):
    """A surface, and the options of its picture."""


def _to_place(point: FloatArray | None) -> tuple[float, float, float] | None:
    """A point as a value that can be compared."""
    if point is None:
        return None
    x, y, z = point.tolist()
    return x, y, z


def _read_color(text: str) -> tuple[float, float, float] | None:
    """The components of `rrggbb`, from 0 to 1; None for a transparent background."""
    if text == "transparent":
        return None
    r, g, b = (int(text[k : k + 2], 16) / 255 for k in (0, 2, 4))
    return r, g, b
