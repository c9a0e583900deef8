"""A model of Bézier patches into one mesh: samples, shared edges, faces, report.

1. Find which sides of which patches are one edge, and give each edge its divisions.
2. Evaluate the patches; overwrite their borders with the samples of the edges.
3. Weld: samples become vertices.
4. Join the vertices to faces by the pattern of each patch.
"""

from dataclasses import dataclass

import numpy as np

from service.engine.basis import samples as parameters
from service.engine.evaluate import Real, evaluate
from service.engine.extent import extent
from service.engine.layout import Block, Layout
from service.engine.mesh import IndexArray, Mesh, MeshPart, MeshReport, Overlay, RealArray
from service.engine.normals import unit_normals
from service.engine.options import MeshOptions
from service.engine.overlays import overlays
from service.engine.patterns import faces
from service.engine.stitch import Ints, Seams, find_seams, sample_edges
from service.engine.weld import Welding, weld
from service.surface.lowered import FloatArray, PatchModel, TensorPatches

FAR = 256.0
"""A model further from zero than this multiple of its extent is stored about a local origin:
float32 would leave it fewer than 16 binary digits."""


def tessellate(model: PatchModel, options: MeshOptions, *, single: bool = False) -> Mesh:
    """The mesh of a model.

    Parameters
    ----------
    model : PatchModel
    options : MeshOptions
    single : bool
        float32 positions about a local origin, for formats that store them so; else float64 in
        model coordinates.
    """
    seams = find_seams(model.batches)
    layout = Layout.plan(model, seams, options.resolution)
    dtype: Real = np.float32 if single else np.float64
    origin = _origin(model, single)
    grid = _sample(model, layout, seams, dtype, origin, options)
    welding = _weld(layout, seams, grid, options)
    positions, normals, uvs = grid.positions, grid.normals, grid.uvs
    if welding is not None:
        positions = positions[welding.samples]
        normals = None if normals is None else normals[welding.samples]
        uvs = None if uvs is None else uvs[welding.samples]
    triangles, quads, parts = _faces(model, layout, seams, welding, options)
    welds = _welds(welding) if options.weld else None
    boundary, watertight = _borders(layout, seams, options, (triangles, quads), welds)
    low, high = _bounds(positions, origin)
    return Mesh(
        name=model.name,
        positions=positions,
        normals=normals,
        uvs=uvs,
        triangles=triangles,
        quads=quads,
        parts=parts,
        grids=_grids(model, layout, welding),
        welds=welds,
        overlays=overlays(model, seams, layout.divisions, options.overlays, origin, dtype),
        origin=origin,
        up=model.up,
        report=MeshReport(
            vertices=len(positions) if welding is None else welding.positions,
            triangles=len(triangles),
            quads=len(quads),
            patches=model.patch_count,
            bounds_min=low,
            bounds_max=high,
            watertight=watertight,
            boundary_edges=boundary,
            poles_repaired=grid.poles,
        ),
    )


@dataclass(frozen=True, eq=False, slots=True)
class _Grid:
    """All samples in one run: (N, 3), (N, 3) or None, (N, 2) or None."""

    positions: RealArray
    normals: RealArray | None
    uvs: RealArray | None
    poles: int


def overlays_of(model: PatchModel, options: MeshOptions) -> tuple[Overlay, ...]:
    """The overlays alone, in float64 and model coordinates, for a form that has no mesh."""
    if not options.overlays:
        return ()
    seams = find_seams(model.batches)
    layout = Layout.plan(model, seams, options.resolution)
    zero = np.zeros(3)
    return overlays(model, seams, layout.divisions, options.overlays, zero, np.float64)


def predicted_size(model: PatchModel, options: MeshOptions) -> tuple[int, int, int]:
    """Vertices, triangles and quads at most, from shapes and seams; nothing is evaluated.

    Exact for patches that meet nowhere; welding and collapsed sides only take away.
    """
    ru, rv = options.resolution
    cells = model.patch_count * ru * rv
    size = model.patch_count * (ru + 1) * (rv + 1)
    framed = False
    if ru != rv:
        layout = Layout.plan(model, find_seams(model.batches), options.resolution)
        size, framed = layout.size, layout.framed
    if options.faces == "quads":
        return size, (2 * size if framed else 2 * (ru + rv) * model.patch_count), cells
    # A patch of V samples, B of them on its border, is 2V - B - 2 triangles.
    return size, (2 * size if framed else 2 * cells), 0


def _sample(
    model: PatchModel,
    layout: Layout,
    seams: Seams,
    dtype: Real,
    origin: FloatArray,
    options: MeshOptions,
) -> _Grid:
    """Evaluates the blocks, then writes the samples of every edge over its sides."""
    results = [
        evaluate(
            block.batch if block.whole else _subset(block),
            block.resolution,
            dtype=dtype,
            normals=options.normals,
            origin=origin,
        )
        for block in layout.blocks
    ]
    poles = sum(result.poles for result in results)
    extras = layout.size - sum(block.count * len(block.patches) for block in layout.blocks)
    positions = _run([result.positions for result in results], extras)
    normals = None
    if options.normals:
        normals = _run([r.normals for r in results if r.normals is not None], extras)
    uvs = (
        _run([_block_uvs(block, dtype) for block in layout.blocks], extras) if options.uvs else None
    )
    _write_edges(positions, layout, seams, origin)
    if layout.framed:
        poles += _write_extras(model, layout, normals, uvs)
    return _Grid(positions, normals, uvs, poles)


