"""The cost of queries: points, closest points, hits of rays, sections and measures.

Sizes and memory are upper bounds, coarse and safe; the time is approximate.
"""

from dataclasses import replace
from typing import NamedTuple

from service.encoders.content import SKIPPED_FACE_CHARS
from service.encoders.json_mesh import points_bound
from service.engine.measures.integrals import NODES
from service.engine.measures.patch_cells import CHUNK
from service.engine.parts.points import CHUNK as PLACED_NUMBERS
from service.pipeline.brep_cost import prepared_bytes
from service.pipeline.cost import MIN_SCRATCH_BYTES, Cost, lowering_memory, with_scratch
from service.surface.sizes import SurfaceSize

ITEM_BYTES = 400
"""Bytes of memory for each item of a query: a place, a point or a ray."""

INSIDE_BYTES = 64 << 20
"""Bytes of the arrays of pairs (point, piece of a border) while trims are honoured."""

PLACED_BYTES = 40
"""Bytes for each number of the nets that are placed together."""

PREPARING_SECONDS, INSIDE_SECONDS = 4e-3, 1e-5
"""Time to prepare a face, and to find whether a point is inside the trims of its face."""

SIGN_BYTES = 64 << 20
"""Bytes of the array of pairs (point, cell) while signs are computed."""

MEASURE_POINT_BYTES, MEASURE_CELL_BYTES, MEASURE_ARRAYS = 192, 400, 12
"""Bytes for each control point of the cells of a measure while the cells are halved, and for each
cell in addition; and the number of work arrays of a batch of cells, each of which has at most
`CHUNK` numbers, or those of one cell if these are more."""

PANEL_BYTES, LENGTH_BYTES, MEASURING_SECONDS = 4000, 300, 1e-2
"""Bytes for each piece of a border, and for each patch of a face, while a part is measured; bytes
for each length of an edge; and the time for a face."""

CELL_BYTES, MAX_CELL_BYTES = 1000, 384 << 20
"""Bytes for each cell of a search, in addition to its net; and the most bytes of all cells, and of
all pairs of a cell and a point or ray, together."""

HIT_BYTES, HIT_JSON_BYTES = 1000, 360
"""The most bytes of a hit of a ray: in memory, and in JSON."""

PIECE_BYTES, PIECE_POINT_BYTES, SECTION_BATCH_BYTES = 700, 40, 64 << 20
"""Bytes for each piece of a section, for each control point of its patch, and for the work arrays
that compare planes with patches."""


def points_cost(size: SurfaceSize, count: int, order: int) -> Cost:
    """The cost of evaluating a surface at `count` places, with partials up to `order`."""
    file_bytes = points_bound(count, order)
    memory = with_scratch(lowering_memory(size) + ITEM_BYTES * count + 2 * file_bytes)
    degree = max(size.degree)
    if size.faces or size.members > 1:
        net = 3 * (size.degree[0] + 1) * (size.degree[1] + 1)
        memory += PLACED_BYTES * min(PLACED_NUMBERS + net, count * net)
    seconds = 5e-4 + 4e-6 * size.patches + 2e-9 * size.peak_bytes
    seconds += count * (order + 1) * 1e-5 * max(1, degree / 4) ** 3
    if size.faces:
        memory += prepared_bytes(size) + INSIDE_BYTES
        seconds += PREPARING_SECONDS * size.defined_faces + INSIDE_SECONDS * count
    return Cost(memory, seconds, file_bytes)


class SearchedNets(NamedTuple):
    """The nets that a query searches: their number, their degree, and the bytes of the surface.

    `scratch` are bytes of temporary arrays of breps, and `seconds` is the time to prepare them.
    """

    number: int
    degree: tuple[int, int]
    surface_memory: int
    scratch: int = 0
    seconds: float = 0.0


def searched_nets(size: SurfaceSize) -> SearchedNets:
    """The nets of a surface, at most: a triangular patch may become three nets.

    They are counted as if all patches were triangular. Breps have nets of the spans of surfaces and
    of edges. `size` counts each member of a group: all members are placed.
    """
    number = 3 * size.patches + size.face_patches + size.edge_pieces
    memory = size.peak_bytes + (size.surface_bytes if size.members > 1 else 0)
    if not size.faces:
        return SearchedNets(number, size.degree, memory)
    seconds = PREPARING_SECONDS * size.defined_faces
    return SearchedNets(number, size.degree, memory + prepared_bytes(size), INSIDE_BYTES, seconds)


def skipped_bytes(size: SurfaceSize) -> int:
    """The most bytes of the faces that an answer lists as left out."""
    return SKIPPED_FACE_CHARS * size.defined_faces


def project_cost(nets: SearchedNets, count: int, file_bytes: int, *, sign: bool) -> Cost:
    """The cost of finding the closest points to `count` points.

    Parameters
    ----------
    nets : SearchedNets
    count : int
        Number of points.
    file_bytes : int
        Bytes of the response.
    sign : bool
        Whether signs are computed, too. Signs need the seams of the surface, and the cells a second
        time.
    """
    p, q = nets.degree
    cell_bytes = _cell_memory(nets.degree)
    memory = MIN_SCRATCH_BYTES + nets.surface_memory + nets.number * cell_bytes
    # This allows 64 cells for each point or ray, up to `MAX_CELL_BYTES`, which no search exceeds.
    memory += min(MAX_CELL_BYTES, 64 * count * cell_bytes)
    seconds = 5e-3 + 1e-4 * nets.number + count * 1e-4 * max(1.0, p * q / 9)
    if sign:
        memory += 4 * nets.surface_memory + SIGN_BYTES
        seconds = 1e-2 + 4 * seconds
    memory += ITEM_BYTES * count + 2 * file_bytes + nets.scratch
    return Cost(memory, seconds + nets.seconds, file_bytes)


