"""Meshes of Open CASCADE for the judge, if `make judge-peers` has installed it."""

import atexit
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

from service.surface.given_mesh import GivenMesh
from service.surface.sizes import SurfaceKind
from tools.judge_meshes.meshes import drop_points
from tools.judge_peers.cases import write_step
from tools.judge_peers.running import MAKERS, Runner


@cache
def _start() -> Runner | None:
    """The maker of this process; None if it is not installed."""
    runner = Runner(MAKERS[0], Path(mkdtemp()))
    if not runner.python.exists():
        return None
    atexit.register(runner.close)
    return runner


def mesh_by_open_cascade(surface: SurfaceKind, tolerance: float) -> GivenMesh | None:
    """The mesh; None without Open CASCADE, or if it makes none of this surface."""
    runner = _start()
    step = write_step(surface, runner.folder / "surface.step") if runner else None
    if runner is None or step is None:
        return None
    made = runner.make("surface", 0.0, {"file": str(step), "tolerance": tolerance})
    runner.slow.clear()
    if made.vertices is None or made.faces is None:
        return None
    return drop_points(made.vertices, made.faces)
