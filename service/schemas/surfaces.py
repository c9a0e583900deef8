"""The kinds of surface as a document says them: one model a kind, one union of them all.

To add a kind: a model with its own `type` and a `to_surface`, its name in `KINDS`, a line in
`SurfaceDefinition`, and a case in `definition`.
"""

from dataclasses import replace
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Discriminator, Field, Tag

from service.errors import Issue
from service.schemas.arrays import CONTROL_NET, NET_WEIGHTS, PATCHES, VERTEX_WEIGHTS, VERTICES
from service.schemas.fields import Name, Parts, StrictModel
from service.schemas.refusals import refusal, wrong_type
from service.surface import Surface
from service.surface.bezier import BezierSurface
from service.surface.lowered import FloatArray, Up
from service.surface.patches import PatchSurface

_UP = Field(
    description="The model's vertical axis. With `z` the root node of a glTF file turns the model "
    "upright; the coordinates stay as they are.",
    examples=["z"],
)
_NAME = Field(
    description="Name of the surface: of its part, its glTF node, its OOGL comment.",
    examples=["sail"],
)


class BezierDefinition(StrictModel):
    """One tensor-product Bézier patch of any degree, rational if weights are given.

    S(u, v) = Σ B_i(u) B_j(v) w_ij P_ij / Σ B_i(u) B_j(v) w_ij for u and v from 0 to 1. A net of
    r × c control points has degree (r − 1, c − 1); rows run along u, columns along v.
    """

    type: Literal["bezier"] = Field(
        default="bezier", description="The kind of surface; this one when left out."
    )
    control_net: Annotated[FloatArray, CONTROL_NET] = Field(
        description="Control points, row by row: rows along u, three coordinates [x, y, z] each, "
        "all rows of one length. At least 2 × 2; every coordinate finite and within single "
        "precision.",
        examples=[[[[0, 0, 0], [0, 1, 1], [0, 2, 0]], [[1, 0, 1], [1, 1, 2], [1, 2, 1]]]],
    )
    weights: Annotated[FloatArray | None, NET_WEIGHTS] = Field(
        default=None,
        description="One positive weight for every control point, in the same rows. Left out, the "
        "surface is polynomial.",
        examples=[[[1, 0.7071067811865476, 1], [1, 0.7071067811865476, 1]]],
    )
    up: Annotated[Up, _UP] = "y"
    name: Annotated[Name, _NAME] = "surface"

    def to_surface(self) -> BezierSurface:
        """The surface itself; raises `InvalidRequest` with pointers relative to it."""
        return BezierSurface(self.control_net, self.weights, self.up, self.name)


class PatchesDefinition(StrictModel):
    """Many Bézier patches of one degree over shared vertices, as the files of the teapot are.

    Neighbouring patches name the same vertices, so that their seams close exactly.
    """

    type: Literal["patches"] = Field(description="The kind of surface.")
    vertices: Annotated[FloatArray, VERTICES] = Field(
        description="Control points [x, y, z] that the patches share.",
        examples=[[[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1], [2, 0, 0], [2, 1, 0]]],
    )
    weights: Annotated[FloatArray | None, VERTEX_WEIGHTS] = Field(
        default=None,
        description="One positive weight for every vertex.",
        examples=[[1, 1, 0.5, 0.5, 1, 1]],
    )
    patches: Annotated[NDArray[np.int64], PATCHES] = Field(
        description="One grid of vertex numbers (from 0) a patch, rows along u: 4 × 4 numbers for "
        "a bicubic patch. All grids have one shape.",
        examples=[[[[0, 1], [2, 3]], [[2, 3], [4, 5]]]],
    )
    parts: Parts = Field(
        default_factory=dict,
        description="Named groups of patches, by patch number (from 0). A patch belongs to at most "
        "one; those in none form a part of the surface's name.",
        examples=[{"left": [0], "right": [1]}],
    )
    up: Annotated[Up, _UP] = "y"
    name: Annotated[Name, _NAME] = "surface"

    def to_surface(self) -> PatchSurface:
        """The surface itself; raises `InvalidRequest` with pointers relative to it."""
        parts = tuple((name, tuple(members.tolist())) for name, members in self.parts.items())
        return PatchSurface(self.vertices, self.patches, self.weights, parts, self.up, self.name)


KINDS = ("bezier", "patches")
"""Names of the kinds of surface; the first is meant where none is said."""


def _kind_of(value: object) -> str | None:
    """The member of the union that a checked value wants to be."""
    return str(value.get("type", KINDS[0])) if isinstance(value, dict) else None


def _of_known_kind(value: object) -> object:
    """Refuses what names no kind, before the union is asked."""
    if not isinstance(value, dict):
        raise refusal([((), wrong_type(value, "an object"))])
    wanted = value.get("type", KINDS[0])
    needed = "one of " + ", ".join(KINDS)
    if not isinstance(wanted, str):
        raise refusal([((), replace(wrong_type(wanted, needed), pointer="/type"))])
    if wanted not in KINDS:
        got = "an unknown name"
        issue = Issue("unknown_type", "There is no such kind of surface.", "/type", got, needed)
        raise refusal([((), issue)])
    return value


SurfaceDefinition: TypeAlias = Annotated[
    Annotated[BezierDefinition, Tag("bezier")] | Annotated[PatchesDefinition, Tag("patches")],
    Discriminator(_kind_of),
    BeforeValidator(_of_known_kind),
]


def definition(surface: Surface) -> dict[str, Any]:
    """A surface in the language of requests, its arrays as they are; what it lacks left out."""
    if isinstance(surface, BezierSurface):
        content: dict[str, Any] = {"type": "bezier", "control_net": surface.control_net}
    else:
        content = {
            "type": "patches",
            "vertices": surface.vertices,
            "patches": surface.patches,
        }
        if surface.parts:
            content["parts"] = {name: list(members) for name, members in surface.parts}
    if surface.weights is not None:
        content["weights"] = surface.weights
    return content | {"up": surface.up, "name": surface.name}
