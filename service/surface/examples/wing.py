"""An example: the swept wing of an airliner, with many knots close to the leading edge.

The upper and the lower skin run from the leading edge (front) to the trailing edge (back), and have
the same knots. Two ruled caps close the wing at the root and at the tip; their control points are
the control points on the borders of the skins.
"""

from math import cos, radians, sin

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.bspline import BsplineSurface
from service.surface.multipatch import MultipatchSurface

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
