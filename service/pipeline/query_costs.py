"""The cost of queries: points, closest points, hits of rays, sections and measures.

Costs are upper bounds, coarse and safe.
"""

from dataclasses import replace

from service.encoders import json_points
from service.engine.measures.integrals import NODES
from service.pipeline.cost import MIN_SCRATCH_BYTES, Cost, lowering_memory, with_scratch
from service.surface.sizes import SurfaceSize

PLACE_BYTES = 400
"""Bytes of memory for each place of a query."""

SIGN_BYTES = 64 << 20
"""Bytes of the array of pairs (point, cell) while signs are computed."""

MEASURE_POINT_BYTES, MEASURE_BATCH_BYTES = 128, 64 << 20
"""Bytes for each control point of the cells of a measure, and of the work arrays of a batch."""

CELL_BYTES, MAX_CELL_BYTES = 1000, 384 << 20
"""Bytes for each patch of a query, in addition to its net; and the most bytes of all cells and of
all pairs of a query and a cell together."""

HIT_BYTES, HIT_JSON_BYTES = 1000, 360
"""The most bytes of a hit of a ray: in memory, and in JSON."""

PIECE_BYTES, PIECE_POINT_BYTES, SECTION_BATCH_BYTES = 700, 40, 64 << 20
"""Bytes for each piece of a section, for each control point of its patch, and for the work arrays
that compare planes with patches."""


def points_cost(size: SurfaceSize, count: int, order: int) -> Cost:
    """The cost of evaluating a surface at `count` places, with partials up to `order`."""
    file = json_points.byte_bound(count, order)
    memory = with_scratch(lowering_memory(size) + PLACE_BYTES * count + 2 * file)
    degree = max(size.degree)
    work = 5e-4 + 4e-6 * size.patches + 2e-9 * size.peak
    work += count * (order + 1) * 1e-5 * max(1, degree / 4) ** 3
    return Cost(count, 0, file, memory, work)


def project_cost(
    patches: int, degree: tuple[int, int], surface_memory: int, count: int, file: int, *, sign: bool
) -> Cost:
    """The cost of finding the closest points to `count` points.

    Parameters
    ----------
    patches : int
        Number of nets that are searched.
    degree : (int, int)
        Their degree (p, q).
    surface_memory, file : int
        Bytes of the surface, and of the response.
    count : int
        Number of points.
    sign : bool
        Whether signs are computed, too. Signs need the seams of the surface, and the cells a second
        time.
    """
    p, q = degree
    net = CELL_BYTES + 2 * 32 * (p + 1) * (q + 1)
    memory = (
        MIN_SCRATCH_BYTES + surface_memory + patches * net + min(MAX_CELL_BYTES, count * net * 64)
    )
    work = 5e-3 + 1e-4 * patches + count * 1e-4 * max(1.0, p * q / 9)
    if sign:
        memory += 4 * surface_memory + SIGN_BYTES
        work = 1e-2 + 4 * work
    return Cost(count, 0, file, memory + PLACE_BYTES * count + 2 * file, work)


def rays_cost(
    patches: int, degree: tuple[int, int], surface_memory: int, count: int, hits: int
) -> Cost:
    """The cost of finding at most `hits` hits of `count` rays.

    The search is on `patches` nets of the degree `degree`; `surface_memory` is the number of bytes
    of the surface.
    """
    file = 1000 + count * 16 + hits * HIT_JSON_BYTES
    base = project_cost(patches, degree, surface_memory, count, file, sign=False)
    return replace(base, memory=base.memory + HIT_BYTES * hits)


def piece_memory(net: int, file: int) -> int:
    """Bytes of memory for each piece of a section.

    `net` is the number of control points of a patch, and `file` the bytes of 1,000 pieces in the
    file.
    """
    return PIECE_BYTES + PIECE_POINT_BYTES * net + 2 * file // 1000


def sections_cost(size: SurfaceSize, planes: int, pieces: int, piece_bytes: int) -> Cost:
    """The cost of sections by `planes` planes; `piece_bytes` bytes for each of the `pieces`."""
    net = CELL_BYTES + 2 * 32 * (size.degree[0] + 1) * (size.degree[1] + 1)
    memory = SECTION_BATCH_BYTES + lowering_memory(size) + 3 * size.patches * net
    work = 2e-2 + 1e-4 * size.patches + 5e-3 * planes
    return Cost(pieces, 0, pieces * piece_bytes, memory + pieces * piece_bytes, work)


def measure_effort(degree: tuple[int, int]) -> int:
    """The least number of multiplications that measuring one patch of this degree takes."""
    p, q = max(degree), min(degree)
    nodes = max(NODES, 2 * p)
    return 18 * nodes * (q + 1) * (p + 1 + nodes) + 200 * nodes**2


def measure_cost(size: SurfaceSize, budget: int, file: int) -> Cost:
    """The cost of measures.

    All cells together have at most `budget` control points more than the patches have, or 3 times
    the number of the patches, whichever is more. `file` is the number of bytes of the response.
    """
    (p, q), nets = size.degree, size.grids + 3 * size.triangles
    points = nets * (p + 1) * (q + 1)
    memory = (
        2 * lowering_memory(size)
        + MEASURE_POINT_BYTES * max(3 * points, budget + points)
        + MEASURE_BATCH_BYTES
    )
    work = 0.1 + 3e-9 * measure_effort(size.degree) * size.patches
    return Cost(0, 0, file, memory + 2 * file, work)
