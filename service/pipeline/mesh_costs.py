"""The cost of meshes, and of estimates of their sizes.

The memory follows from the numbers of vertices and faces (`mesh_counts`), and from the bytes of the
file: each of these takes a certain number of bytes in the step of the work that needs most memory.
"""

import sys

from service.encoders.content import MAX_LISTED_FACES
from service.encoders.format import EncodeOptions, Format, MeshSize
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.pipeline.brep_cost import PROVED_BYTES, SCRATCH_BYTES, count_coarsest
from service.pipeline.cost import (
    MAX_SCRATCH_BYTES,
    MEMORY_SHARE,
    Cost,
    lowering_memory,
    with_scratch,
)
from service.pipeline.limits import Limits
from service.pipeline.mesh_counts import adaptive_size, mesh_counts
from service.surface.sizes import SurfaceSize

VERTEX_BYTES, TRIANGLE_BYTES, RIM_BYTES, LINE_BYTES = 80, 40, 280, 100
"""Bytes, while a mesh is built: for each vertex, in addition to its numbers; for each triangle,
while open edges are counted; for each triangle along the border of a patch, while those with two
equal vertices are removed; and for each point, segment and net cell of the overlays."""

SWEPT_VERTEX_BYTES = 240
"""Bytes for each vertex of a tube or ribbon, in addition, while it is built."""

WRITING_BYTES, TEXT_BYTES = 64, 6 << 20
"""Bytes, while a file is written, in addition to the file: for each vertex; and for one batch of
text."""

PROOF_BYTES, CELL_ARRAY_BYTES = 416, 16 << 20
"""Bytes for a mesh by tolerance: for each triangle, while its bound is proved; and for arrays of
cells, whose size does not depend on the number of triangles."""

MIN_TRIANGLE_BYTES = 1
"""The fewest bytes of a triangle in any format."""

MEMBER_SECONDS, FACE_PART_BYTES = 5e-5, 500
"""Seconds for each placed member of a group, in addition to those for its surface; and bytes for
each placed face of a brep as a part of the mesh."""

EFFORT_FACTOR, TRIANGLE_EFFORT = 2, 5_000
"""A mesh by tolerance, or the search for a mesh within a budget, may take `EFFORT_FACTOR` times the
multiplications of other work; one triangle takes at least `TRIANGLE_EFFORT` multiplications."""


