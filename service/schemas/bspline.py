"""The JSON language of one tensor-product B-spline surface, NURBS included."""

from dataclasses import replace
from typing import Annotated, Any, Literal, Self, TypeAlias, cast

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    PlainValidator,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)

from service.bases.arrays import FloatArray
from service.bases.raising import Raising
from service.errors import Issue
from service.schemas.arrays import NumberGrid
from service.schemas.channels import SPLINE, build_channels
from service.schemas.document import DocumentLimits
from service.schemas.fields import (
    SURFACE_WEIGHTS,
    NameField,
    UpField,
    list_of_two,
    one_or_two,
    whole_numbers,
)
from service.schemas.homogeneous import (
    Homogeneous,
    RationalModel,
    divide,
    find_weights,
    lift,
)
from service.schemas.raising import (
    plan_spline,
    raised_knots,
)
from service.schemas.validation import limits_of, to_invalid, wrong_type
from service.surface.bspline import BsplineSurface
from service.surface.checks import MAX_DEGREE
from service.surface.convert.nets import map_channels
from service.surface.convert.refine_spline import avoid_shape
from service.surface.knots import NAMED, KnotName, Knots

SPLINE_NET = NumberGrid(
    ("rows", "control points", "coordinates"),
    width=3,
    may_be_planar=True,
    may_be_homogeneous=True,
    point_levels=2,
)
SPLINE_WEIGHTS = NumberGrid(("rows", "weights"), is_weight=True, point_levels=2)
KNOTS = NumberGrid(("knots",))


def check_degree_limits(degrees: tuple[int, ...], info: ValidationInfo) -> None:
    """Refuse degrees above the limit of this service, which may be lower than `MAX_DEGREE`."""
    limits = limits_of(info)
    for axis, degree in enumerate(degrees):
        if degree > limits.max_degree:
            # If the degrees are equal, the request may have one number for both.
            where = "/degree" if min(degrees) == max(degrees) else f"/degree/{axis}"
            raise to_invalid(replace(_degree_issue(degree, 1, limits.max_degree), pointer=where))


def _degree_issue(degree: int, min_degree: int, max_degree: int) -> Issue:
    """The issue for a degree that is not from `min_degree` to `max_degree`."""
    return Issue(
        "degree_too_high" if degree > max_degree else "out_of_range",
        "The degree of a B-spline is limited.",
        "",
        f"degree {degree}",
        f"{min_degree} to {max_degree}",
    )


def _split_knot_vectors(value: object) -> object:
    """Split the field `knots` into two values: the two items of a list, or one name twice."""
    if isinstance(value, str):
        return [_parse_knot_name(value)] * 2
    return list_of_two(value, "a name or a list of two")


def _parse_knots(value: object, info: ValidationInfo) -> Knots:
    """Parse one knot vector: a name, or a list of numbers, which becomes an array."""
    if isinstance(value, str):
        return _parse_knot_name(value)
    if not isinstance(value, list | np.ndarray):
        raise to_invalid(wrong_type(value, "a list of knots or a name"))
    return KNOTS.array(value, limits_of(info)).astype(np.float64, copy=False)


def _parse_knot_name(name: str) -> KnotName:
    """Check the name of a knot vector."""
    if name not in NAMED:
        needed = "one of " + ", ".join(NAMED)
        raise to_invalid(
            Issue("wrong_value", "No knots are known by this name.", "", "a string", needed)
        )
    return cast(KnotName, name)


_NAME_SCHEMA = {"type": "string", "enum": list(NAMED)}
_VECTOR_SCHEMA = {
    "oneOf": [_NAME_SCHEMA, {"type": "array", "items": {"type": "number"}, "minItems": 2}]
}
"""`minItems` is 2, because a direction of degree 1 with 2 control points has 4 knots, of which the
first and the last may be left out."""


Degrees: TypeAlias = Annotated[
    tuple[int, int], Field(strict=False), *whole_numbers(1, MAX_DEGREE, _degree_issue)
]
KnotVector: TypeAlias = Annotated[Any, PlainValidator(_parse_knots), WithJsonSchema(_VECTOR_SCHEMA)]
"""The knots of one direction: a name, or numbers."""

KnotVectors: TypeAlias = Annotated[
    tuple[
        Annotated[Any, PlainValidator(_parse_knots)], Annotated[Any, PlainValidator(_parse_knots)]
    ],
    Field(strict=False),
    BeforeValidator(_split_knot_vectors),
    one_or_two(_NAME_SCHEMA, _VECTOR_SCHEMA),
]


