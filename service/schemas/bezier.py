"""The JSON language of one tensor-product Bézier patch."""

from typing import Annotated, Literal

from pydantic import Field

from service.bases.arrays import FloatArray
from service.schemas.arrays import NumberGrid
from service.schemas.channels import NET, build_channels
from service.schemas.fields import SURFACE_WEIGHTS, NameField, StrictModel, UpField
from service.surface.bezier import BezierSurface

CONTROL_NET = NumberGrid(
    ("rows", "control points", "coordinates"), width=3, point_levels=2, degree_levels=(0, 1)
)
NET_WEIGHTS = NumberGrid(("rows", "weights"), positive=True, degree_levels=(0, 1))


class BezierDefinition(StrictModel):
    """One tensor-product Bézier patch of any degree, rational if weights are given.

    S(u, v) = Σ B_i(u) B_j(v) w_ij P_ij / Σ B_i(u) B_j(v) w_ij for u and v from 0 to 1. A net of
    r × c control points has degree (r − 1, c − 1); rows follow each other along u, columns
    along v.
    """

    type: Literal["bezier"] = Field(
        default="bezier", description="The kind of surface; `bezier` is the default."
    )
    control_net: Annotated[FloatArray, CONTROL_NET] = Field(
        description="Control points [x, y, z], row by row. Rows follow each other along u, "
        "points in a row along v; rows have equal lengths. At least 2 × 2 points; every "
        "coordinate is finite and within single precision.",
        examples=[[[[0, 0, 0], [0, 1, 1], [0, 2, 0]], [[1, 0, 1], [1, 1, 2], [1, 2, 1]]]],
    )
    weights: Annotated[FloatArray | None, NET_WEIGHTS, SURFACE_WEIGHTS] = Field(
        default=None, examples=[[[1, 0.7071067811865476, 1], [1, 0.7071067811865476, 1]]]
    )
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
        return BezierSurface(self.control_net, self.weights, self.up, self.name, channels)
