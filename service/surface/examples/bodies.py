"""Examples of closed bodies of several B-splines: a ship, and the wing of an airliner.

The control points of a side of the ship run from the transom (the flat stern) to the stem (the
front edge), and from the keel (the bottom) to the rail (the edge of the deck). The port side is the
mirror image of the starboard side. Along their borders, deck, keel and transom have the control
points of the sides. All normals point outwards, so that the hull has a volume.

The upper and the lower skin of the wing run from the leading edge (front) to the trailing edge
(back), and have the same knots. Two ruled caps close the wing at the root and at the tip; their
control points are the control points on the borders of the skins.
"""

from math import cos, pi, radians, sin

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.bspline import BsplineSurface
from service.surface.channels import Channels
from service.surface.multipatch import MultipatchSurface

LENGTH, BREADTH, DRAUGHT, HALF_KEEL = 30.0, 7.6, 2.6, 0.3
"""In metres. `HALF_KEEL` is half the breadth of the flat keel."""

ARCH = 0.16
"""The middle of the deck is higher than its borders: its control points are raised by this fraction
of half the breadth."""

STATIONS = 15
"""Rows of control points from the transom to the stem; the middle one separates aft from fore."""

NAVY, OAK, WHITE = (0.1, 0.17, 0.3), (0.72, 0.55, 0.35), (0.9, 0.9, 0.88)


def hull() -> MultipatchSurface:
    """The whole ship: sides of degree (3, 3), deck and keel (3, 2), transom (2, 3); z is up."""
    side = _side()
    middle = STATIONS // 2
    surfaces = []
    for name, rows in (("aft", slice(0, middle + 1)), ("fore", slice(middle, None))):
        starboard = side[rows]
        port = starboard * (1, -1, 1)
        # The normals of `port` point outwards. Those of its mirror image would point inwards, so u
        # and v are exchanged there.
        surfaces += [
            _spline(starboard.swapaxes(0, 1), (3, 3), f"starboard {name}", NAVY),
            _spline(port, (3, 3), f"port {name}", NAVY),
            _spline(_span_sides(starboard[:, -1], ARCH), (3, 2), f"deck {name}", OAK),
            # From starboard to port, opposite to the deck: its normals point down.
            _spline(_span_sides(port[:, 0], 0.0), (3, 2), f"keel {name}", NAVY),
        ]
    stern = np.stack([side[0], side[0] * (1, 0, 1), side[0] * (1, -1, 1)])
    # The top row of the transom is the border of the deck, whose middle is raised.
    stern[1, -1] = _span_sides(side[:1, -1], ARCH)[0, 1]
    surfaces.append(_spline(stern, (2, 3), "transom", WHITE))
    return MultipatchSurface(tuple(surfaces), "z", "ship-hull")


def _spline(
    net: FloatArray, degree: tuple[int, int], name: str, color: tuple[float, float, float]
) -> BsplineSurface:
    """A clamped B-spline of one colour."""
    return BsplineSurface(net, degree, name=name, channels=Channels(np.array([[color]])))


def _side() -> FloatArray:
    """Control points (stations, 7, 3) of the starboard side."""
    net = [[_point(i / (STATIONS - 1), j / 6) for j in range(7)] for i in range(STATIONS)]
    # Rounded: the last digits of powers depend on the machine. Adding 0 turns −0 into 0.
    return np.round(np.array(net), 3) + 0.0


def _point(length_share: float, girth_share: float) -> tuple[float, float, float]:
    """A control point of the starboard side.

    `length_share` is the fraction of the length from the transom, `girth_share` the fraction of the
    girth from the keel to the rail.
    """
    # The hull is widest at 0.4 of its length. Both shares are 0 there; `fore_share` grows to 1 at
    # the stem, `aft_share` at the transom.
    fore_share, aft_share = (
        max((length_share - 0.4) / 0.6, 0.0),
        max((0.4 - length_share) / 0.4, 0.0),
    )
    half_breadth = BREADTH / 2 * (1 - fore_share**2.6) * (1 - 0.18 * aft_share**2)
    keel_height = -DRAUGHT * (1 - 0.75 * aft_share**1.8)
    rail_height = 1.5 + 1.6 * fore_share**2 + 0.3 * aft_share**2
    # Round amidships, sharp at the bow.
    fullness = 0.55 + 1.1 * fore_share**1.5 + 0.15 * aft_share
    angle = girth_share * pi / 2
    half_flat = HALF_KEEL * (1 - fore_share**2)
    across = half_flat + (half_breadth - half_flat) * sin(angle) ** fullness
    height = rail_height - (rail_height - keel_height) * cos(angle)
    # At the keel, rounding could make the difference negative.
    height_share = max(height - keel_height, 0.0) / (rail_height - keel_height)
    # How far the stem leans forward, or the transom backward, at this point.
    rake = 3.4 * fore_share**4 * height_share**1.5 - 0.6 * aft_share**4 * girth_share
    return LENGTH * length_share + rake, across, height


def _span_sides(border: FloatArray, arch: float) -> FloatArray:
    """Control points (stations, 3, 3): the mirror image of a border, an arch, and the border.

    `border` has shape (stations, 3). `arch` is the rise of the middle as a fraction of half the
    breadth.
    """
    middle = border * (1, 0, 1)
    middle[:, 2] += np.round(np.abs(border[:, 1]) * arch, 3)
    return np.stack([border * (1, -1, 1), middle, border], axis=1)


CHORDWISE = (0, 0, 0, 0, 1e-8, 8e-7, 2e-5, 3e-4, 2e-3, 8e-3, 0.03, 0.1, 0.3, 0.65, 1, 1, 1, 1)
"""Knots from the leading to the trailing edge. The square root of a knot is the fraction of the
chord there."""

