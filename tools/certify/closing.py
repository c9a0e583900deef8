"""Judges meshes of surfaces whose borders are nearly equal: they must close, or must stay open.

Each surface is meshed by resolution and by tolerance, and by tolerance also in another order of its
patches. The mesh is compared with the original surface, before the service joined borders.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from oracles.deviation import measure_surface_to_mesh
from oracles.sheets import build_sheets
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.connectivity.equal_points import find_knot_ratio
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from tools.certify.crowded import build_crowded, build_mixed
from tools.certify.nearly import (
    Case,
    WeldedSurface,
    build_noisy,
    build_noisy_pieces,
    build_pieces,
    list_points,
)
from tools.certify.table import Finding
from tools.certify.written import Written, read_file

RESOLUTION = (3, 5)


@dataclass
class NearlyClosed(Finding):
    """The findings about one surface.

    `moved` is the largest distance by which joining moved a point; `closed` is whether the last
    mesh is watertight.
    """

    moved: float = 0.0
    closed: bool = False

    def __str__(self) -> str:
        return f"{self.kind} {self.seed}"


@dataclass(frozen=True)
class CaseFamily:
    """A family of `count` surfaces; `build` builds the surface with a seed below `count`."""

    count: int
    build: Callable[[int], Case]


NEARLY_CLOSED: Mapping[str, CaseFamily] = MappingProxyType(
    {
        "noise": CaseFamily(108, build_noisy),
        "borders": CaseFamily(120, build_pieces),
        "noisy borders": CaseFamily(84, build_noisy_pieces),
        "mixed degrees": CaseFamily(112, build_mixed),
        "crowded knots": CaseFamily(112, build_crowded),
    }
)
"""The families of surfaces whose borders are nearly equal."""


def judge_nearly(kind: str, seed: int, tolerance: float) -> NearlyClosed:
    """The findings about the meshes of one surface, by resolution and by tolerance."""
    case = NEARLY_CLOSED[kind].build(seed)
    finding = NearlyClosed(kind=kind, seed=seed)
    start = time.process_time()
    try:
        for options in (
            MeshOptions(RESOLUTION, weld_tolerance=case.weld_tolerance),
            MeshOptions(
                accuracy=Accuracy(relative_tolerance=tolerance), weld_tolerance=case.weld_tolerance
            ),
        ):
            _judge_mesh(finding, case, options)
    except Exception as error:  # any error means that no mesh was made
        finding.faults.append(f"{type(error).__name__}: {error}")
    finding.seconds = time.process_time() - start
    return finding


def _judge_mesh(finding: NearlyClosed, case: Case, options: MeshOptions) -> None:
    """Adds the findings about the mesh of a case with these options."""
    mesh = write_mesh(case.surface, options)
    report = mesh.report
    diagonal = float(np.linalg.norm(np.ptp(list_points(case.surface), axis=0)))
    # The table divides deviations and bounds by `tolerance`: here it gives them in diagonals.
    finding.tolerance = diagonal
    finding.triangles, finding.moved = len(mesh.faces), report.get("moved", 0.0)
    finding.bound = report["deviation_bound"]
    deviation = measure_surface_to_mesh(build_sheets(case.surface), mesh.corners, 1000)
    finding.deviation = deviation.distance
    if not deviation.distance <= finding.bound + deviation.rounding:
        finding.faults.append(f"deviates by {deviation.distance}, bound {finding.bound}")
    finding.closed = report["watertight"]
    # An opening narrower than the tolerance may be closed: both sides may be the same edge.
    is_narrow_opening = case.is_closed is False and options.accuracy is not None
    if not is_narrow_opening and not case.accepts(report["watertight"]):
        finding.faults.append(f"watertight is {report['watertight']} at {case.weld_tolerance}")
    # The service splits borders of a multipatch in rounds, and joins points after each round;
    # 4 rounds must be enough here. A round may move a point by the largest distance at which points
    # are joined, and by as much again if weights change; 0.5 % is for rounding. This distance is
    # `weld_tolerance` diagonals, or as far as the rounding of knots moves points.
    rounds = 4 if isinstance(case.surface, MultipatchSurface) else 1
    reach = max(case.weld_tolerance, 2.0**-48 * find_knot_ratio(case.surface.lower()))
    if finding.moved > 2.01 * rounds * reach * diagonal:
        finding.faults.append(f"moved by {finding.moved}")
    if finding.moved > finding.bound:
        finding.faults.append(f"moved by {finding.moved}, bound {finding.bound}")
    if options.accuracy is not None:
        rng = np.random.default_rng(finding.seed)
        _compare_order(finding, mesh, _change_order(rng, case.surface), options)


def _change_order(rng: np.random.Generator, surface: WeldedSurface) -> WeldedSurface:
    """The surface with its patches in random order, or with its surfaces in reverse order.

    A B-spline, which has no order of patches, is returned unchanged.
    """
    if isinstance(surface, MultipatchSurface):
        return replace(surface, surfaces=surface.surfaces[::-1])
    if not isinstance(surface, PatchSurface):
        return surface
    grids, triangles = (rng.permutation(len(each)) for each in (surface.patches, surface.triangles))
    patches = tuple(surface.patches[k] for k in grids)
    return replace(surface, patches=patches, triangles=surface.triangles[triangles], parts=())


def _compare_order(
    finding: NearlyClosed, mesh: Written, reordered_surface: WeldedSurface, options: MeshOptions
) -> None:
    """Adds a fault if the patches in another order give other triangles."""
    if list_triangles(write_mesh(reordered_surface, options)) != list_triangles(mesh):
        finding.faults.append("the order of the patches matters")


def write_mesh(surface: WeldedSurface, options: MeshOptions) -> Written:
    """The mesh of a surface, written as JSON and read back."""
    return read_file("json", render(surface, options, BY_NAME["json"]))


def list_triangles(mesh: Written) -> set[bytes]:
    """All triangles, each as bytes, with its corners sorted by coordinates."""
    corners = mesh.corners
    # By x, then y, then z: `lexsort` sorts by its last key first, so the axes are reversed.
    order = np.lexsort(corners.transpose(2, 0, 1)[::-1], axis=1)
    return {t.tobytes() for t in np.take_along_axis(corners, order[..., None], axis=1)}
