"""OOGL of the example bourke-1111 is equal, line by line, to the output of a program of 1996.

This module repeats the program's published algorithm: Paul Bourke, "Bézier surfaces (in 3D)". It
multiplies and divides factor by factor, and so rounds differently from the engine in the last bits.
The files are equal, because the program prints only six significant digits.
"""

import json
from collections.abc import Iterator
from pathlib import Path

from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.examples import catalogue as examples

NET = Path(examples.__file__).parent / "data" / "bourke-1111.json"
SAMPLES = 50, 40
"""Samples of the program along u and v."""

Point = tuple[float, float, float]


def evaluate_basis(k: int, t: float, n: int) -> float:
    """The Bernstein polynomial B_k^n at the parameter `t`, factor by factor."""
    value = 1.0
    # n! is divided by the factors of k! and of (n − k)!.
    factor, first_divisor, second_divisor = n, k, n - k
    while factor >= 1:
        value *= factor
        factor -= 1
        if first_divisor > 1:
            value /= first_divisor
            first_divisor -= 1
        if second_divisor > 1:
            value /= second_divisor
            second_divisor -= 1
    if k > 0:
        value *= t**k
    if n - k > 0:
        value *= (1 - t) ** (n - k)
    return value


def compute_point(net: list[list[Point]], i: int, j: int) -> Point:
    """The sample (i, j) of the surface with this control net."""
    p, q = len(net) - 1, len(net[0]) - 1
    u, v = i / (SAMPLES[0] - 1), j / (SAMPLES[1] - 1)
    x = y = z = 0.0
    for k, row in enumerate(net):
        weight_u = evaluate_basis(k, u, p)
        for m, point in enumerate(row):
            weight_v = evaluate_basis(m, v, q)
            x += point[0] * weight_u * weight_v
            y += point[1] * weight_u * weight_v
            z += point[2] * weight_u * weight_v
    return x, y, z


def run_program(net: list[list[Point]]) -> Iterator[str]:
    """The lines that the program prints: a quadrilateral for each cell, then the control net."""
    points = [[compute_point(net, i, j) for j in range(SAMPLES[1])] for i in range(SAMPLES[0])]
    corners = (0, 0), (0, 1), (1, 1), (1, 0)
    yield "LIST"
    yield "{ = CQUAD"
    for i in range(SAMPLES[0] - 1):
        for j in range(SAMPLES[1] - 1):
            for di, dj in corners:
                yield "{:g} {:g} {:g} 1 1 1 1".format(*points[i + di][j + dj])
    yield "}"
    for i in range(len(net) - 1):
        for j in range(len(net[0]) - 1):
            yield "{ = SKEL 4 1  "
            for di, dj in corners:
                yield "{:g} {:g} {:g} ".format(*net[i + di][j + dj])
            yield "5 0 1 2 3 0"
            yield "}"


def render_surface() -> bytes:
    surface = examples.find("bourke-1111").surface()
    options = MeshOptions(resolution=(49, 39), overlays=("control_net",))
    return render(surface, options, BY_NAME["oogl"])


def test_every_line_is_equal_to_a_line_of_the_program() -> None:
    net = json.loads(NET.read_text(encoding="utf-8"))["control_net"]
    expected = [line.rstrip() for line in run_program(net)]
    assert render_surface().decode("ascii").splitlines() == expected
    # 49 × 39 cells of the surface, and 5 × 4 cells of the control net.
    assert sum(line.endswith("1 1 1 1") for line in expected) == 4 * 49 * 39
    assert sum(line.startswith("{ = SKEL") for line in expected) == 5 * 4
