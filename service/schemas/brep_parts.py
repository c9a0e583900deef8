"""The JSON language of one edge, one face, one loop and one shell of a brep.

`service.schemas.brep_batches` reads valid edges and faces without these models. The models describe
them in the OpenAPI document, and word the errors of the first that is wrong.
"""

from typing import Annotated, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field, Tag, model_validator

from service.errors import InvalidRequest, Issue, count_nouns, pointer
from service.schemas.arrays import NumberGrid
from service.schemas.bezier import BezierNet
from service.schemas.bspline import BsplineNet
from service.schemas.curves import CurveDefinition
from service.schemas.fields import (
    Color,
    Name,
    Omittable,
    StrictModel,
    length_issue,
    one_of_kinds,
    optional,
)
from service.schemas.validation import MAX_INDEX, index_too_large, kind, to_invalid, to_refusal
from service.surface.bezier import BezierSurface
from service.surface.brep import discontinuous_surface
from service.surface.bspline import BsplineSurface
from service.surface.knot_tables import KnotTable

_ARC = {"control_points": [[0, 0, 0], [1, 2, 0], [3, 2, 1]]}


def _refuse_large(index: int) -> int:
    """Refuse an index that not all programs can store; smaller ones are looked up later."""
    if abs(index) > MAX_INDEX:
        raise to_invalid(index_too_large())
    return index


Index: TypeAlias = Annotated[
    int, Field(json_schema_extra={"minimum": 0}), AfterValidator(_refuse_large)
]
"""The number of a vertex, an edge or a face, from 0; the class of the brep checks it."""


class EdgeDefinition(StrictModel):
    """An edge: a curve of space between two vertices.

    An edge without a `curve` is a straight line between its vertices.
    """

    vertices: Annotated[tuple[Index, ...], Field(strict=False, min_length=1, max_length=2)] = Field(
        description="The numbers, from 0, of the vertices at which the curve begins and ends. A "
        "closed curve begins and ends at one vertex, whose number is there twice. A `degenerate` "
        "edge has one vertex.",
        examples=[[0, 1], [4, 4]],
    )
    curve: Annotated[CurveDefinition | None, Omittable()] = optional(
        "The curve, with control points [x, y, z]. Its `up` and `name` have no effect.",
        _ARC,
    )
    uncertainty: Annotated[float | None, Omittable(), Field(ge=0)] = optional(
        "How far the curve may be from the true edge, in model units; an edge that is no longer "
        "than this may become a point. The default is the uncertainty of the brep.",
        1e-6,
    )
    degenerate: bool = Field(
        default=False,
        description="Whether the edge is a point: a side of a surface that is collapsed, as at the "
        "pole of a sphere. Such an edge has one vertex and no curve.",
    )

    @model_validator(mode="after")
    def _check(self) -> "EdgeDefinition":
        names = set(self.vertices)
        if self.degenerate and len(names) > 1:
            message = "A degenerate edge has one vertex."
            raise to_refusal([(("vertices",), length_issue("two vertices", "one", message))])
        if not self.degenerate and len(self.vertices) < 2:
            message = "An edge lies between two vertices, which may be the same."
            raise to_refusal([(("vertices",), length_issue("one vertex", "two", message))])
        if self.curve is None:
            return self
        if self.degenerate:
            message = "A degenerate edge is a point and has no curve."
            issue = Issue("conflicting_options", message, "", "a curve", "nothing")
            raise to_refusal([(("curve",), issue)])
        _check_curve(self.curve, ("curve",), 3)
        return self


def _check_curve(curve: Any, path: tuple[str | int, ...], dimension: int) -> None:
    """Refuse a curve as its own class does, and control points of another dimension."""
    curve = curve.divided()
    found = curve.control_points.shape[-1]
    if found != dimension:
        message = {
            2: "A pcurve has two coordinates, u and v: it is in the parameters of the surface.",
            3: "The curve of an edge is in space: its points have three coordinates.",
        }
        texts = count_nouns(found, "coordinates"), count_nouns(dimension, "coordinates")
        issue = Issue("wrong_dimension", message[dimension], "/control_points", *texts)
        raise to_refusal([(path, issue)])
    try:
        curve.to_curve()
    except InvalidRequest as error:
        raise to_refusal((path, issue) for issue in error.issues) from None


_SOME = Field(strict=False, min_length=1, fail_fast=True)
"""A list with items; after the first wrong item the others are not checked."""


