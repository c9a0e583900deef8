"""Homogeneous control points, and weights of 0: converted to points and positive weights.

Only this module and the models that use it know of them: the values of surfaces and curves have
points and positive weights. A model finds while it is validated how far its net must be raised,
from the weights alone; so a document that would have too many control points is refused before they
exist. The points are computed when the surface is built.
"""

from abc import abstractmethod
from typing import Annotated, Any, Self, TypeAlias

import numpy as np
from pydantic import Field, ValidationInfo

from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue
from service.schemas.document import DocumentLimits
from service.schemas.fields import StrictModel
from service.schemas.validation import limits_of, to_refusal
from service.surface.checks import USUAL_EXPONENT, check_ratio

Homogeneous: TypeAlias = Annotated[
    bool,
    Field(
        description="Whether control points are homogeneous: [w x, w y, w z, w], with no `weights` "
        "beside them. A point with w = 0 is a direction. If a w is 0 or negative, but none at a "
        "corner, the degree is raised, to 64 at most, until all weights are positive; this does "
        "not change the surface. It is stored, answered and hashed as points and weights.",
        examples=[True],
    ),
]


class PlannedModel(StrictModel):
    """The base of models of control points that may have weights."""

    def prepare(self, info: ValidationInfo) -> Self:
        """Find and keep how the net is raised; raises `ValidationError` if it cannot be."""
        self.__dict__["_raising"] = self._plan(limits_of(info))
        return self

    @abstractmethod
    def _plan(self, limits: DocumentLimits) -> Any:
        """How the net is raised; None if it has points and positive weights, or none."""

    @property
    def raising(self) -> Any:
        """The result of `prepare`."""
        return self.__dict__.get("_raising")

    @property
    def point_count(self) -> int | None:
        """The number of control points after raising; None if nothing is raised."""
        return None if self.raising is None else self.raising.point_count


class RationalModel(PlannedModel):
    """The base of models of one net or polygon that may have weights."""

    @abstractmethod
    def divided(self) -> Self:
        """The model with points and positive weights."""

    def replaced(self, **fields: object) -> Self:
        """The model with other values of some fields, and with points and positive weights."""
        return self.model_copy(update={**fields, "homogeneous": False, "_raising": None})


def find_weights(
    points: FloatArray, weights: FloatArray | None, *, is_homogeneous: bool
) -> FloatArray | None:
    """The weights of a net that must be divided or raised; None if it stays as it is.

    A net also stays as it is if its weights have another shape, or one of them is negative: the
    class of the surface refuses it.
    """
    if is_homogeneous:
        if weights is not None:
            message = "Homogeneous control points have their weights themselves."
            issue = Issue(
                "conflicting_options", message, "", "both", "`weights`, or `homogeneous`: true"
            )
            raise to_refusal([(("weights",), issue)])
        own = points[..., -1]
        if (own > 0).all():
            try:
                check_ratio(own, "")
            except InvalidRequest as error:
                raise to_refusal(((), issue) for issue in error.issues) from None
        return own
    if weights is None or weights.shape != points.shape[:-1] or (weights < 0).any():
        return None
    return weights if (weights == 0).any() else None


def lift(points: FloatArray, weights: FloatArray | None, *, is_homogeneous: bool) -> FloatArray:
    """Homogeneous control points (…, d + 1) of a net, for which `find_weights` has weights."""
    if is_homogeneous or weights is None:
        return points
    exponent = int(np.frexp(weights.max())[1])
    if abs(exponent) > USUAL_EXPONENT:  # products must stay in the range of float64
        weights = np.ldexp(weights, -exponent)
    return to_homogeneous(points, weights)


def divide(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points (…, d) and weights of homogeneous points (…, d + 1), whose weights are positive."""
    weights = np.ascontiguousarray(values[..., -1])
    # Overflow gives infinite values, which the class of the surface refuses.
    with np.errstate(over="ignore"):
        return values[..., :-1] / weights[..., np.newaxis], weights
