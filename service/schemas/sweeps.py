"""The JSON language of tubes and ribbons along curves."""

from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import Field, PlainValidator, WithJsonSchema

from service.bases.arrays import FloatArray
from service.schemas.arrays import NumberGrid
from service.schemas.curves import CurveDefinition, build_curve
from service.schemas.document import DocumentLimits
from service.schemas.fields import NameField, StrictModel, UpField, optional
from service.schemas.validation import to_invalid, wrong_type
from service.surface.checks import MAX_DEGREE
from service.surface.sweeps import MAX_SIDES, MIN_SIDES, RibbonSurface, TubeSurface

_COEFFICIENTS = NumberGrid(("numbers",), degree_levels=(0,), min_degree=0)
_VECTOR = NumberGrid(
    ("coordinates",), width=3, width_rule="A vector in space has exactly three coordinates."
)


def _parse_coefficients(value: object) -> FloatArray:
    """Parse coefficients: one number, or a list of numbers, to an array (k+1,) for degree k."""
    if type(value) in (int, float):
        return np.array([value], dtype=np.float64)
    if not isinstance(value, list | np.ndarray):
        raise to_invalid(wrong_type(value, "a number or a list of numbers"))
    # The setting for degrees limits surfaces and curves, not radii and widths.
    limits = DocumentLimits(max_degree=MAX_DEGREE)
    return _COEFFICIENTS.array(value, limits).astype(np.float64, copy=False)


_NUMBER = {"type": "number", "minimum": 0}
Coefficients: TypeAlias = Annotated[
    Any,
    PlainValidator(_parse_coefficients),
    WithJsonSchema(
        {
            "oneOf": [
                _NUMBER,
                {"type": "array", "items": _NUMBER, "minItems": 1, "maxItems": MAX_DEGREE + 1},
            ]
        }
    ),
]
"""A radius or a width as a function along a curve."""

_ALONG = (
    "One number, or a list of the coefficients of a Bézier function over the whole curve. The "
    "function has the first coefficient as its value at the beginning of the curve, and the last "
    "as its value at the end. No coefficient is negative, and at least one is above 0."
)
_CURVE = (
    "The curve along which the surface runs. Its `up` and `name` are ignored; the surface has its "
    "own."
)
_CURVES = [{"control_points": [[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]]}]


class TubeDefinition(StrictModel):
    """A round tube about a curve: a wire, a hair, a knot.

    From ring to ring the tube turns about the curve as little as possible. A closed curve gives a
    closed tube. `resolution` is the number of divisions of each Bézier piece of the curve. Corners
    up to 90° are mitred, and sharper corners are rounded. Where radius × curvature exceeds 1, the
    tube intersects itself; where it is 1, the inside of the bend is one vertex. A control point
    that is repeated adds no faces.
    """

    type: Literal["tube"] = Field(description="The kind of surface.")
    curve: CurveDefinition = Field(description=_CURVE, examples=_CURVES)
    radius: Coefficients = Field(description=f"Radius. {_ALONG}", examples=[0.1, [0.2, 0.1, 0]])
    sides: Annotated[int, Field(ge=MIN_SIDES, le=MAX_SIDES)] = Field(
        default=16,
        description="Sides of the regular polygon that approximates the circle.",
        examples=[48],
    )
    caps: bool = Field(
        default=True,
        description="Whether the ends of an open tube are closed by flat discs, which have normals "
        "of their own. An end where the radius is 0 is a point.",
    )
    up: UpField = "y"
    name: NameField = "tube"

    def to_surface(self) -> TubeSurface:
        """The tube as a value; raises `InvalidRequest` with pointers relative to the surface."""
        curve = build_curve(self.curve, plain=True)
        return TubeSurface(curve, self.radius, self.sides, self.caps, self.up, self.name)


class RibbonDefinition(StrictModel):
    """A flat stripe along a curve that faces a direction, or a camera.

    The line across the ribbon is at right angles to the curve and to the direction that the ribbon
    faces. `resolution` is the number of divisions of each Bézier piece of the curve. Corners up to
    90° are mitred, and sharper corners are rounded. Where the line turns round at a corner, or gets
    another width at a control point that is repeated, no faces join its two directions or widths.
    """

    type: Literal["ribbon"] = Field(description="The kind of surface.")
    curve: CurveDefinition = Field(description=_CURVE, examples=_CURVES)
    width: Coefficients = Field(description=f"Width. {_ALONG}", examples=[0.2, [0, 0.3, 0]])
    facing: Annotated[FloatArray | None, _VECTOR] = optional(
        "Direction that the ribbon faces, of any length but 0. The default, without a `camera`, is "
        "[0, 0, 1].",
        [0, 1, 0],
    )
    camera: Annotated[FloatArray | None, _VECTOR] = optional(
        "A point that the ribbon faces, in place of a direction.", [0, 2, 10]
    )
    up: UpField = "y"
    name: NameField = "ribbon"

    def to_surface(self) -> RibbonSurface:
        """The ribbon as a value; raises `InvalidRequest` with pointers relative to the surface."""
        curve = build_curve(self.curve, plain=True)
        return RibbonSurface(curve, self.width, self.facing, self.camera, self.up, self.name)
