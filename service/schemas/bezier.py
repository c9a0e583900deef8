"""The JSON language of one Bézier patch, tensor-product or triangular; nets of triangles as rows.

In a document, the net of a triangle is a list of rows of n + 1, n, … 1 entries. In an array, all
rows are one axis of (n+1)(n+2)/2 entries.
"""

import re
from dataclasses import replace
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from service.bases.arrays import AnyArray, FloatArray
from service.bases.raising import Raising, TriangleDirection
from service.bases.triangle import degree_of, degree_or_none, row_starts
from service.errors import InvalidRequest, Issue, pointer
from service.schemas.arrays import NumberGrid
from service.schemas.channels import NET, TRIANGLE, build_channels
from service.schemas.document import DocumentLimits
from service.schemas.fields import SURFACE_WEIGHTS, NameField, UpField
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
    least_of_patches,
    least_of_triangles,
    plan_net,
)
from service.surface.bezier import BezierSurface, TriangleSurface

CONTROL_NET = NumberGrid(
    ("rows", "control points", "coordinates"),
    width=3,
    may_be_planar=True,
    may_be_homogeneous=True,
    point_levels=2,
    degree_levels=(0, 1),
)
NET_WEIGHTS = NumberGrid(("rows", "weights"), is_weight=True, degree_levels=(0, 1))


class BezierNet(RationalModel):
    """One tensor-product Bézier patch: the surface of a face of a `brep`.

    S(u, v) = Σ B_i(u) B_j(v) w_ij P_ij / Σ B_i(u) B_j(v) w_ij for u and v from 0 to 1. A net of
    r × c control points has degree (r − 1, c − 1); rows follow each other along u, columns
    along v.
    """

    type: Literal["bezier"] = Field(
        default="bezier", description="The kind of surface; `bezier` is the default."
    )
    homogeneous: Homogeneous = False
    control_net: Annotated[FloatArray, CONTROL_NET] = Field(
        description="Control points [x, y, z], or [x, y] in the plane z = 0, row by row; "
        "[w x, w y, w z, w] if they are `homogeneous`. Rows "
        "follow each other along u, points in a row along v; rows have equal lengths. At least "
        "2 × 2 points; every coordinate is finite and within single precision.",
        examples=[[[[0, 0, 0], [0, 1, 1], [0, 2, 0]], [[1, 0, 1], [1, 1, 2], [1, 2, 1]]]],
    )
    weights: Annotated[FloatArray | None, NET_WEIGHTS, SURFACE_WEIGHTS] = Field(
        default=None, examples=[[[1, 0.7071067811865476, 1], [1, 0.7071067811865476, 1]]]
    )

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        return self.prepare(info) if self.homogeneous or self.weights is not None else self

    def _plan(self, limits: DocumentLimits) -> Raising | None:
        weights = find_weights(self.control_net, self.weights, is_homogeneous=self.homogeneous)
        if weights is None:
            return None
        field = "control_net" if self.homogeneous else "weights"
        return plan_net(
            weights,
            bezier_directions(weights.shape),
            limits,
            corners=[(field, *index) for index in find_corners(weights)],
            look=lambda: least_of_patches(weights[np.newaxis]),
        )

    def divided(self) -> Self:
        """The net with points and positive weights."""
        if (not self.homogeneous and self.weights is None) or self.raising is None:
            return self
        values = lift(self.control_net, self.weights, is_homogeneous=self.homogeneous)
        points, weights = divide(self.raising.apply(values))
        return self.replaced(control_net=points, weights=weights)


class BezierDefinition(BezierNet):
    """One tensor-product Bézier patch of any degree, rational if weights are given.

    S(u, v) = Σ B_i(u) B_j(v) w_ij P_ij / Σ B_i(u) B_j(v) w_ij for u and v from 0 to 1. A net of
    r × c control points has degree (r − 1, c − 1); rows follow each other along u, columns
    along v.
    """

    colors: Annotated[FloatArray | None, *NET.colors()] = None
    uvs: Annotated[FloatArray | None, *NET.uvs()] = None
    attributes: Annotated[dict[str, Annotated[FloatArray, NET.values()]], *NET.attributes()] = (
        Field(default_factory=dict)
    )
    up: UpField = "y"
    name: NameField = "surface"

    def to_surface(self) -> BezierSurface:
        """The surface as a value; raises `InvalidRequest` with pointers relative to the surface."""
        channels = build_channels(self.colors, self.uvs, self.attributes)
        net = self.divided()
        return BezierSurface(net.control_net, net.weights, self.up, self.name, channels)


TRIANGLE_RULE = "A triangle of n + 1 rows is one patch of degree n."
TRIANGLE_NET = NumberGrid(
    ("rows", "control points", "coordinates"),
    width=3,
    may_be_planar=True,
    may_be_homogeneous=True,
    point_levels=2,
    degree_levels=(0,),
    degree_rule=TRIANGLE_RULE,
    triangle_level=1,
)
TRIANGLE_WEIGHTS = NumberGrid(
    ("rows", "weights"),
    is_weight=True,
    degree_levels=(0,),
    degree_rule=TRIANGLE_RULE,
    triangle_level=1,
)

_NETS = ("control_net", "weights", "colors", "uvs")


