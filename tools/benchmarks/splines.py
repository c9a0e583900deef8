"""Large B-splines, step by step, beside scipy's evaluation of the same samples."""

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.interpolate import NdBSpline

from service.engine.closure import closure
from service.engine.evaluation.evaluate import evaluate
from service.engine.options import MeshOptions
from service.engine.stitch import find_seams
from service.engine.tessellate import tessellate
from service.settings.process import pin_blas
from service.surface.batches import TensorPatches
from service.surface.bspline import BsplineSurface
from service.surface.lowered import PatchModel
from tests.strategies import Array
from tools.benchmarks.alternately import alternately

WORKS = (
    (10, (3, 3), 16, False),
    (100, (3, 3), 4, False),
    (100, (3, 3), 4, True),
    (300, (3, 3), 2, False),
    (30, (12, 12), 16, False),
)
"""Spans in each direction, degree, divisions of each, whether there are weights."""


def field(spans: int, degree: tuple[int, int], rational: bool) -> BsplineSurface:
    """A uniform B-spline over a grid, without pattern."""
    rng = np.random.default_rng(3)
    shape = spans + degree[0], spans + degree[1]
    x, y = np.meshgrid(*map(np.arange, shape), indexing="ij")
    net = np.stack([x, y, rng.uniform(-1, 1, shape)], axis=-1)
    weights = rng.uniform(0.2, 5, shape) if rational else None
    return BsplineSurface(net, degree, ("uniform", "uniform"), weights)


def by_scipy(surface: BsplineSurface, spans: int, divisions: int) -> Callable[[], Array]:
    """The points alone at all samples, each seam once."""
    net = surface.control_net
    if surface.weights is not None:
        weights = surface.weights[..., np.newaxis]
        net = np.concatenate([net * weights, weights], axis=-1)
    spline = NdBSpline(surface.knot_vectors, net, surface.degree)
    line = np.linspace(0, spans, spans * divisions + 1)
    places = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1)

    def points() -> Array:
        values: Array = spline(places)
        return values if surface.weights is None else values[..., :3] / values[..., 3:]

    return points


def steps(model: PatchModel, divisions: int) -> dict[str, Callable[[], object]]:
    """What a mesh of the model is made of, and the whole of it."""
    resolution = divisions, divisions
    (batch,) = model.batches
    assert isinstance(batch, TensorPatches)
    return {
        "seams": partial(find_seams, model.batches),
        "closure": partial(closure, model),
        "evaluate": partial(evaluate, batch, resolution),
        "mesh": partial(tessellate, model, MeshOptions(resolution=resolution)),
    }


def run() -> None:
    """Prints the table."""
    print("B-splines, ms of CPU time; `evaluate` gives points and normals, scipy points alone")
    names = ("lower", "seams", "closure", "evaluate", "mesh", "scipy")
    print(f"{'surface':44}" + "".join(f"{name:>10}" for name in names))
    for spans, degree, divisions, rational in WORKS:
        surface = field(spans, degree, rational)
        rivals: dict[str, Callable[[], object]] = {
            "lower": surface.lower,
            **steps(surface.lower(), divisions),
            "scipy": by_scipy(surface, spans, divisions),
        }
        times = alternately(rivals, rounds=3)
        kind = " rational" if rational else ""
        title = f"{spans} × {spans} spans of degree {degree}{kind} at {divisions}"
        print(f"{title:44}" + "".join(f"{times[name] * 1e3:10.1f}" for name in names))


if __name__ == "__main__":
    pin_blas()
    run()
