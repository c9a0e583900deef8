"""The JSON language of curves: a model for each kind, their union, and the request of a curve."""

from dataclasses import replace
from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, Tag, ValidationInfo, model_validator
from typing_extensions import TypeAliasType

from service.bases.arrays import FloatArray
from service.bases.raising import Raising
from service.engine.curves.derivatives import MAX_ORDER
from service.engine.curves.polyline import CurveOptions
from service.engine.options import MAX_RESOLUTION
from service.errors import InvalidRequest, Issue, count_nouns
from service.schemas.arrays import NumberGrid
from service.schemas.bspline import KnotVector, check_degree_limits
from service.schemas.document import DocumentLimits
from service.schemas.fields import (
    CURVE_WEIGHTS,
    NameField,
    Omittable,
    RequestModel,
    StrictModel,
    UpField,
    conflict_issue,
    one_of_kinds,
    optional,
)
from service.schemas.homogeneous import (
    Homogeneous,
    RationalModel,
    divide,
    find_weights,
    lift,
)
from service.schemas.raising import (
    bezier_directions,
    find_corners,
    least_of_curve,
    plan_net,
    plan_spline,
    raised_knots,
)
from service.schemas.validation import to_invalid, to_refusal
from service.surface.checks import MAX_DEGREE
from service.surface.curve import BezierCurve, BsplineCurve, Curve

BEZIER_POINTS = NumberGrid(
    ("control points", "coordinates"),
    point_levels=1,
    degree_levels=(0,),
    degree_rule="n + 1 control points are one Bézier curve of degree n.",
    list_schema={"minItems": 2, "maxItems": 4},
)
SPLINE_POINTS = NumberGrid(
    ("control points", "coordinates"), point_levels=1, list_schema={"minItems": 2, "maxItems": 4}
)
Weights: TypeAlias = Annotated[
    FloatArray | None, NumberGrid(("weights",), is_weight=True, point_levels=1), CURVE_WEIGHTS
]


class BezierCurveDefinition(RationalModel):
    """One Bézier curve of any degree, in the plane or in space, rational if weights are given.

    C(t) = Σ B_i(t) w_i P_i / Σ B_i(t) w_i for t from 0 to 1. A curve of n + 1 control points has
    degree n. If the last control point equals the first, the curve is closed.
    """

    type: Literal["bezier"] = Field(
        default="bezier", description="The kind of curve; `bezier` is the default."
    )
    homogeneous: Homogeneous = False
    control_points: Annotated[FloatArray, BEZIER_POINTS] = Field(
        description="The control polygon: at least two points, all [x, y] or all [x, y, z]; "
        "[w x, w y, w] or [w x, w y, w z, w] if they are `homogeneous`.",
        examples=[[[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]], [[1, 0], [1, 1], [0, 1]]],
    )
    weights: Weights = Field(default=None, examples=[[1, 0.7071067811865476, 1]])
    up: UpField = "y"
    name: NameField = "curve"

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        return self.prepare(info) if self.homogeneous or self.weights is not None else self

    def _plan(self, limits: DocumentLimits) -> Raising | None:
        weights = find_curve_weights(self)
        if weights is None:
            return None
        field = "control_points" if self.homogeneous else "weights"
        return plan_net(
            weights,
            bezier_directions(weights.shape),
            limits,
            corners=[(field, *index) for index in find_corners(weights)],
            look=lambda: least_of_curve(weights),
        )

    def divided(self) -> Self:
        """The curve with points and positive weights."""
        if self.raising is None:
            return self
        values = lift(self.control_points, self.weights, is_homogeneous=self.homogeneous)
        points, weights = divide(self.raising.apply(values))
        return self.replaced(control_points=points, weights=weights)

    def to_curve(self) -> BezierCurve:
        """The curve as a value; raises `InvalidRequest` with pointers relative to the curve."""
        curve = self.divided()
        return BezierCurve(curve.control_points, curve.weights, self.up, self.name)


class BsplineCurveDefinition(RationalModel):
    """One B-spline curve in the plane or in space; with weights it is a NURBS curve.

    C(t) = Σ N_i(t) w_i P_i / Σ N_i(t) w_i over the domain of its knots; n control points need
    n + degree + 1 knots. Each interval between neighbouring distinct knots of the domain becomes
    one Bézier piece.
    """

    type: Literal["bspline"] = Field(description="The kind of curve.")
    homogeneous: Homogeneous = False
    control_points: Annotated[FloatArray, SPLINE_POINTS] = Field(
        description="The control polygon: at least degree + 1 points, all [x, y] or all [x, y, z]; "
        "[w x, w y, w] or [w x, w y, w z, w] if they are `homogeneous`. A periodic curve needs at "
        "least 3 points, and they are not repeated.",
        examples=[[[0, 0], [1, 2], [3, 2], [4, 0], [6, 1]]],
    )
    degree: Annotated[int, Field(ge=1, le=MAX_DEGREE)] = Field(
        default=3, description="Degree, 1 to 64. The default is 3.", examples=[2]
    )
    knots: KnotVector = Field(
        default="clamped",
        description="Knots: a list of numbers, or a name. Numbers never decrease, and each occurs "
        "at most degree times inside the domain; at a knot that occurs degree times the curve has "
        "a corner. With `clamped`, the default, the curve reaches its first and last control "
        "points; with `uniform` it does not; with `periodic` it closes smoothly. The intervals of "
        "named knots have length 1, and the first begins at 0.",
        examples=["periodic", [0, 0, 0, 0, 0.5, 1, 1, 1, 1]],
    )
    weights: Weights = Field(default=None, examples=[[1, 2, 1, 2, 1]])
    up: UpField = "y"
    name: NameField = "curve"

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        check_degree_limits((self.degree,), info)
        return self.prepare(info) if self.homogeneous or self.weights is not None else self

    def _plan(self, limits: DocumentLimits) -> Raising | None:
        weights = find_curve_weights(self)
        if weights is None:
            return None
        field = "control_points" if self.homogeneous else "weights"
        return plan_spline(weights, (self.knots,), (self.degree,), field, limits)

    def divided(self) -> Self:
        """The curve with points and positive weights."""
        if self.raising is None:
            return self
        values = lift(self.control_points, self.weights, is_homogeneous=self.homogeneous)
        points, weights = divide(self.raising.apply(values))
        (degree,), (knots,) = self.raising.degrees, raised_knots(self.raising, (self.knots,))
        return self.replaced(control_points=points, weights=weights, degree=degree, knots=knots)

    def to_curve(self) -> BsplineCurve:
        """The curve as a value; raises `InvalidRequest` with pointers relative to the curve."""
        curve = self.divided()
        return BsplineCurve(
            curve.control_points, curve.degree, curve.knots, curve.weights, self.up, self.name
        )


