"""Meshes for tests of encoders, built by plain code without the engine.

The silo is a closed body of three patches, each a part: a flat base whose centre is a pole with
one normal, a wall, and a conical roof whose apex is a pole with many normals. It has creases (two
normals at one position) and a seam. With four sides and one row, its numbers have few digits.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from oracles.topology import count_topology
from service.bases.arrays import FloatArray, IndexArray, RealArray
from service.encoders.format import MeshSize
from service.engine.mesh.brep_report import BrepReport
from service.engine.mesh.mesh import Mesh, MeshPart, MeshReport, Overlay
from service.errors import Issue
from service.surface.brep_model import SkippedFace
from service.surface.checks import Up

Faces = Literal["triangles", "quads"]
ORIGIN = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Grid:
    """Samples of one patch: positions and unit normals, shape (Ru+1, Rv+1, 3)."""

    name: str
    positions: FloatArray
    normals: FloatArray


def build_silo(
    sides: int = 4, rows: int = 1, faces: Faces = "triangles", *, name: str = "silo"
) -> Mesh:
    """A prism of radius and height 1 below a pyramid of height 1: a closed mesh, float64.

    Every patch has `sides` divisions around the axis, and `rows` divisions along the other
    direction.
    """
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    # Rounded, so that the seam closes, and the numbers are equal on all machines.
    cosine, sine = np.round(np.cos(angle), 12), np.round(np.sin(angle), 12)
    steps = np.arange(rows + 1) / rows

    def revolve(radius: FloatArray, height: FloatArray) -> FloatArray:
        # Points or normals, by their distances from the axis and their z.
        columns = (np.outer(cosine, radius), np.outer(sine, radius))
        # Adding 0.0 turns -0.0 into 0.0.
        return np.stack([*columns, np.broadcast_to(height, columns[0].shape)], axis=-1) + 0.0

    one, zero = np.ones(rows + 1), np.zeros(rows + 1)
    slant = np.sqrt(0.5)
    grids = (
        Grid("base", revolve(steps, zero), revolve(zero, -one)),
        Grid("wall", revolve(one, steps), revolve(one, zero)),
        Grid("roof", revolve(1 - steps, 1 + steps), revolve(one * slant, one * slant)),
    )
    return weld_grids(name, grids, faces)


def build_sheet(divisions: int) -> Mesh:
    """A flat square of one patch, float64, with `divisions` divisions in each direction."""
    u, v = np.meshgrid(*[np.arange(divisions + 1) / divisions] * 2, indexing="ij")
    positions = np.stack([u, v, np.zeros_like(u)], axis=-1)
    normals = np.broadcast_to([0.0, 0.0, 1.0], positions.shape)
    return weld_grids("sheet", (Grid("sheet", positions, normals),), "triangles")


def build_control_net() -> Overlay:
    """An overlay with a control net of 3 × 2 points, which has two cells."""
    positions = np.array([[x, y, x * y / 8] for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0)])
    segments = [[0, 1], [2, 3], [4, 5], [0, 2], [2, 4], [1, 3], [3, 5]]
    cells = [[0, 1, 3, 2], [2, 3, 5, 4]]
    return Overlay("control net", positions, build_indices(segments, 2), build_indices(cells, 4))


def build_boundary() -> Overlay:
    """An overlay with three lines that form a triangle."""
    positions = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [0.0, 1.0, 0.25]])
    return Overlay("boundary", positions, build_indices([[0, 1], [1, 2], [2, 0]], 2))


def add_overlays(mesh: Mesh) -> Mesh:
    """The mesh with two overlays: a control net and a boundary."""
    return replace(mesh, overlays=(build_control_net(), build_boundary()))


def add_attributes(mesh: Mesh, opacity: bool = False) -> Mesh:
    """The mesh with colours by position and two attributes: a temperature, and a flow (6 numbers).

    With `opacity`, colours have an alpha value as their fourth component.
    """
    size = np.ptp(mesh.positions, axis=0)
    fraction = (mesh.positions - mesh.positions.min(axis=0)) / np.where(size > 0, size, 1)
    # From dark to light, so that both branches of the sRGB formula are used.
    colors = np.round(fraction, 3) * [1.0, 0.5, 0.05]
    if opacity:
        colors = np.hstack([colors, 1 - np.round(fraction[:, :1], 3) / 2])
    flow = np.hstack([mesh.positions, -mesh.positions])
    attributes = (("temperature", 20 + 8 * mesh.positions[:, 2:]), ("flow", flow + 0.0))
    return replace(mesh, colors=colors, attributes=attributes)


def to_single(mesh: Mesh, origin: tuple[float, float, float] = ORIGIN, up: Up = "y") -> Mesh:
    """The mesh in float32, moved by `origin`.

    Its positions do not change, because they are relative to the local origin, which is `origin`.
    """
    shift = np.array(origin)
    report = replace(
        mesh.report,
        bounds_min=_to_triple(np.array(mesh.report.bounds_min) + shift),
        bounds_max=_to_triple(np.array(mesh.report.bounds_max) + shift),
    )
    overlays = tuple(
        replace(overlay, positions=overlay.positions.astype(np.float32))
        for overlay in mesh.overlays
    )
    return replace(
        mesh,
        positions=mesh.positions.astype(np.float32),
        normals=None if mesh.normals is None else mesh.normals.astype(np.float32),
        uvs=None if mesh.uvs is None else mesh.uvs.astype(np.float32),
        colors=None if mesh.colors is None else mesh.colors.astype(np.float32),
        attributes=tuple((name, rows.astype(np.float32)) for name, rows in mesh.attributes),
        overlays=overlays,
        origin=shift,
        up=up,
        report=report,
    )


def weld_grids(name: str, grids: tuple[Grid, ...], faces: Faces) -> Mesh:
    """A mesh of grids of samples, each a part of the mesh.

    Samples with equal position and normal are one vertex. With "quads" every cell of a grid is a
    quad, except where two of its corners coincide; otherwise it is two triangles.
    """
    vertex_of_sample: dict[tuple[float, ...], int] = {}
    first_vertex_at: dict[tuple[float, ...], int] = {}
    vertices: list[tuple[float, ...]] = []
    welds: list[int] = []  # for each vertex, the first vertex at the same position
    vertex_grids: list[NDArray[np.uint32]] = []
    for grid in grids:
        numbers: NDArray[np.uint32] = np.empty(grid.positions.shape[:2], dtype=np.uint32)
        for i, j in np.ndindex(numbers.shape):
            position = tuple(grid.positions[i, j].tolist())
            key = (*position, *grid.normals[i, j].tolist())
            if key not in vertex_of_sample:
                vertex_of_sample[key] = len(vertices)
                u, v = i / (numbers.shape[0] - 1), j / (numbers.shape[1] - 1)
                vertices.append((*key, u, v))
                welds.append(first_vertex_at.setdefault(position, vertex_of_sample[key]))
            numbers[i, j] = vertex_of_sample[key]
        vertex_grids.append(numbers)

    triangles: list[list[int]] = []
    quads: list[list[int]] = []
    parts: list[MeshPart] = []
    for grid, numbers in zip(grids, vertex_grids, strict=True):
        first_triangle, first_quad = len(triangles), len(quads)
        for a, b, c, d in _number_cells(numbers):
            if faces == "quads" and len({welds[k] for k in (a, b, c, d)}) == 4:
                quads.append([a, b, c, d])
                continue
            halves = ([a, b, d], [b, c, d])
            triangles += [half for half in halves if len({welds[k] for k in half}) == 3]
        parts.append(
            MeshPart(grid.name, (first_triangle, len(triangles)), (first_quad, len(quads)))
        )

    table = np.array(vertices)
    has_creases = welds != list(range(len(welds)))
    counts = count_topology([[welds[k] for k in face] for face in triangles + quads])
    report = MeshReport(
        vertices=len(table),
        triangles=len(triangles),
        quads=len(quads),
        patches=len(grids),
        bounds_min=_to_triple(table[:, :3].min(axis=0)),
        bounds_max=_to_triple(table[:, :3].max(axis=0)),
        watertight=counts.watertight,
        boundary_edges=counts.boundary,
        poles_repaired=0,
    )
    return Mesh(
        name=name,
        positions=table[:, :3],
        normals=table[:, 3:6],
        uvs=table[:, 6:],
        triangles=build_indices(triangles, 3),
        quads=build_indices(quads, 4),
        parts=tuple(parts),
        grids=tuple(numbers[np.newaxis] for numbers in vertex_grids),
        welds=np.array(welds, dtype=np.uint32) if has_creases else None,
        overlays=(),
        origin=np.zeros(3),
        up="y",
        report=report,
    )


def build_brep(sides: int = 4, rows: int = 1, name: str = "bin") -> Mesh:
    """The silo as the mesh of a brep of four faces: the roof and the base have one colour.

    The first face has no triangles, because it was skipped. The name of no face is that of another.
    """
    silo = build_silo(sides, rows, name=name)
    red = (0.8, 0.2, 0.1, 1.0)
    base, wall, roof = (
        replace(part, color=color, deviation_bound=bound)
        for part, color, bound in zip(silo.parts, (red, None, red), (0.0, 0.25, 0.5), strict=True)
    )
    skipped = MeshPart("lid", (0, 0), (0, 0), color=(0.1, 0.2, 0.3, 0.5))
    issue = Issue("loop_open", "The loop is open.", "", "a distance of 0.5", "a closed loop")
    report = replace(
        silo.report,
        deviation_bound=0.5,
        brep=BrepReport(complete=False, gap_bound=1e-7, skipped_faces=(SkippedFace(0, issue),)),
    )
    return replace(silo, parts=(skipped, base, wall, roof), grids=(), report=report)


def remove_faces(mesh: Mesh) -> Mesh:
    """The mesh without its faces, as if all of them had collapsed to points."""
    parts = tuple(MeshPart(part.name, (0, 0), (0, 0)) for part in mesh.parts)
    report = replace(mesh.report, triangles=0, quads=0)
    return replace(
        mesh,
        triangles=build_indices([], 3),
        quads=build_indices([], 4),
        parts=parts,
        grids=(),
        welds=None,
        report=report,
    )


def measure_size(mesh: Mesh) -> MeshSize:
    """The size of this mesh as if it were not welded: each sample of a grid is a vertex."""
    names = [
        mesh.name,
        *(part.name for part in mesh.parts),
        *(overlay.name for overlay in mesh.overlays),
    ]
    brep_faces = len(mesh.parts) if mesh.report.brep is not None else 0
    return MeshSize(
        vertices=sum(grid.size for grid in mesh.grids) or len(mesh.positions),
        triangles=len(mesh.triangles),
        quads=len(mesh.quads),
        patches=mesh.report.patches,
        control_points=0,
        drawables=(
            len({part.color for part in mesh.parts} if brep_faces else mesh.parts)
            + len(mesh.overlays)
        ),
        name_bytes=sum(len(name.encode()) for name in names),
        overlay_points=sum(len(overlay.positions) for overlay in mesh.overlays),
        overlay_segments=sum(len(overlay.segments) for overlay in mesh.overlays),
        overlay_cells=sum(
            0 if overlay.cells is None else len(overlay.cells) for overlay in mesh.overlays
        ),
        colors=0 if mesh.colors is None else mesh.colors.shape[1],
        attributes=tuple((name, rows.shape[1]) for name, rows in mesh.attributes),
        faces=brep_faces,
    )


def build_indices(rows: list[list[int]], columns: int) -> IndexArray:
    """An array of the rows, shape (N, columns), also if N is 0."""
    return np.array(rows, dtype=np.uint32).reshape(-1, columns)


def _number_cells(numbers: NDArray[np.uint32]) -> list[tuple[int, int, int, int]]:
    """The vertex numbers of each cell of a grid, in the order (i,j) (i+1,j) (i+1,j+1) (i,j+1)."""
    return [
        (
            int(numbers[i, j]),
            int(numbers[i + 1, j]),
            int(numbers[i + 1, j + 1]),
            int(numbers[i, j + 1]),
        )
        for i, j in np.ndindex(numbers.shape[0] - 1, numbers.shape[1] - 1)
    ]


def _to_triple(values: RealArray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
