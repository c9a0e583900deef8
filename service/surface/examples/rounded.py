"""Examples with exact octants of a sphere: a sphere of eight triangles, and a box with round edges.

An octant of the unit sphere is a rational triangular patch of degree 4. Stereographic projection
from the point opposite to the middle of the octant maps the octant to a plane triangle, whose sides
are three arcs of 30° and radius √3. This plane triangle is a rational patch of degree 2, and the
inverse projection doubles the degree. The control points and weights below follow from this.

References
----------
Farin, Piper and Worsey, The octant of a sphere as a non-degenerate triangular Bézier patch,
CAGD 4 (1987).
"""

from itertools import product
from math import sqrt

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.examples.quadrics import Patch, Point
from service.surface.grids import NO_GRIDS
from service.surface.patches import PatchSurface

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
    return _assemble("octahedral-sphere", [], _corners((0.0, 0.0, 0.0), radius))


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
    return _assemble("rounded-box", grids, _corners(half, radius))


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


def _assemble(name: str, grids: list[Patch], triangles: list[list[Point]]) -> PatchSurface:
    """One surface of these patches, in which equal points are one vertex."""
    numbers: dict[Point, int] = {}
    # A dictionary treats −0 and 0 as equal keys, so that they are one vertex.
    patches = [
        [[numbers.setdefault(point, len(numbers)) for point in row] for row in grid]
        for grid in grids
    ]
    corners = [[numbers.setdefault(point, len(numbers)) for point in net] for net in triangles]
    table = np.array(list(numbers))
    return PatchSurface(
        table[:, :3],
        np.array(patches) if patches else NO_GRIDS,
        table[:, 3],
        up="z",
        name=name,
        triangles=np.array(corners),
    )
