"""Makes one mesh, reads its file back, and looks for all faults that it can have."""

import time
from collections import Counter
from dataclasses import dataclass
from math import inf
from typing import Any, Literal

import numpy as np

from service.encoders.registry import BY_NAME
from service.engine.adaptive.tolerance_spec import Accuracy
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from tests.oracles.deviation import measure_mesh_to_surface, measure_surface_to_mesh
from tests.oracles.exact import is_flat
from tests.oracles.sheets import build_sheets
from tools.certify.rounding import is_flattened_by_rounding
from tools.certify.surfaces import FAMILIES
from tools.certify.table import Finding
from tools.certify.written import Array, Rows, Written, list_edges, read

TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4)
"""Shares of the diagonal of the box about the control points."""

SAMPLES = 2000, 20000
"""The fewest and the most samples of a sheet; between these limits 4 for each triangle."""

THIN = 1e-9
"""Below this quotient of twice the area and the square of the longest side, exact arithmetic
decides whether a triangle has an area."""


@dataclass(frozen=True)
class Case:
    """A mesh to be made and judged: by resolution if the case has one, else by tolerance."""

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
        two = ", two-sided" if self.two_sided else ""
        return f"{self.family} {self.seed} at {self.relative:g} as {self.written_as}{two}"


@dataclass
class Verdict(Finding):
    """The findings about the mesh of a case."""

    case: Case
    mesh_bound: float = 0.0
    mesh_deviation: float = 0.0
    missed: bool = False
    bad: int = 0
    excused: int = 0

    def __str__(self) -> str:
        return str(self.case)


def judge(case: Case, samples: tuple[int, int] = SAMPLES) -> Verdict:
    """Makes the mesh, reads it back, and judges it."""
    family = FAMILIES[case.family]
    surface = family.surface(case.seed)
    tolerance = min(case.relative, 1e3) * measure_diagonal(surface)
    verdict = Verdict(case, kind=case.family, seed=case.seed, tolerance=tolerance)
    options = build_options(case)
    start = time.process_time()
    try:
        content = render(surface, options, BY_NAME[case.written_as])
    except Exception as error:  # any error means that no mesh was made
        verdict.wrong.append(f"{type(error).__name__}: {error}")
        return verdict
    verdict.seconds = time.process_time() - start
    mesh = read(case.written_as, content)
    verdict.triangles = len(mesh.faces)
    _measure(verdict, surface, mesh, samples)
    if case.faces == "quads":
        _measure(verdict, surface, read(case.written_as, content, diagonal=1), samples)
    if case.resolution is not None:
        return verdict
    _count(verdict, mesh, None if family.lines else _find_flat(verdict, surface, mesh))
    if family.flat and not case.two_sided and verdict.triangles != 2:
        verdict.wrong.append(f"{verdict.triangles} triangles where two are enough")
    return verdict


def build_options(case: Case) -> MeshOptions:
    """Options for positions alone; meshes by tolerance also have parameters."""
    if case.resolution is not None:
        return MeshOptions(resolution=case.resolution, faces=case.faces, normals=False)
    accuracy = Accuracy(relative_tolerance=case.relative, two_sided=case.two_sided)
    return MeshOptions(accuracy=accuracy, normals=False, uvs=True)


def measure_diagonal(surface: Any) -> float:
    """The diagonal of the bounding box of the control points."""
    points = surface.control_net.reshape(-1, 3)
    return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))