def _cell_memory(degree: tuple[int, int]) -> int:
    """Bytes of memory for each cell of a search on nets of this degree."""
    p, q = degree
    # Twice the bytes of the net, whose control points have 4 numbers of 8 bytes.
    return CELL_BYTES + 2 * 32 * (p + 1) * (q + 1)


def rays_cost(nets: SearchedNets, count: int, hits: int, file_bytes: int) -> Cost:
    """The cost of finding at most `hits` hits of `count` rays."""
    base = project_cost(nets, count, file_bytes, sign=False)
    # If a ray may have several hits, the response may be far shorter.
    response = file_bytes if hits <= count else 0
    return replace(base, memory=base.memory + HIT_BYTES * hits, response=response)


def piece_memory(net_points: int, bytes_of_1000: int) -> int:
    """Bytes of memory for each piece of a section, which include its bytes in the file.

    `net_points` is the number of control points of a patch, and `bytes_of_1000` the number of bytes
    of 1,000 pieces in the file.
    """
    return PIECE_BYTES + PIECE_POINT_BYTES * net_points + 2 * bytes_of_1000 // 1000


def sections_cost(size: SurfaceSize, planes: int, pieces: int, piece_bytes: int) -> Cost:
    """The cost of sections by `planes` planes, with `pieces` pieces.

    `piece_bytes` is the result of `piece_memory`.
    """
    nets = searched_nets(size)
    memory = SECTION_BATCH_BYTES + lowering_memory(size) + nets.scratch
    memory += nets.number * _cell_memory(size.degree)
    seconds = 2e-2 + 1e-4 * (size.patches + size.face_patches) + 5e-3 * planes + nets.seconds
    return Cost(memory + pieces * piece_bytes, seconds)


def measure_effort(degree: tuple[int, int]) -> int:
    """The least number of multiplications that measuring one patch of this degree takes."""
    p, q = max(degree), min(degree)
    nodes = max(NODES, 2 * p)
    return 18 * nodes * (q + 1) * (p + 1 + nodes) + 200 * nodes**2


def measure_cost(size: SurfaceSize, budget: int, file_bytes: int) -> Cost:
    """The cost of measures.

    All cells together have at most 3 times as many control points as the patches, or `budget` more
    than the patches, whichever is more. `file_bytes` is the number of bytes of the response.
    """
    (p, q), points = size.degree, measured_points(size)
    max_points = max(3 * points, budget + points)
    cells = max_points // ((p + 1) * (q + 1)) + 1
    # A rule has NODES nodes in each direction, or 2 p where it is exact; at each, 3 coordinates.
    numbers = 3 * max(NODES, 2 * max(p, q)) ** 2
    batch = max(numbers, min(CHUNK, numbers * cells))
    memory = (
        2 * lowering_memory(size)
        + MEASURE_POINT_BYTES * max_points
        + MEASURE_CELL_BYTES * cells
        + MEASURE_ARRAYS * 8 * batch
    )
    seconds = 0.1 + 3e-9 * measure_effort(size.degree) * size.patches
    return Cost(memory + 2 * file_bytes, seconds, file_bytes)


def part_measures_cost(
    size: SurfaceSize, stored: SurfaceSize, budget: int, file_bytes: int
) -> Cost:
    """The cost of the measures of a brep, or of a group with breps.

    Equal breps are measured once: `stored` is `SurfaceKind.stored_size`.
    """
    base = measure_cost(size if size.patches else stored, budget, file_bytes)
    memory = base.memory + PANEL_BYTES * (stored.edge_pieces + stored.face_patches)
    memory += LENGTH_BYTES * size.edges
    seconds = MEASURING_SECONDS * stored.faces + 1e-5 * size.edges
    return replace(base, memory=memory, seconds=base.seconds + seconds)


def measure_budget(size: SurfaceSize, memory: int) -> int:
    """The budget with which a measure takes about `memory` bytes; 0 if it always takes more."""
    return _find_budget(size, memory - measure_cost(size, 0, 0).memory)


def part_budget(size: SurfaceSize, stored: SurfaceSize, memory: int) -> int:
    """As `measure_budget`, for breps and groups with breps."""
    return _find_budget(size, memory - part_measures_cost(size, stored, 0, 0).memory)


def _find_budget(size: SurfaceSize, room: int) -> int:
    """The most control points of cells in a number of bytes."""
    p, q = size.degree
    return max(0, int(room / (MEASURE_POINT_BYTES + MEASURE_CELL_BYTES / ((p + 1) * (q + 1)))))


def measured_points(size: SurfaceSize) -> int:
    """The most control points of the nets that are measured; a triangle becomes three nets."""
    p, q = size.degree
    return (size.grids + 3 * size.triangles) * (p + 1) * (q + 1)
