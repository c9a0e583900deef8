"""A request for a curve: its definition and, beside it, how it shall be sampled."""

from typing import Annotated

from pydantic import Field, model_validator

from service.engine.curves.options import CurveOptions
from service.engine.options import MAX_RESOLUTION
from service.errors import Issue
from service.schemas.curves import CurveDefinition, curve_of
from service.schemas.fields import Omittable, StrictModel
from service.schemas.validation import refusal
from service.surface.curve import Curve

_DEFAULTS = CurveOptions()


class CurveOptionFields(StrictModel):
    """The options of a curve. All may be left out."""

    resolution: Annotated[int, Field(ge=1, le=MAX_RESOLUTION)] = Field(
        default=_DEFAULTS.resolution,
        description="Divisions of every piece of the curve: of the one Bézier curve, or of every "
        "span of a B-spline.",
        examples=[16],
    )
    tolerance: Annotated[float | None, Omittable(), Field(gt=0)] = Field(
        default=None,
        description="Instead of a resolution: the distance, in model units, within which the "
        "curve stays from the straight lines between its points. Pieces are halved until that is "
        "certain.",
        examples=[0.001],
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
            issue = Issue(
                "conflicting_options",
                "The points follow from the resolution or from the tolerance.",
                got="both",
                needed="one of resolution and tolerance",
            )
            raise refusal([(("tolerance",), issue)])
        return self

    def curve_options(self) -> CurveOptions:
        """What the engine reads."""
        return CurveOptions(self.resolution, self.tolerance, self.tangents, self.arc_lengths)


class CurveRequest(CurveOptionFields):
    """A curve to sample, and how."""

    curve: CurveDefinition = Field(description="The curve, by its control points.")

    def to_curve(self) -> Curve:
        """The curve itself.

        Raises
        ------
        InvalidRequest
            With pointers into the whole request.
        """
        return curve_of(self.curve)