def find_curve_weights(
    curve: BezierCurveDefinition | BsplineCurveDefinition,
) -> FloatArray | None:
    """`find_weights` of a curve, whose homogeneous points have three or four numbers."""
    points = curve.control_points
    weights = find_weights(points, curve.weights, is_homogeneous=curve.homogeneous)
    if curve.homogeneous and points.shape[-1] not in (3, 4):
        message = (
            "Homogeneous control points are [w x, w y, w] in the plane, and [w x, w y, w z, w] in "
            "space."
        )
        got = count_nouns(points.shape[-1], "numbers")
        issue = Issue("wrong_dimension", message, "", got, "3 or 4 numbers")
        raise to_refusal([(("control_points",), issue)])
    return weights


CurveDefinition = TypeAliasType(
    "CurveDefinition",
    Annotated[
        Annotated[BezierCurveDefinition, Tag("bezier")]
        | Annotated[BsplineCurveDefinition, Tag("bspline")],
        *one_of_kinds(
            ("bezier", "bspline"),
            Issue("unknown_type", "No kind of curve has this name."),
            "A curve: its `type` names the kind; the default is `bezier`.",
        ),
    ],
)


_DEFAULTS = CurveOptions()

SAMPLINGS = ("resolution", "tolerance", "parameters")
"""The fields that choose the points of a curve, of which a request has at most one."""


PARAMETERS = NumberGrid(("parameters",))


class CurveOptionFields(StrictModel):
    """The options of a curve. All of them have defaults."""

    resolution: Annotated[int, Field(ge=1, le=MAX_RESOLUTION)] = Field(
        default=_DEFAULTS.resolution,
        description="Divisions of every piece of the curve. A Bézier curve is one piece; a "
        "B-spline has one piece for every knot span.",
        examples=[16],
    )
    tolerance: Annotated[float | None, Omittable(), Field(gt=0)] = optional(
        "In place of a resolution: the largest distance, in model units, of the curve from the "
        "straight lines between its points. Pieces are halved until this is proved.",
        0.001,
    )
    parameters: Annotated[FloatArray | None, PARAMETERS] = optional(
        "In place of a resolution or a tolerance: the parameters of the points, in any order, in "
        "the domain of the curve; for a Bézier curve from 0 to 1. A knot belongs to the span that "
        "begins at it, and the end of the domain belongs to the last span. Only for JSON.",
        [0, 0.5, 1],
    )
    derivatives: Annotated[int, Field(ge=0, le=MAX_ORDER)] = Field(
        default=_DEFAULTS.order,
        description="Order of the derivatives that points carry. 1 adds `dt` and `degenerate`; 2 "
        "adds `dtt` and `curvature`; 3 adds `dttt` and, for curves in space, `torsion`. Only for "
        "JSON.",
        examples=[2],
    )
    tangents: bool = Field(
        default=_DEFAULTS.tangents, description="Whether points carry unit tangents."
    )
    arc_lengths: bool = Field(
        default=_DEFAULTS.arc_lengths,
        description="Whether each point carries the length of the curve from its beginning to the "
        "point.",
    )

    @model_validator(mode="after")
    def _check_one_form(self) -> "CurveOptionFields":
        names = [name for name in SAMPLINGS if name in self.model_fields_set]
        if len(names) > 1:
            message = "The points follow from a resolution, a tolerance or parameters."
            issue = conflict_issue(names[0], names[1], message, is_neither=False)
            raise to_invalid(replace(issue, needed=f"one of {names[0]} and {names[1]}"))
        return self

    def curve_options(self) -> CurveOptions:
        """The options for the engine."""
        return CurveOptions(
            self.resolution,
            self.tolerance,
            self.tangents,
            self.arc_lengths,
            self.parameters,
            self.derivatives,
        )


class CurveRequest(RequestModel, CurveOptionFields):
    """A curve, and the options with which it is sampled."""

    curve: CurveDefinition = Field(description="The curve, by its control points.")

    def to_curve(self) -> Curve:
        """The curve as a value; the first call builds it.

        Raises `InvalidRequest` with pointers into the whole request.
        """
        curve: Curve | None = self.__dict__.get("_curve")
        if curve is None:
            curve = self.__dict__["_curve"] = build_curve(self.curve)
        return curve

    build = to_curve


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
