"""Surfaces of revolution of a profile, exact and rational.

A circle is four rational arcs of degree 2 with the knots 0, π/2, …, 2π; a part of it has arcs of at
most a quarter turn. The product of its points (cos, sin, w) with the profile's points (r, h, w) is
the control net, in the coordinates of a frame whose z is the axis.
"""

from math import ceil, cos, pi, sin, sqrt, tau

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.conics import FULL
from service.decoders.cad.content import Surface
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import MAX_COORDINATE, Frame
from service.decoders.cad.knot_vectors import MAX_PARAMETER
from service.surface.knots import find_least_span

_HALF = sqrt(0.5)

CIRCLE: FloatArray = np.array(
    [
        (1.0, 0.0, 1.0),
        (_HALF, _HALF, _HALF),
        (0.0, 1.0, 1.0),
        (-_HALF, _HALF, _HALF),
        (-1.0, 0.0, 1.0),
        (-_HALF, -_HALF, _HALF),
        (0.0, -1.0, 1.0),
        (_HALF, -_HALF, _HALF),
        (1.0, 0.0, 1.0),
    ]
)
"""Homogeneous points (w cos, w sin, w) of the unit circle, (9, 3)."""

QUARTERS: FloatArray = (
    np.array([0.0, 0.0, 0.0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1.0, 1.0, 1.0]) * tau
)
"""The knots of `CIRCLE`: angles."""

for _table in (CIRCLE, QUARTERS):
    _table.flags.writeable = False


def build_arc(first: float, last: float) -> tuple[FloatArray, FloatArray]:
    """Knots and homogeneous points (w cos, w sin, w) of an arc of the unit circle.

    An arc of a full turn from the angle 0 is `CIRCLE`.
    """
    sweep = last - first
    if not 0.0 < sweep <= tau + FULL:
        raise InvalidGeometry("the range of an angle is not between 0 and a full turn")
    if first == 0.0 and sweep >= tau - FULL:
        return QUARTERS, CIRCLE
    count = max(1, ceil(sweep / (pi / 2) - FULL))
    step = sweep / count
    weight = cos(step / 2)
    rows = [(cos(first), sin(first), 1.0)]
    knots = [first] * 3
    for k in range(count):
        middle, angle = first + (k + 0.5) * step, first + (k + 1) * step
        rows.append((cos(middle), sin(middle), weight))
        rows.append((cos(angle), sin(angle), 1.0))
        knots += [angle, angle]
    knots.append(knots[-1])
    if sweep >= tau - FULL:
        rows[-1] = rows[0]
    return np.array(knots), np.array(rows)


def turn_profile(
    frame: Frame,
    degree: int,
    knots: FloatArray,
    profile: FloatArray,
    wedge: tuple[float, float] | None = None,
) -> Surface:
    """The surface (angle, profile) of a profile in the plane of x and z that turns about z.

    Parameters
    ----------
    profile : ndarray of float64, shape (m, 3)
        Rows (w r, w h, w): the signed distance from the axis, and the height along it.
    wedge : tuple of two floats, or None
        The range of the angle from x; None for a full turn.
    """
    local = np.zeros((len(profile), 4))
    local[:, 0], local[:, 2], local[:, 3] = profile.T
    return turn_points(frame, degree, knots, local, wedge)


def turn_points(
    frame: Frame,
    degree: int,
    knots: FloatArray,
    local: FloatArray,
    wedge: tuple[float, float] | None = None,
) -> Surface:
    """The surface (angle, curve) of a curve anywhere in space that turns about z of a frame.

    `local` (m, 4) are the curve's homogeneous points in the frame's coordinates.
    """
    angles, circle = (QUARTERS, CIRCLE) if wedge is None else build_arc(*wedge)
    x, y, z, origin = (np.array(each) for each in (frame.x, frame.y, frame.z, frame.origin))
    a, b, c, weights = local[:, :1], local[:, 1:2], local[:, 2:3], local[:, 3:]
    # A point turns to cos · across + sin · beside + along.
    across, beside, along = a * x + b * y, a * y - b * x, c * z + weights * origin
    cosines, sines, factors = circle.T[:, :, np.newaxis, np.newaxis]
    net = np.empty((len(circle), len(local), 4))
    net[..., 3] = factors[..., 0] * local[:, 3]
    points = net[..., :3]
    np.multiply(cosines, across, out=points)
    points += sines * beside
    points += factors * along
    return finish_surface((2, degree), (angles, knots), net)


def finish_surface(
    degrees: tuple[int, int], knots: tuple[FloatArray, FloatArray], net: FloatArray
) -> Surface:
    """The surface of a homogeneous net, if its numbers are not too large and it has a width.

    Raises
    ------
    InvalidGeometry
    """
    if not np.abs(net).max() <= MAX_COORDINATE:  # true for NaN, too
        raise InvalidGeometry("a surface is too large, or not finite")
    for vector in knots:
        low, high = vector.item(0), vector.item(-1)
        is_wide = high - low >= find_least_span(low, high)
        if not (is_wide and low >= -MAX_PARAMETER and high <= MAX_PARAMETER):
            raise InvalidGeometry("a surface has no width, or too large parameters")
    return Surface(degrees, knots, net)
