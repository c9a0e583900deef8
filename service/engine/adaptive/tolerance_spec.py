"""How near a mesh must be to its surface: what a user states, checked at birth."""

from dataclasses import dataclass
from math import inf, isfinite, pi

from service.errors import InvalidRequest, Issue
from service.surface.checks import MAX_COORDINATE


@dataclass(frozen=True, slots=True)
class Camera:
    """A perspective camera, as far as it matters how large an error looks.

    Attributes
    ----------
    position : (x, y, z)
        Model coordinates.
    field_of_view : float
        Vertical, radians, between 0 and π.
    height : int
        Of the picture, in pixels.
    """

    position: tuple[float, float, float]
    field_of_view: float
    height: int

    def __post_init__(self) -> None:
        if not all(isfinite(x) and abs(x) <= MAX_COORDINATE for x in self.position):
            raise _out_of_range(
                "/camera/position",
                "The camera stands at a point of the model's space.",
                "a coordinate beyond it",
                f"coordinates up to {MAX_COORDINATE:.7g}",
            )
        if not 0 < self.field_of_view < pi:
            raise _out_of_range(
                "/camera/field_of_view",
                "The field of view is the angle between its upper and its lower border.",
                f"{self.field_of_view:.6g}",
                "an angle between 0 and π radians",
            )
        if self.height < 1:
            raise _out_of_range(
                "/camera/height",
                "The height of the picture is counted in pixels.",
                str(self.height),
                "a whole number above 0",
            )


@dataclass(frozen=True, slots=True)
class Accuracy:
    """How near a mesh must be to its surface, or how good it can be at its price.

    Attributes
    ----------
    tolerance : float or None
        Model units. No point of the surface is further than this from the mesh.
    relative_tolerance : float or None
        The same as a share of the diagonal of the box about the control points.
    angle_tolerance : float or None
        Radians between the normals of neighbouring vertices; sought, not certified.
    max_triangles, max_bytes : int or None
        The least deviation that so many triangles, or so many bytes of the format, allow.
    two_sided : bool
        Whether the distance from the mesh to the surface is bounded as well, by twice the
        tolerance.
    camera : Camera or None
    pixel_tolerance : float or None
        Pixels that an error may seem to be, seen from the camera.
    """

    tolerance: float | None = None
    relative_tolerance: float | None = None
    angle_tolerance: float | None = None
    max_triangles: int | None = None
    max_bytes: int | None = None
    two_sided: bool = False
    camera: Camera | None = None
    pixel_tolerance: float | None = None

    def __post_init__(self) -> None:
        for name in ("tolerance", "relative_tolerance", "pixel_tolerance"):
            value = getattr(self, name)
            if value is not None and not 0 < value < inf:
                raise _out_of_range(
                    f"/{name}", "A tolerance is a distance.", f"{value:.6g}", "a number above 0"
                )
        if self.angle_tolerance is not None and not 0 < self.angle_tolerance <= pi:
            raise _out_of_range(
                "/angle_tolerance",
                "The angle is one between two normals.",
                f"{self.angle_tolerance:.6g}",
                "above 0, at most π radians",
            )
        for name in ("max_triangles", "max_bytes"):
            value = getattr(self, name)
            if value is not None and value < 1:
                raise _out_of_range(f"/{name}", "A budget is a count.", str(value), "at least 1")
        if self.tolerance is not None and self.relative_tolerance is not None:
            raise InvalidRequest(
                Issue(
                    "conflicting_options",
                    "The tolerance is given in model units, or relative to the model's size.",
                    "/relative_tolerance",
                    "both",
                    "one of the two",
                )
            )
        if self.two_sided and not self._bounded:
            raise InvalidRequest(
                Issue(
                    "missing_field",
                    "The distance from the mesh to the surface is bounded beside the other one.",
                    "/tolerance",
                    "two_sided alone",
                    "a tolerance or a budget as well",
                )
            )
        if (self.camera is None) != (self.pixel_tolerance is None):
            raise InvalidRequest(
                Issue(
                    "missing_field",
                    "A camera tells what is seen, and a tolerance how much of it matters.",
                    "/camera" if self.camera is None else "/pixel_tolerance",
                    "nothing",
                    "both of camera and pixel_tolerance, or neither",
                )
            )

    @property
    def _bounded(self) -> bool:
        """Whether a distance is asked for: angles alone bound none."""
        given = (
            self.tolerance,
            self.relative_tolerance,
            self.pixel_tolerance,
            self.max_triangles,
            self.max_bytes,
        )
        return any(value is not None for value in given)

    @property
    def budgeted(self) -> bool:
        """Whether nothing but a budget says how near the mesh must be."""
        demands = (
            self.tolerance, self.relative_tolerance, self.angle_tolerance, self.pixel_tolerance
        )  # fmt: skip
        budgets = self.max_triangles, self.max_bytes
        return any(b is not None for b in budgets) and all(d is None for d in demands)


def _out_of_range(where: str, message: str, got: str, needed: str) -> InvalidRequest:
    return InvalidRequest(Issue("out_of_range", message, where, got, needed))
