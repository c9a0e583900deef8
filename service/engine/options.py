"""What may be asked of the engine, checked at birth."""

from dataclasses import dataclass
from math import pi, radians
from typing import Literal, TypeAlias

from service.errors import InvalidRequest, Issue

Faces: TypeAlias = Literal["triangles", "quads"]
OverlayName: TypeAlias = Literal["control_net", "boundary"]

MAX_RESOLUTION = 1 << 16
"""Divisions in one direction beyond which a number is a mistake. What is affordable is decided by
the vertices that would come out."""


@dataclass(frozen=True, slots=True)
class MeshOptions:
    """How a surface shall be divided into a mesh.

    Attributes
    ----------
    resolution : (Ru, Rv)
        Divisions of every patch along u and v.
    faces : "triangles" or "quads"
    normals, uvs : bool
        Whether vertices carry unit normals, and parameters (u, v) where the surface has no texture
        coordinates of its own.
    weld : bool
        Whether patches share the vertices of the edges they share.
    crease_angle : float
        Radians. Welded positions whose normals differ by more keep them apart.
    overlays : tuple of names
        Lines to draw beside the faces.
    """

    resolution: tuple[int, int] = (16, 16)
    faces: Faces = "triangles"
    normals: bool = True
    uvs: bool = False
    weld: bool = True
    crease_angle: float = radians(1.0)
    overlays: tuple[OverlayName, ...] = ()

    def __post_init__(self) -> None:
        if not all(1 <= r <= MAX_RESOLUTION for r in self.resolution):
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The resolution is the number of divisions of a patch along u and along v.",
                    "/resolution",
                    f"{self.resolution[0]} × {self.resolution[1]}",
                    f"1 to {MAX_RESOLUTION} each",
                )
            )
        if not 0 <= self.crease_angle <= pi:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The crease angle is an angle between two normals.",
                    "/crease_angle",
                    f"{self.crease_angle:.6g}",
                    "0 to π radians",
                )
            )
