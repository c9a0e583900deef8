"""Merging of hits where rays pass edges: all faces that meet at an edge have one hit together.

A pass of an edge has a hit for each face at the edge, with the normal of the face there. The
merged hit includes the hits of these faces in the interval of the pass, and strips and small cells
whose intervals overlap it. It is *along* if the ray follows the edge, or a face beside it. It is a
crossing if the ray runs against the normals of all faces at the edge, or in the direction of all
normals: then it comes from one side of the two faces to the other. Otherwise it touches. Hits of
other faces at the same place are merged by themselves (`hits`).
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import count_runs, find_begins
from service.engine.rays.bounds import Rays
from service.engine.rays.hits import (
    MAX_TANGENT_SINE,
    MAX_VARIATION,
    STRIP_PADDING,
    Evidence,
    Hits,
    Kind,
    are_nearly_equal,
    merge_hits,
)
from service.engine.rays.intervals import ApartIntervals, number_clusters
from service.engine.rays.net_sides import NetSides
from service.engine.rays.seam_merging import close_seams


def merge_at_edges(hits: Hits, sides: NetSides, rays: Rays, min_length_along: float) -> Hits:
    """Merge hits, some of which are passes of edges, to one hit for each place.

    The result is that of `merge_hits`. Hits near edges are marked.
    """
    order = np.lexsort((*hits.parameters[::-1], hits.net, hits.label, hits.low, hits.ray))
    hits = hits.take(order)
    is_seam = hits.label == Evidence.SEAM
    seams, hits = hits.take(is_seam), hits.take(~is_seam)
    sines = sides.find_sines(hits, rays)
    joined = _find_joined(hits, sides.patch[hits.net], min_length_along)
    rest = merge_hits(hits.take(~joined), sines[~joined], rays, min_length_along)
    merged = _merge(hits.take(joined), sines[joined], sides, rays, min_length_along)
    hits = close_seams(Hits.join([rest, merged]), seams, sides, rays)
    return hits.take(np.lexsort((hits.net, hits.t, hits.ray)))


def _find_joined(hits: Hits, patch: Ints, min_length_along: float) -> Bools:
    """Which hits (n,), in the order of rays and of `low`, belong to passes of edges."""
    is_pass = hits.label >= Evidence.EDGE
    is_strip = (hits.label == Evidence.STRIP) | (hits.label == Evidence.POINT)
    joined = is_pass | _list_near(hits, is_pass, patch)
    # Strips and small cells join passes, and each other.
    rows = np.flatnonzero(joined | is_strip)
    chosen, cluster = _number_places(hits.take(rows), min_length_along)
    rows = rows[chosen]
    has_pass = np.zeros(len(rows) + 1, bool)
    has_pass[cluster[is_pass[rows]]] = True
    joined[rows] |= has_pass[cluster]
    return joined


def _number_places(hits: Hits, min_length_along: float) -> tuple[Ints, Ints]:
    """An order of hits in which those of one place follow each other, and numbers of the places."""
    pad = np.where(hits.label == Evidence.STRIP, STRIP_PADDING * min_length_along, 0.0)
    low, high = hits.low - pad, hits.high + pad
    order = np.lexsort((low, hits.ray))
    return order, number_clusters(hits.ray[order], low[order], high[order])


def _list_near(hits: Hits, is_pass: Bools, patch: Ints) -> Bools:
    """Which hits (n,) overlap passes of edges of their own faces."""
    key = hits.ray * (int(patch.max(initial=0)) + 1) + patch
    passes = ApartIntervals.of(key[is_pass], hits.low[is_pass], hits.high[is_pass])
    is_near: Bools = passes.find(key, hits.low, hits.high)[0] > 0
    return is_near


def _merge(
    hits: Hits, sines: FloatArray, sides: NetSides, rays: Rays, min_length_along: float
) -> Hits:
    """One hit for each place of joined hits."""
    if not len(hits.ray):
        return hits
    order, cluster = _number_places(hits, min_length_along)
    hits, sines = hits.take(order), sines[order]
    first = find_begins(cluster)
    low, high = np.minimum.reduceat(hits.low, first), np.maximum.reduceat(hits.high, first)
    is_along = _find_along(hits, cluster, first, rays, min_length_along)
    is_pass = hits.label >= Evidence.EDGE
    sign = np.where(sines > MAX_TANGENT_SINE, 1, np.where(sines < -MAX_TANGENT_SINE, -1, 0))
    least = np.minimum.reduceat(np.where(is_pass, sign, 1), first)
    most = np.maximum.reduceat(np.where(is_pass, sign, -1), first)
    # Hits ahead of the beginning of the ray come first: roots before strips, and these before
    # passes. Along an edge or a face, it is the first hit of a face that the ray follows.
    is_behind = hits.t < rays.near[hits.ray]
    runs_along = is_along[cluster]
    is_aside = runs_along & ~_find_followed(hits, cluster, sides.patch[hits.net])
    key = np.where(runs_along, hits.t, hits.label)
    order = np.lexsort((hits.net, hits.t, hits.residual, key, is_behind, is_aside, cluster))
    chosen = order[first]
    is_crossing = (least == most) & (least != 0) & (np.sign(sines[chosen]) == least)
    kind = np.where(is_along, Kind.ALONG, np.where(is_crossing, Kind.CROSSING, Kind.TOUCHING))
    merged = hits.take(chosen)
    merged.low[:], merged.high[:], merged.label[:], merged.is_near_edge[:] = low, high, kind, True
    return merged


def _find_along(
    hits: Hits, cluster: Ints, first: Ints, rays: Rays, min_length_along: float
) -> Bools:
    """Whether the ray follows an edge, or the strips beside it, in each cluster (k,)."""
    is_along: Bools = np.maximum.reduceat(hits.label, first) == Evidence.LONG_EDGE
    is_strip = hits.label == Evidence.STRIP
    has_strip = np.logical_or.reduceat(is_strip, first)
    low, high = np.minimum.reduceat(hits.t, first), np.maximum.reduceat(hits.t, first)
    is_long = has_strip & ~is_along & (high - low > min_length_along)
    sizes = count_runs(first, len(cluster))
    for k in np.flatnonzero(is_long).tolist():
        rows = np.arange(first[k], first[k] + sizes[k])
        limit = MAX_VARIATION * rays.thickness[hits.ray[first[k]]]
        is_along[k] = are_nearly_equal(hits.residual[rows[is_strip[rows]]], limit)
    return is_along


def _find_followed(hits: Hits, cluster: Ints, patch: Ints) -> Bools:
    """Which hits (n,) are of faces that the ray follows, or that have an edge that it follows."""
    key = cluster * (int(patch.max(initial=0)) + 1) + patch
    own, number = np.unique(key, return_inverse=True)
    is_followed = np.zeros(len(own), bool)
    follows = (hits.label == Evidence.STRIP) | (hits.label == Evidence.LONG_EDGE)
    is_followed[number[follows]] = True
    followed: Bools = is_followed[number]
    return followed
