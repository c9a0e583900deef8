"""Closest points on surfaces and curves, as arrays with one row for each point of the query."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.cells.bounding_spheres import BoundingSpheres
from service.engine.cells.pair_search import Chunks
from service.engine.cells.tree import CellTree, WorkLimits
from service.engine.closest.levels import ClosestLevels
from service.engine.closest.nearest import ClosestPoints
from service.engine.closest.open_sides import find_open_sides
from service.engine.curves.evaluation import CurveSamples, evaluate_tangents
from service.engine.joining.join import join
from service.engine.nets.partials import net_partials
from service.engine.nets.query_nets import LocalPoints, QueryNets, curve_nets, surface_nets
from service.engine.points.surface_columns import Columns, surface_columns
from service.engine.signs.signs import WELD_TOLERANCE, compute_signs
from service.engine.trims.trimmed_nets import NetTrims
from service.surface.curve_model import CurvePieces, to_space
from service.surface.lowered import PatchModel

RELATIVE_TOLERANCE = 1e-9
"""The default width of intervals of distances, in diagonals of the box of control points."""

CHUNK_SIZES = 16, 8192, 8192
"""How many points are searched together (`Chunks`): at most 8192, so that their data stay in the
processor's cache."""

LIMITS = WorkLimits(pairs=12_000_000, of_item=1000)
"""A pair takes 1 to 2.5 µs, so a response takes at most half a minute."""

MAX_ROUNDS = 12
"""The most halvings of all cells after which some centre of a cell is inside of the trims."""


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
        - on_boundary (m,): whether the closest point is on an open side of the joined surface
        - signs (m,), if requested: −1 inside, +1 outside, NaN where this is uncertain
    """
    nets = surface_nets(model.batches)
    local_points = nets.to_near_points(query.points)
    closest, columns = find_closest(nets, local_points, query)
    joined = join(model, WELD_TOLERANCE) if query.sign else None
    if joined is not None:
        columns["signs"] = compute_signs(model, joined, nets, local_points.points, closest.low)
    patch = nets.patch[closest.net]
    local = nets.parameters(closest.net, closest.parameters.T)
    _, du, dv = net_partials(nets, closest.net, closest.parameters, 1)
    columns |= surface_columns(model, patch, local, du, dv)
    columns["on_boundary"] = find_open_sides(model, patch, local, joined)
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
    closest, columns = find_closest(nets, nets.to_near_points(to_space(query.points)), query)
    columns["positions"] = columns["positions"][:, : pieces.dimension]
    samples = CurveSamples(closest.net, closest.parameters[0])
    columns["parameters"] = samples.parameters(pieces.breaks)
    columns["tangents"] = evaluate_tangents(pieces, samples)
    return columns


def _search(
    nets: QueryNets,
    tolerance: float,
    points: FloatArray,
    limits: WorkLimits,
    trims: NetTrims | None = None,
) -> ClosestPoints:
    """Find the closest points to `points` (m, 3), in the coordinates of the nets.

    `tolerance` is the largest width of intervals.
    """
    cells = CellTree(nets, limits, trims=trims)
    if trims is not None:
        begin_inside(cells)
    trees = _build_trees(cells, trims)
    chunks = Chunks(cells, len(points), CHUNK_SIZES)
    results = []
    for rows, budget in chunks:
        search = ClosestLevels(
            trees, points[rows], budget, tolerance, can_split=chunks.can_split, trims=trims
        )
        result = search.search()
        if result is None:
            chunks.split()
        else:
            results.append(result)
            chunks.grow(search.most_open)
    return ClosestPoints.join(results)


def _build_trees(cells: CellTree, trims: NetTrims | None) -> list[BoundingSpheres]:
    """The spheres of cells at which the search begins, and those of edges, which join it later."""
    if trims is None:
        return [BoundingSpheres(cells)]
    is_edge = cells.nets.is_curve[cells.net[cells.first]]
    chosen = cells.first[~is_edge], cells.first[is_edge]
    return [BoundingSpheres(cells, reach=trims.gaps, first=each) for each in chosen if len(each)]


def find_closest(
    nets: QueryNets, local_points: LocalPoints, query: ProjectQuery, trims: NetTrims | None = None
) -> tuple[ClosestPoints, Columns]:
    """Find the closest points; returns them, and the arrays that all answers share."""
    width = query.relative_tolerance * nets.diagonal
    closest = _search(nets, width / nets.scale, local_points.points, query.limits, trims)
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


def begin_inside(cells: CellTree) -> None:
    """Halve the first cells until the centre of one of them is inside of the trims.

    So each point of a query has an upper bound of its distance.
    """
    for _ in range(MAX_ROUNDS):
        if cells.has_center(cells.first).any() or not cells.can_halve(cells.first).all():
            break
        cells.replace_first(np.ones(len(cells.first), bool))
