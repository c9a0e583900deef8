"""Compact GLB: how many bytes it has, alone and after gzip, and how long it takes to make."""

import gzip
from collections.abc import Callable
from functools import partial

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.gridded import gridded
from service.engine.options import MeshOptions
from service.pipeline.mesh import build_mesh
from service.settings.process import pin_blas
from service.surface.bezier import BezierSurface
from service.surface.lowered import PatchModel
from tests.examples import patches_of
from tools.benchmarks.alternately import alternately
from tools.benchmarks.evaluation import hills

FORMS = {
    "plain": EncodeOptions(),
    "quantize": EncodeOptions(quantize=True),
    "meshopt": EncodeOptions(compression="meshopt"),
    "both": EncodeOptions(quantize=True, compression="meshopt"),
}
LEVEL = 6
"""Of gzip: what zlib takes where nothing is said."""


def writer(model: PatchModel, options: MeshOptions, encode: EncodeOptions) -> Callable[[], bytes]:
    """What writes the file of a model whose mesh is made already."""
    glb = BY_NAME["glb"]
    made = build_mesh(model, options, glb)

    def write() -> bytes:
        on = gridded(made, model, options) if encode.quantize else made
        return glb.write(on, encode)

    return write


def run() -> None:
    """Prints the table."""
    print("Compact GLB with normals, beyond the mesh itself; CPU time, alternating rounds")
    print(f"{'mesh':34}{'form':>10}{'ms':>8}{'bytes':>11}{'share':>8}{'gzip ms':>9}{'gzip':>11}")
    square = BezierSurface(hills(1, 3).points[0]).lower()
    works = (
        ("teapot at 16 divisions", patches_of("utah-teapot"), 16),
        ("1 bicubic patch at 512 divisions", square, 512),
    )
    for title, model, divisions in works:
        options = MeshOptions(resolution=(divisions, divisions))
        writers = {name: writer(model, options, form) for name, form in FORMS.items()}
        files = {name: write() for name, write in writers.items()}
        times = alternately(writers, rounds=5)
        zipped = {name: partial(gzip.compress, file, LEVEL) for name, file in files.items()}
        gzips = alternately(zipped, rounds=3)
        for name, file in files.items():
            share = len(file) / len(files["plain"])
            print(
                f"{title:34}{name:>10}{times[name] * 1e3:8.2f}{len(file):11}{share:8.2f}"
                f"{gzips[name] * 1e3:9.1f}{len(zipped[name]()):11}"
            )


if __name__ == "__main__":
    pin_blas()
    run()
