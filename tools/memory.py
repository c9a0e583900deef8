"""Compares the memory of meshes, of pictures and of questions to parts with the prediction.

`make memory` runs it. For small meshes and for questions the program traces the allocations of
Python and NumPy. For large meshes it measures the resident memory of a process of its own. The exit
status is 1 if one of them uses more memory than predicted.

    python -m tools.memory [name of a surface …]
"""

import sys
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import radians
from multiprocessing import get_context
from multiprocessing.pool import Pool
from typing import Any, NamedTuple

import numpy as np

from oracles.solids import read_solid
from service.bases.cache import MESH_PLANS
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.accuracy import Accuracy
from service.engine.measures.values import BudgetEnded
from service.engine.options import MeshOptions, OverlayName
from service.engine.pictures.options import PictureOptions, PictureStyle, Viewpoint
from service.errors import SurfaceError
from service.pipeline.cost import Work, lowering_memory
from service.pipeline.limits import Limits
from service.pipeline.mesh import plan_mesh
from service.pipeline.mesh_plan import build_plan
from service.pipeline.picture import plan_picture
from service.schemas.request import MeshRequest, SurfaceRequest
from service.schemas.validation import validate_document
from service.settings.runtime import pin_blas, share_heap
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.brep import BrepSurface
from service.surface.bspline import BsplineSurface
from service.surface.channels import Channels
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.kinds import Surface
from service.surface.patches import PatchSurface
from tools.breps import build_sheet, repeat_solid
from tools.part_questions import list_questions
from tools.processes import peak_memory, reset_peak, resident_memory

RESOLUTIONS = (1, 1), (3, 7)
LARGE = ("saddle", 900), ("utah-teapot", 150), ("tea-service", 60), ("spline", 6)
"""Surfaces and divisions whose resident memory is measured, each in a process of its own."""

BREPS, BREP_TOLERANCES = ("box", "plate", "thread", "tee", "pipe", "sphere"), (1e-2, 1e-3, 1e-4)
"""Solids whose meshes are measured, and their tolerances, as shares of the diagonal."""

ASKED = ("box", "plate", "gear", "impeller", "thread", "tee", "pipe")
"""Solids that are asked all questions."""

PICTURES = ("saddle", "utah-teapot", "bspline-hills", "octahedral-sphere", "trefoil-tube",
            "tea-service", "pipe-tee", "impeller")  # fmt: skip
"""Built-in surfaces of which pictures are measured."""

CACHE_BYTES = 16 << 20
"""Bytes that a process keeps in caches after the first large mesh: bases, plans, work arrays."""

MAX_VERTICES = 300_000
"""Meshes with more vertices are not traced, because tracing takes ten times as long as the work."""


class Measurement(NamedTuple):
    """The bytes that a mesh used, and the predicted bytes."""

    name: str
    used_bytes: int
    predicted_bytes: int


