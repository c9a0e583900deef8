"""Hits of rays, and the merging of hits that several cells report at one place.

Every hit represents some points of the surface on its ray, and has an interval of t that contains
them all. There is evidence of four kinds: a *proved* root, a point at which a cell meets the ray; a
root that is so *near* the border of its cell that it may be outside, and is not proved; an end of a
*strip*, a curve in a cell that the ray is almost tangent to; and a *point*, a cell much smaller
than the thickness of the ray. Hits of one ray whose intervals overlap are at one place, and form a
cluster. A cluster is merged by these rules:

- Each proved hit stays a separate crossing, except in a hit *along* (see below). Two proved hits in
  a cluster are two sheets of the surface, or the surface meets itself there.
- An unproved hit, near the border of its cell, is dropped if a proved hit of the cluster crosses
  the surface in the same direction. The remaining unproved hits become one hit: a crossing if the
  ray crosses at all of them in one direction (as on a seam), else touching (as on a ridge).
- Strips and points become one hit, with the unproved hits. But unproved hits between two strips or
  points, at which the ray is not almost tangent, are another sheet of the surface, and are merged
  as above. The one hit is *along* if its interval is long and the distance from the ray is nearly
  constant; it then includes proved hits in its interval at which the ray is almost tangent. It is a
  crossing if all are points and their normals are on one side of the ray (as at a pole). Otherwise
  it is *touching*. However, a strip next to a proved crossing at which the ray is almost tangent
  only makes the interval of the crossing longer.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import count_runs, find_begins
from service.engine.rays.bounds import Rays
from service.engine.rays.intervals import number_clusters
from service.engine.vectors import Items, cross, dot, length

MIN_LENGTH_ALONG = 32
"""The least length of the interval of a hit *along*, in units of √(thickness · diagonal).
A ray that touches a sphere whose radius is the diagonal is within the thickness for 2.8 units."""

MAX_VARIATION = 1 / 64
"""At three quarters of the ends of strips in a hit *along*, the distance between surface and ray
varies by at most this, in units of the thickness."""

STRIP_PADDING = 1 / 8
"""The intervals of strips are enlarged by this at both ends before it is decided which of them
overlap; in units of the least length of a hit *along*."""

MAX_TANGENT_SINE = 1e-3
"""A ray and the surface are almost tangent if the sine of their angle is at most this."""


class Evidence(IntEnum):
    """How a hit was found: as a proved root, near the border of a cell, as a strip or a point.

    On trimmed faces there is also the ray that passes an edge, or follows it, or passes a seam.
    """

    PROVED = 0
    NEAR = 1
    STRIP = 2
    POINT = 3
    EDGE = 4
    LONG_EDGE = 5
    SEAM = 6


class Kind(IntEnum):
    """The kind of a hit."""

    CROSSING = 0
    TOUCHING = 1
    ALONG = 2


@dataclass(frozen=True, eq=False, slots=True)
class RayPoints(Items):
    """n points of the surface that are near rays.

    Attributes
    ----------
    ray, net : ndarray of int, shape (n,)
    parameters : ndarray of float64, shape (2, n)
        The parameters (u, v) of the net.
    position, du, dv : ndarray of float64, shape (3, n)
        The points, and the partials by the parameters of the net.
    t : ndarray of float64, shape (n,)
        The parameter of the nearest point of the ray.
    residual : ndarray of float64, shape (n,)
        The distance from the ray.
    """

    ray: Ints
    net: Ints
    parameters: FloatArray
    position: FloatArray
    du: FloatArray
    dv: FloatArray
    t: FloatArray
    residual: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Hits(RayPoints):
    """n hits of rays.

    Attributes
    ----------
    low, high : ndarray of float64, shape (n,)
        The interval of t.
    label : ndarray of int, shape (n,)
        Before merging an `Evidence`, after merging a `Kind`.
    side : ndarray of float64, shape (n,)
        The proved sign of d · (du × dv): 1 or −1 at proved roots, 0 at other hits.
    is_near_edge : ndarray of bool, shape (n,)
        Whether an edge of a face is near.
    """

    low: FloatArray
    high: FloatArray
    label: Ints
    side: FloatArray
    is_near_edge: Bools

    def sines(self, direction: FloatArray) -> FloatArray:
        """Sines (n,) of the angles between directions (3, n) and the surface at these hits.

        A sine is negative if the direction is against the normal, and 0 if du × dv vanishes.
        """
        normal = cross(self.du, self.dv)
        lengths = length(normal)
        return dot(normal, direction) / np.where(lengths > 0, lengths, 1.0)


_NUMBERS, _VALUES, _VECTORS = np.zeros(0, np.intp), np.zeros(0), np.zeros((3, 0))

NO_HITS = Hits(
    *(_NUMBERS, _NUMBERS, np.zeros((2, 0)), _VECTORS, _VECTORS, _VECTORS),
    *(_VALUES, _VALUES, _VALUES, _VALUES),
    _NUMBERS,
    _VALUES,
    np.zeros(0, bool),
)
"""An empty list of hits."""


def merge_hits(hits: Hits, sines: FloatArray, rays: Rays, min_length_along: float) -> Hits:
    """Merge hits to one hit for each place, in the order of rays and of t.

    `label` of the merged hits is a `Kind`. `sines` (n,) are those of the rays, positive in the
    direction of normals. `min_length_along` is the least length of the interval of a hit *along*.
    If such an interval begins behind the origin of the ray, the hit is at the first end of a strip
    that is not behind the origin.
    """
    # Enlarge the intervals of strips: a surface that is almost tangent to the ray is also near the
    # ray before and after the strip.
    pad = np.where(hits.label == Evidence.STRIP, STRIP_PADDING * min_length_along, 0.0)
    order = np.lexsort((*hits.parameters[::-1], hits.net, hits.low - pad, hits.ray))
    hits, sines, pad = hits.take(order), sines[order], pad[order]
    max_variation = MAX_VARIATION * rays.thickness[hits.ray]
    is_behind = hits.t < rays.near[hits.ray]
    cluster = number_clusters(hits.ray, hits.low - pad, hits.high + pad)
    first = find_begins(cluster)
    sizes = count_runs(first, len(cluster))
    kind = np.full(len(cluster), int(Kind.CROSSING))
    is_kept = np.ones(len(cluster), bool)
    # `first` has the first row of each cluster. A cluster needs merging if it has a strip or a
    # point, or several hits of which one is not proved.
    max_evidence = np.maximum.reduceat(hits.label, first) if len(first) else first
    needs_merging = (max_evidence >= Evidence.STRIP) | (
        (sizes > 1) & (max_evidence > Evidence.PROVED)
    )
    for k in np.flatnonzero(needs_merging).tolist():
        rows = np.arange(first[k], first[k] + sizes[k])
        is_kept[rows] = False
        for row, merged_kind in _merge_cluster(
            hits, sines, (min_length_along, max_variation, is_behind), rows
        ):
            is_kept[row], kind[row] = True, merged_kind
    hits.label[:] = kind
    merged = hits.take(is_kept)
    return merged.take(np.lexsort((merged.net, merged.t, merged.ray)))


def _merge_cluster(
    hits: Hits, sines: FloatArray, limits: tuple[float, FloatArray, Bools], rows: Ints
) -> list[tuple[int, Kind]]:
    """Merge the hits `rows` of one cluster; returns the hits that remain, with their kinds.

    The intervals of the remaining hits are updated in `hits`. `limits` are the least length of a
    hit *along* and, for each hit, the largest variation of distances, and whether it is behind the
    origin of its ray.
    """
    evidence, t = hits.label[rows], hits.t[rows]
    proved, unproved = rows[evidence == Evidence.PROVED], rows[evidence == Evidence.NEAR]
    strips = rows[evidence >= Evidence.STRIP]  # and points
    merged: list[tuple[int, Kind]] = []
    if len(strips):
        # Unproved hits between the strips, at which the ray is not almost tangent, are another
        # sheet; the other unproved hits join the strips.
        ends = t[evidence >= Evidence.STRIP]
        is_between_ends = (hits.low[unproved] > ends.min()) & (hits.high[unproved] < ends.max())
        is_sheet = is_between_ends & (np.abs(sines[unproved]) > MAX_TANGENT_SINE)
        strips, unproved = np.concatenate([strips, unproved[~is_sheet]]), unproved[is_sheet]
        tangent_rows = proved[np.abs(sines[proved]) <= MAX_TANGENT_SINE]
        strip_sines, are_points = sines[strips], (hits.label[strips] == Evidence.POINT).all()
        residuals = hits.residual[rows[evidence == Evidence.STRIP]]
        min_length_along, max_variation, is_behind = limits
        if np.ptp(ends) > min_length_along and are_nearly_equal(residuals, max_variation[rows[0]]):
            low, high = hits.low[strips].min(), hits.high[strips].max()
            tangent_rows_within = tangent_rows[
                (hits.low[tangent_rows] <= high) & (hits.high[tangent_rows] >= low)
            ]
            proved, strips = (
                np.setdiff1d(proved, tangent_rows_within),
                np.concatenate([strips, tangent_rows_within]),
            )
            rows_ahead = strips[~is_behind[strips]] if (~is_behind[strips]).any() else strips
            chosen = rows_ahead[np.lexsort((hits.residual[rows_ahead], hits.t[rows_ahead]))[0]]
            merged.append((_extend_interval(hits, chosen, strips), Kind.ALONG))
        else:
            # A strip beside a crossing at which the ray is almost tangent belongs to its interval.
            strips = np.array(
                [row for row in strips if not _join_to_crossing(hits, row, tangent_rows)], np.intp
            )
            if len(strips):
                rows_ahead = strips[~is_behind[strips]] if (~is_behind[strips]).any() else strips
                chosen = rows_ahead[np.argmin(hits.residual[rows_ahead])]
                is_one_sided = (strip_sines > MAX_TANGENT_SINE).all() or (
                    strip_sines < -MAX_TANGENT_SINE
                ).all()
                kind = Kind.CROSSING if are_points and is_one_sided else Kind.TOUCHING
                merged.append((_extend_interval(hits, chosen, strips), kind))
    # Unproved hits join the nearest proved hit that crosses in the same direction as they do.
    for sign in (-1, 1):
        same_direction = proved[sines[proved] * sign > 0]
        if len(same_direction):
            for row in unproved[sines[unproved] * sign > 0]:
                chosen = same_direction[np.argmin(np.abs(hits.t[same_direction] - hits.t[row]))]
                _extend_interval(hits, chosen, np.array([chosen, row]))
            unproved = unproved[sines[unproved] * sign <= 0]
    if len(unproved):
        chosen = unproved[np.argmin(hits.residual[unproved])]
        signs = np.sign(sines[unproved])
        kind = Kind.CROSSING if (signs == signs[0]).all() else Kind.TOUCHING
        merged.append((_extend_interval(hits, chosen, unproved), kind))
    return merged + [(int(row), Kind.CROSSING) for row in proved]


def _extend_interval(hits: Hits, chosen: np.intp, rows: Ints) -> int:
    """Extend the interval of the hit `chosen` to contain those of `rows`; returns `chosen`."""
    low, high = hits.low[rows].min(), hits.high[rows].max()
    hits.low[chosen], hits.high[chosen] = low, high
    return int(chosen)


def _join_to_crossing(hits: Hits, strip: np.intp, tangent_rows: Ints) -> bool:
    """Join a strip to the nearest crossing among `tangent_rows`.

    Returns whether there is a crossing that is at most the length of the strip's interval away.
    """
    low, high = hits.low[strip], hits.high[strip]
    neighbors = tangent_rows[
        np.maximum(low - hits.high[tangent_rows], hits.low[tangent_rows] - high) <= high - low
    ]
    if len(neighbors):
        chosen = neighbors[np.argmin(np.abs(hits.t[neighbors] - hits.t[strip]))]
        _extend_interval(hits, chosen, np.array([chosen, strip]))
    return len(neighbors) > 0


def are_nearly_equal(residuals: FloatArray, max_variation: float) -> bool:
    """Whether three quarters of the ends of strips have nearly equal distances from the ray.

    The other ends may be at borders, where the distance may be larger than elsewhere.
    """
    if not len(residuals):
        return False
    return bool(np.quantile(residuals, 0.75) - residuals.min() <= max_variation)
