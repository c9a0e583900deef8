"""Crossings of rays with trimmed faces, of which all are proved.

A ray is *certain* if it passes no edge within its reach, and each of its hits is a proved root
ahead of its origin. Then its hits are exactly the points where the ray meets the faces, and it
crosses a face at each.

Proof in docs/proofs.md: "Winding numbers of parts".
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Bools
from service.engine.cells.pair_search import Chunks
from service.engine.rays.bounds import Rays
from service.engine.rays.edge_search import NO_PASSES
from service.engine.rays.hits import NO_HITS, Evidence, Hits
from service.engine.rays.intersect import CHUNK_SIZES, RayBorders, RaySearch
from service.engine.rays.levels import RayLevels
from service.engine.rays.trimming import RayTrims


def find_crossings(search: RaySearch, borders: RayBorders, rays: Rays) -> tuple[Hits, Bools]:
    """The crossings of the certain rays among m rays, and which rays are certain, (m,)."""
    passes, reached = borders.find_passes(rays)
    reached[passes.ray[passes.high >= rays.near[passes.ray]]] = False
    chosen = np.flatnonzero(reached)
    is_certain = np.zeros(len(reached), bool)
    parts = [NO_HITS]
    chunks = Chunks(search.cells, len(chosen), CHUNK_SIZES)
    for rows, budget in chunks:
        own = chosen[rows]
        taken = rays.take(own)
        trims = RayTrims.of(borders.trims, NO_PASSES)
        levels = RayLevels(
            search.spheres,
            taken,
            budget,
            only_first=False,
            can_split=chunks.can_split,
            trims=trims,
        )
        hits = levels.search()
        if hits is None:
            chunks.split()
            continue
        certain = levels.reached
        certain[_find_vague(hits, taken)] = False
        is_certain[own] = certain
        kept = hits.take(certain[hits.ray])
        parts.append(replace(kept, ray=own[kept.ray]))
        chunks.grow(levels.most_open)
    return Hits.join(parts), is_certain


def _find_vague(hits: Hits, rays: Rays) -> Bools:
    """Which rays (m,) have a hit that is not proved, or not ahead of the origin."""
    is_vague = np.zeros(len(rays.near), bool)
    is_bad = (hits.label != Evidence.PROVED) | (hits.low <= rays.near[hits.ray])
    is_vague[hits.ray[is_bad]] = True
    return is_vague
