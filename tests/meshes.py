"""Meshes for tests of encoders, built by plain code without the engine.

The silo is a closed body of three patches, each a part: a flat base whose centre is a pole with
one normal, a wall, and a conical roof whose apex is a pole with many. It has creases (two normals
at one position), a seam, and overlays. With four sides and one row, all of its numbers are short.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, IndexArray, RealArray
from service.encoders.format import MeshSize
from service.engine.mesh.mesh_value import Mesh, MeshPart, Overlay
from service.engine.mesh.report import MeshReport
from service.surface.checks import Up
from tests.oracles.topology import count_topology

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
    """A prism of radius and height 1 below a pyramid of height 1, closed, float64."""
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    # Rounded, so that the seam closes, and the numbers are equal on all machines.
    cosine, sine = np.round(np.cos(angle), 12), np.round(np.sin(angle), 12)
    climb = np.arange(rows + 1) / rows

    def turned(radius: FloatArray, height: FloatArray) -> FloatArray:
        columns = (np.outer(cosine, radius), np.outer(sine, radius))
        # Adding zero makes -0 plain 0.
        return np.stack([*columns, np.broadcast_to(height, columns[0].shape)], axis=-1) + 0.0

    one, zero = np.ones(rows + 1), np.zeros(rows + 1)
    slant = np.sqrt(0.5)
    grids = (
        Grid("base", turned(climb, zero), turned(zero, -one)),
        Grid("wall", turned(one, climb), turned(one, zero)),
        Grid("roof", turned(1 - climb, 1 + climb), turned(one * slant, one * slant)),
    )
    return weld_grids(name, grids, faces)


def build_sheet(divisions: int) -> Mesh:
    """A flat square of one patch, float64, with a given number of samples."""
    u, v = np.meshgrid(*[np.arange(divisions + 1) / divisions] * 2, indexing="ij")
    positions = np.stack([u, v, np.zeros_like(u)], axis=-1)
    normals = np.broadcast_to([0.0, 0.0, 1.0], positions.shape)
    return weld_grids("sheet", (Grid("sheet", positions, normals),), "triangles")


def build_control_net() -> Overlay:
    """A net of 3 × 2 points: two cells."""
    positions = np.array([[x, y, x * y / 8] for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0)])
    segments = [[0, 1], [2, 3], [4, 5], [0, 2], [2, 4], [1, 3], [3, 5]]
    cells = [[0, 1, 3, 2], [2, 3, 5, 4]]
    return Overlay("control net", positions, build_indices(segments, 2), build_indices(cells, 4))


def build_boundary() -> Overlay:
    """A triangle of lines."""
    positions = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [0.0, 1.0, 0.25]])
    return Overlay("boundary", positions, build_indices([[0, 1], [1, 2], [2, 0]], 2))


def add_overlays(mesh: Mesh) -> Mesh:
    """The mesh beside a control net and a boundary."""
    return replace(mesh, overlays=(build_control_net(), build_boundary()))


def add_attributes(mesh: Mesh, opacity: bool = False) -> Mesh:
    """The mesh with colours by position, a temperature, and a flow of six numbers."""
    size = np.ptp(mesh.positions, axis=0)
    share = (mesh.positions - mesh.positions.min(axis=0)) / np.where(size > 0, size, 1)
    # From dark to light, so that both branches of the sRGB formula are used.
    colors = np.round(share, 3) * [1.0, 0.5, 0.05]
    if opacity:
        colors = np.hstack([colors, 1 - np.round(share[:, :1], 3) / 2])
    flow = np.hstack([mesh.positions, -mesh.positions])
    attributes = (("temperature", 20 + 8 * mesh.positions[:, 2:]), ("flow", flow + 0.0))
    return replace(mesh, colors=colors, attributes=attributes)


def to_single(mesh: Mesh, origin: tuple[float, float, float] = ORIGIN, up: Up = "y") -> Mesh:
    """The mesh in float32 about a local origin, which moves the model there."""
    shift = np.array(origin)
    report = replace(
        mesh.report,
        bounds_min=_triple(np.array(mesh.report.bounds_min) + shift),
        bounds_max=_triple(np.array(mesh.report.bounds_max) + shift),
    )
    overlays = tuple(replace(o, positions=o.positions.astype(np.float32)) for o in mesh.overlays)
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
    """Welds grids of samples, each a part: samples with equal position and normal are one
    vertex."""
    rows: dict[tuple[float, ...], int] = {}
    spots: dict[tuple[float, ...], int] = {}
    vertices: list[tuple[float, ...]] = []
    welds: list[int] = []
    numbered: list[NDArray[np.uint32]] = []
    for grid in grids:
        numbers: NDArray[np.uint32] = np.empty(grid.positions.shape[:2], dtype=np.uint32)
        for i, j in np.ndindex(numbers.shape):
            position = tuple(grid.positions[i, j].tolist())
            key = (*position, *grid.normals[i, j].tolist())
            if key not in rows:
                rows[key] = len(vertices)
                u, v = i / (numbers.shape[0] - 1), j / (numbers.shape[1] - 1)
                vertices.append((*key, u, v))
                welds.append(spots.setdefault(position, rows[key]))
            numbers[i, j] = rows[key]
        numbered.append(numbers)

    triangles: list[list[int]] = []
    quads: list[list[int]] = []
    parts: list[MeshPart] = []
    for grid, numbers in zip(grids, numbered, strict=True):
        before = len(triangles), len(quads)
        for a, b, c, d in _number_cells(numbers):
            if faces == "quads" and len({welds[k] for k in (a, b, c, d)}) == 4:
                quads.append([a, b, c, d])
                continue
            halves = ([a, b, d], [b, c, d])
            triangles += [half for half in halves if len({welds[k] for k in half}) == 3]
        runs = ((before[0], len(triangles)), (before[1], len(quads)))
        parts.append(MeshPart(grid.name, *runs))

    table = np.array(vertices)
    creased = welds != list(range(len(welds)))
    counts = count_topology([[welds[k] for k in face] for face in triangles + quads])
    report = MeshReport(
        vertices=len(table),
        triangles=len(triangles),
        quads=len(quads),
        patches=len(grids),
        bounds_min=_triple(table[:, :3].min(axis=0)),
        bounds_max=_triple(table[:, :3].max(axis=0)),
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
        grids=tuple(numbers[np.newaxis] for numbers in numbered),
        welds=np.array(welds, dtype=np.uint32) if creased else None,
        overlays=(),
        origin=np.zeros(3),
        up="y",
        report=report,
    )


def remove_faces(mesh: Mesh) -> Mesh:
    """A mesh whose faces have all collapsed."""
    parts = tuple(MeshPart(part.name, (0, 0), (0, 0)) for part in mesh.parts)
    report = replace(mesh.report, triangles=0, quads=0)
    none = build_indices([], 3), build_indices([], 4)
    return replace(
        mesh, triangles=none[0], quads=none[1], parts=parts, grids=(), welds=None, report=report
    )


def measure_size(mesh: Mesh) -> MeshSize:
    """The size of this mesh from its shapes alone: without welding."""
    names = [mesh.name, *(p.name for p in mesh.parts), *(o.name for o in mesh.overlays)]
    return MeshSize(
        vertices=sum(grid.size for grid in mesh.grids) or len(mesh.positions),
        triangles=len(mesh.triangles),
        quads=len(mesh.quads),
        patches=mesh.report.patches,
        control_points=0,
        named=len(mesh.parts) + len(mesh.overlays),
        name_bytes=sum(len(name.encode()) for name in names),
        overlay_points=sum(len(o.positions) for o in mesh.overlays),
        overlay_segments=sum(len(o.segments) for o in mesh.overlays),
        overlay_cells=sum(0 if o.cells is None else len(o.cells) for o in mesh.overlays),
        colors=0 if mesh.colors is None else mesh.colors.shape[1],
        attributes=tuple((name, rows.shape[1]) for name, rows in mesh.attributes),
    )


def build_indices(rows: list[list[int]], columns: int) -> IndexArray:
    """Rows of indices, shape (N, columns), also where there are none."""
    return np.array(rows, dtype=np.uint32).reshape(-1, columns)


def _number_cells(numbers: NDArray[np.uint32]) -> list[tuple[int, int, int, int]]:
    """Quads (i,j) (i+1,j) (i+1,j+1) (i,j+1) of a grid."""
    return [
        (
            int(numbers[i, j]),
            int(numbers[i + 1, j]),
            int(numbers[i + 1, j + 1]),
            int(numbers[i, j + 1]),
        )
        for i, j in np.ndindex(numbers.shape[0] - 1, numbers.shape[1] - 1)
    ]


def _triple(values: RealArray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