def _subset(block: Block) -> TensorPatches:
    weights = block.batch.weights
    return TensorPatches(
        block.batch.points[block.patches], None if weights is None else weights[block.patches]
    )


def _run(grids: list[RealArray], extras: int) -> RealArray:
    """Grids (m, Ru+1, Rv+1, d) as one run of rows, with room for the extra samples."""
    rows = [grid.reshape(-1, grid.shape[-1]) for grid in grids]
    if len(rows) == 1 and not extras:
        return rows[0]
    return np.concatenate([*rows, np.zeros((extras, rows[0].shape[1]), rows[0].dtype)])


def _block_uvs(block: Block, dtype: Real) -> RealArray:
    u, v = (parameters(r).astype(dtype) for r in block.resolution)
    pairs = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    return np.tile(pairs, (len(block.patches), 1, 1, 1))


def _write_edges(positions: RealArray, layout: Layout, seams: Seams, origin: FloatArray) -> None:
    """Every side gets the very samples of its edge, every corner its control point."""
    edge = seams.edge.ravel()
    row = np.zeros(len(seams.users), dtype=np.intp)
    for divisions, sides in layout.side_groups(seams):
        used = np.zeros(len(row), dtype=bool)
        used[edge[sides]] = True
        ids = np.flatnonzero(used)
        row[ids] = np.arange(len(ids))
        points = sample_edges(seams.curves, used, divisions) - origin
        positions[layout.side_samples(sides, divisions, seams)] = points[row[edge[sides]]]
    corners = seams.corner_points - origin
    positions[layout.corner_samples()] = corners[seams.corner]
    samples, corner = layout.collapsed_samples(seams)
    positions[samples] = corners[corner]


def _write_extras(
    model: PatchModel, layout: Layout, normals: RealArray | None, uvs: RealArray | None
) -> int:
    """Normals and parameters of the samples beside the grids; how many normals are limits."""
    limits = 0
    first = 0
    for batch in model.batches:
        extra = layout.extra[first : first + batch.count]
        patch, side = np.nonzero(extra >= 0)
        inner = layout.inner[first : first + batch.count][patch, side]
        row = np.repeat(np.arange(len(patch)), inner)
        k = np.arange(len(row)) - np.repeat(np.cumsum(inner) - inner, inner)
        samples = extra[patch, side][row] + k
        along = (k + 1) / (inner[row] + 1)
        across = (side % 2)[row].astype(np.float64)
        on_u = side[row] < 2
        u, v = np.where(on_u, across, along), np.where(on_u, along, across)
        if normals is not None:
            normals[samples], found = unit_normals(batch, patch[row], u, v)
            limits += found
        if uvs is not None:
            uvs[samples] = np.stack([u, v], axis=1)
        first += batch.count
    return limits


def _weld(layout: Layout, seams: Seams, grid: _Grid, options: MeshOptions) -> Welding | None:
    """Vertices from samples; None where every sample is a vertex of its own."""
    shared = bool((seams.users > 1).any() or seams.collapsed.any() or _corners_meet(seams))
    if not layout.framed and not (options.weld and shared):
        return None
    place = np.arange(layout.size)
    if options.weld:
        edge = seams.edge.ravel()
        for divisions, sides in layout.side_groups(seams):
            samples = layout.side_samples(sides, divisions, seams)
            # The first side of every edge stands for all of them.
            ids, first, back = np.unique(edge[sides], return_index=True, return_inverse=True)
            place[samples] = samples[first][back]
            del ids
        corners = layout.corner_samples()
        _, first, back = np.unique(seams.corner, return_index=True, return_inverse=True)
        stand_in = corners.ravel()[first]
        place[corners] = stand_in[back.reshape(corners.shape)]
        samples, corner = layout.collapsed_samples(seams)
        place[samples] = stand_in[corner]
    used = _used(layout) if layout.framed else None
    merge = options.weld and grid.uvs is None
    return weld(place, used, grid.normals, options.crease_angle, merge)


def _corners_meet(seams: Seams) -> bool:
    return len(seams.corner_points) < seams.corner.size


def _used(layout: Layout) -> Ints:
    """Samples that occur in faces: all but those that a frame has replaced."""
    used = np.ones(layout.size, dtype=bool)
    patch, side = np.nonzero(layout.extra >= 0)
    own = np.where(side < 2, layout.rv[patch], layout.ru[patch])
    for divisions in np.unique(own).tolist():
        sides = (patch * 4 + side)[own == divisions]
        used[layout.grid_samples(sides, divisions)[:, 1:-1]] = False
    return np.flatnonzero(used)


