"""Vectors of three Python floats, and orthonormal frames at a point.

On three numbers Python's arithmetic takes less time than one call of NumPy.
"""

from dataclasses import dataclass
from math import hypot, isfinite
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.faults import InvalidGeometry

Vector: TypeAlias = tuple[float, float, float]

MAX_COORDINATE = 1e12
"""The largest absolute value of a coordinate, in the unit of the file."""

LEAST = 1e-150
"""Shorter vectors are multiplied before their length is measured; smaller radii are refused."""

PARALLEL = 1e-9
"""Directions whose angle has at most this sine count as parallel."""

SIMILAR = 1e-9
"""The columns of a rotation's matrix differ in length, and from right angles, by at most this."""


def add(a: Vector, b: Vector) -> Vector:
    """The sum a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a: Vector, b: Vector) -> Vector:
    """The difference a − b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scale(a: Vector, factor: float) -> Vector:
    """The vector factor · a."""
    return factor * a[0], factor * a[1], factor * a[2]


def dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product a × b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def norm(a: Vector) -> float:
    """The length of a vector."""
    return hypot(*a)


def distance(a: Vector, b: Vector) -> float:
    """The distance between two points."""
    return hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2])


def check_point(point: Vector) -> None:
    """Refuse coordinates that are not finite, or larger than `MAX_COORDINATE`.

    Raises
    ------
    InvalidGeometry
    """
    x, y, z = point
    # The comparisons are false for NaN, too.
    if not (abs(x) <= MAX_COORDINATE and abs(y) <= MAX_COORDINATE and abs(z) <= MAX_COORDINATE):
        raise InvalidGeometry("a coordinate is not finite or too large")


def unit(a: Vector) -> Vector:
    """The vector of length 1 in the direction of a.

    Raises
    ------
    InvalidGeometry
        If a has no direction: its length is 0 or no finite number.
    """
    length = norm(a)
    if not (length > 0.0 and isfinite(length)):
        raise InvalidGeometry("a direction has no length")
    if length < LEAST:  # subnormal numbers have few digits
        return unit(scale(a, 1.0 / LEAST**2))
    return a[0] / length, a[1] / length, a[2] / length


@dataclass(frozen=True, slots=True)
class Frame:
    """An origin and three directions x, y, z: unit vectors at right angles, z = x × y."""

    origin: Vector
    x: Vector
    y: Vector
    z: Vector

    @property
    def directions(self) -> tuple[Vector, Vector, Vector]:
        """The directions x, y and z."""
        return self.x, self.y, self.z

    def place(self, a: float, b: float, c: float = 0.0) -> Vector:
        """The point with the local coordinates (a, b, c)."""
        (ox, oy, oz), x, y, z = self.origin, self.x, self.y, self.z
        return (
            ox + a * x[0] + b * y[0] + c * z[0],
            oy + a * x[1] + b * y[1] + c * z[1],
            oz + a * x[2] + b * y[2] + c * z[2],
        )

    def locate(self, point: Vector) -> Vector:
        """The local coordinates of a point."""
        origin = self.origin
        a, b, c = point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]
        x, y, z = self.x, self.y, self.z
        return (
            a * x[0] + b * x[1] + c * x[2],
            a * y[0] + b * y[1] + c * y[2],
            a * z[0] + b * z[1] + c * z[2],
        )

    def locate_all(self, points: FloatArray) -> FloatArray:
        """The local coordinates of points (k, 3), as rows (3, k)."""
        a, b, c = (points - self.origin).T
        local = np.empty((3, len(points)))
        for k, axis in enumerate((self.x, self.y, self.z)):
            # In this order, and not by a matrix product, which processors round differently.
            local[k] = a * axis[0] + b * axis[1] + c * axis[2]
        return local

    def move(self, origin: Vector) -> "Frame":
        """The frame with these directions at another point."""
        return Frame(origin, self.x, self.y, self.z)


def build_frame(origin: Vector, z: Vector | None = None, x: Vector | None = None) -> Frame:
    """The frame of ISO 10303-42's axis2_placement_3d (`build_axes`).

    Parameters
    ----------
    z : Vector or None
        The axis; (0, 0, 1) by default.
    x : Vector or None
        A direction whose part perpendicular to z becomes x. By default, and if it is parallel to z,
        it is (1, 0, 0), or (0, 1, 0) if z is nearly parallel to that.

    Raises
    ------
    InvalidGeometry
        `z` has no length, or the origin is not finite or too large.
    """
    check_point(origin)
    axis = unit(z) if z is not None else (0.0, 0.0, 1.0)
    candidates: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    if x is not None:
        candidates = (unit(x), *candidates)
    for candidate in candidates:
        rest = _remove(candidate, axis)
        if norm(rest) > PARALLEL:
            # The second time removes what the cancellation of digits has left.
            first = unit(_remove(unit(rest), axis))
            break
    return Frame(origin, first, cross(axis, first), axis)


def transform_frame(frame: Frame, matrix: FloatArray) -> Frame | None:
    """The frame after a rotation and a translation (4, 4); None for any other affine map."""
    rows: list[list[float]] = matrix.tolist()
    columns = list(zip(*rows, strict=True))
    x, y, z = (column[:3] for column in columns[:3])
    products = (dot(x, x) - 1, dot(y, y) - 1, dot(z, z) - 1, dot(x, y), dot(y, z), dot(z, x))
    if max(map(abs, products)) > SIMILAR or dot(cross(x, y), z) < 0:
        return None
    base = Frame(columns[3][:3], x, y, z)
    turned = [subtract(base.place(*direction), base.origin) for direction in (frame.z, frame.x)]
    return build_frame(base.place(*frame.origin), *turned)


def _remove(vector: Vector, axis: Vector) -> Vector:
    """The part of a vector at right angles to an axis of the length 1."""
    return subtract(vector, scale(axis, dot(vector, axis)))
