"""How much memory a mesh and its file take at most, from the counts of vertices and faces alone.

The work has two halves. While a mesh is made, it stands beside what leads to it: the shared edges,
samples twice over, where each sample's vertex is. While it is written, it stands beside the file in
pieces, then beside the file twice. What is larger counts. Work arrays that are as large whatever is
computed in them are not counted where threads keep them (`service.engine.scratch`).
"""

from bisect import bisect_left
from dataclasses import dataclass, replace
from itertools import combinations

from service.encoders.format import EncodeOptions, Format, MeshSize
from service.engine.options import MeshOptions
from service.surface.batches import Patches, TrianglePatches
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sweep_model import SweepModel

NUMBER = 8
"""Bytes of a number in double precision, and of an index."""

TRIANGLE, QUAD = 12, 16
"""Bytes of a face."""

SEAM, SIDE = 600, 4
"""Bytes for each patch, and for each byte of the control points on its sides, while shared edges
are found."""

PLACED = 72
"""Bytes for each sample while samples become vertices: nine indices."""

JOINED = 20
"""Bytes for each sample while vertices become faces, beside the faces."""

COUNTED = 40
"""Bytes for each triangle while edges are counted that only one of them uses."""

DRAWN, SEGMENT, CELL = 70, 30, 80
"""Bytes for each point, segment and cell of lines beside the faces."""

STATION, PATH = 240, 400
"""Bytes for each sample of what is swept along curves, and for each grid of such."""

CURVED, CURVED_SAMPLES = 800, 16_384
"""Bytes for each sample of which curvatures are computed, and how many are at a time."""

SNAPPED = 120
"""Bytes for each vertex that is put on a grid."""

RIM = 280
"""Bytes for each triangle along the borders of patches where some may be lost in folds."""

LIMITS, DEGENERATE = 3, 4 << 20
"""Copies of the nets of patches of which normals are limits, and bytes of those at a time."""

BENT, NETS = 4, 1 << 20
"""Copies of the nets of patches of which the bends are bounded, and bytes of those at a time."""

TEXT = 6 << 20
"""Bytes of a piece of text and of what leads to it; or six times as many as the text has."""

CERTIFIED, CELLS = 1600, 4 << 20
"""Bytes for each triangle of a mesh by tolerance while it is proved, and at least."""

SHARE = 2
"""A mesh by tolerance may take one part of so many of the memory: how large it becomes is not known
before, so it is given as much as it may come to."""

MOST = 1 << 32
"""More triangles than any mesh has."""

SMALL = 1 << 19
"""Bytes that are taken whatever is computed."""


@dataclass(frozen=True, slots=True)
class _Row:
    """What a vertex has: bytes of a number, numbers, and how many of these are its colour."""

    real: int
    numbers: int

    @property
    def bytes(self) -> int:
        return self.real * self.numbers


def meshing(
    model: Model,
    options: MeshOptions,
    form: tuple[Format, EncodeOptions],
    stored: MeshSize,
) -> int:
    """Bytes that a mesh and its file take beside the model that it is made of.

    Parameters
    ----------
    form : (Format, EncodeOptions)
    stored : MeshSize
        Counts of what the format stores.
    """
    fmt, encode = form
    file = fmt.byte_bound(stored, encode)
    if encode.exact and fmt.encode_exact is not None:
        return SMALL + _lines(stored, NUMBER) + _exact(stored) + 2 * file + min(TEXT, 6 * file)
    row = _row(model, options, single=fmt.single)
    flat = isinstance(model, GroupModel) and fmt.encode_scene is None
    made, mesh = _making(model, options, stored, row), _mesh(stored, row)
    if flat:
        # Different ones once, every copy for itself, and all as one; then in single precision.
        made = max(made, 3 * _mesh(stored, _Row(NUMBER, row.numbers)) + mesh)
    if encode.quantize:
        made = max(made, mesh + SNAPPED * (stored.vertices + stored.overlay_points))
    return SMALL + max(made, mesh + _writing(fmt, encode, stored, file))


def certifying(
    model: Model,
    options: MeshOptions,
    form: tuple[Format, EncodeOptions],
    stored: MeshSize,
    triangles: int,
) -> int:
    """The same of a mesh by tolerance, if it gets so many triangles."""
    fmt, encode = form
    vertices = triangles + 2 * stored.patches
    lines = triangles if "boundary" in options.overlays else 0
    size = replace(
        stored,
        vertices=vertices,
        triangles=triangles,
        overlay_points=stored.overlay_points + lines,
        overlay_segments=stored.overlay_segments + lines,
    )
    row = _row(model, options, single=fmt.single)
    mesh = _mesh(size, row)
    made = CELLS + CERTIFIED * triangles + _seams(_patches(model)) + mesh
    if isinstance(model, GroupModel) and fmt.encode_scene is None:
        made += 2 * mesh
    file = fmt.byte_bound(size, encode)
    written = mesh + _writing(fmt, encode, size, file)
    # While a budget is sought, the nearest mesh so far is kept, and the coarsest.
    budgeted = options.accuracy is not None and options.accuracy.budgeted
    return max(made, written) + (2 * (mesh + file) if budgeted else 0)