def _faces(
    model: PatchModel,
    layout: Layout,
    seams: Seams,
    welding: Welding | None,
    options: MeshOptions,
) -> tuple[IndexArray, IndexArray, tuple[MeshPart, ...]]:
    """Triangles, quads and the runs of both that are the parts, patch by patch."""
    groups = layout.shapes(seams)
    patterns = [faces(shape, options.faces) for shape, _ in groups]
    counts = np.zeros((2, model.patch_count + 1), dtype=np.intp)
    for (_, patches), pattern in zip(groups, patterns, strict=True):
        for kind in (0, 1):
            counts[kind, patches + 1] = len(pattern[kind])
    ends = counts.cumsum(axis=1)
    found = []
    for kind, corners in enumerate((3, 4)):
        if welding is None and len(groups) == 1 and model.patch_count == 1:
            found.append(patterns[0][kind])
            continue
        out = np.empty((ends[kind, -1], corners), dtype=np.uint32)
        for (shape, patches), pattern in zip(groups, patterns, strict=True):
            if len(pattern[kind]):
                samples = layout.patch_samples(patches, shape)
                vertices = samples if welding is None else welding.vertex[samples]
                # Gathering through the pattern writes each patch's faces in one go.
                whole = vertices.astype(np.uint32)[:, pattern[kind]]
                rows = ends[kind, patches][:, None] + np.arange(len(pattern[kind]))
                if len(patches) == model.patch_count:
                    out = whole.reshape(-1, corners)
                else:
                    out[rows] = whole
        found.append(out)
    parts = tuple(
        MeshPart(
            part.name,
            (int(ends[0, part.first]), int(ends[0, part.last])),
            (int(ends[1, part.first]), int(ends[1, part.last])),
        )
        for part in model.parts
    )
    return found[0], found[1], parts


def _grids(model: PatchModel, layout: Layout, welding: Welding | None) -> tuple[IndexArray, ...]:
    """The vertex at every sample of every patch; nothing where a frame breaks the grid."""
    if layout.framed:
        return ()
    grids = []
    for block in layout.blocks:
        size = block.count * len(block.patches)
        samples = slice(block.base, block.base + size)
        vertex = (
            np.arange(samples.start, samples.stop) if welding is None else welding.vertex[samples]
        )
        shape = (len(block.patches), block.resolution[0] + 1, block.resolution[1] + 1)
        grids.append(vertex.astype(np.uint32).reshape(shape))
    return tuple(grids)


def _welds(welding: Welding | None) -> IndexArray | None:
    """The first vertex at each vertex's position; None where all positions differ."""
    if welding is None or bool((welding.welds == np.arange(len(welding.welds))).all()):
        return None
    return welding.welds.astype(np.uint32)


def _borders(
    layout: Layout,
    seams: Seams,
    options: MeshOptions,
    mesh_faces: tuple[IndexArray, IndexArray],
    welds: IndexArray | None,
) -> tuple[int, bool]:
    """Edges that one face uses alone, and whether every edge is used by exactly two."""
    lines = ~seams.collapsed
    if layout.divisions[seams.edge[lines]].min(initial=2) < 2:
        # With one division, different edges between the same corners are one line of the mesh,
        # and a patch between two poles vanishes: only the faces themselves tell.
        return _count_borders(mesh_faces, welds)
    if not options.weld:
        return int(layout.divisions[seams.edge[lines]].sum()), not lines.any()
    uses = np.bincount(seams.edge[lines], minlength=len(layout.divisions))
    boundary = int(layout.divisions[uses == 1].sum())
    return boundary, boundary == 0 and bool((uses <= 2).all())


def _count_borders(
    mesh_faces: tuple[IndexArray, IndexArray], welds: IndexArray | None
) -> tuple[int, bool]:
    """The same, counted on the faces."""
    edges = []
    for rows in mesh_faces:
        ring = rows.astype(np.int64) if welds is None else welds[rows].astype(np.int64)
        for a in range(ring.shape[1]):
            edges.append(np.stack([ring[:, a], ring[:, (a + 1) % ring.shape[1]]], axis=1))
    ends = np.sort(np.concatenate(edges), axis=1)
    _, uses = np.unique(ends[:, 0] << 32 | ends[:, 1], return_counts=True)
    return int((uses == 1).sum()), bool((uses == 2).all())


def _origin(model: PatchModel, single: bool) -> FloatArray:
    """Origin of the stored positions: zero, unless float32 far from zero would lose the shape."""
    if not single:
        return np.zeros(3)
    bounds = [batch.bounds for batch in model.batches]
    low = np.min([low for low, _ in bounds], axis=0)
    high = np.max([high for _, high in bounds], axis=0)
    middle = low + (high - low) / 2
    if np.abs(middle).max() <= FAR * (high - low).max():
        return np.zeros(3)
    # A float32 itself, so that viewers that compute in float32 place it exactly.
    return middle.astype(np.float32).astype(np.float64)


def _bounds(
    positions: RealArray, origin: FloatArray
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Least and greatest coordinates of the vertices, in the model's own system."""
    low, high = (tuple((bound.astype(np.float64) + origin).tolist()) for bound in extent(positions))
    return low, high
