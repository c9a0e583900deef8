"""The size and the cost of a mesh, from the shapes of its surface; refuses too large meshes."""

from dataclasses import replace
from functools import lru_cache

from service.encoders.format import EncodeOptions, Format, MeshSize
from service.engine.options import MeshOptions
from service.pipeline.checks import check_bytes, check_options, check_surface, check_vertices
from service.pipeline.cost import Cost, adaptive_cost, mesh_cost
from service.pipeline.limits import Limits
from service.pipeline.mesh_counts import count_samples, mesh_size
from service.surface.sizes import SurfaceKind, SurfaceSize


@lru_cache(512)
def plan_sizes(
    complete: SurfaceSize,
    distinct: SurfaceSize,
    options: MeshOptions,
    form: tuple[Format, EncodeOptions],
    limits: Limits,
) -> tuple[MeshSize, MeshSize, bool, bool, int, Cost]:
    """Check a mesh against the limits, and compute its size and cost.

    The results are cached, because most requests repeat the shape of a surface and the format.

    Parameters
    ----------
    complete, distinct : SurfaceSize
        The size of the surface: if all members of a group count, and if equal members count once.
    options : MeshOptions
    form : (Format, EncodeOptions)
    limits : Limits

    Returns
    -------
    size, stored, is_certain, is_possible, unjoined_memory, cost
        The fields of a `MeshWork`.

    Raises
    ------
    InvalidRequest, TooLarge, UnsupportedByFormat
    """
    fmt, encode = form
    counted_size = distinct if shares_meshes(fmt, encode) and not options.curvatures else complete
    check_surface(distinct, limits)
    check_options(complete, options, fmt, encode)
    size = mesh_size(complete, options, fmt)
    stored = size if counted_size is complete else mesh_size(counted_size, options, fmt)
    is_possible = options.method != "de_casteljau" and not (
        complete.curves or options.has_solid_wires or options.curvatures
    )
    if options.accuracy is not None:
        cost = adaptive_cost(counted_size, options, stored, form, limits)
        return size, stored, True, is_possible, cost.memory, cost
    ru, rv = options.resolution
    # In the other cases bounds from shapes may be far above bounds from patches.
    is_certain = ru == rv and not (complete.curves or (options.curvatures and complete.members > 1))
    file_bytes = fmt.byte_bound(stored, encode)
    if is_certain:
        check_vertices(size.vertices + size.overlay_points, limits)
        check_bytes(file_bytes, fmt, limits)
    else:
        check_vertices(count_samples(complete, options), limits)
        # `MeshWork.check` refuses a larger mesh before it is built, so the limits are bounds.
        max_vertices = limits.max_vertices
        stored = replace(
            stored,
            vertices=min(stored.vertices, max_vertices),
            triangles=min(stored.triangles, 2 * max_vertices),
            quads=min(stored.quads, max_vertices),
        )
        file_bytes = min(file_bytes, limits.max_bytes)
    cost = mesh_cost(counted_size, options, stored, file_bytes, form)
    instead = "a lower resolution, or another format, takes less"
    limits.check_memory(cost.memory, "The mesh", "/resolution", instead)
    unjoined_memory = cost.memory
    if counted_size is not complete and options.weld_tolerance:
        # Members of a group that meet cannot share a mesh, so each of them is stored.
        file_bytes = min(fmt.byte_bound(size, encode), limits.max_bytes)
        separate_memory = mesh_cost(complete, options, size, file_bytes, form).memory
        cost = replace(cost, memory=max(unjoined_memory, min(separate_memory, limits.max_memory)))
    return size, stored, is_certain, is_possible, unjoined_memory, cost


def shares_meshes(fmt: Format, encode: EncodeOptions) -> bool:
    """Whether the format stores equal surfaces of a group only once."""
    return fmt.encode_scene is not None and not encode.exact


def estimate_stored_size(
    surface: SurfaceKind, options: MeshOptions, fmt: Format, encode: EncodeOptions
) -> SurfaceSize:
    """The size of the surfaces whose meshes a file stores.

    If curvatures are written, each member of a group counts, because the curvatures of equal
    surfaces may differ by their placements.
    """
    if shares_meshes(fmt, encode) and not options.curvatures:
        return surface.stored_size()
    return surface.size()
