"""The proof: halves pieces of a surface until each is proved to be near the mesh.

Theorem. Let a piece of a patch with positive weights have the projected control points P_i. If each
lies within d of a point q_i of one triangle, so does every point of the piece: it is Σ λ_i P_i with
λ_i ≥ 0 that add up to 1, and Σ λ_i q_i is a point of the triangle, which is convex.

Two triangles with a common edge e, folded by an angle θ, give almost the same bound. Σ λ_i q_i then
lies on the segment from a point a of the one to a point b of the other. Let these be at the
distances x and y from the line of e, and their feet on it within e. Seen along e, the segment
passes e at the distance x y sin θ / √(x² + y² + 2 x y cos θ), which grows with x and with y and is
at most x y sin θ / ((x + y) √cos θ) if cos θ > 0; there it is over a point c of e. The path from a
to c to b stays on the mesh, and by similar triangles no point of the segment is further from it
than that. If c is the foot of a, or that of b, the same path shows that the distance is at most x,
or y. If feet lie beyond an end of e, c is moved to this end.

Rounding. Each number is a float64 with an error radius, which is computed once for all numbers.
Halving a net of degree p takes p averages one after the other, each with an error of at most u =
2^-53 of the largest number; so h halvings of degree at most p have an error of at most h p u. A
quotient X/w adds the rounding of X and of w over the least weight. q_i is a corner plus s and t
times the two sides from there, with s, t ≥ 0 and s + t < 1, so it is in its triangle, no matter how
s and t were found; it and P_i − q_i are computed in some dozen operations of numbers that are no
larger than the coordinates. A piece or a point whose distance differs from the bound by no more
than its error is decided without rounding (`tools.judge.hulls`).
"""

from dataclasses import dataclass
from fractions import Fraction
from math import inf, nextafter
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracles.distance import Soup, measure_distances
from tools.judge.exact import Array, Exact, to_fractions
from tools.judge.hulls import cut_net, is_hull_near, measure_squared_distance

Index: TypeAlias = NDArray[np.intp]

U = 2.0**-53
CHUNK, SEARCHED = 2048, 256
"""Numbers of pieces of the surface whose proof is started together, and of points whose nearest
triangles are searched together."""

TINY = 1e-300
"""It replaces zero in divisors."""

DEEPEST, MOST = 60, 1 << 16
"""Most halvings of a piece, and most pieces at a time; beyond these, pieces stay undecided."""

SLENDER = 16.0
"""Most times that a piece may be longer in the direction in which its distances do not change."""

FEW = 3
"""Number of points of the search tree whose triangles are compared before all others."""

LATE = 5
"""Halvings in `_prove` after which the nearest of all triangles are searched, and points of the
remaining pieces are tested for a violation."""

WITNESSES = 64
"""Most pieces whose corners are tested."""

NEEDLE = 2.0**-23
"""Most by which `measure_distances` exceeds the distance from a triangle that is almost a segment,
as a share of the size of the mesh. It measures distances from the sides too, so the excess is at
most the height of the triangle; above a height of about √U, the error of the normal is smaller."""


@dataclass
class Proof:
    """Result of a proof: the pieces examined, those that stay undecided, and a violation.

    `exact` counts the pieces that were proved without rounding. `beyond` is a violation, which ends
    the proof: the distance, rounded, of a point of the surface whose exact distance from the whole
    mesh exceeds the bound.
    """

    pieces: int = 0
    exact: int = 0
    undecided: int = 0
    beyond: float | None = None


