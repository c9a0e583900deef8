"""Upper bounds of the counts of a mesh: from the shapes of its surface, or from its patches."""

from collections.abc import Sequence
from dataclasses import astuple, replace

from service.bases import triangle
from service.encoders.content import MAX_LISTED_FACES
from service.encoders.format import Format, MeshSize
from service.engine.mesh.mesh import CURVATURE_NAMES
from service.engine.options import MeshOptions
from service.engine.plans.counts import Counts
from service.engine.sweeps.sweep import predict_sweep
from service.engine.tessellate import predict_size
from service.engine.wires.divisions import bound_isocurves
from service.engine.wires.draw import NAME as WIRES
from service.engine.wires.draw import bound_solid_counts
from service.surface.brep_model import BrepModel
from service.surface.curve_model import SweepModel
from service.surface.lowered import GroupModel, Model, SingleModel
from service.surface.sizes import SurfaceSize


def count_samples(size: SurfaceSize, options: MeshOptions) -> int:
    """The number of samples of a mesh, before vertices are added at bends or removed by welding."""
    ru, rv = options.resolution
    swept_vertices = size.swept_vertices * ru
    if not options.has_faces:
        return swept_vertices
    return (
        swept_vertices
        + size.grids * (ru + 1) * (rv + 1)
        + size.triangles * triangle.count_points(max(ru, rv))
    )


def mesh_counts(size: SurfaceSize, options: MeshOptions) -> Counts:
    """Upper bounds of the vertices, triangles and quads of a mesh by resolution.

    The bounds are exact for patches that do not meet, with equal divisions along u and v; except
    that quads along collapsed sides become triangles, so that triangles are allowed for each
    border. Welding and collapsed sides only reduce the numbers of vertices and of faces.
    """
    (ru, rv), has_quads = options.resolution, options.faces == "quads"
    vertices, triangles, quads, max_divisions = count_samples(size, options), 0, 0, max(ru, rv)
    if options.has_faces:
        quads, border_quads = size.grids * ru * rv, 2 * (ru + rv) * size.grids
        triangles = size.triangles * max_divisions**2 + (border_quads if has_quads else 2 * quads)
        if ru != rv:
            # Neighbours may divide two of the four edges more finely, which adds samples on these
            # edges. A grid of one division then also gets a line of samples inside.
            vertices += size.grids * (2 * max_divisions + (max_divisions + 1) * (min(ru, rv) < 2))
            # A patch has fewer quads than samples, and fewer triangles than twice its samples.
            quads, triangles = max(quads, vertices), 2 * vertices
    swept_quads = size.swept_vertices * ru + size.extra_vertices
    return Counts(
        vertices + size.extra_vertices,
        triangles + 2 * swept_quads,
        quads + swept_quads if has_quads else 0,
    )


def mesh_size(
    size: SurfaceSize, options: MeshOptions, fmt: Format, counts: Counts | None = None
) -> MeshSize:
    """Upper bounds of the counts of a mesh and its overlays.

    `counts`, if given, replace the bounds of `mesh_counts` for the faces of the surface.
    """
    counts = counts or mesh_counts(size, options)
    vertices, triangles, quads = counts.vertices, counts.triangles, counts.quads
    points = segments = cells = 0
    names: list[str] = [*options.overlays]
    # Caps and bends divide a sweep into grids, and each adds at least 2 vertices.
    patches, max_divisions = size.patches + size.extra_vertices // 2, max(options.resolution)
    if "control_net" in options.overlays:
        points, segments, cells = size.net_points, size.net_segments, size.net_cells
    if "boundary" in options.overlays:
        segments += 4 * size.patches * max_divisions
        points += 4 * size.patches * (max_divisions + 1)
    if options.has_wires:
        names.append(WIRES)
        curves, samples = bound_isocurves(
            size.grids, size.triangles, options.resolution, options.isocurves
        )
        if options.has_solid_wires:
            solids = Counts(*bound_solid_counts(curves, samples, options))
            vertices += solids.vertices
            triangles += solids.triangles
            quads += solids.quads
            # A tube has a grid for its side and a grid at each end.
            patches += 3 * curves
        else:
            points, segments = points + samples, segments + samples - curves
    attributes = size.attributes if "attribute" in fmt.carries else ()
    if options.curvatures and "attribute" in fmt.carries:
        attributes += tuple((name, 1) for name in CURVATURE_NAMES)
    listed = min(2 * MAX_LISTED_FACES, size.patches) if options.orient else 0
    letters = size.members * sum(map(len, names))
    # In formats without nodes, vertices have the colours of the faces of breps.
    colors = 4 if size.face_colors and fmt.encode_scene is None else size.colors
    return MeshSize(
        vertices,
        triangles,
        quads,
        patches,
        size.control_points,
        drawables=size.parts + size.face_colors + size.members * len(names),
        name_bytes=size.name_bytes + len(names) * size.label_bytes + letters,
        overlay_points=points,
        overlay_segments=segments,
        overlay_cells=cells,
        colors=colors if "colors" in fmt.carries else 0,
        attributes=attributes,
        faces=size.faces,
        placed_faces=size.placed_faces,
        defined_faces=size.defined_faces,
        face_name_bytes=size.face_name_bytes,
        listed_patches=listed,
    )


def adaptive_size(
    mesh: MeshSize, options: MeshOptions, triangles: int, *, has_sweeps: bool = False
) -> MeshSize:
    """The size of a mesh by tolerance with this number of triangles.

    Each triangle adds at most one vertex, and one point and one segment of lines; with tubes and
    ribbons two vertices, because rings end where they begin, with other texture coordinates.
    Patches, names and attributes are those of `mesh`.
    """
    added_points = triangles if "boundary" in options.overlays or options.has_wires else 0
    return replace(
        mesh,
        vertices=(1 + has_sweeps) * triangles + 2 * (mesh.patches + mesh.faces),
        triangles=triangles,
        quads=0,
        overlay_points=mesh.overlay_points + added_points,
        overlay_segments=mesh.overlay_segments + added_points,
    )


def count_models(model: Model, options: MeshOptions) -> tuple[Counts, Counts]:
    """Upper bounds of the counts of a mesh, from the lowered surface.

    They are closer than bounds from a `SurfaceSize`, because the patches show which
    neighbours divide an edge more finely, and how a curve bends.

    Returns
    -------
    distinct_counts, all_counts : Counts
        The counts if each distinct model of a group counts once, and if all copies count.
    """
    models = model.models if isinstance(model, GroupModel) else (model,)
    return sum_counts(model, [_count(submodel, options) for submodel in models])


def _count(model: SingleModel, options: MeshOptions) -> Counts:
    if isinstance(model, SweepModel):
        return Counts(*predict_sweep(model, options)[:3])
    if isinstance(model, BrepModel):
        return Counts(0, 0, 0)  # a mesh by resolution has no breps
    return Counts(*predict_size(model, options)) if options.has_faces else Counts(0, 0, 0)


def sum_counts(model: Model, counts: Sequence[Counts]) -> tuple[Counts, Counts]:
    """The sums of the counts of a group's models: each model once, and for all copies."""
    copy_counts = counts
    if isinstance(model, GroupModel):
        copy_counts = [counts[member.model] for member in model.members]
    distinct_counts, all_counts = (
        Counts(*map(sum, zip(*map(astuple, summands), strict=True)))
        for summands in (counts, copy_counts)
    )
    return distinct_counts, all_counts
