"""Closest points on surfaces and curves, as arrays with one row for each point of the query."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.cells.bounding_spheres import BoundingSpheres
from service.engine.cells.pair_search import Chunks
from service.engine.cells.tree import CellTree, WorkLimits
from service.engine.closest.levels import ClosestLevels
from service.engine.closest.nearest import ClosestPoints
from service.engine.connectivity.connect import connect, connect_if_apart
from service.engine.connectivity.incidence import triangular_patches
from service.engine.connectivity.seams import Seams
from service.engine.curves.evaluation import CurveSamples, evaluate_tangents
from service.engine.evaluation.normals import evaluate_scattered_normals
from service.engine.nets.partials import net_partials
from service.engine.nets.query_nets import LocalPoints, QueryNets, curve_nets, surface_nets
from service.engine.signs.signs import WELD_TOLERANCE, compute_signs
from service.engine.vectors import cross, dot, length
from service.surface.curve_model import CurvePieces, to_space
from service.surface.lowered import PatchModel

Columns: TypeAlias = dict[str, NDArray[Any]]

MIN_SINE = 1e-4
"""The normal is computed as a limit if the sine of the angle between S_u and S_v is at most
MIN_SINE, or if |S_u × S_v|, in coordinates of the nets, is at most MIN_SINE²."""

RELATIVE_TOLERANCE = 1e-9
"""The default width of intervals of distances, in diagonals of the box of control points."""

CHUNK_SIZES = 16, 8192, 8192
"""How many points are searched together (`Chunks`): at most 8192, so that their data stay in the
processor's cache."""

LIMITS = WorkLimits(pairs=12_000_000, of_item=1000)
"""A pair takes 1 to 2.5 µs, so a response takes at most half a minute."""

MAX_GAP = 1e-12
"""A point counts as on a side of its patch if its parameters are at most this far from the side."""


@dataclass(frozen=True, eq=False, slots=True)
class ProjectQuery:
    """Points, and the largest width of the intervals of their distances.

    Attributes
    ----------
    points : ndarray of float64, shape (m, 3), or (m, 2) for a curve in the plane
        Model units.
    relative_tolerance : float
        The largest width of the intervals of distances, in diagonals of the box of control points.
    sign : bool
        Whether to compute which points are inside a closed surface.
    limits : WorkLimits
        The most work of the search for closest points.
    """

    points: FloatArray
    relative_tolerance: float = RELATIVE_TOLERANCE
    sign: bool = False
    limits: WorkLimits = LIMITS


def project_on_surface(model: PatchModel, query: ProjectQuery) -> Columns:
    """Find the closest points of a surface: the nearest of all its patches.

    Returns
    -------
    dict of ndarray
        - positions (m, 3); distances (m,); distance_bounds (m, 2), which contain the least distance
        - reached (m,): whether the bounds are as narrow as requested
        - tied (m,): whether another point of the surface may be equally near
        - patch (m,): the number in the request; omitted if the request is one surface with a domain
        - uv (m, 2): parameters of the surface if it has a domain, else of the patch; (s, t) on
          triangles
        - normals (m, 3)
        - on_boundary (m,): whether the closest point is on an open side
        - signs (m,), if requested: −1 inside, +1 outside, NaN where this is uncertain
    """
    nets = surface_nets(model.batches)
    local_points = nets.to_near_points(query.points)
    closest, columns = _closest(nets, local_points, query)
    seams = None
    if query.sign:
        # None if points on borders may be nearly, but not exactly equal: then `compute_signs` makes
        # them equal.
        seams = connect_if_apart(model, WELD_TOLERANCE)
        columns["signs"] = compute_signs(model, seams, nets, local_points.points, closest.low)
    patch = nets.patch[closest.net]
    local = nets.parameters(closest.net, closest.parameters.T)
    normals = net_normals(nets, closest.net, closest.parameters)
    columns |= surface_columns(model, patch, local, normals)
    columns["on_boundary"] = _on_boundary(model, seams or connect(model), patch, local)
    return columns


def project_on_curve(pieces: CurvePieces, query: ProjectQuery) -> Columns:
    """Find the closest points of a curve.

    Returns
    -------
    dict of ndarray
        positions (m, d), distances, distance_bounds, reached and tied as for a surface; parameters
        (m,) in the domain of the curve; unit tangents (m, d).
    """
    nets = curve_nets(pieces)
    local_points = nets.to_near_points(to_space(query.points))
    closest, columns = _closest(nets, local_points, query)
    columns["positions"] = columns["positions"][:, : pieces.dimension]
    samples = CurveSamples(closest.net, closest.parameters[0])
    columns["parameters"] = samples.parameters(pieces.breaks)
    columns["tangents"] = evaluate_tangents(pieces, samples)
    return columns


def net_normals(nets: QueryNets, net: Ints, parameters: FloatArray) -> tuple[FloatArray, Bools]:
    """Unit normals (m, 3) at parameters (2, m) of nets, and whether each is precise (m,)."""
    _, du, dv = net_partials(nets, net, parameters, 1)
    return regular_normals(du.T, dv.T)