def mesh_cost(
    size: SurfaceSize,
    options: MeshOptions,
    mesh: MeshSize,
    file_bytes: int,
    form: tuple[Format, EncodeOptions],
) -> Cost:
    """The cost of a mesh of this size, and of its file.

    Parameters
    ----------
    size : SurfaceSize
        The size of the surface.
    options : MeshOptions
    mesh : MeshSize
        Upper bounds of the counts of the mesh.
    file_bytes : int
        Upper bound of the bytes of the file.
    form : (Format, EncodeOptions)
    """
    fmt, encode = form
    degree = max(size.degree)
    # The time matters only for small meshes: it decides whether they run in a thread. Even if their
    # plan is not cached, they take less time than `seconds`.
    seconds = 1.2e-3 + 4e-5 * size.patches + mesh.vertices * 1.5e-7 + file_bytes * 1.5e-9
    if size.curves or size.members > 1 or options.has_solid_wires:
        seconds += 2e-3 * size.surfaces + MEMBER_SECONDS * size.members
    # Measured: texts take at least half of this time, other files a tenth; half of each is a margin
    # for faster processors.
    least_seconds = seconds / (20 if fmt.is_float32 else 4)
    seconds *= max(1.0, degree / 8) ** 3 * (1 + 2 * options.curvatures)
    if options.method != "matrix":
        seconds *= 10 * degree
    triangles = mesh.triangles + 2 * mesh.quads
    line_memory = LINE_BYTES * (mesh.overlay_points + mesh.overlay_segments + mesh.overlay_cells)
    if encode.exact and fmt.encode_exact is not None:
        text_memory = 2 * file_bytes + min(TEXT_BYTES, 8 * file_bytes)
        patch_memory = 96 * mesh.control_points + line_memory + text_memory
        return Cost(lowering_memory(size, patch_memory), seconds, file_bytes)
    # A group in a format without nodes: its meshes are built, and then joined to one mesh.
    is_flattened = size.members > 1 and fmt.encode_scene is None
    numbers = 3 + 3 * options.normals + size.width * bool(fmt.carries)
    numbers += 2 * options.uvs + 2 * options.curvatures
    # A vertex takes 8 bytes beside its numbers; each index of a face takes 4.
    vertex_bytes = (8 if is_flattened or not fmt.is_float32 else 4) * numbers + 8
    mesh_bytes = vertex_bytes * mesh.vertices + 12 * mesh.triangles + 16 * mesh.quads + line_memory
    ru, rv = options.resolution
    rim_memory = RIM_BYTES * min(triangles, 8 * (ru + rv) * mesh.patches)
    # Before the faces are built, normals and curvatures at degenerate points are computed in
    # batches.
    face_memory = VERTEX_BYTES * mesh.vertices + max(TRIANGLE_BYTES * triangles, rim_memory)
    degenerate_memory = min(MAX_SCRATCH_BYTES, 2000 * size.control_points)
    degenerate_memory += min(MAX_SCRATCH_BYTES, 1000 * mesh.vertices) * options.curvatures
    # At most twice the bytes of the mesh are in use while it is built, and as many for the separate
    # meshes of a group while these are joined.
    building_memory = (2 + 2 * is_flattened) * mesh_bytes + max(face_memory, degenerate_memory)
    if options.method == "de_casteljau":
        # The method keeps several levels of nets, for at least 64 samples.
        building_memory += max(4 << 20, 10_000 * (degree + 1) ** 2)
    if size.curves or options.has_solid_wires:
        building_memory += SWEPT_VERTEX_BYTES * (mesh.vertices + mesh.patches)
    mesh_memory = max(building_memory, mesh_bytes + _writing_memory(mesh, file_bytes, fmt, encode))
    return Cost(lowering_memory(size, mesh_memory), seconds, file_bytes, least_seconds)


def adaptive_cost(
    size: SurfaceSize,
    options: MeshOptions,
    mesh: MeshSize,
    form: tuple[Format, EncodeOptions],
    limits: Limits,
    *,
    complete: SurfaceSize,
    distinct: SurfaceSize,
) -> tuple[int, int, Cost]:
    """The size and cost of the largest mesh by tolerance that limits, budget and memory allow.

    Parameters
    ----------
    size : SurfaceSize
        The size of the surface.
    options : MeshOptions
    mesh : MeshSize
        Numbers of patches, names and overlays of the mesh.
    form : (Format, EncodeOptions)
    limits : Limits
    complete, distinct : SurfaceSize
        The sizes of all surfaces of a group, and of the distinct ones.

    Returns
    -------
    max_triangles, file_bytes, cost
        The most triangles of the mesh, the most bytes of its file, and its cost.

    Raises
    ------
    TooLarge
        `too_much_memory`: the memory limit allows fewer than two triangles.
    """
    (fmt, encode), accuracy = form, options.accuracy or Accuracy()
    has_sweeps = size.curves > 0
    empty, large = (adaptive_size(mesh, options, k, has_sweeps=has_sweeps) for k in (0, 1 << 16))
    empty_bytes = fmt.byte_bound(empty, encode)
    # The bytes of a triangle in the file, rounded up, and one more: `large` has 2^16 triangles.
    triangle_bytes = -(-(fmt.byte_bound(large, encode) - empty_bytes) >> 16) + 1
    # The search for a mesh within a budget keeps two more files: the best and the coarsest.
    files = 4 if accuracy.is_budgeted else 2
    line_memory = LINE_BYTES * (mesh.overlay_points + mesh.overlay_segments + mesh.overlay_cells)
    surface_memory = lowering_memory(size)
    array_bytes = SCRATCH_BYTES if size.faces else CELL_ARRAY_BYTES
    part_memory = FACE_PART_BYTES * max(size.faces, min(size.placed_faces, MAX_LISTED_FACES))
    fixed_memory = surface_memory + array_bytes + files * empty_bytes + line_memory + part_memory
    proof_bytes = PROVED_BYTES if size.faces or size.curves else PROOF_BYTES
    triangle_memory = proof_bytes + 8 * size.width + files * triangle_bytes
    limits.check_memory(
        fixed_memory + 2 * triangle_memory, "The mesh", accuracy.pointer, "a smaller surface"
    )
    allowed_memory = max(
        limits.max_memory // MEMORY_SHARE, min(fixed_memory + surface_memory, limits.max_memory)
    )
    max_triangles = min(
        adaptive_triangles(accuracy, limits, count_counted(accuracy, size, complete)),
        (allowed_memory - fixed_memory) // triangle_memory,
    )
    file_bytes = min(
        empty_bytes + triangle_bytes * max_triangles,
        limits.max_bytes,
        accuracy.max_bytes or sys.maxsize,
    )
    seconds = 5e-3 + 3e-5 * max_triangles + 1e-3 * distinct.coedges + MEMBER_SECONDS * size.members
    return max_triangles, file_bytes, Cost(fixed_memory + triangle_memory * max_triangles, seconds)


