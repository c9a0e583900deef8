"""The options of a picture: from where, how large, and in which look."""

from dataclasses import dataclass, field
from math import radians
from typing import Literal, TypeAlias

from service.engine.accuracy import Accuracy, Camera
from service.engine.options import MeshOptions, OverlayName

Look: TypeAlias = Literal["shaded", "gaussian", "mean"]

PIXEL_TOLERANCE = 0.25
"""No point of a surface is drawn further than this from where it is, in pixels."""


_UNPLACED = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """The camera that a request asks for.

    Attributes
    ----------
    width, height : int
        Pixels.
    field_of_view : float
        Vertical, radians; of an orthographic picture: as much of the target is seen.
    orthographic : bool
    azimuth, elevation : float
        Degrees.
    zoom : float
        How much larger than a picture that shows the whole model, with its control net if drawn.
    position, target : (x, y, z) or None
        In the frame turned y-up, model units; both or neither.
    """

    width: int = 512
    height: int = 512
    field_of_view: float = radians(30.0)
    orthographic: bool = False
    azimuth: float = 30.0
    elevation: float = 25.0
    zoom: float = 1.0
    position: tuple[float, float, float] | None = None
    target: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class PictureStyle:
    """How a picture looks.

    Attributes
    ----------
    look : "shaded", "gaussian" or "mean"
    background : (r, g, b) or None
        sRGB from 0 to 1; None is transparent.
    """

    look: Look = "shaded"
    background: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class PictureOptions:
    """The options of a picture.

    Attributes
    ----------
    viewpoint : Viewpoint
    style : PictureStyle
    overlays : tuple of names
        Lines: the borders of the patches, or the edges of parts; the control net.
    isocurves : (n_u, n_v)
        As in `MeshOptions`.
    """

    viewpoint: Viewpoint = field(default_factory=Viewpoint)
    style: PictureStyle = field(default_factory=PictureStyle)
    overlays: tuple[OverlayName, ...] = ()
    isocurves: tuple[int, int] = (0, 0)

    def mesh_options(self) -> MeshOptions:
        """The options of the mesh that is drawn; its camera is placed later."""
        viewpoint = self.viewpoint
        camera = Camera(_UNPLACED, viewpoint.field_of_view, viewpoint.height)
        return MeshOptions(
            places=True,
            overlays=self.overlays,
            isocurves=self.isocurves,
            curvatures=self.style.look != "shaded",
            accuracy=Accuracy(camera=camera, pixel_tolerance=PIXEL_TOLERANCE),
        )
