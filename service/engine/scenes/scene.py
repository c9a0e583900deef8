"""A group of models as a scene: the mesh of each distinct model, and the placements of its copies.

Formats with nodes encode the scene; for other formats it is flattened to one mesh
(`service.engine.scenes.flattening`).
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.engine.extent import AT_ZERO, choose_origin, find_stored_bounds
from service.engine.mesh.mesh import Mesh, MeshPart, MeshReport, round_ranges
from service.engine.scenes.copies import stack_placements
from service.engine.scenes.placing import place_points
from service.engine.scenes.reports import find_shown_points, find_spreads, report_copies
from service.engine.stored_positions import Storage, bound_single_error
from service.surface.checks import Up
from service.surface.lowered import GroupModel, GroupNode, PlacedModel


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
    report = report_copies(meshes, model.members)
    return Scene(model.name, model.up, model.members, meshes, report, tree=model.nodes)


def count_parts(scene: Scene) -> int:
    """The number of the parts of all copies."""
    counts = [len(mesh.parts) for mesh in scene.meshes]
    return sum(counts[node.model] for node in scene.nodes)


def scene_parts(scene: Scene) -> tuple[MeshPart, ...]:
    """The parts of all copies, under their names, with bounds in the coordinates of the scene.

    The faces of a part are numbered as in the mesh of its copy.
    """
    spreads = find_spreads(scene.meshes, scene.nodes, stack_placements(scene.nodes))
    parts: list[MeshPart] = []
    for node, *spread in zip(scene.nodes, *(each.tolist() for each in spreads), strict=True):
        parts += place_parts(scene.meshes[node.model], node, (spread[0], spread[1]))
    return tuple(parts)


def place_parts(
    mesh: Mesh, node: PlacedModel, spread: tuple[float, float], first: tuple[int, int] = (0, 0)
) -> list[MeshPart]:
    """The parts of one copy, with its names and colours.

    Parameters
    ----------
    spread : (float, float)
        The factor by which placing multiplies distances, and the rounding error that it adds.
    first : (int, int)
        The numbers of the first triangle and of the first quad of the copy.
    """
    (stretch, error), (t, q) = spread, first
    has_one_part = len(mesh.parts) == 1
    return [
        MeshPart(
            node.name if has_one_part else f"{node.name}/{part.name}",
            (part.triangles[0] + t, part.triangles[1] + t),
            (part.quads[0] + q, part.quads[1] + q),
            part.color or node.color,
            _grow(part.deviation_bound, stretch, error),
        )
        for part in mesh.parts
    ]


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

    def move(positions: RealArray) -> FloatArray:
        return place_points(positions, None, mesh.origin)

    overlays = tuple(replace(each, positions=move(each.positions)) for each in mesh.overlays)
    moved = replace(
        mesh,
        positions=move(mesh.positions),
        normals=None if mesh.normals is None else mesh.normals.astype(np.float64),
        overlays=overlays,
        origin=np.zeros(3),
        step=0.0,  # moved positions are not on a grid
    )
    return round_to_single(moved, AT_ZERO)


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
