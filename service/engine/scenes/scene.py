"""A group of models as a scene: the mesh of each distinct model, and the placements of its copies.

Formats with nodes encode the scene; for other formats it is flattened to one mesh.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, RealArray
from service.bases.row_batches import unique_rows
from service.engine.extent import AT_ZERO, choose_origin, find_extent, find_stored_bounds
from service.engine.mesh.mesh import Mesh, MeshPart, MeshReport, find_largest_angle, round_ranges
from service.engine.scenes.colors import tint
from service.engine.scenes.merge import add_reports, merge_meshes
from service.engine.scenes.painting import paint_parts
from service.engine.scenes.placing import (
    bound_placing_error,
    place_normals,
    place_points,
    reverse_faces,
    scalings,
)
from service.engine.stored_positions import Storage, bound_single_error
from service.surface.checks import Up
from service.surface.lowered import GroupModel, GroupNode, PlacedModel
from service.surface.placement import is_mirroring


@dataclass(frozen=True, eq=False, slots=True)
class Scene:
    """Meshes and their placed copies, the nodes.

    Attributes
    ----------
    nodes : tuple of PlacedModel
        Each node refers to a mesh: its `model` is a number in `meshes`.
    meshes : tuple of Mesh
        Each mesh in the coordinates of its model, before placing.
    report : MeshReport
        Its counts are sums over all nodes; its bounds are the bounds of the placed vertices.
    joined : tuple of tuples of int
        Groups of nodes whose meshes meet. Vertices of one group at equal positions count as one
        position.
    tree : tuple of GroupNode
        The tree with the copies, by their numbers in `nodes`; empty if each copy is a node below
        the root.
    """

    name: str
    up: Up
    nodes: tuple[PlacedModel, ...]
    meshes: tuple[Mesh, ...]
    report: MeshReport
    joined: tuple[tuple[int, ...], ...] = ()
    tree: tuple[GroupNode, ...] = ()


def arrange(model: GroupModel, meshes: tuple[Mesh, ...]) -> Scene:
    """The scene of a group, given the meshes of its models."""
    reports = [_place_report(meshes[node.model], node) for node in model.members]
    report = add_reports(reports)
    return Scene(model.name, model.up, model.members, meshes, report, tree=model.nodes)


def flatten(scene: Scene) -> Mesh:
    """All copies as one mesh, float64, in the coordinates of the scene.

    A part has the name of its member. If the surface of the member has several parts, the name is
    "member/part".
    """
    copies = [_place_copy(scene.meshes[node.model], node) for node in scene.nodes]
    mesh = merge_meshes(copies, scene.name)
    if scene.joined:
        mesh = replace(mesh, welds=_join_welds(mesh, copies, scene.joined))
    return replace(mesh, up=scene.up, report=scene.report)


def _join_welds(
    mesh: Mesh, copies: Sequence[Mesh], joined: tuple[tuple[int, ...], ...]
) -> IndexArray:
    """For each vertex, the first vertex at its position; only joined nodes share positions."""
    count = len(mesh.positions)
    welds = np.arange(count, dtype=np.uint32) if mesh.welds is None else mesh.welds.copy()
    first = np.cumsum([0, *(len(copy.positions) for copy in copies)])
    for nodes in joined:
        rows = np.concatenate([np.arange(first[n], first[n + 1]) for n in nodes])
        # + 0.0 turns −0.0 into 0.0, because rows are compared bit by bit.
        first_at_position, position_number = unique_rows(
            mesh.positions[rows].astype(np.float64) + 0.0
        )
        welds[rows] = rows[first_at_position[position_number]]
    return welds


def scene_parts(scene: Scene) -> tuple[MeshPart, ...]:
    """The parts of all copies, under their names, with bounds in the coordinates of the scene.

    The faces of a part are numbered as in the mesh of its copy.
    """
    return tuple(
        part for node in scene.nodes for part in _place_parts(scene.meshes[node.model], node)
    )


def store_positions(mesh: Mesh, storage: Storage, origin: FloatArray) -> Mesh:
    """The mesh with all positions, also those of lines, as they are stored; with their bounds."""

    def store(positions: RealArray) -> RealArray:
        return storage.store_positions(place_points(positions, None, mesh.origin), origin)

    stored = replace(
        mesh,
        positions=store(mesh.positions),
        overlays=tuple(replace(o, positions=store(o.positions)) for o in mesh.overlays),
        origin=origin,
        step=storage.step,
    )
    low, high = find_stored_bounds(find_shown_points(stored), origin)
    return replace(stored, report=replace(mesh.report, bounds_min=low, bounds_max=high))


def round_to_single(mesh: Mesh, origin: FloatArray | None = None, step: float = 0.0) -> Mesh:
    """Converts a mesh from float64 in model coordinates to float32 about an origin.

    If `origin` is None, `choose_origin` chooses it from the bounds of the mesh. With a `step`,
    positions are also rounded to its multiples; the bounds of the deviation do not include this.
    """
    if origin is None:
        bounds = mesh.report.bounds_min, mesh.report.bounds_max
        origin = choose_origin(*(np.array(bound) for bound in bounds))
    stored = store_positions(mesh, Storage(is_float32=True, step=step), origin)
    bounds_min, bounds_max = np.array(mesh.report.bounds_min), np.array(mesh.report.bounds_max)
    error = bound_single_error(bounds_min, bounds_max, origin)
    report = _spread_report(stored.report, 1.0, error)
    return replace(
        stored,
        parts=tuple(_spread_part(part, 1.0, error) for part in mesh.parts),
        normals=None if mesh.normals is None else mesh.normals.astype(np.float32),
        uvs=None if mesh.uvs is None else mesh.uvs.astype(np.float32),
        colors=None if mesh.colors is None else mesh.colors.astype(np.float32),
        attributes=tuple((name, rows.astype(np.float32)) for name, rows in mesh.attributes),
        report=replace(report, curvature=round_ranges(report.curvature)),
    )


def move_to_zero(mesh: Mesh) -> Mesh:
    """The mesh with float32 positions about (0, 0, 0), for formats without a local origin."""
    if not mesh.origin.any():
        return mesh
    return round_to_single(place_mesh(mesh, PlacedModel(mesh.name, 0)), AT_ZERO)


def _place_copy(mesh: Mesh, node: PlacedModel) -> Mesh:
    """One placed copy, with the names and the colour of its member."""
    copy = place_mesh(mesh, node)
    overlays = (replace(overlay, name=f"{node.name}/{overlay.name}") for overlay in copy.overlays)
    copy = replace(copy, parts=_place_parts(mesh, node), overlays=tuple(overlays))
    if mesh.report.brep is not None:
        return paint_parts(copy)
    if node.color is None:
        return copy
    return replace(copy, colors=tint(copy.colors, np.array(node.color), len(copy.positions)))


def _place_parts(mesh: Mesh, node: PlacedModel) -> tuple[MeshPart, ...]:
    """The parts of one copy."""
    has_one_part = len(mesh.parts) == 1
    stretch, error = _find_spread(mesh, node)
    return tuple(
        replace(
            _spread_part(part, stretch, error),
            name=node.name if has_one_part else f"{node.name}/{part.name}",
            color=part.color or node.color,
        )
        for part in mesh.parts
    )


def place_mesh(mesh: Mesh, node: PlacedModel) -> Mesh:
    """The placed mesh: float64, in the coordinates of the scene.

    Points become L x + t, and normals the unit vectors of L⁻ᵀ n. If L mirrors, faces are reversed,
    so that they stay counter-clockwise about their normals, and grids are transposed.
    """
    matrix = node.matrix
    positions = place_points(mesh.positions, matrix, mesh.origin)
    overlays = tuple(
        replace(overlay, positions=place_points(overlay.positions, matrix, mesh.origin))
        for overlay in mesh.overlays
    )
    normals, triangles, quads, grids = mesh.normals, mesh.triangles, mesh.quads, mesh.grids
    if normals is not None:
        normals = place_normals(normals, matrix)
    if is_mirroring(matrix):
        triangles, quads = reverse_faces(triangles), reverse_faces(quads)
        grids = tuple(grid.swapaxes(1, 2) for grid in grids)
    return replace(
        mesh,
        positions=positions,
        normals=normals,
        triangles=triangles,
        quads=quads,
        grids=grids,
        overlays=overlays,
        origin=np.zeros(3),
        step=0.0,  # placed positions are not on a grid
        report=_place_report(mesh, node),
    )


def _place_report(mesh: Mesh, node: PlacedModel) -> MeshReport:
    """The report of a mesh after a placement."""
    matrix = node.matrix
    if matrix is None and node.chain is None:
        return mesh.report
    placed_points = place_points(find_shown_points(mesh), matrix, mesh.origin)
    (a, b, c), (d, e, f) = (bound.tolist() for bound in find_extent(placed_points))
    report = replace(mesh.report, bounds_min=(a, b, c), bounds_max=(d, e, f))
    if report.normal_angle is not None and mesh.normals is not None:
        angle = find_largest_angle(mesh.triangles, place_normals(mesh.normals, matrix))
        report = replace(report, normal_angle=angle)
    return _spread_report(report, *_find_spread(mesh, node))


def _find_spread(mesh: Mesh, node: PlacedModel) -> tuple[float, float]:
    """The largest factor by which placing multiplies distances, and the rounding error it adds."""
    low, high = np.array(mesh.report.bounds_min), np.array(mesh.report.bounds_max)
    return scalings(node.matrix)[1], bound_placing_error(node.matrix, low, high, node.chain)


def _spread_part(part: MeshPart, stretch: float, error: float) -> MeshPart:
    """A part whose bound is multiplied by `stretch`, plus `error`."""
    return replace(part, deviation_bound=_grow(part.deviation_bound, stretch, error))


def _spread_report(report: MeshReport, stretch: float, error: float) -> MeshReport:
    """A report whose bounds are multiplied by `stretch`, plus `error`."""
    return replace(
        report,
        deviation_bound=_grow(report.deviation_bound, stretch, error),
        mesh_deviation_bound=_grow(report.mesh_deviation_bound, stretch, error),
        moved=report.moved * stretch,
        brep=None if report.brep is None else report.brep.scale(stretch),
    )


def _grow(bound: float | None, stretch: float, error: float) -> float | None:
    """A bound multiplied by `stretch`, plus `error`; None stays None."""
    return None if bound is None else bound * stretch + error


def find_shown_points(mesh: Mesh) -> RealArray:
    """The points (N, 3) that determine the bounds of a mesh: its vertices, or else its lines.

    If the mesh has neither, they are the corners of the bounds in its report.
    """
    if len(mesh.positions):
        return mesh.positions
    lines = [overlay.positions for overlay in mesh.overlays if len(overlay.positions)]
    corners = np.array([mesh.report.bounds_min, mesh.report.bounds_max]) - mesh.origin
    return np.concatenate(lines) if lines else corners
