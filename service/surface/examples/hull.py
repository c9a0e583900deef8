"""An example: the hull of a ship, made of several B-splines that share their borders.

The control points of a side run from the transom (the flat stern) to the stem (the front edge), and
from the keel (the bottom) to the rail (the edge of the deck). The port side is the mirror image of
the starboard side. Along their borders, deck, keel and transom have the control points of the
sides. All normals point outwards, so that the hull has a volume.
"""

from math import cos, pi, sin

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
    painted = Channels(np.array([[color]]))
    return BsplineSurface(net, degree, name=name, channels=painted)


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
