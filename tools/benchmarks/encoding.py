"""Our GLB against trimesh's, and every encoder on the teapot."""

from collections.abc import Callable
from functools import partial

import trimesh

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.mesh import Mesh
from service.engine.options import MeshOptions
from service.pipeline.mesh import build_mesh
from service.settings.process import pin_blas
from service.surface.bezier import BezierSurface
from tests.examples import patches_of
from tools.benchmarks.alternately import alternately
from tools.benchmarks.evaluation import hills


def by_trimesh(made: Mesh) -> Callable[[], object]:
    """GLB by trimesh from the same arrays, normals included."""
    whole = trimesh.Trimesh(
        made.positions, made.triangles, vertex_normals=made.normals, process=False
    )
    return lambda: whole.export(file_type="glb", include_normals=True)


def run() -> None:
    """Prints both tables."""
    print("GLB with normals from a mesh; CPU time, medians of alternating rounds")
    print(f"{'mesh':38}{'ours ms':>10}{'trimesh ms':>12}{'ours / trimesh':>16}")
    glb = BY_NAME["glb"]
    square = BezierSurface(hills(1, 3).points[0]).lower()
    works = (
        ("teapot at 16 divisions", patches_of("utah-teapot"), 16),
        ("1 bicubic patch at 512 divisions", square, 512),
    )
    for title, model, divisions in works:
        made = build_mesh(model, MeshOptions(resolution=(divisions, divisions)), glb)
        rivals: dict[str, Callable[[], object]] = {
            "ours": partial(glb.encode, made, EncodeOptions()),
            "trimesh": by_trimesh(made),
        }
        times = alternately(rivals, rounds=7)
        ours, theirs = times["ours"], times["trimesh"]
        print(f"{title:38}{ours * 1e3:10.2f}{theirs * 1e3:12.2f}{ours / theirs:16.3f}")
    print()
    print("Every encoder on the teapot at 16 divisions")
    print(f"{'format':38}{'ms':>10}{'bytes':>12}")
    model = patches_of("utah-teapot")
    for fmt in FORMATS:
        made = build_mesh(model, MeshOptions(), fmt)
        seconds = alternately({fmt.name: partial(fmt.encode, made, EncodeOptions())}, rounds=5)
        size = len(fmt.encode(made, EncodeOptions()))
        print(f"{fmt.title:38}{seconds[fmt.name] * 1e3:10.2f}{size:12}")


if __name__ == "__main__":
    pin_blas()
    run()
