"""Evaluation against its floor: copying the result once, warm.

Seven works, float32 positions and unit normals; every formulation that is fit for the shape is
shown, the one that `evaluate` chooses is marked. The last column is the figure to keep: half as
much again as the best that was reached on the machine on which the formulations were found.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from service.engine.evaluate import Formulation, choose, evaluate
from service.surface.examples import find
from service.surface.lowered import TensorPatches
from tests.benchmarks.alternately import alternately


@dataclass(frozen=True)
class Work:
    """One shape of work, and the multiple of a copy that it may cost."""

    title: str
    patches: TensorPatches
    divisions: int
    allowed: float


def hills(count: int, degree: int) -> TensorPatches:
    """Patches over a regular grid with small pseudo-random heights, the same in every run."""
    steps = np.arange(degree + 1.0)
    flat = np.stack(np.meshgrid(steps, steps, [0.0], indexing="ij"), axis=-1)[:, :, 0]
    return TensorPatches(flat + 0.3 * np.random.default_rng(1).random((count, *flat.shape)))


def works() -> list[Work]:
    """The seven works of the record."""
    teapot = find("utah-teapot").surface().lower().batches[0]
    return [
        Work("1 bicubic patch, 65 x 65", hills(1, 3), 64, 1.5 * 18),
        Work("1 bicubic patch, 513 x 513", hills(1, 3), 512, 1.5 * 3.5),
        Work("1 bicubic patch, 2049 x 2049", hills(1, 3), 2048, 1.5 * 2.0),
        Work("teapot, 32 bicubic patches, 17 x 17", teapot, 16, 1.5 * 18),
        Work("10 000 bicubic patches, 9 x 9", hills(10_000, 3), 8, 1.5 * 4.3),
        Work("100 000 bicubic patches, 5 x 5", hills(100_000, 3), 4, 1.5 * 4.8),
        Work("degree 15 x 15, 129 x 129", hills(1, 15), 128, 1.5 * 22),
    ]


def rivals(work: Work) -> list[Formulation]:
    """The formulations worth timing on this shape."""
    samples = (work.divisions + 1) ** 2
    fit: list[Formulation] = []
    if samples * (work.patches.degree[0] + 1) ** 2 <= 1e5:
        fit.append("kronecker")
    if work.patches.count < 1000:
        fit.append("separable")
        if samples >= 4000 and work.patches.degree[0] <= 5:
            fit.append("normal_polynomial")
    return fit


def run() -> None:
    """Prints the table."""
    print("Evaluation, float32 positions and normals; CPU time, medians of alternating rounds")
    print(f"{'work':38}{'formulation':20}{'ns/vertex':>10}{'x copy':>9}{'allowed':>9}")
    for work in works():
        measure(work)


def measure(work: Work) -> None:
    """Prints the lines of one work."""
    resolution = (work.divisions, work.divisions)
    result = evaluate(work.patches, resolution, dtype=np.float32)
    assert result.normals is not None
    sources = (result.positions, result.normals)
    copies = tuple(np.empty_like(source) for source in sources)

    def copy() -> None:
        for target, source in zip(copies, sources, strict=True):
            np.copyto(target, source)

    def evaluation(formulation: Formulation) -> Callable[[], object]:
        return lambda: evaluate(
            work.patches, resolution, dtype=np.float32, formulation=formulation, out=result
        )

    chosen = choose(work.patches, resolution, True)
    calls: dict[str, Callable[[], object]] = {name: evaluation(name) for name in rivals(work)}
    times = alternately({"copy": copy, **calls}, rounds=9)
    vertices = result.positions.size / 3
    for name in calls:
        ratio = times[name] / times["copy"]
        mark = " *" if name == chosen else ""
        allowed = f"{work.allowed:9.1f}" if name == chosen else ""
        print(
            f"{work.title:38}{name + mark:20}{times[name] / vertices * 1e9:10.1f}"
            f"{ratio:9.1f}{allowed}"
        )


if __name__ == "__main__":
    run()
