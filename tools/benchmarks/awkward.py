"""Valid surfaces at their dearest: patches whose normals the working precision cannot vouch for."""

from functools import partial

import numpy as np

from service.engine.evaluation.evaluate import evaluate
from service.engine.scratch import Real
from service.settings.process import pin_blas
from service.surface.batches import TensorPatches
from tools.benchmarks.alternately import alternately


def nets(degree: int) -> dict[str, TensorPatches]:
    """Nets of one patch each, by what is awkward about them."""
    shape = (1, degree + 1, degree + 1)
    random = np.random.default_rng(1).random((*shape, 3))
    far = np.stack(np.meshgrid(*[np.arange(degree + 1.0)] * 2, [0.0], indexing="ij"), axis=-1)
    far = far[np.newaxis, :, :, 0].copy()
    far[0, degree // 2, degree // 2] = 1e6
    line = np.repeat(np.arange(degree + 1.0), degree + 1).reshape(*shape, 1) * (1.0, 2.0, 3.0)
    step = np.zeros((*shape, 3))
    step[:, degree // 2 :, :, 0] = step[:, :, degree // 2 :, 1] = 1.0
    return {
        "random": TensorPatches(random),
        "random, rational": TensorPatches(random, 0.2 + random[..., 0]),
        "one point far away": TensorPatches(far),
        "all on a line": TensorPatches(line),
        "a step": TensorPatches(step),
    }


def run() -> None:
    """Prints the table."""
    print("One patch at 99 x 99 samples; CPU milliseconds")
    print(f"{'net':38}{'degree':>8}{'float32':>10}{'float64':>10}")
    kinds: tuple[Real, ...] = (np.float32, np.float64)
    for degree in (3, 15, 64):
        for title, patches in nets(degree).items():
            times = [
                alternately({title: partial(evaluate, patches, (98, 98), dtype=kind)}, 3)[title]
                for kind in kinds
            ]
            print(f"{title:38}{degree:8}" + "".join(f"{t * 1e3:10.1f}" for t in times))


if __name__ == "__main__":
    pin_blas()
    run()
