"""The options of the engine, checked when they are created."""

from dataclasses import dataclass, field
from math import pi, radians
from typing import Literal, TypeAlias

from service.engine.accuracy import Accuracy
from service.errors import InvalidRequest, Issue
from service.surface.checks import MAX_COORDINATE

Faces: TypeAlias = Literal["triangles", "quads"]
Method: TypeAlias = Literal["matrix", "de_casteljau", "forward_difference"]
OverlayName: TypeAlias = Literal["control_net", "boundary"]
WireForm: TypeAlias = Literal["lines", "tubes", "ribbons"]

MAX_RESOLUTION = 1 << 16
"""The largest resolution in one direction. A mesh usually reaches the limit of vertices at lower
resolutions."""

MAX_WELD_TOLERANCE = 1e-6
"""The largest weld tolerance, as a fraction of the model's diagonal: rounding alone moves no two
equal points further apart than this."""

MAX_ISOCURVES = 1024
"""The most pieces into which isoparametric curves cut a patch, in one direction."""

MIN_SIDES, MAX_SIDES = 3, 256
"""The fewest and the most sides of a wire that is a tube."""


@dataclass(frozen=True, slots=True)
class MeshOptions:
    """The options of a mesh.

    Attributes
    ----------
    resolution : (Ru, Rv)
        Divisions of every patch along u and v; a triangle takes the larger number.
    faces : "triangles" or "quads"
    normals, uvs : bool
        Whether vertices have unit normals, and parameters (u, v) if the surface has no texture
        coordinates.
    weld : bool
        Whether patches share vertices on common edges.
    crease_angle : float
        Radians. Vertices at one position stay separate if the angle between their normals is
        larger.
    weld_tolerance : float
        Two control points on borders count as one point if their distance is at most the larger of
        two lengths: this fraction of the diagonal of the box about the control points; and the
        rounding error of coordinates and knots, but at most `MAX_WELD_TOLERANCE` of this diagonal
        (`find_weld_distance`). 0 turns both off: only points that are equal bit for bit then count
        as one.
    overlays : tuple of names
        Lines to draw beside the faces.
    isocurves : (n_u, n_v)
        The curves u = i/n_u and v = j/n_v are drawn on every patch, with its borders; 0 draws no
        curves in that direction.
    wires : "lines", "tubes" or "ribbons"
        The form in which isoparametric curves are drawn.
    wire_width : float or None
        Diameter of the tubes, width of the ribbons, in model units; None is 1/300 of the model's
        diagonal.
    wire_sides : int
        Sides of a tube.
    has_faces : bool
        Whether the mesh has the faces of the surface, or only the lines and wires drawn on it.
    method : "matrix", "de_casteljau" or "forward_difference"
        The method that computes the samples.
    accuracy : Accuracy or None
        The accuracy of a mesh by tolerance, in place of `resolution`; None for a mesh by
        resolution.
    curvatures : bool
        Whether vertices have Gaussian and mean curvature as attributes. If so, the models of a
        group must be results of `service.engine.curvatures.placement_scale.add_stretches`.
    orient : bool
        Whether patches are turned first, so that neighbours agree and volumes are positive.
    has_resolution : bool
        Whether the request names the resolution, which may be the default.
    places : bool
        Whether the mesh says where its vertices are on the surface, for pictures; then samples of
        different faces are different vertices. Only for meshes by tolerance.
    """

    resolution: tuple[int, int] = (16, 16)
    faces: Faces = "triangles"
    normals: bool = True
    uvs: bool = False
    weld: bool = True
    crease_angle: float = radians(1.0)
    weld_tolerance: float = 1e-12
    overlays: tuple[OverlayName, ...] = ()
    isocurves: tuple[int, int] = (0, 0)
    wires: WireForm = "lines"
    wire_width: float | None = None
    wire_sides: int = 8
    has_faces: bool = True
    method: Method = "matrix"
    accuracy: Accuracy | None = None
    curvatures: bool = False
    orient: bool = False
    has_resolution: bool = False
    places: bool = False

    has_wires: bool = field(init=False)
    """Whether isoparametric curves are drawn."""
    has_solid_wires: bool = field(init=False)
    """Whether isoparametric curves are drawn as tubes or ribbons, which have faces."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "has_wires", any(self.isocurves))
        object.__setattr__(self, "has_solid_wires", self.has_wires and self.wires != "lines")
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
        if not 0 <= self.weld_tolerance <= MAX_WELD_TOLERANCE:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The weld tolerance is a share of the diagonal, as small as rounding errors.",
                    "/weld_tolerance",
                    f"{self.weld_tolerance:.6g}",
                    f"0 to {MAX_WELD_TOLERANCE:.0e}",
                )
            )
        self._check_wires()

    def _check_wires(self) -> None:
        """Refuse invalid options of isoparametric curves, and options that draw nothing."""
        if not all(0 <= n <= MAX_ISOCURVES for n in self.isocurves):
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The number of pieces between isoparametric curves is limited.",
                    "/isocurves",
                    f"{self.isocurves[0]} × {self.isocurves[1]}",
                    f"0 to {MAX_ISOCURVES} each",
                )
            )
        if self.wire_width is not None and not 0 < self.wire_width <= MAX_COORDINATE:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The width of a wire is a length.",
                    "/wire_width",
                    f"{self.wire_width:.6g}",
                    f"a number above 0, at most {MAX_COORDINATE:.7g}",
                )
            )
        if not MIN_SIDES <= self.wire_sides <= MAX_SIDES:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The number of sides of a tube is limited.",
                    "/wire_sides",
                    str(self.wire_sides),
                    f"{MIN_SIDES} to {MAX_SIDES}",
                )
            )
        if not (self.has_faces or self.has_wires or self.overlays):
            raise InvalidRequest(
                Issue(
                    "nothing_to_draw",
                    "A mesh without faces needs isoparametric curves or overlays.",
                    "/faces",
                    "no faces, isocurves or overlays",
                    "isocurves or overlays, or faces",
                )
            )
