"""Hits where rays pass seams and poles of faces, which are no edges.

The two sides of a seam may be apart by a gap, or overlap. A ray through the gap has no hit of the
face, and gets one. A ray that crosses both sides where they overlap has two hits, and keeps one.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, find_begins
from service.engine.rays.bounds import Rays
from service.engine.rays.hits import MAX_TANGENT_SINE, Hits, Kind
from service.engine.rays.intervals import number_clusters
from service.engine.rays.net_sides import NetSides


def close_seams(hits: Hits, seams: Hits, sides: NetSides, rays: Rays) -> Hits:
    """Merged hits with one hit at each place where a ray passes a seam; `seams` are such passes."""
    if not len(seams.ray):
        return hits
    seams = seams.take(np.lexsort((seams.low, seams.ray)))
    place = number_clusters(seams.ray, seams.low, seams.high)
    first = find_begins(place)
    ray = seams.ray[first]
    low, high = np.minimum.reduceat(seams.low, first), np.maximum.reduceat(seams.high, first)
    hits = hits.take(np.argsort(hits.ray, kind="stable"))
    begin, end = (np.searchsorted(hits.ray, ray, side) for side in ("left", "right"))
    at, row = expand_runs(end - begin, begin)
    is_met = (hits.low[row] <= high[at]) & (hits.high[row] >= low[at])
    is_own = _match(at, sides.patch[hits.net[row]], place, sides.patch[seams.net])
    # A hit near an edge may be that of any face there.
    met = np.flatnonzero(is_met & (is_own | hits.is_near_edge[row]))
    missing = np.ones(len(first), bool)
    missing[at[met]] = False
    sines = sides.find_sines(hits, rays)
    kept = np.ones(len(hits.ray), bool)
    kept[_join_double(hits, sines, sides.patch[hits.net], (at[met], row[met]))] = False
    added = seams.take(missing[place])
    return Hits.join([hits.take(kept), _take_one(added, sides.find_sines(added, rays))])


def _match(at: Ints, patch: Ints, place: Ints, own: Ints) -> Bools:
    """Whether the face `patch` (n,) of the place `at` (n,) is one of the faces at this place."""
    step = int(max(patch.max(initial=0), own.max(initial=0))) + 1
    return np.isin(at * step + patch, place * step + own)


def _join_double(hits: Hits, sines: FloatArray, patch: Ints, met: tuple[Ints, Ints]) -> Ints:
    """The crossings at places that repeat one of the same face in the same direction.

    `met` are places and their hits. The interval of the crossing that stays is extended.
    """
    place, row = met
    is_crossing = (hits.label[row] == Kind.CROSSING) & ~hits.is_near_edge[row]
    place, row = place[is_crossing], row[is_crossing]
    keys = np.stack([place, patch[row], np.sign(sines[row]).astype(np.intp)])
    order = np.lexsort((hits.net[row], hits.residual[row], *keys[::-1]))
    keys, row = keys[:, order], row[order]
    repeats = np.flatnonzero((keys[:, 1:] == keys[:, :-1]).all(axis=0)) + 1
    is_first = np.ones(len(row), bool)
    is_first[repeats] = False
    stays = row[is_first][is_first.cumsum() - 1][repeats]
    double: Ints = row[repeats]
    np.minimum.at(hits.low, stays, hits.low[double])
    np.maximum.at(hits.high, stays, hits.high[double])
    return double


def _take_one(passes: Hits, sines: FloatArray) -> Hits:
    """One hit for each place of passes of seams, marked as near an edge."""
    if not len(passes.ray):
        return passes
    place = number_clusters(passes.ray, passes.low, passes.high)
    first = find_begins(place)
    low, high = np.minimum.reduceat(passes.low, first), np.maximum.reduceat(passes.high, first)
    sign = np.where(sines > MAX_TANGENT_SINE, 1, np.where(sines < -MAX_TANGENT_SINE, -1, 0))
    least, most = np.minimum.reduceat(sign, first), np.maximum.reduceat(sign, first)
    chosen = np.lexsort((passes.net, passes.residual, place))[first]
    merged = passes.take(chosen)
    is_crossing = (least == most) & (least != 0)
    merged.label[:] = np.where(is_crossing, Kind.CROSSING, Kind.TOUCHING)
    merged.low[:], merged.high[:], merged.is_near_edge[:] = low, high, True
    return merged
