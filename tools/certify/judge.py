"""Makes the file of one mesh, reads the file, and checks the mesh for all kinds of faults.

The mesh is compared with the sheets of the surface: tensor-product or triangular surfaces that
`oracles.sheets` samples.
"""

import time
from collections import Counter
from dataclasses import dataclass
from math import inf
from typing import Any, Literal

import numpy as np

from oracles.deviation import measure_mesh_to_surface, measure_surface_to_mesh
from oracles.exact import is_flat
from oracles.sheets import build_sheets
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from tools.certify.rounding import is_flattened_by_rounding
from tools.certify.surfaces import FAMILIES
from tools.certify.table import Finding
from tools.certify.written import Array, Rows, Written, list_edges, read_file

TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4)
"""Tolerances relative to the diagonal of the bounding box of the control points."""

SAMPLES = 2000, 20000
"""The smallest and the largest number of samples of a sheet. Between them, it is 4 times the number
of triangles of the mesh."""

THIN = 1e-9
"""If twice the area of a triangle, divided by the square of its longest side, is below this, exact
arithmetic decides whether the area is zero."""


@dataclass(frozen=True)
class Case:
    """A mesh to judge: by resolution if the case has one, else by tolerance.

    `relative` is the relative tolerance, `written_as` the name of the format: `json` or `glb`.
    """

    family: str
    seed: int
    relative: float = inf
    two_sided: bool = False
    written_as: str = "json"
    resolution: tuple[int, int] | None = None
    faces: Literal["triangles", "quads"] = "triangles"

    def __str__(self) -> str:
        if self.resolution is not None:
            return f"{self.family} {self.seed} at {self.resolution} in {self.faces}"
        two_sided = ", two-sided" if self.two_sided else ""
        return f"{self.family} {self.seed} at {self.relative:g} as {self.written_as}{two_sided}"


@dataclass
class Verdict(Finding):
    """The findings about the mesh of a case.

    `missed` is whether the mesh of a spike does not reach its top, `bad` the number of faulty
    triangles, and `excused` that of triangles without area that are no fault.
    """

    case: Case
    mesh_bound: float = 0.0
    mesh_deviation: float = 0.0
    missed: bool = False
    bad: int = 0
    excused: int = 0

    def __str__(self) -> str:
        return str(self.case)


def judge(case: Case, samples: tuple[int, int] = SAMPLES) -> Verdict:
    """The findings about the mesh of a case, compared with samples of its surface."""
    family = FAMILIES[case.family]
    surface = family.surface(case.seed)
    # A mesh by resolution has no tolerance; its bound is only required not to be absurd.
    tolerance = min(case.relative, 1e3) * measure_diagonal(surface)
    verdict = Verdict(case, kind=case.family, seed=case.seed, tolerance=tolerance)
    options = build_options(case)
    start = time.process_time()
    try:
        content = render(surface, options, BY_NAME[case.written_as])
    except Exception as error:  # any error means that no mesh was made
        verdict.faults.append(f"{type(error).__name__}: {error}")
        return verdict
    verdict.seconds = time.process_time() - start
    mesh = read_file(case.written_as, content)
    verdict.triangles = len(mesh.faces)
    _compare_bounds(verdict, surface, mesh, samples)
    if case.faces == "quads":
        # The bound holds for both ways to split the quads.
        _compare_bounds(verdict, surface, read_file(case.written_as, content, diagonal=1), samples)
    if case.resolution is not None:
        return verdict
    _count_faults(verdict, mesh, None if family.has_no_area else _find_flat(verdict, surface, mesh))
    # The proof of the converse bound needs more triangles.
    if family.is_flat and not case.two_sided and verdict.triangles != 2:
        verdict.faults.append(f"{verdict.triangles} triangles where two are enough")
    return verdict


def build_options(case: Case) -> MeshOptions:
    """The options of a case: without normals; meshes by tolerance have parameters of vertices."""
    if case.resolution is not None:
        return MeshOptions(resolution=case.resolution, faces=case.faces, normals=False)
    accuracy = Accuracy(relative_tolerance=case.relative, two_sided=case.two_sided)
    return MeshOptions(accuracy=accuracy, normals=False, uvs=True)


def measure_diagonal(surface: Any) -> float:
    """The diagonal of the bounding box of the control points."""
    points = surface.control_net.reshape(-1, 3)
    return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))


