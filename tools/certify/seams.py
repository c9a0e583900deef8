"""Judges models of many patches: shared edges must be joined.

Each patch must have the same triangles in any order of the patches. If it is meshed alone, its
edges must have the same vertices. A sheet is a patch as the oracles sample it
(`oracles.sheets`).
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from oracles.deviation import measure_each_sheet
from oracles.sheets import Sheet, build_sheets
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.lowered import PatchModel
from service.surface.sizes import SurfaceKind, SurfaceSize
from tools.certify.models import Complex, Loop, Pair, build_complex
from tools.certify.table import Finding
from tools.certify.written import Array, Rows, Written, list_edges, read_file

ALONE_PATCHES = 3
"""Number of patches of each model that are also meshed alone."""


@dataclass(frozen=True, eq=False)
class LoweredSurface(SurfaceKind):
    """A model as a surface, which is lowered to this model."""

    model: PatchModel
    name: str = "lowered"

    def size(self) -> SurfaceSize:
        # Only estimates of memory need the size, so the degrees need not be exact.
        return SurfaceSize((3, 3), grids=self.model.patch_count)

    def lower(self) -> PatchModel:
        return self.model


@dataclass
class SeamReport(Finding):
    """The findings about one model, with the numbers of its seams and of its boundary edges."""

    seams: int = 0
    boundary: int = 0

    def __str__(self) -> str:
        return f"{self.kind} {self.seed} at {self.tolerance:g}"


def judge_model(kind: str, seed: int, tolerance: float) -> SeamReport:
    """The findings about the meshes of a model, of the model in another order, of patches alone."""
    seam_report = SeamReport(kind=kind, seed=seed, tolerance=tolerance)
    net_complex = build_complex(kind, seed)
    rng = np.random.default_rng([seed, 1])
    patches = range(len(net_complex.nets))
    try:
        start = time.process_time()
        mesh = _write_mesh(net_complex.model(patches), tolerance)
        seam_report.seconds = time.process_time() - start
        reordered_mesh = _write_mesh(
            net_complex.model(rng.permutation(len(patches)).tolist(), together=False), tolerance
        )
        alone_numbers = rng.permutation(len(patches))[:ALONE_PATCHES].tolist()
        alone_meshes = {k: _write_mesh(net_complex.model([k]), tolerance) for k in alone_numbers}
    except Exception as error:  # any error means that no mesh was made
        seam_report.faults.append(f"{type(error).__name__}: {error}")
        return seam_report
    seam_report.triangles = len(mesh.faces)
    check_order(seam_report, mesh, reordered_mesh)
    sides = check_seams(seam_report, net_complex, mesh)
    for k, alone_mesh in alone_meshes.items():
        side_points = {pair: mesh.vertices[line] for (n, pair), line in sides.items() if n == k}
        _check_alone(seam_report, net_complex, k, alone_mesh, side_points)
    count = int(np.clip(4 * len(mesh.faces) / len(patches), 400, 4000))
    check_deviation(seam_report, build_sheets(net_complex.model(patches)), mesh, "patch", count)
    return seam_report


def _write_mesh(model: PatchModel, tolerance: float) -> Written:
    """The mesh of a model, written as JSON and read back."""
    options = MeshOptions(accuracy=Accuracy(tolerance=tolerance), normals=False)
    return read_file("json", render(LoweredSurface(model), options, BY_NAME["json"]))


def check_order(seam_report: SeamReport, mesh: Written, reordered_mesh: Written) -> None:
    """Adds a fault for each part whose triangles are not equal bit for bit in both meshes."""
    for name in mesh.parts:
        if _list_triangles(mesh, name) != _list_triangles(reordered_mesh, name):
            seam_report.faults.append(f"{name} depends on the order of the patches")


def _list_triangles(mesh: Written, name: str) -> set[tuple[tuple[float, ...], ...]]:
    """The triangles of a part: their corners, beginning with the smallest corner."""
    triangles = set()
    for corners in mesh.corners[slice(*mesh.parts[name])].tolist():
        points = [tuple(corner) for corner in corners]
        first = points.index(min(points))
        triangles.add(tuple(points[first:] + points[:first]))
    return triangles


def check_seams(
    seam_report: SeamReport, net_complex: Complex, mesh: Written
) -> dict[tuple[int, Pair], list[int]]:
    """Adds faults if patches at a seam have different vertices there, or boundary edges are wrong.

    Returns the rows of the vertices along every side, by number of the patch and pair of corners;
    only some of the sides if a border is not closed.
    """
    edges, uses = np.unique(np.sort(list_edges(mesh.faces), axis=1), axis=0, return_counts=True)
    use_counts = {(a, b): n for (a, b), n in zip(edges.tolist(), uses.tolist(), strict=True)}
    if uses.max() > 2:
        seam_report.faults.append(f"{(uses > 2).sum()} edges of more than two triangles")
    sides: dict[tuple[int, Pair], list[int]] = {}
    for k, loop in enumerate(net_complex.loops):
        lines = _find_sides(
            mesh.vertices, mesh.faces[slice(*mesh.parts[f"patch {k}"])], net_complex, loop
        )
        if lines is None:
            seam_report.faults.append(f"the border of patch {k} does not run from corner to corner")
            return sides
        sides |= {(k, pair): line for pair, line in lines.items()}
    for pair, patches in net_complex.edges().items():
        seam_lines = [sides[k, pair] for k in patches]
        if any(line != seam_lines[0] for line in seam_lines):
            seam_report.faults.append(f"the sides of the seam {pair} differ")
        counts = [use_counts[min(a, b), max(a, b)] for a, b in pairwise(seam_lines[0])]
        if any(n != len(patches) for n in counts):
            seam_report.faults.append(f"edges on {pair} are used {sorted(set(counts))} times")
        if len(patches) > 1:
            seam_report.seams += 1
        else:
            seam_report.boundary += len(counts)
    if not (uses == 1).sum() == seam_report.boundary == mesh.report["boundary_edges"]:
        seam_report.faults.append(
            f"{(uses == 1).sum()} boundary edges, {seam_report.boundary} expected, "
            f"{mesh.report['boundary_edges']} reported"
        )
    if mesh.report["watertight"] != (seam_report.boundary == 0):
        seam_report.faults.append(f"watertight is {mesh.report['watertight']}")
    return sides


def _find_sides(
    vertices: Array, faces: Rows, net_complex: Complex, loop: Loop
) -> dict[Pair, list[int]] | None:
    """Rows of the vertices along each side of a patch, from its corner with the lower number on.

    The border of the patch consists of the edges that only one triangle has. It must be one loop
    through the corners of the patch in their order; otherwise the result is None.
    """
    ends = list_edges(faces)
    _, rows, uses = np.unique(np.sort(ends, axis=1), axis=0, return_index=True, return_counts=True)
    # From each vertex of the border to the next vertex.
    next_vertex = dict(ends[rows[uses == 1]].tolist())
    if len(next_vertex) != (uses == 1).sum():
        return None
    vertex_at = {tuple(point): row for row, point in enumerate(vertices.tolist())}
    corner_of_vertex = {vertex_at.get(tuple(net_complex.corners[c].tolist()), -1): c for c in loop}
    if -1 in corner_of_vertex:
        return None
    start = current = next(iter(corner_of_vertex))
    lines: dict[Pair, list[int]] = {}
    line = [current]
    for _ in next_vertex:
        current = next_vertex.get(current, start)
        line.append(current)
        if current in corner_of_vertex:
            a, b = corner_of_vertex[line[0]], corner_of_vertex[current]
            lines[min(a, b), max(a, b)] = line if a < b else line[::-1]
            line = [current]
        if current == start:
            break
    expected = {(min(a, b), max(a, b)) for a, b in pairwise([*loop, loop[0]])}
    edge_count = sum(len(line) - 1 for line in lines.values())
    return lines if set(lines) == expected and edge_count == len(next_vertex) else None


def _check_alone(
    seam_report: SeamReport,
    net_complex: Complex,
    k: int,
    alone_mesh: Written,
    side_points: Mapping[Pair, Array],
) -> None:
    """Adds a fault if patch k, meshed alone, has other vertices on an edge of `Complex.alike`.

    `side_points` are the vertices along its sides in the mesh of the model.
    """
    lines = _find_sides(alone_mesh.vertices, alone_mesh.faces, net_complex, net_complex.loops[k])
    if lines is None:
        seam_report.faults.append(
            f"the border of patch {k} alone does not run from corner to corner"
        )
        return
    for pair, line in lines.items():
        is_alike = pair in net_complex.alike and pair in side_points
        if is_alike and alone_mesh.vertices[line].tolist() != side_points[pair].tolist():
            seam_report.faults.append(f"edge {pair} of patch {k} differs when computed alone")


def check_deviation(
    seam_report: SeamReport, sheets: Sequence[Sheet], mesh: Written, prefix: str, count: int
) -> None:
    """Adds faults if a deviation exceeds the bound of its part, or a bound is too large.

    Sheet k, with `count` samples, is the part named `prefix` and k. The bound of a part must not
    exceed that of the mesh, which must not exceed the tolerance.
    """
    seam_report.bound = mesh.report.get("deviation_bound", np.nan)
    if not seam_report.bound <= seam_report.tolerance:
        seam_report.faults.append(f"bound {seam_report.bound} above the tolerance")
    for k, each in enumerate(measure_each_sheet(sheets, mesh.corners, count)):
        bound = mesh.part_bounds.get(f"{prefix} {k}", np.nan)
        seam_report.deviation = max(seam_report.deviation, each.distance)
        if not each.distance <= bound + each.rounding or not bound <= seam_report.bound:
            seam_report.faults.append(f"{prefix} {k} deviates by {each.distance}, bound {bound}")
