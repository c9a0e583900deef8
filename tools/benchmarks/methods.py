"""Measures time and error of the methods of evaluation: the tables of docs/methods.md.

Times are CPU times for positions and normals, divided by the time of `matrix`; the methods run
alternately. Errors are the largest error of a position, divided by the extent of the net. They are
measured by exact arithmetic; at many divisions by `matrix` in float64, whose error is 1e-15.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from oracles import exact
from service.engine.evaluation.evaluate import evaluate
from service.engine.evaluation.forward_difference import MAX_DEGREE
from service.engine.options import Method
from service.engine.scratch import Real
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from tools.benchmarks.alternately import measure_alternately
from tools.examples import lower_example

METHODS: tuple[Method, ...] = ("matrix", "de_casteljau", "forward_difference")
DIVISIONS = (64, 256, 1024, 4096)
DEGREES = (1, 2, 3, 5, 8, 16)


def build_random_patches(p: int, q: int, *, weights: bool = False, count: int = 1) -> TensorPatches:
    """Patches of independent control points and weights from 0.2 to 5, the same in every run."""
    rng = np.random.default_rng(p + 100 * q)
    shape = (count, p + 1, q + 1)
    points = rng.uniform(-1, 1, (*shape, 3))
    return TensorPatches(points, rng.uniform(0.2, 5, shape) if weights else None)


def list_cases() -> list[tuple[str, Patches, int]]:
    """The cases: title, patches, and number of divisions."""
    teapot = lower_example("utah-teapot")
    cubic = np.random.default_rng(3).uniform(-1, 1, (1, 10, 3))
    return [
        ("bilinear, 257 x 257", build_random_patches(1, 1), 256),
        ("bicubic, 257 x 257", build_random_patches(3, 3), 256),
        ("teapot, 32 x 17 x 17", teapot, 16),
        ("1000 bicubics, 9 x 9", build_random_patches(3, 3, count=1000), 8),
        ("rational 3 x 5, 129 x 129", build_random_patches(3, 5, weights=True), 128),
        ("rational 8 x 8, 65 x 65", build_random_patches(8, 8, weights=True), 64),
        ("15 x 15, 65 x 65", build_random_patches(15, 15), 64),
        ("cubic triangle, 256 rows", TrianglePatches(cubic), 256),
    ]


def run() -> None:
    """Prints the tables."""
    print_costs()
    print()
    print_errors()
    print()
    print_growth()


def print_costs() -> None:
    """Prints the CPU times of all methods, divided by that of `matrix`."""
    print("CPU time in multiples of matrix (ns a sample), float32 and float64; normals included")
    print(f"{'work':28}{'':9}" + "".join(f"{name:>24}" for name in METHODS))
    for title, patches, divisions in list_cases():
        for dtype in (np.float32, np.float64):
            times = measure_alternately(list_calls(patches, divisions, dtype), rounds=5)
            samples = evaluate(patches, (divisions, divisions), normals=False).positions.size / 3
            cells = "".join(
                f"{times[m] / times['matrix']:14.1f} ({times[m] / samples * 1e9:6.0f})"
                if m in times
                else f"{'-':>24}"
                for m in METHODS
            )
            print(f"{title:28}{dtype.__name__:9}{cells}")


def list_calls(patches: Patches, divisions: int, dtype: Real) -> dict[str, Callable[[], Any]]:
    """Calls of all methods that accept the degree of these patches, by name."""
    degree = max(patches.side_degrees)
    methods = [m for m in METHODS if m != "forward_difference" or degree <= MAX_DEGREE[dtype]]
    resolution = (divisions, divisions)
    return {m: partial(evaluate, patches, resolution, dtype=dtype, method=m) for m in methods}


def print_errors() -> None:
    """Prints the largest errors at 16 × 16 divisions, compared with exact fractions."""
    print("Largest error of a position at 16 x 16 divisions, divided by the extent")
    print(f"{'degree':28}{'':9}" + "".join(f"{name:>24}" for name in METHODS))
    for p, q, weights in ((3, 3, False), (3, 5, True), (8, 8, True), (16, 16, True)):
        patches = build_random_patches(p, q, weights=weights)
        patch_weights = None if patches.weights is None else patches.weights[0]
        truth = exact.positions(patches.points[0], patch_weights, (16, 16))
        for dtype in (np.float32, np.float64):
            calls = list_calls(patches, 16, dtype)
            errors = {m: np.abs(call().positions[0] - truth).max() for m, call in calls.items()}
            cells = "".join(
                f"{errors[m] / patches.extent:24.1e}" if m in errors else f"{'-':>24}"
                for m in METHODS
            )
            title = f"{'rational ' if weights else ''}{p} x {q}"
            print(f"{title:28}{dtype.__name__:9}{cells}")


def print_growth() -> None:
    """Prints the largest errors of forward differences by the number of divisions of a row."""
    print("Largest error of forward_difference, divided by the extent, by divisions of a row")
    print(f"{'degree':28}{'':9}" + "".join(f"{divisions:>12}" for divisions in DIVISIONS))
    for degree in DEGREES:
        patches = build_random_patches(2, degree, count=4)
        for dtype in (np.float32, np.float64):
            if degree > MAX_DEGREE[dtype]:
                continue
            cells = ""
            for divisions in DIVISIONS:
                differences = partial(evaluate, dtype=dtype, method="forward_difference")
                expected, positions = (
                    method(patches, (2, divisions), normals=False).positions
                    for method in (evaluate, differences)
                )
                cells += f"{np.abs(positions - expected).max() / patches.extent:12.1e}"
            print(f"{degree:<28}{dtype.__name__:9}{cells}")
