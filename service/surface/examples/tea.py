"""An example group: a tea service of the teapot, four cups, four saucers and a tray."""

from math import cos, pi, sin

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.examples.quadrics import Patch, assemble, cylinder, revolve, sphere, turn_arc
from service.surface.group import GroupSurface
from service.surface.member import Member
from service.surface.patches import PatchSurface

CREAM, RUST, SAGE, OAK = (0.93, 0.89, 0.8), (0.72, 0.35, 0.23), (0.52, 0.6, 0.48), (0.5, 0.36, 0.24)


def tea_service(pot: PatchSurface) -> GroupSurface:
    """The group: the pot in the middle, a cup and saucer at each corner of a square, a tray below.

    z is up. Two of the cups are mirrored, so that their handles point in the opposite direction
    around the pot.
    """
    # The top of the tray is at z = 0.
    tray = np.diag([6.2, 6.2, 0.08, 1.0])
    tray[2, 3] = -0.08
    members = [
        Member(cylinder(), "tray", OAK, tray),
        Member(pot, "teapot", CREAM),
    ]
    cup_surface, ball = cup(), sphere()
    for corner in range(4):
        placement = _build_rotation(corner * pi / 2 + pi / 4)
        placement[:3, 3] = placement[:3, :3] @ (4.4, 0.0, 0.04)
        saucer_placement = placement @ np.diag([1.3, 1.3, 0.07, 1.0])
        cup_placement = placement @ np.diag([1.0, 1.0 if corner < 2 else -1.0, 1.0, 1.0])
        cup_placement[2, 3] += 0.06
        color = RUST if corner % 2 else SAGE
        members += [
            Member(ball, f"saucer {corner + 1}", color, saucer_placement),
            Member(cup_surface, f"cup {corner + 1}", color, cup_placement),
        ]
    return GroupSurface(tuple(members), up="z", name="tea-service")


def cup() -> PatchSurface:
    """A cup of radius 1 and height 1, with a handle at y > 0."""
    outside = revolve([(0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, 1.0)])
    inside = revolve([(1.0, 1.0, 1.0), (0.94, 0.07, 1.0), (0.0, 0.07, 1.0)])
    return assemble("cup", {"cup": outside + inside, "handle": _handle(0.25, 0.05)})


def _handle(radius: float, thickness: float) -> list[Patch]:
    """The handle: half a torus in a vertical plane, whose ends are inside the wall of the cup."""
    patches: list[Patch] = []
    for quarter in range(4):
        arc = turn_arc(quarter)
        ring = revolve([(radius + thickness * x, thickness * z, w) for x, z, w in arc])
        patches += (ring[0], ring[3])  # the half of the torus at x ≥ 0
    # The x axis becomes the outward direction y, tilted like the wall by an angle of sine 7/25 and
    # cosine 24/25. The centre of the torus is at y = 0.93, z = 0.62.
    return [
        [
            [(z, 0.93 + 0.96 * x + 0.28 * y, 0.62 - 0.28 * x + 0.96 * y, w) for x, y, z, w in row]
            for row in patch
        ]
        for patch in patches
    ]


def _build_rotation(angle: float) -> FloatArray:
    """The rotation about z by an angle in radians, as a matrix (4, 4)."""
    matrix = np.eye(4)
    matrix[:2, :2] = [[cos(angle), -sin(angle)], [sin(angle), cos(angle)]]
    return matrix