class LoopDefinition(StrictModel):
    """A loop: edges that follow each other around a face, with the face on their left.

    Left is as seen with du × dv towards the viewer, also if the face is reversed. Loops are given
    by their `edges`, by `pcurves`, or by both.
    """

    edges: Annotated[tuple[Index, ...] | None, Omittable(), _SOME] = optional(
        "The numbers of the edges, from 0, in the order of the loop. Left out, the loop is "
        "given by its pcurves alone, and its edges belong to this face only.",
        [0, 1, 2, 3],
    )
    reversed: Annotated[tuple[bool, ...] | None, Omittable(), _SOME] = optional(
        "For each edge, whether the loop runs from its end to its start; left out, none does.",
        [False, True, False, False],
    )
    pcurves: Annotated[tuple[CurveDefinition | None, ...] | None, Omittable(), _SOME] = optional(
        "For each edge, its curve in the parameters of the surface, with control points [u, v]; or "
        "null, and the service makes it. A pcurve runs in the direction of its edge, also where "
        "the loop is reversed, and at the parameters of the edge up to an affine map. A pcurve "
        "that does not, or that is further from the edge than the uncertainty, is made anew.",
        [{"control_points": [[0, 0], [1, 0]]}, None, None, None],
    )

    @model_validator(mode="after")
    def _check(self) -> "LoopDefinition":
        lists = {"edges": self.edges, "pcurves": self.pcurves, "reversed": self.reversed}
        given = {name: values for name, values in lists.items() if values is not None}
        if "edges" not in given and "pcurves" not in given:
            message = "A loop is given by its edges, by pcurves, or by both."
            issue = Issue("missing_field", message, "/edges", "neither", "`edges` or `pcurves`")
            raise to_invalid(issue)
        first, *others = given
        count = len(given[first])
        for name in others:
            if len(given[name]) != count:
                message = f"There is one entry for each of the {first}."
                issue = length_issue(f"a list of {len(given[name])}", str(count), message)
                raise to_refusal([((name,), issue)])
        for number, edge in enumerate(self.edges or ()):
            if edge < 0:
                message = "A loop lists edges by their numbers, from 0."
                issue = Issue("unknown_edge", message, "", f"edge {edge}", "a number from 0")
                raise to_refusal([(("edges", number), issue)])
        for number, curve in enumerate(self.pcurves or ()):
            if curve is not None:
                _check_curve(curve, ("pcurves", number), 2)
            elif self.edges is None:
                message = "A loop without edges is given by its pcurves."
                issue = Issue("null_value", message, "", "null", "a curve; or `edges`")
                raise to_refusal([(("pcurves", number), issue)])
        return self


_OWN_FIELDS = {
    "colors": "a face has a `color`",
    "uvs": "the parameters of the face are its texture coordinates",
    "attributes": "faces have no attributes",
    "up": "the brep has an `up`",
    "name": "a face has a `name`",
}
"""Fields that the surface of a face does not have, and what stands in place of them."""


def _refuse_own_fields(value: object) -> object:
    """Refuse fields of surfaces that the surface of a face does not have."""
    if isinstance(value, dict) and _OWN_FIELDS.keys() & value.keys():
        message = "The surface of a face is geometry alone."
        # The pointer is in the issue: after `surface`, a path has the name of a model.
        raise to_refusal(
            (
                (),
                Issue(
                    "unknown_field", message, f"/{name}", kind(value[name]), f"nothing here: {text}"
                ),
            )
            for name, text in _OWN_FIELDS.items()
            if name in value
        )
    return value


FaceSurface: TypeAlias = Annotated[
    Annotated[BezierNet, Tag("bezier")] | Annotated[BsplineNet, Tag("bspline")],
    *one_of_kinds(
        ("bezier", "bspline"),
        Issue("unknown_type", "The surface of a face is one patch or one B-spline."),
        "The surface of a face.",
    ),
    BeforeValidator(_refuse_own_fields),
]


class FaceDefinition(StrictModel):
    """A face: the part of a surface that is inside its loops.

    A face without loops is its whole surface, with its natural borders. Where the surface is
    closed, or collapses to a point, the face is closed there.
    """

    name: Annotated[Name | None, Omittable()] = optional("Name of the face.", "top")
    color: Annotated[Color | None, Omittable()] = optional(
        "Colour of the face: red, green, blue and, as an optional fourth number, opacity; sRGB, "
        "each from 0 to 1. The colour of a member of a group applies to faces without one.",
        [0.8, 0.2, 0.1],
    )
    reversed: bool = Field(
        default=False, description="Whether the normal of the face is −(du × dv)."
    )
    surface: FaceSurface = Field(
        description="The surface, which may be larger than the face. It is continuous: inside its "
        "domain no knot occurs more than degree times.",
        examples=[{"control_net": [[[0, 0, 0], [0, 10, 0]], [[10, 0, 0], [10, 10, 0]]]}],
    )
    loops: Annotated[tuple[LoopDefinition, ...], Field(strict=False, fail_fast=True)] = Field(
        default=(),
        description="The loops, in any order: material is on the left of each of them.",
        examples=[[{"edges": [0, 1, 2, 3]}, {"edges": [4], "reversed": [True]}]],
    )

    @model_validator(mode="after")
    def _check(self) -> "FaceDefinition":
        try:
            _check_surface(self.surface)
        except InvalidRequest as error:
            raise to_refusal((("surface",), issue) for issue in error.issues) from None
        return self


def _check_surface(surface: BezierNet | BsplineNet) -> None:
    """Refuse a surface as its own class does, and a surface that is not continuous."""
    surface = surface.divided()
    if isinstance(surface, BezierNet):
        BezierSurface(surface.control_net, surface.weights)
        return
    value = BsplineSurface(surface.control_net, surface.degree, surface.knots, surface.weights)
    for axis, (knots, degree) in enumerate(zip(value.knot_vectors, value.degree, strict=True)):
        count = len(knots) - degree - 1
        if KnotTable(knots, np.array([degree]), np.array([count])).find_discontinuous().any():
            raise InvalidRequest(discontinuous_surface(pointer(("knots", axis))))


class ShellDefinition(StrictModel):
    """A shell: faces that are connected at their edges."""

    faces: Annotated[NDArray[np.int64], NumberGrid(("face numbers",), integers=True)] = Field(
        description="The numbers of the faces, from 0. Each face belongs to one shell.",
        examples=[[0, 1, 2, 3, 4, 5]],
    )
    closed: bool = Field(
        default=False,
        description="Whether the shell is closed: then it is refused if an edge of it has a "
        "border.",
    )
