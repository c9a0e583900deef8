"""What rounding may do to the bounds of the certificate, and the least tolerance it leaves.

u = 2^-53 is what one operation may do, relative to its result. All of a piece happens in units in
which no coordinate about the middle of the patch is above 1, neither of control points nor of
vertices of hosts; hence no difference of two points is longer than 2√3 < 4.

**Nets.** On its way from the given control points to a net over a triangle a number meets

    P − M, times its weight                                2
    three a level where a row of a triangle is raised      3 max(p, q)
    w a, subtracted; three products added in the frame     5; the frame itself is right to 8 u
    rows of blossoms, two a level, (1 − t) b + t b         2 (p + q); 1 − t is exact
    their products with lines of the net                   p + q + 2
    its share, and adding up (p+1)(q+1) terms at most      2 + (p+1)(q+1); where degrees are
                                                           reduced, p + q + 4 are enough

roundings, r in all. Only combinations with factors that are not negative are made of the points, so
a coordinate (of a homogeneous point: relative to the weight that it is of) is right to r u times 4,
and a weight to r u times itself; dividing by it doubles this. A point is right to
√3 · 2 r · 4 u < 16 r u.

A sum of k products is right to k u times the sum of their sizes in whatever order it is added, with
fused operations or without (Higham, Accuracy and stability of numerical algorithms, section 3.1).
The order of such sums is the library's own; it is the same for every item of stacked matrices.

**Distances.** `distances` and `highest` do a few operations more with such coordinates: at most 16
in a row, and one a point of an edge where values half-way are added up, p + q + 1. The greatest
value of Q has a factor 4/3, and what is taken off for R has at most 8/3 in one row, for 4 Σ i_k
i_{k+1} ≤ 4 n²/3 and n ≥ 2: together 4 · 4 (n + 1) u and less than 60 u more, which is below 16 (16
+ p + q) u. Wedges are right to 8 u times the length of an edge: see `reference_triangles`.

**Vertices.** X − M is rounded, relative to 1. A position that is stored about an origin, and told
here as one number, may be off by u |X| in each coordinate; so may the middle of the patch added to
a point, which is no matter here, for the surface is what the control points say.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.bounds.degree_reduction import DIRECT, SHIFT
from service.engine.bounds.goal import Goal, too_small
from service.engine.bounds.patch_nets import PatchNets

UNIT = 2.0**-53
"""Half the distance from 1 to the next number: what one rounding may do."""


def roundings(p: int, q: int) -> int:
    """The sum of all that, in units u, for patches of degree (p, q)."""
    path = 2 + 3 * max(p, q) + 13 + 3 * (p + q) + 2 + 2 + (p + 1) * (q + 1)
    return 16 * path + 16 * (16 + p + q) + 64


def stored(far: FloatArray) -> FloatArray:
    """What vertices with coordinates up to `far` may be off by, shape (m,)."""
    slack: FloatArray = 4 * UNIT * far
    return slack


def floor(ground: PatchNets, step: float = 0.0) -> float:
    """The least tolerance that is worth an attempt, in model units.

    However fine a mesh is, its bounds have all of the above in them, and how far its vertices are
    from the surface: by their evaluation, which rounds less than the certificate does, and by
    `step`, what they lose when they are stored. As much again is left for the surface to bend.
    """
    least = 0.0
    for nets in ground.groups:
        sizes = ground.sizes[nets.patches]
        far = sizes + np.abs(ground.middles[:, nets.patches]).max(axis=0)
        # Units are powers of two, up to twice the size.
        share = 2 * UNIT * roundings(*nets.degree)
        if sum(nets.degree) > DIRECT:
            share += SHIFT
        slack = 2 * share * sizes + stored(far)
        least = max(least, float(slack.max()))
    return 4 * (least + ground.lowering) + 2 * step


def check_goal(goal: Goal, least: float, nearest: float = 0.0) -> None:
    """Refuses a goal of which rounding takes too much, nothing being nearer to the eye than that.

    Raises
    ------
    InvalidRequest
        `tolerance_too_small`.
    """
    asked = float(goal.allowed(np.array([nearest]))[0])
    if asked < least:
        pointer = "/tolerance" if goal.view is None else "/pixel_tolerance"
        raise too_small(f"{asked:.6g}", least, pointer)