def count_counted(accuracy: Accuracy, size: SurfaceSize, complete: SurfaceSize) -> int:
    """The most triangles of the coarsest mesh, as they count: in a budget, those of all copies.

    `size` and `complete` are the sizes of the surfaces that are stored, and of all surfaces.
    """
    return count_coarsest(size if accuracy.max_triangles is None else complete)


def adaptive_triangles(accuracy: Accuracy, limits: Limits, coarsest: int = 0) -> int:
    """The most triangles that limits and budget allow for a mesh by tolerance; memory is ignored.

    The coarsest mesh, of `coarsest` triangles, is allowed even if it exceeds the budget, because
    the error must name the budget that it needs.
    """
    # A closed mesh has about two triangles for each vertex, an open mesh fewer.
    max_triangles = min(
        2 * limits.max_vertices, EFFORT_FACTOR * limits.max_multiplications // TRIANGLE_EFFORT
    )
    budget = max_triangles if accuracy.max_triangles is None else accuracy.max_triangles
    if accuracy.max_bytes is not None:
        budget = min(budget, accuracy.max_bytes // MIN_TRIANGLE_BYTES + 1)
    return min(max_triangles, max(budget, coarsest))


def estimation_cost(size: SurfaceSize, options: MeshOptions, formats: int, limits: Limits) -> Cost:
    """The cost of an estimate for `formats` formats.

    Counting the vertices of a mesh by resolution needs most memory if two sides of a patch are one
    edge, or if a side has one division; each count is taken to be such a count.
    """
    vertices = 0 if options.accuracy else mesh_counts(size, options).vertices
    counted_vertices = vertices if vertices <= limits.max_vertices else 0
    memory = with_scratch(lowering_memory(size) + VERTEX_BYTES // 2 * counted_vertices)
    seconds = 4e-4 + 6e-5 * formats + 3e-5 * size.patches + 1e-3 * (size.surfaces - 1)
    seconds += MEMBER_SECONDS * (size.members - 1)
    if options.accuracy is not None:
        seconds += 1e-4 * size.patches + 5e-3
    return Cost(min(memory, limits.max_memory), seconds)


def _writing_memory(mesh: MeshSize, file_bytes: int, fmt: Format, encode: EncodeOptions) -> int:
    """The most bytes in use while a file is written: the file and the arrays for writing it."""
    index_bytes = 12 * (mesh.triangles + 2 * mesh.quads)
    memory = 2 * file_bytes + 96 * mesh.vertices * bool(mesh.colors or encode.quantize)
    if encode.compression != "none":
        memory += 2 * file_bytes + WRITING_BYTES * mesh.vertices + index_bytes
    if not fmt.compact:
        memory += WRITING_BYTES * mesh.vertices + index_bytes + min(TEXT_BYTES, 8 * file_bytes)
        memory += LINE_BYTES * (mesh.patches + mesh.overlay_cells)
    return memory