class BsplineNet(RationalModel):
    """One tensor-product B-spline surface: the surface of a face of a `brep`.

    S(u, v) = Σ N_i(u) N_j(v) w_ij P_ij / Σ N_i(u) N_j(v) w_ij over the domain of its knots. A net
    of r × c control points needs r + p + 1 knots along u and c + q + 1 along v. Each cell between
    neighbouring distinct knots along u and along v becomes one Bézier patch.
    """

    type: Literal["bspline"] = Field(description="The kind of surface.")
    homogeneous: Homogeneous = False
    control_net: Annotated[FloatArray, SPLINE_NET] = Field(
        description="Control points [x, y, z], or [x, y] in the plane z = 0, row by row; "
        "[w x, w y, w z, w] if they are `homogeneous`. Rows "
        "follow each other along u, points in a row along v; rows have equal lengths. At least "
        "degree + 1 points in each direction (3 in a periodic direction); every coordinate is "
        "finite and within single precision.",
        examples=[
            [
                [[0, 0, 0], [0, 1, 1], [0, 2, 1], [0, 3, 0]],
                [[1, 0, 1], [1, 1, 2], [1, 2, 2], [1, 3, 1]],
                [[2, 0, 1], [2, 1, 0], [2, 2, 0], [2, 3, 1]],
                [[3, 0, 0], [3, 1, 1], [3, 2, 1], [3, 3, 0]],
            ]
        ],
    )
    degree: Degrees = Field(
        default=(3, 3),
        description="Degree along u and along v, 1 to 64, or one number for both. The default is "
        "3.",
        examples=[[3, 2]],
    )
    knots: KnotVectors = Field(
        default=("clamped", "clamped"),
        description="Knots along u and along v, each a list of numbers or a name; or one name for "
        "both. Numbers never decrease, and each occurs at most degree + 1 times. At a knot that "
        "occurs degree times the surface has a crease, and at one that occurs degree + 1 times it "
        "is discontinuous. With `clamped`, the default, the surface reaches its first and last "
        "control points; with `uniform` it does not; with `periodic` it closes smoothly, and its "
        "control points are not repeated. The intervals of named knots have length 1, and the "
        "first begins at 0. Knots that differ by less than 9e-13 of the length of the domain are "
        "made equal, unless this would make more than degree knots equal (degree + 1 at an end "
        "of the domain). The first and the last knot have no effect and may both be left out.",
        examples=[["clamped", [0, 0, 0, 0.5, 1, 1, 1]]],
    )
    weights: Annotated[FloatArray | None, SPLINE_WEIGHTS, SURFACE_WEIGHTS] = Field(
        default=None, examples=[[[1, 1, 1, 1], [1, 2, 2, 1], [1, 2, 2, 1], [1, 1, 1, 1]]]
    )

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        check_degree_limits(self.degree, info)
        return self.prepare(info) if self.homogeneous or self.weights is not None else self

    def _plan(self, limits: DocumentLimits) -> Raising | None:
        weights = find_weights(self.control_net, self.weights, is_homogeneous=self.homogeneous)
        if weights is None:
            return None
        field = "control_net" if self.homogeneous else "weights"
        return plan_spline(weights, self.knots, self.degree, field, limits)

    def divided(self) -> Self:
        """The net with points and positive weights."""
        if self.raising is None:
            return self
        values = lift(self.control_net, self.weights, is_homogeneous=self.homogeneous)
        points, weights = divide(self.raising.apply(values))
        return self.replaced(
            control_net=points,
            weights=weights,
            degree=self.raising.degrees,
            knots=raised_knots(self.raising, self.knots),
        )


class BsplineDefinition(BsplineNet):
    """One tensor-product B-spline surface; with weights it is a NURBS surface.

    S(u, v) = Σ N_i(u) N_j(v) w_ij P_ij / Σ N_i(u) N_j(v) w_ij over the domain of its knots. A net
    of r × c control points needs r + p + 1 knots along u and c + q + 1 along v. Each cell between
    neighbouring distinct knots along u and along v becomes one Bézier patch.
    """

    colors: Annotated[FloatArray | None, *SPLINE.colors()] = None
    uvs: Annotated[FloatArray | None, *SPLINE.uvs()] = None
    attributes: Annotated[
        dict[str, Annotated[FloatArray, SPLINE.values()]], *SPLINE.attributes()
    ] = Field(default_factory=dict)
    up: UpField = "y"
    name: NameField = "surface"

    def to_surface(self) -> BsplineSurface:
        """The surface as a value; raises `InvalidRequest` with pointers relative to the surface."""
        channels = build_channels(self.colors, self.uvs, self.attributes)
        net = self.divided()
        old, new = self.control_net.shape[:2], net.control_net.shape[:2]
        if self.raising is not None and old != new:
            apply = self.raising.apply
            channels = map_channels(
                channels,
                lambda each: apply(each) if each.shape[:2] == old else avoid_shape(each, new),
            )
        return BsplineSurface(
            net.control_net, net.degree, net.knots, net.weights, self.up, self.name, channels
        )
