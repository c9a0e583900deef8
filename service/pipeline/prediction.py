"""How large a mesh will be, from the shapes of its model alone: before anything is computed."""

from collections.abc import Iterable
from dataclasses import astuple, replace
from itertools import zip_longest
from typing import TypeAlias

from service.encoders.format import MeshSize
from service.engine.curvatures.ranges import NAMES as CURVATURES
from service.engine.models import colored
from service.engine.options import MeshOptions
from service.engine.sweeps.sweep import predicted_sweep
from service.engine.tessellate import predicted_size
from service.engine.wires.draw import NAME as WIRES
from service.engine.wires.draw import most_solids
from service.engine.wires.isocurves import most_isocurves
from service.stopping import checkpoint
from service.surface.batches import TrianglePatches
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sweep_model import SweepModel

Attributes: TypeAlias = tuple[tuple[str, int], ...]
"""Names and numbers of numbers."""

Known: TypeAlias = dict[tuple[int, ...], tuple[int, int, int]]
"""Vertices, triangles and quads of patches that were counted before, by the arrays they are in.

Whoever holds it holds the surface, and the options stay the same."""


def predict(
    model: Model, options: MeshOptions, *, shared: bool = False, known: Known | None = None
) -> MeshSize:
    """Counts of the mesh from the shapes alone; upper bounds where welding takes some away.

    With `shared`, the arrays of equal members of a group count once, as where they are stored
    once; else every copy counts. `known` is added to.
    """
    known = {} if known is None else known
    if not isinstance(model, GroupModel):
        return _predict_alone(model, options, known)
    sizes = [_predict_alone(own, options, known) for own in model.models]
    copies = [sizes[member.model] for member in model.members]
    names = [len(member.name.encode()) + 1 for member in model.members]
    counts = (astuple(replace(size, attributes=())) for size in (sizes if shared else copies))
    total = MeshSize(*(sum(column) for column in list(zip(*counts, strict=True))[:-1]))
    return replace(
        total,
        colors=4 if colored(model) else max(size.colors for size in sizes),
        attributes=_largest([size.attributes for size in sizes]),
        # A node for every member, and below it one for everything that has a name.
        named=sum(size.named + 1 for size in copies),
        name_bytes=len(model.name.encode())
        + sum(
            size.name_bytes + (size.named + 1) * name
            for size, name in zip(copies, names, strict=True)
        ),
    )


def _largest(found: Iterable[Attributes]) -> Attributes:
    """Attributes that need at least as many bytes as any of these, name by name."""
    ranked = (sorted(attributes, key=lambda named: -named[1]) for attributes in found)
    return tuple(
        (max((name for name, _ in column), key=len), max(size for _, size in column))
        for column in zip_longest(*ranked, fillvalue=("", 0))
    )


def _predict_alone(model: PatchModel | SweepModel, options: MeshOptions, known: Known) -> MeshSize:
    """Counts of the mesh of a model that is no group."""
    checkpoint()
    if isinstance(model, SweepModel):
        return _predict_sweep(model, options)
    return _predict_patches(model, options, known)


def _predict_sweep(model: SweepModel, options: MeshOptions) -> MeshSize:
    """Counts of the mesh of a tube or ribbon."""
    vertices, triangles, quads, grids = predicted_sweep(model, options)
    drawn = len(model.polygon) * ("control_net" in options.overlays)
    names = [model.name, model.name, *options.overlays]
    return MeshSize(
        vertices,
        triangles,
        quads,
        patches=grids,
        named=len(names) - 1,
        name_bytes=sum(len(name.encode()) for name in names),
        overlay_points=drawn,
        overlay_segments=drawn,
        control_points=len(model.polygon),
    )


def _predict_patches(model: PatchModel, options: MeshOptions, known: Known) -> MeshSize:
    """Counts of the mesh of patches."""
    vertices = triangles = quads = 0
    if options.surface:
        key = tuple(id(batch.points) for batch in model.batches)
        if key not in known:
            known[key] = predicted_size(model, options)
        vertices, triangles, quads = known[key]
    points = segments = cells = 0
    control_points, grids = 0, model.patch_count
    for batch in model.batches:
        count = batch.points.size // 3
        triangular = isinstance(batch, TrianglePatches)
        # The exact form of a triangle is a square with fewer than twice as many.
        control_points += (1 + triangular) * count
    if "control_net" in options.overlays:
        for batch in model.nets:
            count = batch.points.size // 3
            triangular = isinstance(batch, TrianglePatches)
            points += count
            # A control point begins at most two segments and one cell; of a triangle, three.
            segments += (2 + triangular) * count
            cells += count
    if "boundary" in options.overlays:
        segments += 4 * model.patch_count * max(options.resolution)
        points += 4 * model.patch_count * (max(options.resolution) + 1)
    channels = model.batches[0].channels
    attributes = [(c.name, c.dimension) for c in channels if c.kind == "attribute"]
    if options.curvatures:
        attributes += [(name, 1) for name in CURVATURES]
    names = [model.name, *(part.name for part in model.parts), *options.overlays]
    if options.wired:
        names.append(WIRES)
        curves, samples = most_isocurves(model, options.resolution, options.isocurves)
        if options.solid_wires:
            more = most_solids(curves, samples, options)
            vertices, triangles, quads = vertices + more[0], triangles + more[1], quads + more[2]
            # A tube is a grid between two bends, and one at each end.
            grids += 3 * curves
        else:
            points += samples
            segments += samples - curves
    return MeshSize(
        vertices,
        triangles,
        quads,
        grids,
        named=len(names) - 1,
        name_bytes=sum(len(name.encode()) for name in names),
        overlay_points=points,
        overlay_segments=segments,
        overlay_cells=cells,
        control_points=control_points,
        colors=sum(c.dimension for c in channels if c.kind == "colors"),
        attributes=tuple(attributes),
    )
