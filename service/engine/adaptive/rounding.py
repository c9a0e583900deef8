"""What rounding may do to the bounds of the certificate, and the least tolerance it leaves.

u = 2^-53 is what one operation may do, relative to its result. All of a piece happens in units in
which no coordinate about the middle of the patch is above 1, neither of control points nor of
vertices of hosts; hence no difference of two points is longer than 2√3 < 4.

**Nets.** On its way from the given control points to a net over a triangle a number meets

    P − M, times its weight                                2
    three a level where a row of a triangle is raised      3 max(p, q)
    two a level of the blossom, (1 − t) a + t b            2 (p + q); 1 − t is exact
    its share, and adding up (p+1)(q+1) terms at most      2 + (p+1)(q+1)
    w a, subtracted; a product and two sums of the frame   5; the frame itself is right to 8 u

roundings, r in all. Only combinations with factors that are not negative are made of the points, so
a coordinate (of a homogeneous point: relative to the weight that it is of) is right to r u times 4,
and a weight to r u times itself; dividing by it doubles this. A point is right to
√3 · 2 r · 4 u < 16 r u.

**Distances.** `reach` and `highest` do a few operations more with such coordinates: at most 16 in a
row, and one a point of an edge where values half-way are added up, p + q + 1. Factors 4/3 of the
greatest value of Q and 2 of R less Q leave this below 16 (16 + p + q) u. Tents are right to 8 u
times the length of an edge: see `hosts`.

**Vertices.** X − M is rounded, relative to 1. A position that is stored about an origin, and told
here as one number, may be off by u |X| in each coordinate; so may the middle of the patch added to
a point, which is no matter here, for the surface is what the control points say.
"""

from service.bases.arrays import FloatArray

UNIT = 2.0**-53
"""Half the distance from 1 to the next number: what one rounding may do."""


def roundings(p: int, q: int) -> int:
    """The sum of all that, in units u, for patches of degree (p, q)."""
    path = 2 + 3 * max(p, q) + 2 * (p + q) + 2 + (p + 1) * (q + 1) + 13
    return 16 * path + 16 * (16 + p + q) + 64


def stored(far: FloatArray) -> FloatArray:
    """What vertices with coordinates up to `far` may be off by, shape (m,)."""
    slack: FloatArray = 4 * UNIT * far
    return slack