def most_certified(
    model: Model,
    options: MeshOptions,
    form: tuple[Format, EncodeOptions],
    stored: MeshSize,
    memory: int,
) -> int:
    """Triangles that a mesh by tolerance may have, if it has so much memory."""

    def beyond(triangles: int) -> bool:
        return certifying(model, options, form, stored, triangles) > memory

    return bisect_left(range(MOST), True, key=beyond) - 1


def _making(model: Model, options: MeshOptions, size: MeshSize, row: _Row) -> int:
    """Bytes of the meshes of all different models, and of what leads to the largest."""
    samples, faces = size.vertices, TRIANGLE * size.triangles + QUAD * size.quads
    patches = _patches(model)
    seams = _seams(patches)
    nets = sum(batch.points.nbytes for batch in patches)
    again = min(LIMITS * 24 * nets, LIMITS * DEGENERATE) if options.normals else 0
    kept = _lines(size, row.real) + seams + BENT * min(nets, NETS)
    anew = samples * 6 * NUMBER if row.real < NUMBER else 0
    bent = CURVED * min(samples, CURVED_SAMPLES) + 4 * NUMBER * samples
    steps = (
        row.bytes * samples * 2 + anew + again,
        row.bytes * samples + PLACED * samples,
        row.bytes * samples + (JOINED + 24) * samples + 2 * faces,
        row.bytes * samples * 2 + 32 * samples + faces,
        row.bytes * samples + 8 * samples + faces + COUNTED * (size.triangles + 2 * size.quads),
        row.bytes * samples + bent if options.curvatures else 0,
        row.bytes * samples + 8 * samples + _rims(patches, options),
    )
    swept = options.solid_wires or has_sweeps(model)
    return kept + max(steps) + (STATION * samples + PATH * size.patches if swept else 0)


def _seams(patches: list[Patches]) -> int:
    """Bytes that finding shared edges takes."""
    return sum(
        batch.count * (SEAM + SIDE * NUMBER * (3 + (batch.weights is not None)) * _on_sides(batch))
        for batch in patches
    )


def _mesh(size: MeshSize, row: _Row) -> int:
    """Bytes of a mesh: a vertex is named once by the grids, and once by those at its place."""
    faces = TRIANGLE * size.triangles + QUAD * size.quads
    return (row.bytes + 8) * size.vertices + faces + _lines(size, row.real)


def _lines(size: MeshSize, real: int) -> int:
    return (
        (DRAWN + 3 * real) * size.overlay_points
        + SEGMENT * size.overlay_segments
        + CELL * size.overlay_cells
    )


def _writing(fmt: Format, encode: EncodeOptions, size: MeshSize, file: int) -> int:
    """Bytes of a file, and of what leads to it."""
    faces = TRIANGLE * size.triangles + QUAD * size.quads
    if fmt.compact:
        columns = 32 * size.vertices if size.colors or encode.quantize else 0
        if encode.compression == "meshopt":
            columns += 2 * file + 60 * size.vertices + faces
        return 2 * file + columns
    # Positions in double precision, about zero; those that differ; which of them each vertex has.
    places = (2 * 24 + 16) * size.vertices
    if fmt.fixed:
        return 2 * file + 24 * size.vertices + min(TEXT, file * 8)
    text = min(TEXT, 6 * file)
    colors = 32 * 3 * size.vertices if size.colors else 0
    return 2 * file + places + faces + colors + text + 60 * size.patches + 100 * size.overlay_cells


def _exact(size: MeshSize) -> int:
    """Bytes for the control points of all patches, as they are written."""
    return 3 * 32 * size.control_points


def _row(model: Model, options: MeshOptions, *, single: bool) -> _Row:
    """What a vertex of the mesh of a model has at most."""
    channels = [sum(channel.dimension for channel in batch.channels) for batch in _patches(model)]
    numbers = 3 + 3 * options.normals + 2 * options.uvs + 2 * options.curvatures
    if isinstance(model, GroupModel) and any(m.color is not None for m in model.members):
        numbers += 4
    return _Row(4 if single else 8, numbers + max(channels, default=0))


def _patches(model: Model) -> list[Patches]:
    models = model.models if isinstance(model, GroupModel) else (model,)
    return [batch for own in models if isinstance(own, PatchModel) for batch in own.batches]


def has_sweeps(model: Model) -> bool:
    """Whether anything is swept along a curve."""
    models = model.models if isinstance(model, GroupModel) else (model,)
    return any(isinstance(own, SweepModel) for own in models)


def _rims(patches: list[Patches], options: MeshOptions) -> int:
    """Bytes for the triangles along the borders of patches, where these are looked at."""
    ru, rv = options.resolution
    if options.accuracy is not None or not (min(ru, rv) < 2 or any(map(_may_fold, patches))):
        return 0
    triangles = min(2 * ru * rv, 8 * (ru + rv))
    return RIM * triangles * sum(batch.count for batch in patches)


def _may_fold(batch: Patches) -> bool:
    """Whether a patch has a corner twice; else no two of its sides are one, and none is a point."""
    corners = batch.corners[:, : 3 if isinstance(batch, TrianglePatches) else 4]
    return any(
        bool((corners[:, one] == corners[:, other]).all(axis=1).any())
        for one, other in combinations(range(corners.shape[1]), 2)
    )


def _on_sides(batch: Patches) -> int:
    """Control points on the sides of a patch."""
    return sum(degree + 1 for degree in batch.side_degrees)
