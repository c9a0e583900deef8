"""Hits of rays on whole parts: trimmed faces, their edges, and patches without trims.

Hits are inside of the trims, or near an edge. Where faces meet at an edge, they have one hit.

Proof in docs/proofs.md: "Hits on trimmed faces".
"""

from dataclasses import replace
from typing import Any

import numpy as np

from service.engine.cells.tree import WorkLimits
from service.engine.parts.border_nets import build_border_nets
from service.engine.parts.columns import PartColumns
from service.engine.parts.edge_hits import EdgeFaces
from service.engine.parts.net_places import NetPlaces
from service.engine.parts.part import Part
from service.engine.rays.edge_search import EdgeSearch
from service.engine.rays.intersect import (
    CHUNK_SIZES,
    RayBorders,
    RayQuery,
    RaySearch,
    find_hits,
    list_kinds,
)
from service.engine.rays.net_sides import NetSides

FIRST_BYTES, RAY_BYTES = 24 << 20, 1 << 17
"""The most bytes of cells of a search: for the first ray, and more for each. A single ray in a face
of degree 8, whose search ends at its limits, took 340 MB without this limit, and 130 MB with it."""


def intersect_part(part: Part, query: RayQuery, max_hits: int) -> dict[str, Any]:
    """Find the hits of rays on a part.

    Normals are those of faces, which point out of the material of a solid: −(du × dv) of the
    surface where the face is reversed. A ray is `entering` if it runs against this normal.

    Returns
    -------
    dict of ndarray or list
        As `intersect_rays`; `patch` counts faces and patches of the request. And for n hits:

        - near_edge (n,): whether the ray is nearer to an edge than its gap and the thickness of the
          ray. All faces that meet there have one hit together. No border is further from its edge
          than the gap, so rays through a gap between faces have such a hit.

    Raises
    ------
    TooLarge
        `too_many_hits`: more than `max_hits`.
    """
    faces, count = part.faces, np.broadcast(query.origins, query.directions).size // 3
    limits = query.limits
    limits = replace(limits, bytes=min(limits.bytes, FIRST_BYTES + RAY_BYTES * count))
    query = replace(query, limits=limits)
    thickness = query.relative_thickness * (faces.diagonal / faces.scale)
    borders = build_ray_borders(part, thickness, limits)
    rays, hits, columns = find_hits(RaySearch(faces, query, borders), query, max_hits)
    sides = borders.sides
    columns |= PartColumns(part).describe(hits.net, hits.parameters, hits.du, hits.dv)
    columns |= list_kinds(hits, sides.find_sines(hits, rays))
    return columns | {"near_edge": hits.is_near_edge}


def build_ray_borders(part: Part, thickness: float, limits: WorkLimits) -> RayBorders:
    """The trims and edges of a part."""
    faces, count = part.faces, part.surface_nets
    patch = part.rows.patch[:count]
    sides = NetSides(patch, part.is_reversed[patch])
    nets = build_border_nets(part)
    if nets is None:
        return RayBorders(part.trims, None, sides, None)
    edges = EdgeSearch(nets.nets, nets.item, nets.reach, limits, CHUNK_SIZES)
    rows = EdgeFaces(nets, faces, NetPlaces(part), thickness)
    return RayBorders(part.trims, edges, sides, rows.list_hits)