SPANWISE = (0, 0, 0, 0, 3, 5.5, 8, 11, 13.5, 15, 15.5, 16, 16.5, 17, 17.5, 18.5, 18.5, 18.5, 18.5)
"""Knots along the leading edge, dense where the tip turns up.

Like all lengths along the leading edge here, these are metres as seen from the front: without the
sweep.
"""

CHORDS = ((0.0, 5.5, 15.0, 16.8, 18.5), (6.4, 3.9, 1.9, 1.35, 0.6))
"""Positions along the leading edge, and the chord (the length from front to back) at each of them;
both in metres."""

THICKNESS, CAMBER, SUMMIT = 0.12, 0.02, 0.4
"""Thickness, camber, and position of the largest camber of the aerofoil NACA 2412, as fractions of
its chord."""

BEND, BEND_LENGTH, CANT = 15.2, 1.6, radians(72)
"""The tip turns up: the position where the bend begins and the length of the bend, in metres along
the leading edge; and the angle after the bend."""

DIHEDRAL = radians(5)
"""The angle between the wing and the horizontal plane before the bend, seen from the front."""


def wing() -> MultipatchSurface:
    """The right wing: a closed body of four B-splines. x points backwards, y right, z up."""
    upper, lower = (_skin(sign) for sign in (1.0, -1.0))
    chordwise, spanwise = np.array(CHORDWISE), np.array(SPANWISE)
    # u and v of the lower skin are exchanged, and v of the root reversed, compared with the upper
    # skin and the tip: so all normals point outwards.
    skins = (
        BsplineSurface(upper, (3, 3), (chordwise, spanwise), name="upper skin"),
        BsplineSurface(lower.swapaxes(0, 1), (3, 3), (spanwise, chordwise), name="lower skin"),
    )
    caps = (
        BsplineSurface(np.stack(net, axis=1), (3, 1), (chordwise, "clamped"), name=name)
        for name, net in (
            ("tip", (upper[:, -1], lower[:, -1])),
            ("root", (lower[:, 0], upper[:, 0])),
        )
    )
    return MultipatchSurface((*skins, *caps), "z", "swept-wing")


def _skin(sign: float) -> FloatArray:
    """Control points (chordwise, spanwise, 3) of the upper skin (sign = 1) or lower skin (−1).

    Each control point is the point of the wing at its Greville abscissae (Schoenberg's
    approximation).
    """
    chordwise, spanwise = (
        np.convolve(knots[1:-1], np.full(3, 1 / 3), "valid") for knots in (CHORDWISE, SPANWISE)
    )
    net = [[_find_point(u, t, sign) for t in spanwise.tolist()] for u in chordwise.tolist()]
    # Rounded, since the last digits of sines depend on the machine.
    return np.round(np.array(net), 9)


def _find_point(u: float, t: float, sign: float) -> tuple[float, float, float]:
    """The point of a skin at the fraction √u of the chord, t metres along the leading edge.

    `sign` is 1 for the upper skin, −1 for the lower.

    The section is a four-digit NACA section with a closed trailing edge: Abbott and von Doenhoff,
    Theory of Wing Sections, section 6.4.
    """
    s = u**0.25
    x = s * s
    half_thickness = (
        5 * THICKNESS * (0.2969 * s - x * (0.126 + x * (0.3516 + x * (0.1036 * x - 0.2843))))
    )
    if u == 1:
        half_thickness = 0.0  # exactly, so that the skins close at the trailing edge
    camber = CAMBER / SUMMIT**2 * x * (2 * SUMMIT - x)
    if x > SUMMIT:
        camber = CAMBER / (1 - SUMMIT) ** 2 * (1 - x) * (1 + x - 2 * SUMMIT)
    chord = float(np.interp(t, *CHORDS))
    height = chord * (camber + sign * half_thickness)
    # The tip turns up along an arc, from the angle `DIHEDRAL` to the angle `CANT`.
    arc_fraction = min(max((t - BEND) / BEND_LENGTH, 0.0), 1.0)
    angle = DIHEDRAL + (CANT - DIHEDRAL) * arc_fraction
    y, z = _find_edge_point(t)
    # Washout: from the root to the tip, sections are rotated more and more with the leading edge
    # down, about the point at a quarter of the chord.
    twist = radians(2 - 0.3 * t)
    back, up = chord * x - chord / 4, height
    back, up = back * cos(twist) + up * sin(twist), up * cos(twist) - back * sin(twist)
    sweep = 0.5 * t + 0.35 * max(t - BEND, 0.0)
    return sweep + chord / 4 + back, y - up * sin(angle), z + up * cos(angle)


def _find_edge_point(t: float) -> tuple[float, float]:
    """The point (y, z) of the leading edge, t metres from the root, seen from the front.

    From the front the edge is a line at the angle `DIHEDRAL`, then an arc, then a line at the angle
    `CANT`.
    """
    radius = BEND_LENGTH / (CANT - DIHEDRAL)
    inner_length = min(t, BEND)
    arc_length = min(max(t - BEND, 0), BEND_LENGTH)
    outer_length = max(t - BEND - BEND_LENGTH, 0)
    angle = DIHEDRAL + arc_length / radius
    y = inner_length * cos(DIHEDRAL) + radius * (sin(angle) - sin(DIHEDRAL))
    z = inner_length * sin(DIHEDRAL) + radius * (cos(DIHEDRAL) - cos(angle))
    return y + outer_length * cos(CANT), z + outer_length * sin(CANT)
