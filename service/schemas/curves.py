"""The JSON language of curves: a model for each kind, their union, and the request of a curve."""

from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field, Tag, ValidationInfo, model_validator
from typing_extensions import TypeAliasType

from service.bases.arrays import FloatArray
from service.engine.curves.options import CurveOptions
from service.engine.options import MAX_RESOLUTION
from service.errors import InvalidRequest, Issue
from service.schemas.arrays import CURVE_POINTS, SPLINE_POINTS, CurveWeights
from service.schemas.bspline import KnotVector, check_degree_limits
from service.schemas.fields import (
    NameField,
    Omittable,
    RequestModel,
    StrictModel,
    UpField,
    conflict_error,
    one_of_kinds,
    optional,
)
from service.schemas.validation import to_invalid
from service.surface.checks import MAX_DEGREE
from service.surface.curve import BezierCurve, BsplineCurve, Curve

CURVE_KINDS = ("bezier", "bspline")
"""Names of the kinds of curve; the first is the default."""


class BezierCurveDefinition(StrictModel):
    """One Bézier curve of any degree, in the plane or in space, rational if weights are given.

    C(t) = Σ B_i(t) w_i P_i / Σ B_i(t) w_i for t from 0 to 1; n + 1 control points have degree n.
    A curve that ends in its first control point is closed.
    """

    type: Literal["bezier"] = Field(
        default="bezier", description="The kind of curve; this one when left out."
    )
    control_points: Annotated[FloatArray, CURVE_POINTS] = Field(
        description="The control polygon: points [x, y] or [x, y, z], all alike. At least two.",
        examples=[[[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]], [[1, 0], [1, 1], [0, 1]]],
    )
    weights: CurveWeights = Field(default=None, examples=[[1, 0.7071067811865476, 1]])
    up: UpField = "y"
    name: NameField = "curve"

    def to_curve(self) -> BezierCurve:
        """The curve itself; raises `InvalidRequest` with pointers relative to it."""
        return BezierCurve(self.control_points, self.weights, self.up, self.name)


class BsplineCurveDefinition(StrictModel):
    """One B-spline curve in the plane or in space, with weights a NURBS curve.

    C(t) = Σ N_i(t) w_i P_i / Σ N_i(t) w_i over the domain of its knots: n control points need
    n + degree + 1 knots. Every interval between two different knots of the domain is one Bézier
    piece.
    """

    type: Literal["bspline"] = Field(description="The kind of curve.")
    control_points: Annotated[FloatArray, SPLINE_POINTS] = Field(
        description="The control polygon: points [x, y] or [x, y, z], all alike. At least "
        "degree + 1 (3 of a periodic curve, whose points are given once).",
        examples=[[[0, 0], [1, 2], [3, 2], [4, 0], [6, 1]]],
    )
    degree: Annotated[int, Field(ge=1, le=MAX_DEGREE)] = Field(
        default=3, description="Degree, 1 to 64. Left out: 3.", examples=[2]
    )
    knots: KnotVector = Field(
        default="clamped",
        description="Numbers that never decrease, each at most degree times inside the domain "
        "(there, a corner), or a name. `clamped` reaches the first and last control points; "
        "`uniform` does not; `periodic` closes smoothly. Intervals of named knots have length 1, "
        "the first begins at 0. Left out: clamped.",
        examples=["periodic", [0, 0, 0, 0, 0.5, 1, 1, 1, 1]],
    )
    weights: CurveWeights = Field(default=None, examples=[[1, 2, 1, 2, 1]])
    up: UpField = "y"
    name: NameField = "curve"

    @model_validator(mode="after")
    def _check_degree(self, info: ValidationInfo) -> "BsplineCurveDefinition":
        check_degree_limits((self.degree,), info)
        return self

    def to_curve(self) -> BsplineCurve:
        """The curve itself; raises `InvalidRequest` with pointers relative to it."""
        return BsplineCurve(
            self.control_points, self.degree, self.knots, self.weights, self.up, self.name
        )


_UNKNOWN = Issue("unknown_type", "No kind of curve has this name.")

CurveDefinition = TypeAliasType(
    "CurveDefinition",
    Annotated[
        Annotated[BezierCurveDefinition, Tag("bezier")]
        | Annotated[BsplineCurveDefinition, Tag("bspline")],
        *one_of_kinds(
            CURVE_KINDS, _UNKNOWN, "A curve: its `type` names the kind; the default is `bezier`."
        ),
    ],
)


_DEFAULTS = CurveOptions()


class CurveOptionFields(StrictModel):
    """The options of a curve. All may be left out."""

    resolution: Annotated[int, Field(ge=1, le=MAX_RESOLUTION)] = Field(
        default=_DEFAULTS.resolution,
        description="Divisions of every piece of the curve: of the one Bézier curve, or of every "
        "span of a B-spline.",
        examples=[16],
    )
    tolerance: Annotated[float | None, Omittable(), Field(gt=0)] = optional(
        "Instead of a resolution: the distance, in model units, within which the curve stays from "
        "the straight lines between its points. Pieces are halved until that is certain.",
        0.001,
    )
    tangents: bool = Field(
        default=_DEFAULTS.tangents, description="Whether points carry unit tangents."
    )
    arc_lengths: bool = Field(
        default=_DEFAULTS.arc_lengths,
        description="Whether points carry the length of the curve up to them.",
    )

    @model_validator(mode="after")
    def _one_of_two(self) -> "CurveOptionFields":
        if {"resolution", "tolerance"} <= self.model_fields_set:
            message = "The points follow from the resolution or from the tolerance."
            issue = conflict_error("resolution", "tolerance", message, is_neither=False)
            raise to_invalid(replace(issue, needed="one of resolution and tolerance"))
        return self

    def curve_options(self) -> CurveOptions:
        """The options of the engine."""
        return CurveOptions(self.resolution, self.tolerance, self.tangents, self.arc_lengths)


class CurveRequest(RequestModel, CurveOptionFields):
    """A curve to sample, and how."""

    curve: CurveDefinition = Field(description="The curve, by its control points.")

    def build(self) -> None:
        """Builds the curve, which `to_curve` returns from then on."""
        self.to_curve()

    def to_curve(self) -> Curve:
        """The curve itself, built once; `InvalidRequest` points into the whole request."""
        built: Curve | None = self.__dict__.get("_built")
        if built is None:
            built = self.__dict__["_built"] = build_curve(self.curve)
        return built


def build_curve(definition: CurveDefinition, *, plain: bool = False) -> Curve:
    """The curve of a definition; a `plain` curve is built without its name and its `up`.

    Raises
    ------
    InvalidRequest
        With pointers into the document that contains the curve as `curve`.
    """
    try:
        curve = definition.to_curve()
    except InvalidRequest as error:
        raise error.within("/curve") from None
    if plain and (curve.up, curve.name) != ("y", "curve"):
        return replace(curve, up="y", name="curve")
    return curve


def define_curve(curve: Curve) -> dict[str, Any]:
    """A curve in the form of a request, without a name: it is part of a surface, which has one."""
    content: dict[str, Any] = {"type": "bezier", "control_points": curve.control_points}
    if isinstance(curve, BsplineCurve):
        content |= {"type": "bspline", "degree": curve.degree, "knots": curve.knots}
    if curve.weights is not None:
        content["weights"] = curve.weights
    return content