def measure_memory(work: Callable[[], Any]) -> int:
    """The peak of the bytes that `work` allocates."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def build_surfaces() -> dict[str, Surface]:
    """The built-in surfaces, and surfaces with extreme numbers, degrees or shapes, by name."""
    random = np.random.default_rng(8)
    surfaces = {name: find(name).surface() for name in EXAMPLES}
    points, draw_indices = random.normal(size=(500, 3)), random.integers
    line_net = np.zeros((40, 40, 3))
    line_net[..., 0] = np.arange(40)[:, np.newaxis]
    weights = random.uniform(1, 2, (30, 30))
    nets = random.normal(size=(60, 60, 3)), random.normal(size=(30, 30, 3))
    channels = Channels(
        random.uniform(0, 1, (500, 4)),
        random.normal(size=(500, 2)),
        (("heat", random.normal(size=(500, 7))),),
    )
    return surfaces | {
        "spline": BsplineSurface(nets[0]),
        "rational": BsplineSurface(nets[1], weights=weights),
        "linear": BsplineSurface(nets[0], (1, 1)),
        "high": BsplineSurface(nets[1], (10, 9)),
        "degenerate": BsplineSurface(np.rint(nets[0])),  # many equal points
        "line": BsplineSurface(line_net),
        "bezier": BezierSurface(random.normal(size=(21, 18, 3)), random.uniform(1, 2, (21, 18))),
        "triangle": TriangleSurface(random.normal(size=(28, 3))),
        "soup": PatchSurface(
            points,
            draw_indices(0, 500, (3000, 2, 2)),
            triangles=draw_indices(0, 500, (2000, 6)),
            weights=random.uniform(1, 2, 500),
        ),
        "channels": PatchSurface(points, draw_indices(0, 500, (800, 3, 3)), channels=channels),
    }


def list_variants(resolution: tuple[int, int]) -> Iterator[tuple[str, MeshOptions, EncodeOptions]]:
    """Variants of a mesh: name, options of the mesh, options of the file."""
    plain, base = EncodeOptions(), MeshOptions(resolution)
    yield "plain", base, plain
    yield "bare", MeshOptions(resolution, normals=False, weld=False), plain
    yield "quads", MeshOptions(resolution, faces="quads", uvs=True), plain
    yield "curved", MeshOptions(resolution, uvs=True, curvatures=True), plain
    lines: tuple[OverlayName, ...] = ("control_net", "boundary")
    yield "lines", MeshOptions(resolution, overlays=lines, isocurves=(2, 3)), plain
    yield "tubes", MeshOptions(resolution, isocurves=(1, 1), wires="tubes", wire_sides=4), plain
    ribbons = MeshOptions(resolution, isocurves=(2, 1), wires="ribbons", has_faces=False)
    yield "ribbons", ribbons, plain
    yield "quantized", base, EncodeOptions(quantize=True)
    yield "compressed", base, EncodeOptions(quantize=True, compression="meshopt")
    yield "exact", base, EncodeOptions(oogl="bez")
    yield "meshes", MeshOptions(resolution, uvs=True), EncodeOptions(oogl="mesh")
    yield "de Casteljau", MeshOptions(resolution, method="de_casteljau"), plain
    if resolution == RESOLUTIONS[0]:  # once, because a tolerance replaces the resolution
        yield "tolerance", MeshOptions(accuracy=Accuracy(relative_tolerance=0.01)), plain


def measure_surface(name: str, surface: Surface) -> Iterator[Measurement]:
    """Measures the meshes of a surface in all variants and in all formats that can store them."""
    for resolution in RESOLUTIONS:
        for variant, options, encode in list_variants(resolution):
            for fmt in FORMATS:
                is_other_format = encode.oogl is not None and fmt.name != "oogl"
                if is_other_format or (encode.quantize and not fmt.compact):
                    continue
                title = f"{name} {resolution[0]}×{resolution[1]} {variant} {fmt.name}"
                try:
                    if build_plan(surface, options, fmt, encode).size.vertices > MAX_VERTICES:
                        continue
                    work = plan_mesh(surface, options, fmt, encode)
                    work.run()  # fills the caches, which are not part of the cost
                    yield Measurement(title, measure_memory(work.run), work.cost.memory)
                except SurfaceError:  # this surface or format does not have this variant
                    continue
    lowering = measure_memory(surface.lower)
    yield Measurement(f"{name} as patches", lowering, lowering_memory(surface.size()))


def measure_brep(name: str, tolerance: float) -> Iterator[Measurement]:
    """Measures the meshes of a solid in all formats, with a limit near the number of triangles."""
    document = {"surface": read_solid(name)}
    surface = validate_document(MeshRequest, document).to_surface()
    accuracy = Accuracy(relative_tolerance=tolerance)
    report = plan_mesh(surface, MeshOptions(accuracy=accuracy), BY_NAME["stl"]).run().report
    assert report is not None
    # Without this limit the predicted memory would be that of the largest mesh.
    accuracy = replace(accuracy, max_triangles=report.triangles + report.triangles // 8)
    plain = MeshOptions(accuracy=accuracy)
    lines: tuple[OverlayName, ...] = ("boundary",)
    variants: tuple[tuple[str, MeshOptions], ...] = (
        ("plain", plain),
        ("curved", replace(plain, uvs=True, curvatures=True)),
        ("lines", replace(plain, overlays=lines)),
    )
    for variant, options in variants:
        for fmt in FORMATS:
            title = f"{name} {tolerance:g} {variant} {fmt.name}"
            try:
                work = plan_mesh(surface, options, fmt)
            except SurfaceError:  # this format does not have this variant
                continue
            yield Measurement(title, measure_memory(work.run), work.cost.memory)


def measure_pictures(name: str) -> Iterator[Measurement]:
    """Measures pictures of a surface, with a limit near the number of vertices."""
    surface = find(name).surface()
    lines: tuple[OverlayName, ...] = ("boundary",)
    variants = {
        "plain": PictureOptions(Viewpoint(512, 512)),
        "large": PictureOptions(Viewpoint(2048, 1024)),
        "near": PictureOptions(Viewpoint(512, 512, radians(90), zoom=4)),
        "lines": PictureOptions(Viewpoint(512, 512, orthographic=True), overlays=lines),
        "mean": PictureOptions(Viewpoint(512, 512), PictureStyle("mean")),
    }
    for variant, options in variants.items():
        # Without this limit the predicted memory would be that of the largest mesh.
        for exponent in range(8, 20):
            limits = Limits(max_vertices=1 << exponent)
            with suppress(SurfaceError):  # too small a limit, or this surface lacks the variant
                work = plan_picture(surface, options, limits)
                work.run()
                title = f"picture of {name}, {variant}"
                yield Measurement(title, measure_memory(work.run), work.cost.memory)
                break


def measure_questions(name: str, document: dict[str, Any]) -> Iterator[Measurement]:
    """Measures all questions to a part, each as if it were the first to this part."""
    surface = validate_document(SurfaceRequest, {"surface": document}).to_surface()
    assert isinstance(surface, BrepSurface)
    for title, work in list_questions(surface):
        MESH_PLANS.clear()
        yield Measurement(f"{name}, {title}", measure_memory(partial(_try, work)), work.cost.memory)


def _try(work: Work[bytes]) -> None:
    """Runs work that may end because its budget is too small, or the answer too long."""
    with suppress(BudgetEnded, SurfaceError):
        work.run()


def measure_resident(name: str, divisions: int, fmt: str) -> Measurement:
    """Measures a large mesh in this process, which must have done no work before."""
    pin_blas()
    share_heap()
    surface, options = build_surfaces()[name], MeshOptions((divisions, divisions))
    plan_mesh(surface, MeshOptions((2, 2)), BY_NAME[fmt]).run()
    bytes_before = resident_memory()
    reset_peak()
    work = plan_mesh(surface, options, BY_NAME[fmt])
    work.run()
    title = f"{name} {divisions}×{divisions} {fmt}, resident"
    return Measurement(title, peak_memory() - bytes_before - CACHE_BYTES, work.cost.memory)


def print_measurement(measurement: Measurement) -> bool:
    """Prints a line if a mesh used more than predicted, or over 8 MiB but less than a third of it.

    Returns whether it used more. Lines of large meshes are always printed.
    """
    exceeds_prediction = measurement.used_bytes > measurement.predicted_bytes
    is_far_below_prediction = (
        measurement.used_bytes > 8 << 20
        and measurement.predicted_bytes > 3 * measurement.used_bytes
    )
    if exceeds_prediction or is_far_below_prediction or "resident" in measurement.name:
        share = (
            f"{measurement.used_bytes / 1e6:8.2f} MB of {measurement.predicted_bytes / 1e6:8.2f} MB"
        )
        print(
            f"{share}  {measurement.name}{'  TOO MUCH' if exceeds_prediction else ''}", flush=True
        )
    return exceeds_prediction


def measure_all(names: list[str]) -> Iterator[Measurement]:
    """Measures all surfaces, pictures and parts, or the named ones."""
    asked = {name: read_solid(name) for name in ASKED}
    asked |= {"300 faces": repeat_solid(read_solid("plate"), 10), "sheet": build_sheet(40, 40)}
    by_name: list[tuple[str, Callable[[], Iterator[Measurement]]]] = [
        *((name, partial(measure_surface, name, each)) for name, each in build_surfaces().items()),
        *((name, partial(measure_brep, name, each)) for name in BREPS for each in BREP_TOLERANCES),
        *((name, partial(measure_pictures, name)) for name in PICTURES),
        *((name, partial(measure_questions, name, each)) for name, each in asked.items()),
    ]
    with get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for name, divisions in LARGE:
            calls = [(name, divisions, fmt.name) for fmt in FORMATS]
            by_name.append((name, partial(_measure_in, pool, calls)))
        for name, measure in by_name:
            if not names or name in names:
                yield from measure()


def _measure_in(pool: Pool, calls: list[tuple[str, int, str]]) -> Iterator[Measurement]:
    """Measures large meshes, each in a process of its own."""
    return (pool.apply(measure_resident, call) for call in calls)


def main(names: list[str]) -> int:
    """Prints the measurements that matter; returns the exit status."""
    pin_blas()
    exceeds = [print_measurement(each) for each in measure_all(names)]
    count, excess_count = len(exceeds), sum(exceeds)
    print(
        f"{count} meshes, pictures and questions, {excess_count} of which used more than predicted."
    )
    return 1 if excess_count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
