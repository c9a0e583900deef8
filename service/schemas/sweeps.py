"""The JSON language of tubes and ribbons along curves."""

from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import Field, PlainValidator, WithJsonSchema

from service.bases.arrays import FloatArray
from service.schemas.arrays import NumberGrid
from service.schemas.curves import CurveDefinition, build_curve, define_curve
from service.schemas.document import DocumentLimits
from service.schemas.fields import NameField, StrictModel, UpField, optional
from service.schemas.validation import to_invalid, wrong_type
from service.surface.checks import MAX_DEGREE
from service.surface.sweeps import MAX_SIDES, MIN_SIDES, RibbonSurface, TubeSurface

_COEFFICIENTS = NumberGrid(("numbers",), degree_levels=(0,), least_degree=0)
_VECTOR = NumberGrid(
    ("coordinates",), width=3, width_rule="A vector in space has exactly three coordinates."
)


def _spread(value: object) -> FloatArray:
    """A number, or a list of them."""
    if type(value) in (int, float):
        return np.array([value], dtype=np.float64)
    if not isinstance(value, list | np.ndarray):
        raise to_invalid(wrong_type(value, "a number or a list of numbers"))
    return _COEFFICIENTS.array(value, DocumentLimits(max_degree=MAX_DEGREE)).astype(np.float64)


_NUMBER = {"type": "number", "minimum": 0}
Spread: TypeAlias = Annotated[
    Any,
    PlainValidator(_spread),
    WithJsonSchema(
        {
            "oneOf": [
                _NUMBER,
                {"type": "array", "items": _NUMBER, "minItems": 1, "maxItems": MAX_DEGREE + 1},
            ]
        }
    ),
]

_ALONG = (
    "A list holds the coefficients of a Bézier function over the whole curve: the first at its "
    "beginning, the last at its end, pulled towards those between. No coefficient is negative, "
    "and at least one is above 0."
)
_CURVE = (
    "The curve that it runs along. Its `up` and `name` are not read: those of the surface count."
)
_CURVES = [{"control_points": [[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]]}]


class TubeDefinition(StrictModel):
    """A round tube about a curve: a wire, a hair, a knot.

    Its rings turn about the curve as little as they can; a closed curve gives a closed tube.
    `resolution` counts the divisions of each piece of the curve. Corners up to 90° are mitred,
    sharper ones rounded. Where radius × curvature exceeds 1, the tube intersects itself.
    """

    type: Literal["tube"] = Field(description="The kind of surface.")
    curve: CurveDefinition = Field(description=_CURVE, examples=_CURVES)
    radius: Spread = Field(description=f"Radius. {_ALONG}", examples=[0.1, [0.2, 0.1, 0]])
    sides: Annotated[int, Field(ge=MIN_SIDES, le=MAX_SIDES)] = Field(
        default=16, description="Sides of the polygon that stands for the circle.", examples=[48]
    )
    caps: bool = Field(
        default=True,
        description="Whether open ends get flat discs with normals of their own. Where the radius "
        "is 0 the tube is pointed.",
    )
    up: UpField = "y"
    name: NameField = "tube"

    def to_surface(self) -> TubeSurface:
        """The tube itself; raises `InvalidRequest` with pointers relative to it."""
        curve = build_curve(self.curve, plain=True)
        return TubeSurface(curve, self.radius, self.sides, self.caps, self.up, self.name)


class RibbonDefinition(StrictModel):
    """A flat stripe along a curve that faces a direction, or a camera.

    Its crossbars are at right angles to the curve and to the direction that it faces. `resolution`
    counts the divisions of each piece of the curve; corners are those of a tube.
    """

    type: Literal["ribbon"] = Field(description="The kind of surface.")
    curve: CurveDefinition = Field(description=_CURVE, examples=_CURVES)
    width: Spread = Field(description=f"Width. {_ALONG}", examples=[0.2, [0, 0.3, 0]])
    facing: Annotated[FloatArray | None, _VECTOR] = optional(
        "Direction that it faces, of any length: [0, 0, 1] if neither this nor a camera is given.",
        [0, 1, 0],
    )
    camera: Annotated[FloatArray | None, _VECTOR] = optional(
        "A point that it faces, in place of a direction.", [0, 2, 10]
    )
    up: UpField = "y"
    name: NameField = "ribbon"

    def to_surface(self) -> RibbonSurface:
        """The ribbon itself; raises `InvalidRequest` with pointers relative to it."""
        curve = build_curve(self.curve, plain=True)
        return RibbonSurface(curve, self.width, self.facing, self.camera, self.up, self.name)


def define_tube(surface: TubeSurface) -> dict[str, Any]:
    """The tube in the form of a request, with NumPy arrays."""
    content = {"type": "tube", "curve": define_curve(surface.curve)}
    names = ("radius", "sides", "caps", "up", "name")
    return content | {name: getattr(surface, name) for name in names}


def define_ribbon(surface: RibbonSurface) -> dict[str, Any]:
    """The ribbon in the form of a request, with NumPy arrays."""
    towards = "facing" if surface.camera is None else "camera"
    content = {"type": "ribbon", "curve": define_curve(surface.curve)}
    return content | {name: getattr(surface, name) for name in ("width", towards, "up", "name")}
