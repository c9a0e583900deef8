"""The JSON language of one tensor-product B-spline surface, NURBS included."""

from dataclasses import replace
from typing import Annotated, Any, Literal, TypeAlias, cast

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
from service.errors import Issue
from service.schemas.arrays import KNOTS, SPLINE_NET, SplineWeights
from service.schemas.channels import (
    SplineAttributes,
    SplineColors,
    SplineUvs,
    build_channels,
    define_surface,
)
from service.schemas.fields import (
    NameField,
    StrictModel,
    UpField,
    list_of_two,
    one_or_two,
    whole_numbers,
)
from service.schemas.validation import limits_of, to_invalid, wrong_type
from service.surface.bspline import BsplineSurface
from service.surface.checks import MAX_DEGREE
from service.surface.knots import NAMED, KnotName, Knots


def check_degree_limits(degrees: tuple[int, ...], info: ValidationInfo) -> None:
    """Refuses degrees above the limit of the service, which may be lower than that of surfaces."""
    limits = limits_of(info)
    for axis, degree in enumerate(degrees):
        if degree > limits.max_degree:
            # Equal degrees may have been given as one number.
            where = "/degree" if min(degrees) == max(degrees) else f"/degree/{axis}"
            issue = _degree_error(degree, 1, limits.max_degree)
            raise to_invalid(replace(issue, pointer=where))


def _degree_error(degree: int, least: int, most: int) -> Issue:
    code = "degree_too_high" if degree > most else "out_of_range"
    needed = f"{least} to {most}"
    return Issue(code, "No B-spline has such a degree.", "", f"degree {degree}", needed)


def _knot_vectors(value: object) -> object:
    """Two knot vectors from a list of two, or from one name for both directions."""
    if isinstance(value, str):
        return [_is_known(value)] * 2
    return list_of_two(value, "a name or a list of two")


def _knots(value: object, info: ValidationInfo) -> Knots:
    """One knot vector, by its name or its numbers."""
    if isinstance(value, str):
        return _is_known(value)
    if not isinstance(value, list | np.ndarray):
        raise to_invalid(wrong_type(value, "a list of knots or a name"))
    return KNOTS.array(value, limits_of(info)).astype(np.float64, copy=False)


def _is_known(name: str) -> KnotName:
    if name not in NAMED:
        needed = "one of " + ", ".join(NAMED)
        issue = Issue("wrong_value", "No knots are known by this name.", "", "a string", needed)
        raise to_invalid(issue)
    return cast(KnotName, name)


_NAME_SCHEMA = {"type": "string", "enum": list(NAMED)}
_VECTOR_SCHEMA = {
    "oneOf": [_NAME_SCHEMA, {"type": "array", "items": {"type": "number"}, "minItems": 4}]
}


Degrees: TypeAlias = Annotated[
    tuple[int, int], Field(strict=False), *whole_numbers(1, MAX_DEGREE, _degree_error)
]
KnotVector: TypeAlias = Annotated[Any, PlainValidator(_knots), WithJsonSchema(_VECTOR_SCHEMA)]
"""Knots of one direction, by their name or their numbers."""

KnotVectors: TypeAlias = Annotated[
    tuple[Annotated[Any, PlainValidator(_knots)], Annotated[Any, PlainValidator(_knots)]],
    Field(strict=False),
    BeforeValidator(_knot_vectors),
    one_or_two(_NAME_SCHEMA, _VECTOR_SCHEMA),
]


class BsplineDefinition(StrictModel):
    """One tensor-product B-spline surface, with weights a NURBS surface.

    S(u, v) = Σ N_i(u) N_j(v) w_ij P_ij / Σ N_i(u) N_j(v) w_ij over the domain of its knots. A net
    of r × c control points needs r + p + 1 knots along u and c + q + 1 along v; every interval
    between two different knots of the domain becomes one Bézier patch in each direction.
    """

    type: Literal["bspline"] = Field(description="The kind of surface.")
    control_net: Annotated[FloatArray, SPLINE_NET] = Field(
        description="Control points, row by row: rows along u, three coordinates [x, y, z] each, "
        "all rows of one length. At least degree + 1 of them in each direction (3 in a periodic "
        "one); every coordinate finite and within single precision.",
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
        description="Degree along u and along v, 1 to 64; one number means both. Left out: 3.",
        examples=[[3, 2]],
    )
    knots: KnotVectors = Field(
        default=("clamped", "clamped"),
        description="Knots along u and along v: numbers that never decrease, each at most degree + "
        "1 times, or a name; one name means both. `clamped` reaches the first and last control "
        "points; `uniform` does not; `periodic` closes smoothly, its control points given once. "
        "Intervals of named knots have length 1, the first begins at 0. Equal knots: degree times "
        "is a crease, degree + 1 times parts the surface. Knots that differ by less than 9e-13 of "
        "the domain are taken for equal, up to degree times. The first and the last knot, which "
        "do not matter, may both be left out. Left out: clamped.",
        examples=[["clamped", [0, 0, 0, 0.5, 1, 1, 1]]],
    )
    weights: SplineWeights = Field(
        default=None, examples=[[[1, 1, 1, 1], [1, 2, 2, 1], [1, 2, 2, 1], [1, 1, 1, 1]]]
    )
    colors: SplineColors = None
    uvs: SplineUvs = None
    attributes: SplineAttributes = Field(default_factory=dict)
    up: UpField = "y"
    name: NameField = "surface"

    @model_validator(mode="after")
    def _check_degree(self, info: ValidationInfo) -> "BsplineDefinition":
        check_degree_limits(self.degree, info)
        return self

    def to_surface(self) -> BsplineSurface:
        """The surface itself; raises `InvalidRequest` with pointers relative to it."""
        channels = build_channels(self.colors, self.uvs, self.attributes)
        return BsplineSurface(
            self.control_net, self.degree, self.knots, self.weights, self.up, self.name, channels
        )


def define_bspline(surface: BsplineSurface) -> dict[str, Any]:
    """The surface in the form of a request, with NumPy arrays, without the fields that it lacks."""
    return define_surface("bspline", surface, "control_net", "degree", "knots", "weights")
