"""The random surface at 49 × 39 divisions, line by line as the program of 1996 printed it.

The program is written here again, by its published formula: Paul Bourke, "Bézier surfaces (in
3D)". Binomial coefficients are multiplied and divided factor by factor and powers taken with
`pow`, so that its sums differ in the last bits from those of any other formula; six significant
digits do not show it.
"""

import json
from collections.abc import Iterator
from pathlib import Path

from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface import examples

NET = Path(examples.__file__).parent / "data" / "bourke-1111.json"
SAMPLES = 50, 40
"""Points the program samples along u and v."""

Point = tuple[float, float, float]


def blend(k: int, mu: float, n: int) -> float:
    """Bernstein polynomial B_k^n(mu), factor by factor."""
    value = 1.0
    nn, kn, nkn = n, k, n - k
    while nn >= 1:
        value *= nn
        nn -= 1
        if kn > 1:
            value /= kn
            kn -= 1
        if nkn > 1:
            value /= nkn
            nkn -= 1
    if k > 0:
        value *= mu**k
    if n - k > 0:
        value *= (1 - mu) ** (n - k)
    return value


def sample(net: list[list[Point]], i: int, j: int) -> Point:
    """Point (i, j) of the sampled surface."""
    n, m = len(net) - 1, len(net[0]) - 1
    mui, muj = i / (SAMPLES[0] - 1), j / (SAMPLES[1] - 1)
    x = y = z = 0.0
    for ki, row in enumerate(net):
        bi = blend(ki, mui, n)
        for kj, point in enumerate(row):
            bj = blend(kj, muj, m)
            x += point[0] * bi * bj
            y += point[1] * bi * bj
            z += point[2] * bi * bj
    return x, y, z


def run_program(net: list[list[Point]]) -> Iterator[str]:
    """The lines of its output."""
    points = [[sample(net, i, j) for j in range(SAMPLES[1])] for i in range(SAMPLES[0])]
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


def test_every_line_is_that_of_the_program() -> None:
    net = json.loads(NET.read_text(encoding="utf-8"))["control_net"]
    expected = [line.rstrip() for line in run_program(net)]
    assert render_surface().decode("ascii").splitlines() == expected
    assert sum(line.endswith("1 1 1 1") for line in expected) == 4 * 1911
    assert sum(line.startswith("{ = SKEL") for line in expected) == 20
