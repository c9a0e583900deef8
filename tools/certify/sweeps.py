"""Families of random tubes and ribbons, and the comparison of their meshes with the round surfaces.

The meshes are those by tolerance. `oracles.sweeps` samples the surfaces with frames of its own.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracles.distance import Soup
from oracles.sweeps import sample_ribbon, sample_tube
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.curve import BezierCurve, BsplineCurve, Curve
from service.surface.sweeps import RibbonSurface, TubeSurface
from tools.certify.table import Finding
from tools.certify.written import read_file

Array: TypeAlias = NDArray[np.float64]
Random: TypeAlias = np.random.Generator
Sweep: TypeAlias = TubeSurface | RibbonSurface


@dataclass
class SweptFinding(Finding):
    """The findings about the mesh of one tube or ribbon; `refused` is whether it has no bound."""

    refused: bool = False

    def __str__(self) -> str:
        return f"{self.kind} {self.seed} at {self.tolerance:g}"


@dataclass(frozen=True)
class SweptFamily:
    """A family of `count` tubes or ribbons."""

    build: Callable[[Random], Sweep]
    count: int

    def surface(self, seed: int) -> Sweep:
        """The tube or ribbon that the family builds from this seed."""
        return self.build(np.random.default_rng(seed))


def _draw_curve(rng: Random, degrees: tuple[int, int] = (2, 5)) -> Curve:
    """A Bézier or B-spline curve, half of them rational, of any size and place."""
    degree, is_spline = int(rng.integers(*degrees, endpoint=True)), bool(rng.integers(2))
    count = degree + 1 + 4 * is_spline
    points = np.cumsum(rng.normal(size=(count, 3)), axis=0) * 10.0 ** rng.uniform(-2, 2)
    points += rng.normal(size=3) * 10.0 ** rng.uniform(-2, 3)
    weights = 4.0 ** rng.uniform(-1, 1, count) if rng.integers(2) else None
    if not is_spline:
        return BezierCurve(points, weights)
    if rng.integers(3) == 0:
        return BsplineCurve(points, degree, "periodic", weights)
    return BsplineCurve(points, degree, "clamped", weights)


def _draw_radius(rng: Random, curve: Curve, low: float, high: float, degree: int = 0) -> Array:
    size = float(np.ptp(curve.control_points, axis=0).max())
    return np.asarray(size * 10.0 ** rng.uniform(low, high) * rng.uniform(0.2, 1, degree + 1))


def _build_tube(rng: Random, low: float = -2.5, high: float = -1, degree: int = 0) -> Sweep:
    curve = _draw_curve(rng)
    caps = bool(rng.integers(4))
    return TubeSurface(curve, _draw_radius(rng, curve, low, high, degree), 3, caps)


def _build_bent(rng: Random) -> Sweep:
    """A tube about a polyline, or about curves that meet at corners of any angle."""
    degree = int(rng.integers(1, 4))
    count = 4 * degree + 1
    knots = np.concatenate([np.repeat(np.arange(5.0), degree), [0, 4.0]])
    points = rng.normal(size=(count, 3))
    curve = BsplineCurve(points, degree, np.sort(knots))
    return TubeSurface(curve, _draw_radius(rng, curve, -2, -1.2), 3)


def _build_ribbon(rng: Random) -> Sweep:
    curve = _draw_curve(rng)
    width = _draw_radius(rng, curve, -2, -0.5, int(rng.integers(3)))
    size = float(np.ptp(curve.control_points, axis=0).max())
    if rng.integers(2):
        return RibbonSurface(curve, width, facing=rng.normal(size=3))
    return RibbonSurface(
        curve, width, camera=curve.control_points[0] + 8 * size * rng.normal(size=3)
    )


SWEEPS: Mapping[str, SweptFamily] = MappingProxyType(
    {
        "tubes": SweptFamily(_build_tube, 60),
        "tapered tubes": SweptFamily(lambda rng: _build_tube(rng, -2, -1, 3), 40),
        "wide tubes": SweptFamily(lambda rng: _build_tube(rng, -0.7, 0.5), 30),
        "bent tubes": SweptFamily(_build_bent, 60),
        "ribbons": SweptFamily(_build_ribbon, 60),
    }
)
"""The families of tubes and ribbons."""


def judge_sweep(kind: str, seed: int, tolerance: float) -> SweptFinding:
    """The findings about the mesh of one tube or ribbon; `tolerance` is relative to its size."""
    surface = SWEEPS[kind].surface(seed)
    finding = SweptFinding(kind=kind, seed=seed)
    finding.tolerance = tolerance * surface.lower().diagonal
    options = MeshOptions(accuracy=Accuracy(tolerance=finding.tolerance), normals=False)
    start = time.process_time()
    try:
        content = render(surface, options, BY_NAME["json"])
    except Exception as error:  # any other error means that no mesh was made
        finding.refused = _is_sharp(error)
        if not finding.refused:
            finding.faults.append(f"{type(error).__name__}: {error}")
        return finding
    finding.seconds = time.process_time() - start
    mesh = read_file("json", content)
    finding.triangles, finding.bound = len(mesh.faces), mesh.report["deviation_bound"]
    is_tube = isinstance(surface, TubeSurface)
    points = sample_tube(surface, 40, 48) if is_tube else sample_ribbon(surface, 200, 9)
    finding.deviation = Soup(mesh.corners).farthest(points)[1]
    rounding = 64 * 2.0**-53 * float(np.abs(points).max())
    if not finding.bound <= finding.tolerance:
        finding.faults.append(f"bound {finding.bound} above the tolerance")
    if not finding.deviation <= finding.bound + rounding:
        finding.faults.append(f"deviation {finding.deviation} above bound {finding.bound}")
    is_whole = isinstance(surface, TubeSurface) and (surface.caps or surface.lower().closed)
    if is_whole and not mesh.report["watertight"]:
        finding.faults.append(f"{mesh.report['boundary_edges']} open edges")
    return finding


def _is_sharp(error: Any) -> bool:
    """Whether an error says that the path has a cusp."""
    return any(issue.code == "sharp_path" for issue in getattr(error, "issues", ()))
