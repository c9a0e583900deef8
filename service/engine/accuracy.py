"""The accuracy of a mesh as a request gives it: tolerances, angle, budgets and camera."""

from dataclasses import dataclass
from math import pi
from sys import float_info

from service.errors import InvalidRequest, Issue
from service.surface.checks import MAX_COORDINATE

TOLERANCES = ("tolerance", "relative_tolerance", "pixel_tolerance")
BUDGETS = ("max_triangles", "max_bytes")

ACCURACY_OPTIONS = (*TOLERANCES, "angle_tolerance", *BUDGETS)
"""Options that request a mesh by accuracy, in the order in which errors point to them."""


@dataclass(frozen=True, slots=True)
class Camera:
    """The properties of a perspective camera that determine the size of an error in the picture.

    Attributes
    ----------
    position : (x, y, z)
        Model coordinates.
    field_of_view : float
        Vertical, radians, between 0 and π.
    height : int
        Height of the picture in pixels.
    nearest : float
        No point of the surface is nearer to the camera than this; 0 if nothing is known.
    """

    position: tuple[float, float, float]
    field_of_view: float
    height: int
    nearest: float = 0.0

    def __post_init__(self) -> None:
        # These forms of the comparisons refuse NaN too.
        for is_valid, name, message, got, needed in (
            (
                all(abs(x) <= MAX_COORDINATE for x in self.position),
                "position",
                "The position of the camera has coordinates of the model's space.",
                "a larger coordinate, or NaN",
                f"coordinates up to {MAX_COORDINATE:.7g}",
            ),
            (
                0 < self.field_of_view < pi,
                "field_of_view",
                "The field of view is the angle between its upper and its lower border.",
                f"{self.field_of_view:.6g}",
                "an angle between 0 and π radians",
            ),
            (
                self.height >= 1,
                "height",
                "The height of the picture is counted in pixels.",
                str(self.height),
                "a whole number above 0",
            ),
        ):
            if not is_valid:
                raise _build_error("out_of_range", f"/camera/{name}", message, got, needed)


@dataclass(frozen=True, slots=True)
class Accuracy:
    """The required accuracy of a mesh, or its largest size.

    Attributes
    ----------
    tolerance : float or None
        Model units. No point of the surface is further than this from the mesh.
    relative_tolerance : float or None
        The tolerance as a share of the diagonal of the box about the control points.
    angle_tolerance : float or None
        Largest angle, in radians, between the normals of neighbouring vertices; a goal that is not
        certified.
    max_triangles, max_bytes : int or None
        Budget of triangles, or of bytes of the file. The mesh has the least deviation that the
        budget allows.
    two_sided : bool
        Whether the distance from the mesh to the surface is bounded too, by twice the tolerance.
    camera : Camera or None
    pixel_tolerance : float or None
        Largest size of an error in the picture of the camera, in pixels.
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
        # `float_info.max` refuses only infinity.
        for names, max_value, message, needed in (
            (TOLERANCES, float_info.max, "A tolerance is a distance.", "a number above 0"),
            (
                ("angle_tolerance",),
                pi,
                "The tolerance is an angle between two normals.",
                "above 0, at most π radians",
            ),
            (BUDGETS, float_info.max, "A budget is a count.", "at least 1"),
        ):
            for name in names:
                value = getattr(self, name)
                if value is not None and not 0 < value <= max_value:
                    raise _build_error("out_of_range", f"/{name}", message, f"{value:.6g}", needed)
        has_both = self.tolerance is not None and self.relative_tolerance is not None
        # An angle alone bounds no distance.
        has_bound = not self.two_sided or self._has_any(*TOLERANCES, *BUDGETS)
        for is_valid, code, where, message, got, needed in (
            (
                not has_both,
                "conflicting_options",
                "/relative_tolerance",
                "The tolerance is given in model units, or relative to the model's size.",
                "both",
                "one of the two",
            ),
            (
                has_bound,
                "missing_field",
                "/tolerance",
                "`two_sided` needs a tolerance or a budget to bound the second distance by.",
                "two_sided alone",
                "a tolerance or a budget as well",
            ),
            (
                (self.camera is None) == (self.pixel_tolerance is None),
                "missing_field",
                "/camera" if self.camera is None else "/pixel_tolerance",
                "A camera needs a pixel tolerance, and a pixel tolerance needs a camera.",
                "nothing",
                "both `camera` and `pixel_tolerance`, or neither",
            ),
        ):
            if not is_valid:
                raise _build_error(code, where, message, got, needed)

    def _has_any(self, *names: str) -> bool:
        """Whether the request has any of these options."""
        return any(getattr(self, name) is not None for name in names)

    @property
    def is_budgeted(self) -> bool:
        """Whether only a budget determines the accuracy."""
        return self._has_any(*BUDGETS) and not self._has_any(*TOLERANCES, "angle_tolerance")

    @property
    def pointer(self) -> str:
        """JSON pointer to the first accuracy option that the request gives."""
        return f"/{next((name for name in ACCURACY_OPTIONS if self._has_any(name)), 'tolerance')}"


def _build_error(code: str, where: str, message: str, got: str, needed: str) -> InvalidRequest:
    return InvalidRequest(Issue(code, message, where, got, needed))
