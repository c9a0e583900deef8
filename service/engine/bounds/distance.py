"""How far a surface may be from a triangle of a mesh, told from its net in the triangle's frame.

Let c_i = (x_i, h_i) be the points of a net that has the hull property, h_i their heights over the
plane of the host T, x_i their places in it; a point of the surface is S = Σ_i β_i c_i with β_i ≥ 0
and Σ β_i = 1.

**Distance to T.** The distance to a convex set is a convex function, so its maximum over the hull
of the c_i is attained at one of them: d(S, T) ≤ max_i √(h_i² + d(x_i, T)²).

**Height apart.** In the same way d(x, T) ≤ max_i d(x_i, T) for the place x of S. If H ≥ |h(S)| is
known otherwise, then d(S, T) ≤ √(H² + max_i d(x_i, T)²). H comes from `heights`.

**Lens.** Let K be T with its tents (`reference_triangles`), and k_i any point of K: then k = Σ β_i
k_i is in K, which is convex, and both bounds hold for |S − k|, with |x_i − k_i| for d(x_i, T). If k
is in tent e, its height over the edge is at most δ_e, the greatest height over edge e of any k_i,
for that height is affine; folded back it moves by 2 δ_e sin(θ_e/2) at most. A point is in one tent
at most. So max_e 2 δ_e sin(θ_e/2) is added once.

    d(S, mesh) ≤ min(own, lens + fold), each the lesser of two bounds.

**Few points.** What is inside T is at no distance from it, and so is most of a net. Every other
point is measured to all three edges, and to the tents on them.

A flat patch is at no distance from two triangles, whatever its parameters do, as long as its net
stays above them: θ = 0.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.bounds.reference_triangles import ReferenceTriangles

INSIDE = 2.0**-46
"""A place counts as inside T if rounding leaves no doubt, in units in which coordinates are below
1. All others are measured to the edges."""


@dataclass(frozen=True, eq=False, slots=True)
class Reach:
    """What is largest among the points of each net; all of shape (m,).

    `whole` and `whole_lens` are squares of distances to T and to K, `flat` and `flat_lens` of those
    in the plane alone; `height` is max |h_i|, `fold` what folding back adds.
    """

    whole: FloatArray
    whole_lens: FloatArray
    flat: FloatArray
    flat_lens: FloatArray
    height: FloatArray
    fold: FloatArray

    def bound(self, height: FloatArray) -> FloatArray:
        """The bound above, if heights are known to be at most so much."""
        known = np.minimum(self.height, height)
        squared = known * known
        own = np.sqrt(squared + self.flat)
        lens = np.sqrt(squared + self.flat_lens)
        own = np.minimum(own, np.sqrt(self.whole))
        lens = np.minimum(lens, np.sqrt(self.whole_lens))
        bound: FloatArray = np.minimum(own, lens + self.fold)
        return bound


def reach(points: FloatArray, hosts: ReferenceTriangles) -> Reach:
    """The largest distances of net points (m, 3, N), x, y and h in the frames of their hosts."""
    count, _, many = points.shape
    x, y = points[:, 0], points[:, 1]
    squared = points[:, 2] * points[:, 2]
    height = squared.max(axis=1)
    (_, _), (one_x, one_y), (two_x, two_y) = tangents = hosts.tangents
    start = hosts.corners
    # Outwards from each edge: − n · (P − A), with t × A once a piece.
    begin = start[:, 0] * tangents[:, 1] - start[:, 1] * tangents[:, 0]
    out = np.empty((3, count, many))
    np.negative(y, out=out[0])
    for edge, (along_x, along_y) in ((1, (one_x, one_y)), (2, (two_x, two_y))):
        np.multiply(x, along_y[:, np.newaxis], out=out[edge])
        out[edge] -= y * along_x[:, np.newaxis]
        out[edge] -= begin[edge, :, np.newaxis]
    worst = np.maximum(np.maximum(out[0], out[1]), out[2])
    # Where edges are points there is no inside.
    point = hosts.lengths.min(axis=0) == 0
    if point.any():
        worst[point] = np.maximum(worst[point], 0.0)
    beyond = (worst > -INSIDE).ravel().nonzero()[0]
    found = np.zeros((5, count))
    if len(beyond):
        piece = beyond // many
        flat = points.reshape(-1)
        place = beyond + 2 * many * piece
        x, y = flat.take(place), flat.take(place + many)
        values = _beside(x, y, out.reshape(3, -1).take(beyond, axis=1), hosts, piece)
        np.add(squared.reshape(-1).take(beyond), values[:2], out=values[2:4])
        first = np.diff(piece, prepend=-1).nonzero()[0]
        found[:, piece[first]] = np.maximum.reduceat(values, first, axis=1)
    return Reach(
        np.maximum(found[2], height),
        np.maximum(found[3], height),
        found[0],
        found[1],
        np.sqrt(height),
        found[4],
    )


def _beside(
    x: FloatArray, y: FloatArray, out: FloatArray, hosts: ReferenceTriangles, piece: Ints
) -> FloatArray:
    """Squared distances of K places from edges, and from tents; two free rows; folds: (5, K).

    Parameters
    ----------
    x, y : ndarray of float64, shape (K,)
        Places in the frames of hosts, `piece` (K,).
    out : ndarray of float64, shape (3, K)
        How far they are outside of each edge.
    """
    corners, tangents = hosts.corners, hosts.tangents
    begin = corners[:, 0] * tangents[:, 0] + corners[:, 1] * tangents[:, 1]
    along = x * tangents[:, 0].take(piece, axis=1)
    along += y * tangents[:, 1].take(piece, axis=1)
    along -= begin.take(piece, axis=1)
    length = hosts.lengths.take(piece, axis=1)
    # The nearest point of the edge, and the height of the tent there.
    foot = np.maximum(along, 0.0)
    np.minimum(foot, length, out=foot)
    along -= foot
    along *= along
    tent = foot * hosts.begins.take(piece, axis=1)
    np.subtract(length, foot, out=foot)
    foot *= hosts.ends.take(piece, axis=1)
    np.minimum(tent, foot, out=tent)
    # In the tent as high as the place is, if it is so high.
    np.minimum(tent, out, out=tent)
    np.maximum(tent, 0.0, out=tent)
    values = np.empty((5, len(piece)))
    (hosts.folds.take(piece, axis=1) * tent).max(axis=0, out=values[4])
    np.subtract(out, tent, out=tent)
    tent *= tent
    tent += along
    tent.min(axis=0, out=values[1])
    out *= out
    out += along
    out.min(axis=0, out=values[0])
    return values
