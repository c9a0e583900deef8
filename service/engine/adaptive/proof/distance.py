"""How far a surface may be from a triangle of a mesh, told from its net in the triangle's frame.

Let c_i = (x_i, h_i) be the points of a net that has the hull property, h_i their heights over the
plane of the host T, x_i their places in it; a point of the surface is S = Σ_i β_i c_i with β_i ≥ 0
and Σ β_i = 1.

**Distance to T.** The distance to a convex set is a convex function, so its maximum over the hull
of the c_i is attained at one of them: d(S, T) ≤ max_i √(h_i² + d(x_i, T)²).

**Height apart.** In the same way d(x, T) ≤ max_i d(x_i, T) for the place x of S. If H ≥ |h(S)| is
known otherwise, then d(S, T) ≤ √(H² + max_i d(x_i, T)²). H comes from `heights`.

**Lens.** Let K be T with its tents (`hosts`), and k_i any point of K: then k = Σ β_i k_i is in K,
which is convex, and both bounds hold for |S − k|, with |x_i − k_i| for d(x_i, T). If k is in tent
e, its height over the edge is at most δ_e, the greatest height over edge e of any k_i, for that
height is affine; folded back it moves by 2 δ_e sin(θ_e/2) at most. A point is in one tent at most.
So max_e 2 δ_e sin(θ_e/2) is added once.

    d(S, mesh) ≤ min(own, lens + fold), each the lesser of two bounds.

A flat patch is at no distance from two triangles, whatever its parameters do, as long as its net
stays above them: θ = 0.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.adaptive.proof.hosts import Hosts

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


def reach(x: FloatArray, y: FloatArray, h: FloatArray, hosts: Hosts) -> Reach:
    """The largest distances of net points (N, m), given in the frames of their hosts."""
    flat = np.full(x.shape, np.inf)
    lens = np.full(x.shape, np.inf)
    # Where edges are points there is no inside.
    inside = np.broadcast_to(hosts.lengths.min(axis=0) > 0, x.shape).copy()
    fold = np.zeros(x.shape[1])
    for edge in range(3):
        along, out = _beside(x, y, hosts, edge)
        length = hosts.lengths[edge]
        inside &= out <= -INSIDE
        # The nearest point of the edge, and the height of the tent there.
        foot = np.minimum(np.maximum(along, 0.0), length)
        along -= foot
        along *= along
        tent = foot * hosts.begins[edge]
        np.subtract(length, foot, out=foot)
        foot *= hosts.ends[edge]
        np.minimum(tent, foot, out=tent)
        # In the tent as high as the place is, if it is so high.
        np.minimum(tent, out, out=tent)
        np.maximum(tent, 0.0, out=tent)
        np.maximum(fold, tent.max(axis=0) * hosts.folds[edge], out=fold)
        np.subtract(out, tent, out=tent)
        tent *= tent
        tent += along
        np.minimum(lens, tent, out=lens)
        out *= out
        out += along
        np.minimum(flat, out, out=flat)
    flat[inside] = 0.0
    lens[inside] = 0.0
    squared = h * h
    return Reach(
        (squared + flat).max(axis=0),
        (squared + lens).max(axis=0),
        flat.max(axis=0),
        lens.max(axis=0),
        np.sqrt(squared.max(axis=0)),
        fold,
    )


def _beside(x: FloatArray, y: FloatArray, hosts: Hosts, edge: int) -> tuple[FloatArray, FloatArray]:
    """Coordinates along an edge, from its beginning, and outwards from it."""
    if edge == 0:
        return x.copy(), -y
    start, tangent = hosts.corners[edge], hosts.tangents[edge]
    away_x, away_y = x - start[0], y - start[1]
    along = away_x * tangent[0]
    along += away_y * tangent[1]
    away_x *= tangent[1]
    away_y *= tangent[0]
    away_x -= away_y
    return along, away_x
