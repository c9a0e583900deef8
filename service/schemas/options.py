"""How a surface shall be meshed and written: one model, behind the body and the query alike."""

from math import pi
from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from service.engine.options import Faces, MeshOptions
from service.schemas.fields import Omittable, Overlays, Resolution, StrictModel

OoglForm: TypeAlias = Literal["cquad", "mesh", "off", "bez"]
"""As `service.encoders.format` has it: languages and formats do not know each other."""

_DEFAULTS = MeshOptions()


class MeshOptionFields(StrictModel):
    """The options of a mesh. All may be left out."""

    resolution: Resolution = Field(
        default=_DEFAULTS.resolution,
        description="Divisions of every patch: one number, or [u, v]. A patch has "
        "(u + 1) × (v + 1) vertices.",
        examples=[16, [16, 32]],
    )
    faces: Faces = Field(
        default=_DEFAULTS.faces,
        description="Kind of faces. `quads` only where the format has them.",
        examples=["quads"],
    )
    normals: bool = Field(
        default=_DEFAULTS.normals, description="Whether vertices carry analytic unit normals."
    )
    uvs: bool = Field(
        default=_DEFAULTS.uvs,
        description="Whether vertices carry their parameters (u, v) in their patch. A surface that "
        "has texture coordinates of its own (`uvs`) comes out with those, whatever is said here.",
    )
    weld: bool = Field(
        default=_DEFAULTS.weld,
        description="Whether patches share the vertices of the edges that they share. `false` "
        "keeps every sample of every patch as a vertex of its own, patch after patch, sample "
        "(i, j) → i (Rv + 1) + j with Rv the divisions along v; also the samples at a pole that "
        "no face uses.",
    )
    crease_angle: Annotated[float, Field(ge=0, le=pi)] = Field(
        default=_DEFAULTS.crease_angle,
        description="Radians. Where patches meet at a larger angle their normals stay apart.",
        examples=[0.5],
    )
    overlays: Overlays = Field(
        default=_DEFAULTS.overlays,
        description="Lines to draw beside the faces, where the format has lines.",
        examples=[["control_net", "boundary"]],
    )
    oogl: Annotated[OoglForm | None, Omittable()] = Field(
        default=None,
        description="Form of an OOGL file: `cquad` (the default for grids of quads), `mesh`, `off` "
        "(the default elsewhere) or `bez`, the exact patches. Other formats do not read it.",
        examples=["bez"],
    )

    def mesh_options(self) -> MeshOptions:
        """The part that the engine reads."""
        return MeshOptions(
            resolution=self.resolution,
            faces=self.faces,
            normals=self.normals,
            uvs=self.uvs,
            weld=self.weld,
            crease_angle=self.crease_angle,
            overlays=self.overlays,
        )
