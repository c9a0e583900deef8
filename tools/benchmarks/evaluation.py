"""Measures the time of evaluation, in units of the time in which its result is copied once.

Each of the seven cases has float32 positions and unit normals. The table has the formulations that
may be fast for a case, and marks the formulation that `evaluate` chooses. The record is the time of
the best prototype, without poles or checks; the time of the service should be less than 1.5 times
the record. The record is a range, because times depend on other load of the memory.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from service.engine.evaluation.evaluate import Formulation, choose_formulation, evaluate
from service.surface.batches import TensorPatches
from tools.benchmarks.alternately import measure_alternately
from tools.examples import lower_example


@dataclass(frozen=True)
class Case:
    """A case, with the range of its record in units of the time of a copy."""

    title: str
    patches: TensorPatches
    divisions: int
    record: tuple[float, float]


def build_hills(count: int, degree: int) -> TensorPatches:
    """Patches near a regular grid, with small pseudo-random offsets, the same in every run."""
    steps = np.arange(degree + 1.0)
    flat = np.stack(np.meshgrid(steps, steps, [0.0], indexing="ij"), axis=-1)[:, :, 0]
    return TensorPatches(flat + 0.3 * np.random.default_rng(1).random((count, *flat.shape)))


def list_cases() -> list[Case]:
    """The seven cases."""
    teapot = lower_example("utah-teapot")
    return [
        Case("1 bicubic patch, 65 x 65", build_hills(1, 3), 64, (18, 22)),
        Case("1 bicubic patch, 513 x 513", build_hills(1, 3), 512, (3.5, 3.8)),
        Case("1 bicubic patch, 2049 x 2049", build_hills(1, 3), 2048, (2.0, 2.1)),
        Case("teapot, 32 bicubic patches, 17 x 17", teapot, 16, (18, 19)),
        Case("10 000 bicubic patches, 9 x 9", build_hills(10_000, 3), 8, (4.3, 5.2)),
        Case("100 000 bicubic patches, 5 x 5", build_hills(100_000, 3), 4, (4.8, 4.8)),
        Case("degree 15 x 15, 129 x 129", build_hills(1, 15), 128, (22, 24)),
    ]


def list_formulations(case: Case) -> list[Formulation]:
    """The formulations that may be fast for this case."""
    samples, p = (case.divisions + 1) ** 2, case.patches.degree[0]
    is_suitable: dict[Formulation, bool] = {
        "kronecker": samples * (p + 1) ** 2 <= 1e5,
        "separable": case.patches.count < 1000,
        "normal_polynomial": case.patches.count < 1000 and samples >= 4000 and p <= 5,
    }
    return [name for name, is_listed in is_suitable.items() if is_listed]


def run() -> None:
    """Prints the table."""
    print("Evaluation, float32 positions and normals; CPU time, medians of alternating rounds")
    print(
        f"{'work':38}{'formulation':20}{'ns/vertex':>10}{'x copy':>9}{'record':>13}{'x record':>14}"
    )
    for case in list_cases():
        print_case(case)


def print_case(case: Case) -> None:
    """Prints the lines of one case."""
    resolution = (case.divisions, case.divisions)
    result = evaluate(case.patches, resolution, dtype=np.float32)
    assert result.normals is not None
    arrays = np.stack([result.positions, result.normals])
    chosen = choose_formulation(case.patches, resolution, normals=True)
    call = partial(evaluate, case.patches, resolution, dtype=np.float32, out=result)
    calls: dict[str, Callable[[], object]] = {
        name: partial(call, formulation=name) for name in list_formulations(case)
    }
    copy = partial(np.copyto, np.empty_like(arrays), arrays)
    times = measure_alternately({"copy": copy, **calls}, rounds=9)
    for name in calls:
        per_vertex = times[name] * 1e9 / (result.positions.size / 3)  # 3 coordinates each
        ratio = times[name] / times["copy"]
        low, high = case.record
        comparison = f"{low:8.1f} -{high:5.1f}{ratio / high:7.2f} -{ratio / low:5.2f}"
        print(
            f"{case.title:38}{name + ' *' * (name == chosen):20}{per_vertex:10.1f}"
            f"{ratio:9.1f}{comparison if name == chosen else ''}"
        )
