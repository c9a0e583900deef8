"""Decides which points are inside of the solids of a part, by winding numbers, with a proof.

The winding number of a closed solid about a point is the number of times that a ray from the point
to infinity leaves it, less the number of times that it enters. It is the same however the gaps at
edges are closed, if what closes them stays in tubes about the edges, and the ray passes none of
these. If the ray has a hit that is not a certain crossing, the next one of a few directions is
tried.

Proof in docs/proofs.md: "Winding numbers of parts".
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.joining.join import join
from service.engine.nets.query_nets import surface_nets
from service.engine.parts.intersect import build_ray_borders
from service.engine.parts.part import Part
from service.engine.rays.bounds import make_rays
from service.engine.rays.crossings import find_crossings
from service.engine.rays.hits import Hits
from service.engine.rays.intersect import RayQuery, RaySearch
from service.engine.signs.signs import WELD_TOLERANCE, compute_signs, find_grid_points
from service.engine.vectors import UNIT

DIRECTIONS = np.array(
    [
        [0.5417, 0.3119, 0.7805],
        [-0.6811, 0.6323, 0.3690],
        [0.2713, -0.8429, 0.4647],
        [-0.4391, -0.2287, -0.8689],
        [0.8933, -0.1871, -0.4087],
        [0.1373, 0.9187, -0.3703],
        [-0.8237, -0.4909, 0.2837],
        [0.3527, -0.5689, -0.7429],
    ]
)
"""The directions that are tried. None is near an axis, or in a plane of two axes' sums."""


def compute_part_signs(part: Part, points: FloatArray, low: FloatArray) -> FloatArray:
    """Compute the signs (m,) of points: −1 inside, +1 outside, NaN if this is uncertain.

    A point is inside if it is inside of one of the solids: the breps whose shells are all closed,
    with those that are their voids, and all patches without trims together if these are closed.
    Outside it is only if everything is closed. Points within the gap of an edge are uncertain.

    Parameters
    ----------
    points : ndarray of float64, shape (m, 3)
        In the coordinates of the nets.
    low : ndarray of float64, shape (m,)
        Lower bounds of their distances from the part, in the coordinates of the nets.
    """
    solids = part.solids
    signs = _sign_solids(part, solids, points, low)
    if part.members.patches is not None:
        others = _sign_patches(part, points, low)
        is_inside = (signs < 0) | (others < 0)
        signs = np.where(is_inside, -1.0, np.where(np.isnan(signs), np.nan, others))
    if any(solids[copy.first_patch] < 0 for copy in part.members.copies):
        signs[signs > 0] = np.nan
    return signs


def _sign_patches(part: Part, points: FloatArray, low: FloatArray) -> FloatArray:
    """The signs (m,) of points by the patches without trims alone."""
    patches = part.members.patches
    assert patches is not None  # the caller checks it
    nets = surface_nets(patches.batches)
    shift = (part.nets.origin - nets.origin) / nets.scale
    ratio = part.nets.scale / nets.scale
    joined = join(patches, WELD_TOLERANCE)
    return compute_signs(patches, joined, nets, points * ratio + shift, low * ratio)


def _sign_solids(part: Part, solids: Ints, points: FloatArray, low: FloatArray) -> FloatArray:
    """−1 for points (m,) inside of one of the solids, +1 for others, NaN where uncertain."""
    signs = np.ones(len(points))
    if (solids < 0).all():
        return signs
    faces = part.faces
    query = RayQuery(points, points, only_first=False)
    thickness = query.relative_thickness * (faces.diagonal / faces.scale)
    borders = build_ray_borders(part, thickness, query.limits)
    search = RaySearch(faces, query, borders)
    error = 0.0 if faces.errors is None else float(faces.errors.max())
    reach = 0.0 if borders.edges is None else float(borders.edges.reach.max())
    lowest, highest = search.cells.box
    # All tubes are in the box with this margin.
    margin = 2 * reach + 64 * UNIT * search.cells.largest
    is_in_box = ((points >= lowest - margin) & (points <= highest + margin)).all(axis=1)
    signs[is_in_box] = np.nan
    # One point of a grid stands for all points that no face and no tube separates from it.
    rows = np.flatnonzero(is_in_box & (low > 0))
    at, room = points[rows].copy(), low[rows] - 2 * margin
    is_far = room > 0
    at[is_far] = find_grid_points(at[is_far], room[is_far])
    distinct, inverse = np.unique(at, axis=0, return_inverse=True)
    found = np.full(len(distinct), np.nan)
    for direction in DIRECTIONS:
        left = np.flatnonzero(np.isnan(found))
        if not len(left):
            break
        ways = np.broadcast_to(direction, (len(left), 3))
        rays = make_rays(distinct[left], ways, thickness, error)
        hits, is_certain = find_crossings(search, borders, rays)
        inside = _wind(part, solids, hits, len(left))
        found[left[is_certain]] = np.where(inside[is_certain], -1.0, 1.0)
    signs[rows] = found[inverse.reshape(-1)]  # NumPy 2.0 returns a column
    return signs


def _wind(part: Part, solids: Ints, hits: Hits, count: int) -> Bools:
    """Whether rays (count,) begin inside of a solid, from all of their crossings."""
    patch = part.rows.patch[hits.net]
    kept = np.flatnonzero(solids[patch] >= 0)
    patch, ray = patch[kept], hits.ray[kept]
    side = np.where(part.is_reversed[patch], -1.0, 1.0) * hits.side[kept]
    key, number = np.unique(ray * (int(solids.max()) + 1) + solids[patch], return_inverse=True)
    winding = np.bincount(number.reshape(-1), side, minlength=len(key))
    inside = np.zeros(count, bool)
    inside[key[winding != 0] // (int(solids.max()) + 1)] = True
    return inside