def regular_normals(du: FloatArray, dv: FloatArray) -> tuple[FloatArray, Bools]:
    """Unit normals (m, 3) from partials (m, 3), and whether each is precise (m,)."""
    normals = cross(du, dv, -1)
    with np.errstate(all="ignore"):
        lengths = length(normals, -1)
        max_length = np.sqrt(dot(du, du, -1) * dot(dv, dv, -1))
        return normals / lengths[:, np.newaxis], (lengths > MIN_SINE * max_length) & (
            lengths > MIN_SINE**2
        )


def surface_columns(
    model: PatchModel, patch: Ints, local: FloatArray, regular: tuple[FloatArray, Bools]
) -> Columns:
    """The arrays `uv`, `patch` and `normals` of a response, for points on patches of a model.

    `local` (m, 2) are the parameters of the points in their patches, (s, t) on triangles. `regular`
    is the result of `regular_normals`; normals that are not precise are computed as limits.
    """
    normals, is_regular = regular
    columns: Columns = {}
    if model.domains:
        columns["uv"], number = in_domains(model, patch, local)
        if len(model.domains) > 1:
            columns["patch"] = number
    else:
        columns |= {
            "patch": patch if model.request_numbers is None else model.request_numbers[patch],
            "uv": local,
        }
    u, v = local.T
    # `evaluate_scattered_normals` takes triangles as patches with s = u (1 − v) and t = v.
    if triangular_patches(model.batches).any():
        is_triangle = triangular_patches(model.batches)[patch]
        width_of_row = np.where(is_triangle & (v < 1), 1 - v, 1.0)
        u = np.minimum(u / width_of_row, 1.0)
    if len(rows := np.flatnonzero(~is_regular)):
        normals[rows], _ = evaluate_scattered_normals(model.batches, patch[rows], u[rows], v[rows])
    return columns | {"normals": normals}


def in_domains(model: PatchModel, patch: Ints, local: FloatArray) -> tuple[FloatArray, Ints]:
    """Convert parameters (m, 2) of patches to those of the parametric surfaces of a model.

    Returns the parameters (m, 2), and the numbers (m,) of the surfaces.
    """
    first_patches = np.array([domain.first for domain in model.domains])
    order = np.argsort(first_patches)
    surface_numbers = order[np.searchsorted(first_patches[order], patch, side="right") - 1]
    uv = np.empty(local.shape)
    for k in np.unique(surface_numbers).tolist():
        domain, rows = model.domains[k], np.flatnonzero(surface_numbers == k)
        # The patches of a domain are numbered span by span, with v first.
        spans = np.divmod(patch[rows] - domain.first, len(domain.v) - 1)
        for axis, (knots, span) in enumerate(zip((domain.u, domain.v), spans, strict=True)):
            t, low, high = local[rows, axis], knots[span], knots[span + 1]
            uv[rows, axis] = np.where(t == 1, high, low + t * (high - low))
    return uv, surface_numbers


def _find_closest(
    nets: QueryNets, tolerance: float, points: FloatArray, limits: WorkLimits
) -> ClosestPoints:
    """Find the closest points to `points` (m, 3), in the coordinates of the nets.

    `tolerance` is the largest width of intervals.
    """
    cells = CellTree(nets, limits)
    spheres = BoundingSpheres(cells)
    chunks = Chunks(cells, len(points), CHUNK_SIZES)
    results = []
    for rows, budget in chunks:
        search = ClosestLevels(spheres, points[rows], budget, tolerance, can_split=chunks.can_split)
        result = search.search()
        if result is None:
            chunks.split()
        else:
            results.append(result)
            chunks.grow(search.most_open)
    return ClosestPoints.join(results)


def _closest(
    nets: QueryNets, local_points: LocalPoints, query: ProjectQuery
) -> tuple[ClosestPoints, Columns]:
    """Find the closest points; returns them, and the arrays that surfaces and curves share."""
    width = query.relative_tolerance * nets.diagonal
    closest = _find_closest(nets, width / nets.scale, local_points.points, query.limits)
    # `LocalPoints` moves very far points nearer; their distances have an error below one rounding.
    is_moved = local_points.shift > 0
    low = np.where(is_moved, np.nextafter(closest.low, 0.0), closest.low)
    high = np.where(is_moved, np.nextafter(closest.high, np.inf), closest.high)
    bounds = np.stack([local_points.model_lengths(low), local_points.model_lengths(high)], axis=1)
    return closest, {
        "positions": nets.origin + closest.position.T * nets.scale,
        "distances": local_points.model_lengths(closest.distance),
        "distance_bounds": bounds,
        "reached": bounds[:, 1] - bounds[:, 0] <= width,
        "tied": closest.is_tied,
    }


def _on_boundary(model: PatchModel, seams: Seams, patch: Ints, local: FloatArray) -> Bools:
    """Whether points with the parameters `local` (m, 2) lie on an open side of their patch."""
    # A side is open if its edge has no other side.
    is_open = (seams.sides_per_edge[seams.edge] == 1) & ~seams.collapsed
    u, v = local.T
    gaps = np.stack([u, 1 - u, v, 1 - v], axis=1)
    # The sides 0, 1 and 2 of a triangle are s = 0, s + t = 1 and t = 0; it has no side 3.
    is_triangle = triangular_patches(model.batches)[patch]
    gaps[is_triangle, 1] = (1 - u - v)[is_triangle]
    gaps[is_triangle, 3] = 1.0
    return np.asarray(((gaps <= MAX_GAP) & is_open[patch]).any(axis=1))