def _compare_bounds(
    verdict: Verdict, surface: Any, mesh: Written, samples: tuple[int, int]
) -> None:
    """Adds faults if a deviation exceeds the reported bound, or the bound the tolerance."""
    sheets = build_sheets(surface)
    if not len(mesh.faces):
        if verdict.tolerance > 0 and verdict.case.resolution is None:
            verdict.faults.append("no triangles")
        return
    verdict.bound = mesh.report.get("deviation_bound", np.nan)
    if not verdict.bound <= verdict.tolerance:
        verdict.faults.append(f"bound {verdict.bound} above tolerance {verdict.tolerance}")
    count = int(np.clip(4 * len(mesh.faces), *samples))
    deviation = measure_surface_to_mesh(sheets, mesh.corners, count)
    verdict.deviation = max(verdict.deviation, deviation.distance)
    if not deviation.distance <= verdict.bound + deviation.rounding:
        verdict.faults.append(
            f"deviation {deviation.distance} above bound {verdict.bound} at {deviation.place}"
        )
    if verdict.case.family == "spikes" and verdict.case.resolution is None:
        top = max(float((s.at(s.samples(count)) + s.origin)[:, 2].max()) for s in sheets)
        verdict.missed = top - float(mesh.vertices[:, 2].max()) > verdict.tolerance
        if verdict.missed:
            verdict.faults.append("the spike is missed")
    if verdict.case.two_sided:
        verdict.mesh_bound = mesh.report.get("mesh_deviation_bound", np.nan)
        divisions = 4 if len(mesh.faces) < 2000 else 2  # of each edge of a sampled triangle
        verdict.mesh_deviation = measure_mesh_to_surface(
            sheets, mesh.corners, count, divisions, doubt=verdict.mesh_bound
        )
        # The service promises twice the tolerance in this direction.
        if not verdict.mesh_bound <= 2 * verdict.tolerance:
            verdict.faults.append(f"mesh bound {verdict.mesh_bound} above twice the tolerance")
        if not verdict.mesh_deviation <= verdict.mesh_bound + deviation.rounding:
            verdict.faults.append(
                f"mesh deviation {verdict.mesh_deviation} above bound {verdict.mesh_bound}"
            )


def _find_flat(verdict: Verdict, surface: Any, mesh: Written) -> list[int]:
    """Rows of the triangles without area, except those whose area only rounding made zero."""
    flat_rows = find_flat_triangles(mesh.corners)
    if mesh.steps is None or mesh.places is None:
        return flat_rows
    (sheet,) = build_sheets(surface)
    places, steps = mesh.places, mesh.steps[mesh.faces]
    faulty_rows = [
        k
        for k in flat_rows
        if not is_flattened_by_rounding(sheet, mesh.corners[k], places[k], steps[k])
    ]
    verdict.excused = len(flat_rows) - len(faulty_rows)
    return faulty_rows


def _count_faults(verdict: Verdict, mesh: Written, flat_rows: list[int] | None) -> None:
    """Adds faults: triangles without area or reversed, edges with more than two triangles.

    `flat_rows` are the rows of triangles without area. It is None for a mesh of a line, whose
    triangles have no area and whose edges overlap.
    """
    fault_counts = Counter(
        {
            "have a vertex twice": int((np.diff(np.sort(mesh.faces, axis=1)) == 0).any(1).sum()),
            "have no area": len(flat_rows or ()),
            "are reversed": 0 if mesh.places is None else count_reversed_triangles(mesh.places),
        }
    )
    verdict.bad = fault_counts.total()
    verdict.faults += [f"{count} triangles {text}" for text, count in fault_counts.items() if count]
    boundary_edges, overused_edges = count_edges(mesh.faces)
    # In a GLB, an edge may have different vertices in each of its triangles.
    if verdict.case.written_as == "json":
        if overused_edges and flat_rows is not None:
            verdict.faults.append(f"{overused_edges} edges of more than two triangles")
        if boundary_edges != mesh.report["boundary_edges"]:
            verdict.faults.append(
                f"{boundary_edges} boundary edges, reported {mesh.report['boundary_edges']}"
            )


def find_flat_triangles(corners: Array) -> list[int]:
    """Rows of the triangles whose area is exactly zero."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    squared_lengths = [((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))]
    max_squares = np.max(squared_lengths, axis=0)
    thin_rows = np.flatnonzero((normal**2).sum(axis=1) <= (THIN * max_squares) ** 2)
    return [k for k in thin_rows.tolist() if is_flat(corners[k])]


def count_reversed_triangles(places: Array) -> int:
    """Number of triangles that are clockwise in (u, v) by more than the rounding of float32."""
    a, b, c = places[:, 0], places[:, 1], places[:, 2]
    (x, y), (z, w) = (b - a).T, (c - a).T
    rounding = np.abs(places).max(axis=(1, 2)) * 2.0**-22
    max_error = rounding * (np.abs(b - a) + np.abs(c - a)).sum(axis=1)
    return int((x * w - y * z < -max_error).sum())


def count_edges(faces: Rows) -> tuple[int, int]:
    """Numbers of edges with one triangle, and of edges with more than two triangles."""
    _, uses = np.unique(np.sort(list_edges(faces), axis=1), axis=0, return_counts=True)
    return int((uses == 1).sum()), int((uses > 2).sum())