class Mesh:
    """Triangles (T, 3, 3), their neighbours across edges, and search trees.

    Edge 3 t + k of the mesh begins at corner k of triangle t. `across` (T, 3) has the number of the
    same edge in the other triangle; −1 at a border.
    """

    def __init__(self, corners: Array) -> None:
        self.corners = corners
        self.soup = Soup(corners)
        self.size = float(np.abs(corners).max())
        _, vertex = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        rows = vertex.reshape(-1, 3)
        ends = np.sort(np.stack([rows, rows[:, [1, 2, 0]]], axis=2), axis=2).reshape(-1, 2)
        order = np.lexsort(ends.T)
        same = np.flatnonzero((ends[order[1:]] == ends[order[:-1]]).all(axis=1))
        across = np.full(len(ends), -1)
        across[order[same]], across[order[same + 1]] = order[same + 1], order[same]
        self.across: Index = across.reshape(-1, 3)

    def nearest(self, points: Array, *, of_all: bool) -> Index:
        """A triangle (m,) near each point (m, 3); any choice gives a valid proof.

        With `of_all` it is the nearest of all triangles, or else the nearest of a few.
        """
        # k is a range, so that `rows` has two axes also for one triangle.
        _, rows = self.soup.tree.query(points, k=range(1, min(FEW, len(self.soup.owner)) + 1))
        owners = self.soup.owner[rows]
        every = np.repeat(points, owners.shape[1], axis=0)
        gaps = measure_distances(every, self.corners[owners.ravel()]).reshape(owners.shape)
        best = gaps.argmin(axis=1)[:, np.newaxis]
        owner, least = (np.take_along_axis(x, best, 1)[:, 0] for x in (owners, gaps))
        for start in range(0, len(points) if of_all else 0, SEARCHED):
            some = slice(start, start + SEARCHED)
            self._search_all(points[some], owner[some], least[some])
        return np.asarray(owner, dtype=np.intp)

    def _search_all(self, points: Array, owner: Index, least: Array) -> None:
        """Replaces triangles (m,) and their distances (m,) from points by the nearest, in place."""
        for tree, triangles, radius in self.soup.balls:
            near = tree.query_ball_point(points, least + radius)
            row = np.repeat(np.arange(len(points)), [len(each) for each in near])
            chosen = triangles[np.array([k for each in near for k in each], dtype=np.intp)]
            gap = measure_distances(points[row], self.corners[chosen])
            order = np.argsort(-gap)  # the least value is written last
            order = order[gap[order] < least[row[order]]]
            owner[row[order]], least[row[order]] = chosen[order], gap[order]

    def is_near(self, net: Exact, edge: int, bound: float) -> bool:
        """Whether a piece (p+1, q+1, 4) is proved to be within `bound` of the triangles at an edge.

        `edge` is 3 t + k; the proof has no rounding.
        """
        points = (net[..., :3] / net[..., 3:]).reshape(-1, 3)
        host = np.roll(self.corners[edge // 3], -(edge % 3), axis=0)
        other = self.across.flat[edge]
        twin = to_fractions(self.corners[other // 3]) if other >= 0 else None
        return is_hull_near(points, to_fractions(host), twin, Fraction(bound))

    def is_beyond(self, point: Exact, bound: float, error: float) -> bool:
        """Whether a point (3,) is further than `bound` from every triangle.

        Distances in float64 have an error of at most `error`; those that may be within the bound
        are computed exactly.
        """
        copies = np.tile(point.astype(np.float64), (len(self.corners), 1))
        near = measure_distances(copies, self.corners) <= bound + error
        square = Fraction(bound) ** 2
        return all(
            measure_squared_distance(point, each) > square
            for each in to_fractions(self.corners[near])
        )


def prove(nets: list[Exact], corners: Array, bound: float) -> Proof:
    """Shows that all points of all nets (m, p+1, q+1, 4) are within `bound` of the triangles."""
    proof, mesh = Proof(), Mesh(corners)
    total = sum(map(len, nets))
    for net in nets:
        rounded = net.astype(np.float64)
        pieces, halvings = np.moveaxis(rounded, -1, 0), 0
        labels = np.stack([np.arange(len(net)), *np.ones((2, len(net)), dtype=np.intp)])
        scale = np.abs(rounded).reshape(-1, 4).max(axis=0)
        # Pieces much larger than triangles cannot be proved: begins with one for two triangles.
        while pieces.shape[1] < len(corners) / 2 * len(net) / total:
            pieces, labels = halve_pieces(pieces, labels, project_points(pieces))
            halvings += 1
        for start in range(0, pieces.shape[1], CHUNK):
            some = slice(start, start + CHUNK)
            chunk = pieces[:, some], labels[:, some]
            _prove(proof, mesh, net, *chunk, halvings=halvings, scale=scale, bound=bound)
            if proof.beyond is not None:
                return proof
    return proof


def _prove(
    proof: Proof, mesh: Mesh, net: Exact, pieces: Array, labels: Index, *,
    halvings: int, scale: Array, bound: float
) -> None:  # fmt: skip
    """Proves pieces (4, m, p+1, q+1) near the mesh, and adds the result to `proof`.

    The pieces were cut by `halvings` halvings from nets with numbers up to `scale` (4,). A column
    of `labels` (3, m) says which piece of `net` (n, p+1, q+1, 4) a piece is: the row of `net`, and
    `u` and `v` of `cut_net`.
    """
    halvings_before = halvings
    while pieces.shape[1]:
        proof.pieces += pieces.shape[1]
        points = project_points(pieces)
        size = max(mesh.size, float(np.abs(points).max()))
        # Errors of homogeneous numbers, as a share of `scale`; of weights; of projected points.
        share = (1 + halvings * max(pieces.shape[2:])) * U
        weight_error, least_weight = share * scale[3], float(pieces[3].min())
        assert least_weight > 2 * weight_error, "weights that rounding may have turned negative"
        point_error = share * float(scale[:3].max()) + size * weight_error
        point_error /= least_weight - weight_error
        radius = 2 * point_error + 512 * U * size
        late = halvings - halvings_before >= LATE
        bounds, edges, gaps = bound_distances(mesh, points, of_all=late)
        is_left = ~(bounds + radius <= bound)
        for k in np.flatnonzero(is_left & (bounds - radius <= bound)):
            row, u, v = labels[:, k].tolist()
            if mesh.is_near(cut_net(net[row], u, v), edges[k], bound):
                is_left[k], proof.exact = False, proof.exact + 1
        left = np.flatnonzero(is_left)
        pieces, labels, points = pieces[:, left], labels[:, left], points[:, left]
        if late and len(left):
            proof.beyond = find_violation(mesh, net, points, labels, bound=bound, radius=radius)
            if proof.beyond is not None:
                return
        if halvings == DEEPEST or len(left) > MOST:
            proof.undecided += len(left)
            return
        # Points with their distance from the triangle as a fourth coordinate. So a piece over many
        # narrow triangles is halved in the direction across them, until it is SLENDER times as long
        # in the other.
        points_and_gaps = np.concatenate([points / SLENDER, gaps[np.newaxis, left]])
        pieces, labels = halve_pieces(pieces, labels, points_and_gaps)
        halvings += 1


def find_violation(
    mesh: Mesh, net: Exact, points: Array, labels: Index, *, bound: float, radius: float
) -> float | None:
    """The distance of a corner of a piece that is further than `bound` from the mesh, or None.

    It tests the corners of at most `WITNESSES` pieces with the control points (3, m, p+1, q+1) and
    the labels (3, m) of `_prove`. `radius` is the error of distances of control points.
    """
    some = np.arange(0, points.shape[1], 1 + points.shape[1] // WITNESSES)
    corners = points[:, some][:, :, [0, 0, -1, -1], [0, -1, 0, -1]]
    distances = mesh.soup.distances(corners.reshape(3, -1).T)
    k, farthest = int(distances.argmax()), float(distances.max())
    error = radius + NEEDLE * mesh.size
    if farthest + error > bound:
        row, u, v = labels[:, some[k // 4]].tolist()
        # Corner k % 4 of the piece: [0, 0], [0, -1], [-1, 0] or [-1, -1].
        corner = cut_net(net[row], u, v)[-(k // 2 % 2), -(k % 2)]
        if mesh.is_beyond(corner[:3] / corner[3], bound, error):
            return max(farthest, nextafter(bound, inf))
    return None


def project_points(pieces: Array) -> Array:
    """The projected control points of pieces, (3, m, p+1, q+1)."""
    return np.asarray(pieces[:3] / pieces[3])


def halve_pieces(pieces: Array, labels: Index, points: Array) -> tuple[Array, Index]:
    """Both halves of every piece, and their labels; see `_prove`.

    A piece is halved in the direction in which its net of `points` (d, m, p+1, q+1) is longer.
    """
    long_u, long_v = (
        np.sqrt((np.diff(points, axis=axis) ** 2).sum(axis=0)).sum(axis=axis - 1).max(axis=1)
        for axis in (2, 3)
    )
    along_u = long_u >= long_v
    turned = np.swapaxes(_split(np.swapaxes(pieces[:, ~along_u], 2, 3)), 2, 3)
    halves = np.concatenate([_split(pieces[:, along_u]), turned], axis=1)
    (row, u, v), (other, s, t) = labels[:, along_u], labels[:, ~along_u]
    new_labels = [[row, 2 * u, v], [row, 2 * u + 1, v], [other, s, 2 * t], [other, s, 2 * t + 1]]
    return halves, np.concatenate(new_labels, axis=1)


def _split(pieces: Array) -> Array:
    """Halves along u, by de Casteljau."""
    left, right, rows = [], [], pieces
    while rows.shape[2]:
        left.append(rows[:, :, 0])
        right.append(rows[:, :, -1])
        rows = (rows[:, :, :-1] + rows[:, :, 1:]) * 0.5
    return np.concatenate([np.stack(left, axis=2), np.stack(right[::-1], axis=2)], axis=1)


def bound_distances(mesh: Mesh, points: Array, *, of_all: bool) -> tuple[Array, Index, Array]:
    """For each piece with the control points (3, m, p+1, q+1), a bound and how it was found.

    Returns an upper bound (m,) of the distance of the hull from a near triangle, or from this
    triangle and one neighbour; the edge 3 t + k (m,) between them; and the distances
    (m, p+1, q+1) of the control points from the near triangle.
    """
    shape, points = points.shape[1:], points.reshape(3, points.shape[1], -1)
    triangle = mesh.nearest(points.mean(axis=2).T, of_all=of_all)
    corners = mesh.corners[triangle].transpose(1, 2, 0)[..., np.newaxis]
    gaps, shares, reach = _find_closest(points, corners)
    bounds: Array = gaps.max(axis=1)
    # The edge beyond which the net reaches furthest, and the triangle that is there. `lengths` are
    # those of the sides opposite to the corners; the side opposite to corner k is edge k + 1.
    lengths = np.linalg.norm(np.roll(corners, -2, axis=0) - np.roll(corners, -1, axis=0), axis=1)
    edge = ((reach / np.maximum(lengths, TINY)).min(axis=2).argmin(axis=0) + 1) % 3
    other = mesh.across[triangle, edge]
    rows = np.flatnonzero(other >= 0)
    turn = (edge[rows] + np.arange(3)[:, np.newaxis]) % 3
    host = corners[turn, :, rows, :].swapaxes(1, 2)
    # Both triangles begin with the corners of the common edge; the third corner differs.
    twin = host.copy()
    twin[2, :, :, 0] = mesh.corners[other[rows] // 3, (other[rows] + 2) % 3].T
    # Each control point belongs to the nearer of the two triangles.
    twin_gaps, twin_shares, _ = _find_closest(points[:, rows], twin)
    is_nearer = gaps[rows] <= twin_gaps
    host_shares = np.where(is_nearer, shares[turn, rows], 0)
    fold = _bound_fold(host, twin, host_shares, np.where(is_nearer, 0, twin_shares))
    both = np.where(is_nearer, gaps[rows], twin_gaps).max(axis=1) + fold
    bounds[rows] = np.fmin(bounds[rows], both)
    return bounds, 3 * triangle + edge, gaps.reshape(shape)


def _find_closest(points: Array, corners: Array) -> tuple[Array, Array, Array]:
    """Points of triangles (corner, xyz, m, 1) that are almost the nearest to points (3, m, n).

    Returns the distances (m, n) of these points; their barycentric coordinates (3, m, n), all ≥ 0;
    and those of the projections to the planes of the triangles.
    """
    a, (e, f) = corners[0], (corners[1:] - corners[0])
    d = points - a
    ee, ef, ff = _dot(e, e), _dot(e, f), _dot(f, f)
    de, df = _dot(d, e), _dot(d, f)
    area = np.maximum(ee * ff - ef * ef, TINY)
    s, t = (ff * de - ef * df) / area, (ee * df - ef * de) / area
    reach = np.stack([1 - s - t, s, t])
    zero = np.zeros_like(s)
    along = np.clip((df - de + ee - ef) / np.maximum(ee - 2 * ef + ff, TINY), 0, 1)
    least, best = np.full_like(s, np.inf), np.stack([zero, zero])
    # The projection, if it is in the triangle, and the nearest points of the sides.
    nearest = [
        (np.where(reach.min(axis=0) >= 0, s, 0), t),
        (de / np.maximum(ee, TINY), zero),
        (zero, df / np.maximum(ff, TINY)),
        (1 - along, along),
    ]
    for each in nearest:
        s_t = np.clip(each, 0, 1)
        # Now s + t < 1 in spite of rounding, as the proof demands.
        s_t *= (1 - 8 * U) / np.maximum(s_t.sum(axis=0), 1)
        rest = d - s_t[0] * e - s_t[1] * f
        square = _dot(rest, rest)
        nearer = square < least
        least, best = np.where(nearer, square, least), np.where(nearer, s_t, best)
    s, t = best
    return np.sqrt(least), np.stack([1 - s - t, s, t]), reach


def _bound_fold(host: Array, twin: Array, host_shares: Array, twin_shares: Array) -> Array:
    """Bounds (m,) of the distance of segments from one triangle to another from both triangles.

    The triangles (corner, xyz, m, 1) share their first two corners, the ends of the edge e of the
    module's theorem. The shares (3, m, n) are barycentric coordinates of points of the triangles,
    and 0 where a point belongs to the other triangle. A bound is NaN if e has no length.
    """
    e, c, d = host[1] - host[0], host[2] - host[0], twin[2] - host[0]
    host_normal, twin_normal = np.cross(e, c, axis=0), np.cross(d, e, axis=0)
    length, m, n = (np.sqrt(_dot(each, each)) for each in (e, host_normal, twin_normal))
    with np.errstate(divide="ignore", invalid="ignore"):
        rounding = 64 * U * length * (np.sqrt(_dot(c, c)) / m + np.sqrt(_dot(d, d)) / n)
        across = np.cross(host_normal, twin_normal, axis=0)
        sine = np.sqrt(_dot(across, across)) / (m * n) + rounding
        cosine = _dot(host_normal, twin_normal) / (m * n) - rounding
        # The largest distances from the line of e; m and n are twice the areas of the triangles.
        x, y = (
            (shares[2] * double_area / length).max(axis=1)
            for shares, double_area in ((host_shares, m), (twin_shares, n))
        )
        # The feet of the points on e, 0 and 1 at its ends, and how far they lie beyond the ends.
        feet = host_shares[1] + twin_shares[1]
        feet = feet + (host_shares[2] * _dot(c, e) + twin_shares[2] * _dot(d, e)) / length**2
        beyond = np.maximum(np.maximum(-feet, feet - 1).max(axis=1), 0) * length[:, 0]
        bent: Array = x * y / np.maximum(x + y, TINY) * (sine / np.sqrt(cosine))[:, 0]
    least: Array = np.fmin(np.where(cosine[:, 0] > 0.5, bent, np.inf), np.minimum(x, y))
    least += beyond
    return least


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