class TriangleDefinition(RationalModel):
    """One triangular Bézier patch of any degree, rational if weights are given.

    S(r, s, t) = Σ n!/(i! j! k!) r^i s^j t^k w_ijk b_ijk / Σ n!/(i! j! k!) r^i s^j t^k w_ijk for
    r + s + t = 1. The net has n + 1 rows of n + 1, n, … 1 control points. Row k has the points
    b_ijk with this k, in the order of ascending j. So the first row is the side t = 0, and the last
    row is the corner t = 1.
    """

    type: Literal["triangle"] = Field(description="The kind of surface.")
    homogeneous: Homogeneous = False
    control_net: Annotated[FloatArray, TRIANGLE_NET] = Field(
        description="Control points [x, y, z], or [x, y] in the plane z = 0, row by row; "
        "[w x, w y, w z, w] if they are `homogeneous`. Each row has one point "
        "less than the row before. At least two rows; every coordinate is finite and within single "
        "precision. Seen from the side to which the normal points, each row goes from left to "
        "right, and is above the row before.",
        examples=[[[[0, 0, 0], [1, 0, 1], [2, 0, 0]], [[0, 1, 1], [1, 1, 1]], [[0, 2, 0]]]],
    )
    weights: Annotated[FloatArray | None, TRIANGLE_WEIGHTS, SURFACE_WEIGHTS] = Field(
        default=None,
        examples=[[[1, 0.7071067811865476, 1], [0.7071067811865476, 0.7071067811865476], [1]]],
    )
    colors: Annotated[FloatArray | None, *TRIANGLE.colors()] = None
    uvs: Annotated[FloatArray | None, *TRIANGLE.uvs()] = None
    attributes: Annotated[
        dict[str, Annotated[FloatArray, TRIANGLE.values()]], *TRIANGLE.attributes()
    ] = Field(default_factory=dict)
    up: UpField = "y"
    name: NameField = "surface"

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        return self.prepare(info) if self.homogeneous or self.weights is not None else self

    def _plan(self, limits: DocumentLimits) -> Raising | None:
        weights = find_weights(self.control_net, self.weights, is_homogeneous=self.homogeneous)
        if weights is None:
            return None
        degree = degree_of(len(weights))
        field = "control_net" if self.homogeneous else "weights"
        rows = {0: (0, 0), degree: (0, degree), len(weights) - 1: (degree, 0)}
        return plan_net(
            weights,
            [TriangleDirection(0, degree)],
            limits,
            corners=[(field, *row) for index, row in rows.items() if weights[index] <= 0],
            look=lambda: least_of_triangles(weights[np.newaxis]),
        )

    def divided(self) -> Self:
        """The triangle with points and positive weights."""
        if (not self.homogeneous and self.weights is None) or self.raising is None:
            return self
        values = lift(self.control_net, self.weights, is_homogeneous=self.homogeneous)
        points, weights = divide(self.raising.apply(values))
        return self.replaced(control_net=points, weights=weights)

    def to_surface(self) -> TriangleSurface:
        """The surface as a value; raises `InvalidRequest` with pointers relative to the surface."""
        try:
            channels = build_channels(self.colors, self.uvs, self.attributes)
            net = self.divided()
            return TriangleSurface(net.control_net, net.weights, self.up, self.name, channels)
        except InvalidRequest as error:
            nets = {f"/{name}": getattr(self, name) for name in _NETS}
            nets |= {pointer(("attributes", name)): net for name, net in self.attributes.items()}
            for prefix, net in nets.items():
                error = error if net is None else point_to_rows(error, prefix, len(net))
            raise error from None


def write_rows(content: dict[str, Any]) -> dict[str, Any]:
    """The content of a surface, with the nets of triangles as lists of rows, as in documents."""
    if "triangles" in content:
        return content | {"triangles": [split_rows(indices) for indices in content["triangles"]]}
    if content["type"] != "triangle":
        return content
    return {name: _split_nets(value) for name, value in content.items()}


def _split_nets(value: Any) -> Any:
    """A field of a triangle, with each array in it as a list of rows."""
    if isinstance(value, dict):
        return {name: split_rows(net) for name, net in value.items()}
    return split_rows(value) if isinstance(value, np.ndarray) else value


def split_rows(values: AnyArray) -> list[AnyArray]:
    """Split an array of (n+1)(n+2)/2 entries of a triangle into rows of n+1, n, … 1 entries."""
    return np.split(values, row_starts(degree_of(len(values)))[1:-1])


def point_to_rows(error: InvalidRequest, prefix: str, count: int) -> InvalidRequest:
    """The error, with pointers into the rows of a document in place of pointers into arrays.

    A pointer to entry k of an array becomes a pointer to entry j of row m. Returns the error
    unchanged if no triangle has `count` entries.

    Parameters
    ----------
    error : InvalidRequest
    prefix : str
        A regular expression for the pointers of the arrays to change. Names of fields and of
        attributes need no escapes: they have only letters, digits and _.
    count : int
        The number of entries of an array, all rows together.
    """
    degree = degree_or_none(count)
    if degree is None:
        return error
    starts = row_starts(degree)

    def move_issue(issue: Issue) -> Issue:
        match = re.match(rf"({prefix})/(\d+)(/.*)?\Z", issue.pointer)
        if match is None:
            return issue
        entry = int(match[2])
        row = int(np.searchsorted(starts, entry, side="right")) - 1
        where = f"{match[1]}/{row}/{entry - int(starts[row])}{match[3] or ''}"
        return replace(issue, pointer=where)

    return InvalidRequest(*map(move_issue, error.issues))
