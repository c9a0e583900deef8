"""Queries per second: closest points, also of other libraries, rays, signs, sections; and parts."""

import time
from collections.abc import Callable
from statistics import median

import numpy as np

from service.encoders.polylines.registry import SECTIONS_BY_NAME
from service.engine.closest.project import ProjectQuery, project_on_surface
from service.engine.measures.measure import measure
from service.engine.measures.values import MeasureQuery
from service.engine.models import to_patches
from service.engine.rays.intersect import RayQuery, intersect_rays
from service.engine.sections.values import Planes, SectionTolerance
from service.pipeline.polylines import plan_sections
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import find
from service.surface.lowered import PatchModel
from service.surface.sizes import SurfaceKind
from tools.benchmarks import part_queries
from tools.benchmarks.closest_peers import print_closest
from tools.certify.surfaces import FAMILIES

ROUNDS, RAYS = 5, 50_000
"""Number of rounds, and of rays in each."""

SIGNED_POINTS, PLANES = 2000, 20
"""Number of points whose signs are computed in each round, and of planes."""


def run() -> bool:
    """Prints the tables; returns whether questions to parts are within their limits."""
    bicubic = FAMILIES["bicubic, moderate"].surface(1)
    assert isinstance(bicubic, BezierSurface)
    surfaces: dict[str, SurfaceKind] = {
        "one bicubic patch": bicubic, "teapot, 32 patches": find("utah-teapot").surface(),
    }  # fmt: skip
    for title, surface in surfaces.items():
        print_closest(title, to_patches(surface.lower()))
    print(f"\n{'rays a second':24}{'first hits':>12}{'all hits':>12}{'hits a ray':>12}")
    for title, surface in surfaces.items():
        rates, hits_per_ray = measure_ray_rates(to_patches(surface.lower()))
        print(f"{title:24}" + "".join(f"{rate:12,.0f}" for rate in rates) + f"{hits_per_ray:12.2f}")

    print(f"\n{'':24}{'signs a second':>16}{'planes a second':>16}{'measured, ms':>16}")
    for name in ("sphere", "rounded-box", "utah-teapot"):
        values = measure_other_rates(find(name).surface())
        print(f"{name:24}" + "".join(f"{value:16,.0f}" for value in values), flush=True)
    print()
    return part_queries.run()


def measure_other_rates(surface: SurfaceKind) -> tuple[float, float, float]:
    """Points with signs per second, planes per second, and milliseconds of all measures."""
    model = to_patches(surface.lower())
    low, high = model.bounds
    rng = np.random.default_rng(1)
    points = ProjectQuery(rng.uniform(low, high, (SIGNED_POINTS, 3)), sign=True)
    normals = rng.normal(size=(PLANES, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points_on_planes = rng.uniform(low, high, (PLANES, 3))
    planes = Planes(normals, offsets=(points_on_planes * normals).sum(axis=1))
    sections = plan_sections(surface, (planes, SectionTolerance()), SECTIONS_BY_NAME["json"])
    work: tuple[Callable[[], object], ...] = (
        lambda: project_on_surface(model, points),
        sections.run,
        lambda: measure(model, MeasureQuery()),
    )
    seconds: list[list[float]] = [[], [], []]
    for _ in range(ROUNDS):
        for number, call in enumerate(work):
            start = time.process_time()
            call()
            seconds[number].append(time.process_time() - start)
    sign_seconds, plane_seconds, measure_seconds = (median(each) for each in seconds)
    return SIGNED_POINTS / sign_seconds, PLANES / plane_seconds, 1e3 * measure_seconds


def measure_ray_rates(model: PatchModel) -> tuple[list[float], float]:
    """Rays per second for first hits and for all hits, and the number of hits per ray.

    Rays begin on a sphere around the model, and go to random points of its bounding box.
    """
    low, high = model.bounds
    rng = np.random.default_rng(1)
    outward = rng.normal(size=(RAYS, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    origins = (low + high) / 2 + 0.75 * model.diagonal * outward
    directions = rng.uniform(low, high, (RAYS, 3)) - origins
    seconds: list[list[float]] = [[], []]
    hits = 0
    for _ in range(ROUNDS):
        for number, only_first in enumerate((True, False)):
            start = time.process_time()
            query = RayQuery(origins, directions, only_first)
            hits = len(intersect_rays(model, query, max_hits=10**7)["t"])
            seconds[number].append(time.process_time() - start)
    return [RAYS / median(each) for each in seconds], hits / RAYS
