"""How long dear work goes on after nobody wants it: the longest time between two checkpoints."""

import time

import numpy as np

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.adaptive.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.errors import TooLarge
from service.pipeline.mesh import Lowerable, plan
from service.settings.process import pin_blas
from service.stopping import Stop, stopped_by
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.examples import find


class Watch(Stop):
    """Never stops; measures how often it could have."""

    def __init__(self) -> None:
        super().__init__()
        self.longest = 0.0
        self._last = time.perf_counter()

    def check(self) -> None:
        now = time.perf_counter()
        self.longest = max(self.longest, now - self._last)
        self._last = now


def net(rows: int, columns: int) -> np.ndarray:
    """Hills over the unit square, shape (rows, columns, 3)."""
    u, v = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
    return np.stack([u, v, np.sin(9 * u) * np.cos(7 * v)], axis=-1)


def works() -> dict[str, tuple[Lowerable, MeshOptions, str]]:
    """Dear requests, by what is dear about them."""
    patch, high = BezierSurface(net(4, 4)), BezierSurface(net(65, 65))
    spline = BsplineSurface(net(300, 300), (3, 3))
    fine = MeshOptions(resolution=(1000, 1000))
    near = MeshOptions(accuracy=Accuracy(relative_tolerance=1e-5))
    return {
        **{f"a million vertices as {name}": (patch, fine, name) for name in ("glb", "ply", "stl")},
        "half a million as OBJ": (patch, MeshOptions(resolution=(700, 700)), "obj"),
        "degree 64": (high, fine, "glb"),
        "degree 64, near": (high, near, "glb"),
        "300 x 300 control points": (spline, MeshOptions(resolution=(2, 2)), "glb"),
        "300 x 300 control points, near": (spline, near, "glb"),
        "a tube": (find("trefoil-tube").surface(), MeshOptions(resolution=(2000, 2000)), "glb"),
        "budget": (patch, MeshOptions(accuracy=Accuracy(max_triangles=100_000)), "glb"),
    }


def run() -> None:
    """Prints the table."""
    print(f"{'work':36}{'seconds':>9}{'longest ms':>12}")
    for title, (surface, options, fmt) in works().items():
        watch, start = Watch(), time.perf_counter()
        with stopped_by(watch):
            try:
                plan(surface, options, BY_NAME[fmt], EncodeOptions()).run()
                how = ""
            except TooLarge:  # known only on the way
                how = "  refused"
        watch.check()
        seconds = time.perf_counter() - start
        print(f"{title:36}{seconds:9.2f}{watch.longest * 1e3:12.0f}{how}")


if __name__ == "__main__":
    pin_blas()
    run()
