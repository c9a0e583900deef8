"""Planes, the tolerance of sections, and sections as polylines."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.curves.polyline import Polyline
from service.engine.extent import choose_origin
from service.engine.stored_positions import FLOAT32
from service.engine.vectors import cross, dot, length
from service.errors import InvalidRequest, Issue
from service.surface.brep_model import SkippedFace
from service.surface.checks import Up
from service.surface.placement import Box

RELATIVE_TOLERANCE = 1e-3
"""The default tolerance, in diagonals of the box of control points."""

MIN_RELATIVE_TOLERANCE = 1e-9
"""The least tolerance, in diagonals; smaller tolerances would be of the size of rounding errors."""


@dataclass(frozen=True, eq=False, slots=True)
class Planes:
    """Planes n · p = d.

    Attributes
    ----------
    normals : ndarray of float64, shape (m, 3)
        Unit normals n.
    offsets : ndarray of float64, shape (m,)
        Distances d of the planes from the point 0, along their normals, in model units.
    """

    normals: FloatArray
    offsets: FloatArray

    @property
    def axes(self) -> tuple[FloatArray, FloatArray]:
        """Unit vectors x and y, shape (m, 3) each, within each plane, with x × y = n.

        The vector x is the projection of a coordinate axis: the next axis, in cyclic order, after
        that of the component of n with the largest absolute value. So for n = (0, 0, 1), x and y
        are the first two coordinate axes.
        """
        rows = np.arange(len(self.normals))
        start = np.zeros_like(self.normals)
        start[rows, (np.abs(self.normals).argmax(axis=1) + 1) % 3] = 1.0
        along = start - dot(start, self.normals, -1)[:, np.newaxis] * self.normals
        along /= length(along, -1)[:, np.newaxis]
        along += 0.0  # −0 becomes 0
        return along, cross(self.normals, along, -1) + 0.0

    def __len__(self) -> int:
        return len(self.normals)


@dataclass(frozen=True, slots=True)
class SectionTolerance:
    """The largest distance of a section from its polylines.

    Attributes
    ----------
    distance : float or None
        The distance in model units.
    relative : float
        The distance in diagonals of the box of control points, if `distance` is None.
    """

    distance: float | None = None
    relative: float = RELATIVE_TOLERANCE

    def to_model_units(self, bounds: Box, diagonal: float, *, is_float32: bool) -> float:
        """The tolerance in model units, for a model with these bounds and this diagonal.

        `is_float32` says whether points are stored in float32.

        Raises
        ------
        InvalidRequest
            `tolerance_too_small`.
        """
        low, high = bounds
        min_tolerance = MIN_RELATIVE_TOLERANCE * diagonal
        if is_float32:
            max_coordinate = float(np.abs(np.stack([low, high]) - choose_origin(low, high)).max())
            # Rounding to float32 moves a point by less than 1/8 of this.
            min_tolerance = max(min_tolerance, 8 * float(FLOAT32.eps) * max_coordinate)
        tolerance = self.relative * diagonal if self.distance is None else self.distance
        if tolerance < min_tolerance:
            raise InvalidRequest(
                Issue(
                    "tolerance_too_small",
                    "The tolerance is below the precision of the numbers in the response.",
                    "/relative_tolerance" if self.distance is None else "/tolerance",
                    f"{tolerance:.6g}",
                    f"at least {min_tolerance:.3g} for this surface in this format, in model units",
                )
            )
        return tolerance


@dataclass(frozen=True, eq=False, slots=True)
class Section:
    """The section by one plane.

    Attributes
    ----------
    polylines : tuple of Polyline
        Seen from the tip of the plane's normal, the normals of the surface point to the right of a
        polyline. So the polylines around a body run counter-clockwise.
    touching : ndarray of float64, shape (k, 3)
        Points where the surface touches the plane, up to rounding.
    coplanar : ndarray of int, shape (c,)
        Numbers of the patches that lie in the plane; polylines run along their border.
    """

    polylines: tuple[Polyline, ...]
    touching: FloatArray
    coplanar: Ints


@dataclass(frozen=True, eq=False, slots=True)
class Sections:
    """The sections of a surface by some planes, in the order of the planes.

    No point of a section is farther than `deviation_bound`, in model units, from its polylines.
    `metres_per_unit` is the unit of the surface, None if it is not known. `skipped_faces` are the
    faces of breps that were left out, with their numbers in the request.
    """

    name: str
    up: Up
    planes: Planes
    sections: tuple[Section, ...]
    deviation_bound: float
    metres_per_unit: float | None = None
    skipped_faces: tuple[SkippedFace, ...] = ()

    @property
    def polylines(self) -> list[Polyline]:
        """The polylines of all sections."""
        return [line for section in self.sections for line in section.polylines]

    @property
    def point_count(self) -> int:
        """The number of points of all polylines."""
        return sum(len(line.points) for line in self.polylines)
