"""Exact quadrics and a torus as rational Bézier patches: of revolution, and of octants of a sphere.

A polynomial curve cannot be an arc of a circle, but a rational quadratic curve can: a quarter of
the unit circle has the control points (1, 0), (1, 1), (0, 1) and the weights 1, √½, 1 (Piegl and
Tiller, The NURBS Book, 2nd ed., section 7.3; surfaces of revolution: section 8.5). All surfaces
here are closed, and their normals du × dv point outwards. Surfaces of revolution have the z axis.

An octant of the unit sphere is a rational triangular patch of degree 4. Stereographic projection
from the point opposite to the middle of the octant maps the octant to a plane triangle, whose sides
are three arcs of 30° and radius √3. This plane triangle is a rational patch of degree 2, and the
inverse projection doubles the degree. The control points and weights below follow from this (Farin,
Piper and Worsey, The octant of a sphere as a non-degenerate triangular Bézier patch, CAGD 4, 1987).
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from math import sqrt
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.grids import NO_GRIDS
from service.surface.patches import NO_TRIANGLES, PatchSurface

Point: TypeAlias = tuple[float, float, float, float]
"""x, y, z, weight."""

Patch: TypeAlias = list[list[Point]]
"""Rows of control points: axis 0 along u, axis 1 along v."""

ARC = ((1.0, 0.0, 1.0), (1.0, 1.0, sqrt(0.5)), (0.0, 1.0, 1.0))
"""Quarter of the unit circle, counter-clockwise from (1, 0): x, y, weight."""


def sphere(radius: float = 1.0) -> PatchSurface:
    """Sphere about the origin: 4 × 2 octants of degree (2, 2), u eastwards, v northwards."""
    south = [(x * radius, -y * radius, w) for x, y, w in reversed(ARC)]
    north = [(x * radius, y * radius, w) for x, y, w in ARC]
    return assemble("sphere", {"sphere": revolve(south) + revolve(north)})


def torus(radius: float = 1.0, tube: float = 0.4) -> PatchSurface:
    """Torus of 4 × 4 patches of degree (2, 2).

    `radius` is the radius of the circle in the middle of the tube, `tube` the radius of the tube.
    """
    patches: list[Patch] = []
    for quarter in range(4):
        arc = turn_arc(quarter)
        patches += revolve([(radius + tube * x, tube * z, w) for x, z, w in arc])
    return assemble("torus", {"torus": patches})


def cylinder(radius: float = 1.0, height: float = 2.0) -> PatchSurface:
    """Cylinder from z = -height/2 to height/2: a side and two caps of degree (2, 1)."""
    half = height / 2
    side = revolve([(radius, -half, 1.0), (radius, half, 1.0)])
    bottom = revolve([(0.0, -half, 1.0), (radius, -half, 1.0)])
    top = revolve([(radius, half, 1.0), (0.0, half, 1.0)])
    return assemble("cylinder", {"side": side, "top": top, "bottom": bottom})


def cone(radius: float = 1.0, height: float = 2.0) -> PatchSurface:
    """Cone from its base at z = -height/2 to the apex at height/2; degree (2, 1)."""
    half = height / 2
    side = revolve([(radius, -half, 1.0), (0.0, half, 1.0)])
    base = revolve([(0.0, -half, 1.0), (radius, -half, 1.0)])
    return assemble("cone", {"side": side, "base": base})


def turn_arc(quarter: int) -> list[tuple[float, float, float]]:
    """`ARC` rotated by `quarter` quarter turns, without rounding."""
    arc = list(ARC)
    for _ in range(quarter):
        arc = [(-y, x, w) for x, y, w in arc]
    return arc


def revolve(profile: list[tuple[float, float, float]]) -> list[Patch]:
    """Four patches of revolution: each has the profile along v, and a quarter turn along u.

    `profile` has a distance from the axis, z and a weight for each control point.
    """
    return [
        [[(x * r, y * r, z, a * w) for r, z, w in profile] for x, y, a in turn_arc(quarter)]
        for quarter in range(4)
    ]


def assemble(
    name: str, parts: Mapping[str, list[Patch]], triangles: Sequence[list[Point]] = ()
) -> PatchSurface:
    """One surface of these patches, in which equal points are one vertex.

    `parts` has the four-sided patches of each named part; those under "" are no part.
    """
    numbers: dict[Point, int] = {}

    def find_vertices(points: Iterable[Point]) -> list[int]:
        # A dictionary treats −0 and 0 as equal keys, so that they are one vertex.
        return [numbers.setdefault(point, len(numbers)) for point in points]

    grids: list[list[list[int]]] = []
    members: list[tuple[str, tuple[int, ...]]] = []
    for title, patches in parts.items():
        first = len(grids)
        grids += [list(map(find_vertices, patch)) for patch in patches]
        if title:
            members.append((title, tuple(range(first, len(grids)))))
    corners = list(map(find_vertices, triangles))
    table = np.array(list(numbers))
    return PatchSurface(
        table[:, :3],
        np.array(grids) if grids else NO_GRIDS,
        table[:, 3],
        tuple(members),
        "z",
        name,
        triangles=np.array(corners) if corners else NO_TRIANGLES,
    )


ALPHA = (sqrt(3) - 1) / sqrt(3)
BETA = (sqrt(3) + 1) / (2 * sqrt(3))
GAMMA = 1 - (5 - sqrt(2)) * (7 - sqrt(3)) / 46
"""The coordinates of control points of an octant are 0, 1, `ALPHA`, `BETA` and `GAMMA`."""

CORNER, NEXT, MIDDLE, INNER = (
    3 - sqrt(3),
    3 * sqrt(2) / 4,
    1.0,
    (3 + 2 * sqrt(2) - sqrt(3)) / sqrt(24),
)
"""Weights of b_400, b_310, b_220 and b_211."""

OCTANT: Patch = [
    [
        (1, 0, 0, CORNER),
        (1, ALPHA, 0, NEXT),
        (BETA, BETA, 0, MIDDLE),
        (ALPHA, 1, 0, NEXT),
        (0, 1, 0, CORNER),
    ],
    [(1, 0, ALPHA, NEXT), (1, GAMMA, GAMMA, INNER), (GAMMA, 1, GAMMA, INNER), (0, 1, ALPHA, NEXT)],
    [(BETA, 0, BETA, MIDDLE), (GAMMA, GAMMA, 1, INNER), (0, BETA, BETA, MIDDLE)],
    [(ALPHA, 0, 1, NEXT), (0, ALPHA, 1, NEXT)],
    [(0, 0, 1, CORNER)],
]
"""Rows of control points (x, y, z, weight) of the octant x, y, z ≥ 0; the normal is outwards."""


def octahedral_sphere(radius: float = 1.0) -> PatchSurface:
    """Sphere about the origin: eight triangles of degree 4, arranged as the faces of an octahedron.

    Unlike four-sided patches, these triangles have no pole.
    """
    return assemble("octahedral-sphere", {}, _corners((0.0, 0.0, 0.0), radius))


def rounded_box(
    half: tuple[float, float, float] = (1.0, 0.7, 0.5), radius: float = 0.3
) -> PatchSurface:
    """Box with round edges: 6 flat faces, 12 quarter cylinders, and octants of a sphere as corners.

    `half` is half the length of the flat faces along x, y and z. The faces and cylinders have
    degree (4, 4), the octants degree 4. The tangent plane is continuous everywhere.
    """
    h = np.array(half)
    steps = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])  # a straight line, of degree 4 like the arcs
    arc = np.array(OCTANT[0])
    grids: list[Patch] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (1.0, -1.0):
            face = np.empty((5, 5, 4))
            # All weights of a face are equal to `CORNER`, because the control points that the face
            # shares with the quarter cylinders have this weight.
            face[..., axis], face[..., 3] = sign * (h[axis] + radius), CORNER
            face[..., u], face[..., v] = h[u] * steps[:, None], h[v] * steps
            grids.append(_turn_outwards(face))
        for sign_u, sign_v in product((1.0, -1.0), repeat=2):
            # The rows run along the straight axis, the columns along the arc.
            edge = np.empty((5, 5, 4))
            edge[..., axis], edge[..., 3] = h[axis] * steps, arc[:, 3:]
            edge[..., u] = sign_u * (h[u] + radius * arc[:, :1])
            edge[..., v] = sign_v * (h[v] + radius * arc[:, 1:2])
            grids.append(_turn_outwards(edge))
    return assemble("rounded-box", {"": grids}, _corners(half, radius))


def _corners(half: tuple[float, float, float], radius: float) -> list[list[Point]]:
    """Eight octants as the corners of a box; all normals point outwards."""
    triangles = []
    for signs in product((1.0, -1.0), repeat=3):
        # Mirroring a triangle flips its normal; reversing its rows flips it back.
        step = 1 if np.prod(signs) > 0 else -1
        net = [point for row in OCTANT for point in row[::step]]
        triangles.append(
            [
                (
                    signs[0] * (half[0] + radius * x),
                    signs[1] * (half[1] + radius * y),
                    signs[2] * (half[2] + radius * z),
                    w,
                )
                for x, y, z, w in net
            ]
        )
    return triangles


def _turn_outwards(grid: FloatArray) -> Patch:
    """The rows of a 5 × 5 grid, reversed if its normal would point towards the origin."""
    du, dv = grid[-1, 2, :3] - grid[0, 2, :3], grid[2, -1, :3] - grid[2, 0, :3]
    if np.cross(du, dv) @ grid[2, 2, :3] < 0:
        grid = grid[::-1]
    return [[(x, y, z, w) for x, y, z, w in row] for row in grid.tolist()]