def _measure(verdict: Verdict, surface: Any, mesh: Written, samples: tuple[int, int]) -> None:
    """Compares deviations with the reported bounds, and the bounds with the tolerance."""
    sheets = build_sheets(surface)
    if not len(mesh.faces):
        if verdict.tolerance > 0 and verdict.case.resolution is None:
            verdict.wrong.append("no triangles")
        return
    verdict.bound = mesh.report.get("deviation_bound", np.nan)
    if not verdict.bound <= verdict.tolerance:
        verdict.wrong.append(f"bound {verdict.bound} above tolerance {verdict.tolerance}")
    count = int(np.clip(4 * len(mesh.faces), *samples))
    largest = measure_surface_to_mesh(sheets, mesh.corners, count)
    verdict.deviation = max(verdict.deviation, largest.distance)
    if not largest.distance <= verdict.bound + largest.noise:
        verdict.wrong.append(
            f"deviation {largest.distance} above bound {verdict.bound} at {largest.place}"
        )
    if verdict.case.family == "spikes" and verdict.case.resolution is None:
        peak = float(surface.control_net[..., 2].max())
        top = max(float((s.at(s.samples(count)) + s.origin)[:, 2].max()) for s in sheets)
        verdict.missed = peak > 0 and top - float(mesh.vertices[:, 2].max()) > verdict.tolerance
        if verdict.missed:
            verdict.wrong.append("the spike is missed")
    if verdict.case.two_sided:
        verdict.mesh_bound = mesh.report.get("mesh_deviation_bound", np.nan)
        inner = 4 if len(mesh.faces) < 2000 else 2
        verdict.mesh_deviation = measure_mesh_to_surface(
            sheets, mesh.corners, count, inner, doubt=verdict.mesh_bound
        )
        if not verdict.mesh_bound <= 2 * verdict.tolerance:
            verdict.wrong.append(f"mesh bound {verdict.mesh_bound} above twice the tolerance")
        if not verdict.mesh_deviation <= verdict.mesh_bound + largest.noise:
            verdict.wrong.append(
                f"mesh deviation {verdict.mesh_deviation} above bound {verdict.mesh_bound}"
            )


def _find_flat(verdict: Verdict, surface: Any, mesh: Written) -> list[int]:
    """The triangles without area, except those that lost it by rounding alone."""
    flat = find_flat_triangles(mesh.corners)
    if mesh.steps is None or mesh.places is None:
        return flat
    (sheet,) = build_sheets(surface)
    places, steps = mesh.places, mesh.steps[mesh.faces]
    wrong = [
        k for k in flat if not is_flattened_by_rounding(sheet, mesh.corners[k], places[k], steps[k])
    ]
    verdict.excused = len(flat) - len(wrong)
    return wrong


def _count(verdict: Verdict, mesh: Written, without_area: list[int] | None) -> None:
    """Adds faults: triangles without area or turned over, edges with more than two triangles.

    `without_area` is None for a mesh of a line: its triangles have no area, and its edges overlap.
    """
    bad = Counter(
        {
            "name a vertex twice": int((np.diff(np.sort(mesh.faces, axis=1)) == 0).any(1).sum()),
            "have no area": len(without_area or ()),
            "are turned over": 0 if mesh.places is None else count_turned_triangles(mesh.places),
        }
    )
    verdict.bad = bad.total()
    verdict.wrong += [f"{count} triangles {what}" for what, count in bad.items() if count]
    boundary, more = count_edges(mesh.faces)
    if verdict.case.written_as == "json":
        if more and without_area is not None:
            verdict.wrong.append(f"{more} edges of more than two triangles")
        if boundary != mesh.report["boundary_edges"]:
            verdict.wrong.append(
                f"{boundary} boundary edges, reported {mesh.report['boundary_edges']}"
            )


def find_flat_triangles(corners: Array) -> list[int]:
    """Rows of the triangles whose area is zero, exactly."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    longest = np.max([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    thin = np.flatnonzero((normal**2).sum(axis=1) <= (THIN * longest) ** 2)
    return [k for k in thin.tolist() if is_flat(corners[k])]


def count_turned_triangles(places: Array) -> int:
    """Number of triangles that run clockwise in (u, v), as far as float32 shows it."""
    a, b, c = places[:, 0], places[:, 1], places[:, 2]
    (x, y), (z, w) = (b - a).T, (c - a).T
    size = np.abs(places).max(axis=(1, 2)) * 2.0**-22
    doubt = size * (np.abs(b - a) + np.abs(c - a)).sum(axis=1)
    return int((x * w - y * z < -doubt).sum())


def count_edges(faces: Rows) -> tuple[int, int]:
    """Numbers of edges: with one triangle; with more than two, or twice in one direction."""
    _, uses = np.unique(np.sort(list_edges(faces), axis=1), axis=0, return_counts=True)
    return int((uses == 1).sum()), int((uses > 2).sum())
