"""Many Bézier patches over shared vertices as a document says them."""

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from service.bases.arrays import FloatArray
from service.schemas.arrays import PATCHES, VERTEX_WEIGHTS, VERTICES
from service.schemas.channels import (
    VertexAttributes,
    VertexColors,
    VertexUvs,
    channels,
    define_channels,
)
from service.schemas.fields import NameField, Parts, StrictModel, UpField
from service.surface.patches import PatchSurface


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
    colors: VertexColors = None
    uvs: VertexUvs = None
    attributes: VertexAttributes = Field(default_factory=dict)
    up: UpField = "y"
    name: NameField = "surface"

    def to_surface(self) -> PatchSurface:
        """The surface itself; raises `InvalidRequest` with pointers relative to it."""
        parts = tuple((name, tuple(members.tolist())) for name, members in self.parts.items())
        carried = channels(self.colors, self.uvs, self.attributes)
        return PatchSurface(
            self.vertices, self.patches, self.weights, parts, self.up, self.name, carried
        )


def define(surface: PatchSurface) -> dict[str, Any]:
    """The surface in the language of requests, its arrays as they are; what it lacks left out."""
    content: dict[str, Any] = {
        "type": "patches",
        "vertices": surface.vertices,
        "patches": surface.patches,
    }
    if surface.parts:
        content["parts"] = {name: list(members) for name, members in surface.parts}
    if surface.weights is not None:
        content["weights"] = surface.weights
    content |= define_channels(surface.channels)
    return content | {"up": surface.up, "name": surface.name}
