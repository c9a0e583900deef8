"""The JSON language of a triangular Bézier patch, and the rows of its nets.

A document has rows of n + 1, n, … 1 entries; arrays have one axis of (n+1)(n+2)/2.
"""

import re
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from service.bases.arrays import FloatArray
from service.bases.triangle import degree_of, degree_or_none, row_starts
from service.errors import InvalidRequest, Issue, pointer
from service.schemas.arrays import TRIANGLE_NET, TriangleWeights
from service.schemas.channels import (
    TriangleAttributes,
    TriangleColors,
    TriangleUvs,
    build_channels,
    define_surface,
)
from service.schemas.fields import NameField, StrictModel, UpField
from service.surface.triangle import TriangleSurface

_NETS = ("control_net", "weights", "colors", "uvs")


class TriangleDefinition(StrictModel):
    """One triangular Bézier patch of any degree, rational if weights are given.

    S(r, s, t) = Σ n!/(i! j! k!) r^i s^j t^k w_ijk b_ijk / Σ n!/(i! j! k!) r^i s^j t^k w_ijk for
    r + s + t = 1. The net has n + 1 rows of n + 1, n, … 1 control points: row k holds those of that
    k, with j rising, so the first row is the side t = 0 and the last one the corner t = 1.
    """

    type: Literal["triangle"] = Field(description="The kind of surface.")
    control_net: Annotated[FloatArray, TRIANGLE_NET] = Field(
        description="Control points [x, y, z], row by row, each row one shorter than the one "
        "before. At least two rows; every coordinate finite and within single precision. Seen from "
        "outside the rows lie one above the other and run from left to right.",
        examples=[[[[0, 0, 0], [1, 0, 1], [2, 0, 0]], [[0, 1, 1], [1, 1, 1]], [[0, 2, 0]]]],
    )
    weights: TriangleWeights = Field(
        default=None,
        examples=[[[1, 0.7071067811865476, 1], [0.7071067811865476, 0.7071067811865476], [1]]],
    )
    colors: TriangleColors = None
    uvs: TriangleUvs = None
    attributes: TriangleAttributes = Field(default_factory=dict)
    up: UpField = "y"
    name: NameField = "surface"

    def to_surface(self) -> TriangleSurface:
        """The surface itself; raises `InvalidRequest` with pointers relative to it."""
        try:
            channels = build_channels(self.colors, self.uvs, self.attributes)
            return TriangleSurface(self.control_net, self.weights, self.up, self.name, channels)
        except InvalidRequest as error:
            nets = {f"/{name}": getattr(self, name) for name in _NETS}
            nets |= {pointer(("attributes", name)): net for name, net in self.attributes.items()}
            moved = error
            for prefix, net in nets.items():
                moved = moved if net is None else to_rows(moved, prefix, len(net))
            raise moved from None


def define_triangle(surface: TriangleSurface) -> dict[str, Any]:
    """The definition of the surface, with arrays; without the fields that it does not have."""
    return define_surface("triangle", surface, "control_net", "weights")


def replace_rows(content: dict[str, Any]) -> dict[str, Any]:
    """The content with rows for every net, as documents have them."""
    rows: dict[str, Any] = {name: split_rows(content[name]) for name in _NETS if name in content}
    if "attributes" in content:
        rows["attributes"] = {name: split_rows(net) for name, net in content["attributes"].items()}
    return content | rows


def split_rows(values: NDArray[Any]) -> list[NDArray[Any]]:
    """The rows of n+1, n, … 1 entries of an array over a triangle."""
    starts = row_starts(degree_of(len(values)))
    return np.split(values, starts[1:-1])


def to_rows(error: InvalidRequest, prefix: str, count: int) -> InvalidRequest:
    """The error with pointers to entry j of row m instead of entry k below `prefix` (a pattern).

    `count` is the number of entries of the triangle.
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
