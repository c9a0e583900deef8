"""Times of the encoders: GLB compared with trimesh, every format, and the cost of compact GLB."""

import gzip
from collections.abc import Callable
from functools import partial

import trimesh

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.quantize import quantize
from service.pipeline.mesh import build_mesh
from service.surface.bezier import BezierSurface
from service.surface.lowered import PatchModel
from tools.benchmarks.alternately import measure_alternately
from tools.benchmarks.evaluation import build_hills
from tools.examples import lower_patches

GLB = BY_NAME["glb"]
FORMS = {
    "plain": EncodeOptions(),
    "quantize": EncodeOptions(quantize=True),
    "meshopt": EncodeOptions(compression="meshopt"),
    "both": EncodeOptions(quantize=True, compression="meshopt"),
}
GZIP_LEVEL = 6
"""The level of compression by gzip: the default of zlib, not of `gzip.compress`."""


def run() -> None:
    """Prints the tables."""
    patch = BezierSurface(build_hills(1, 3).points[0]).lower()
    models = (
        ("teapot at 16 divisions", lower_patches("utah-teapot"), 16),
        ("1 bicubic patch at 512 divisions", patch, 512),
    )
    print("GLB with normals from a mesh; CPU time, medians of alternating rounds")
    print(f"{'mesh':38}{'ours ms':>10}{'trimesh ms':>12}{'ours / trimesh':>16}")
    for title, model, divisions in models:
        compare_with_trimesh(title, model, MeshOptions(resolution=(divisions, divisions)))
    print()
    print("Every encoder on the teapot at 16 divisions")
    print(f"{'format':38}{'ms':>10}{'bytes':>12}")
    for fmt in FORMATS:
        mesh = build_mesh(lower_patches("utah-teapot"), MeshOptions(), fmt)
        seconds = measure_alternately(
            {fmt.name: partial(fmt.encode, mesh, EncodeOptions())}, rounds=5
        )
        size = len(fmt.encode(mesh, EncodeOptions()))
        print(f"{fmt.title:38}{seconds[fmt.name] * 1e3:10.2f}{size:12}")
    print()
    print("Compact GLB with normals, from a mesh; CPU time, medians of alternating rounds")
    print(
        f"{'mesh':34}{'form':>10}{'ms':>8}{'bytes':>11}{'/ plain':>8}"
        f"{'gzip ms':>9}{'gzip bytes':>11}"
    )
    for title, model, divisions in models:
        compare_compact(title, model, MeshOptions(resolution=(divisions, divisions)))


def compare_with_trimesh(title: str, model: PatchModel, options: MeshOptions) -> None:
    """Prints a row: the times in which the service and trimesh encode the same arrays as GLB."""
    mesh = build_mesh(model, options, GLB)
    trimesh_mesh = trimesh.Trimesh(
        mesh.positions, mesh.triangles, vertex_normals=mesh.normals, process=False
    )
    encoders: dict[str, Callable[[], object]] = {
        "ours": partial(GLB.encode, mesh, EncodeOptions()),
        "trimesh": partial(trimesh_mesh.export, file_type="glb", include_normals=True),
    }
    times = measure_alternately(encoders, rounds=7)
    ratio = times["ours"] / times["trimesh"]
    print(f"{title:38}{times['ours'] * 1e3:10.2f}{times['trimesh'] * 1e3:12.2f}{ratio:16.3f}")


def compare_compact(title: str, model: PatchModel, options: MeshOptions) -> None:
    """Prints a row for each form of GLB.

    Its columns: the time to make the file, its bytes, and their ratio to the bytes of plain GLB;
    then the time to compress the file by gzip, and the bytes of the result.
    """
    mesh = build_mesh(model, options, GLB)

    def write(form: EncodeOptions) -> bytes:
        quantized = quantize(mesh, model, options) if form.quantize else mesh
        assert isinstance(quantized, Mesh)
        return bytes(GLB.encode(quantized, form))

    writers = {name: partial(write, form) for name, form in FORMS.items()}
    files = {name: writer() for name, writer in writers.items()}
    times = measure_alternately(writers, rounds=5)
    compressors = {name: partial(gzip.compress, file, GZIP_LEVEL) for name, file in files.items()}
    gzip_times = measure_alternately(compressors, rounds=3)
    for name, file in files.items():
        ratio = len(file) / len(files["plain"])
        print(
            f"{title:34}{name:>10}{times[name] * 1e3:8.2f}{len(file):11}{ratio:8.2f}"
            f"{gzip_times[name] * 1e3:9.1f}{len(compressors[name]()):11}"
        )
