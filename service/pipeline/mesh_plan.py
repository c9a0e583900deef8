"""The plan of a mesh: its size and its cost, checked against the limits before it is built."""

from dataclasses import dataclass, replace
from functools import lru_cache

from service.cancellation import checkpoint
from service.encoders.format import Content, EncodeOptions, Format, MeshSize
from service.engine.mesh.mesh import Mesh, Orientation
from service.engine.options import MeshOptions
from service.engine.plans.counts import Counts
from service.engine.scenes.scene import Scene
from service.engine.tessellate import predict_size
from service.pipeline.brep_checks import (
    check_brep_options,
    check_preparation,
    settle_accuracy,
)
from service.pipeline.checks import (
    check_bytes,
    check_model,
    check_options,
    check_surface,
    check_vertices,
)
from service.pipeline.cost import Cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.mesh_costs import adaptive_cost, mesh_cost
from service.pipeline.mesh_counts import count_models, count_samples, mesh_size
from service.pipeline.orienting import plan_orientation
from service.surface.lowered import Model, PatchModel
from service.surface.sizes import SurfaceKind, SurfaceSize

PLAIN = EncodeOptions()
"""The default options of a file."""


@dataclass(frozen=True, slots=True)
class MeshPlan:
    """The plan of a mesh file. As far as the shapes of the surface show, the mesh is possible.

    Attributes
    ----------
    options, fmt, encode, limits
        The options of the mesh, the format and its options, and the limits of the request.
    surface_size, counted_size, distinct_size : SurfaceSize
        The size of all surfaces in a group, of those whose meshes the file stores, and of the
        distinct ones.
    size, stored : MeshSize
        Upper bounds of the counts of the mesh, for all copies of the surfaces in a group; and of
        the counts that the format stores, where copies may share one mesh.
    max_triangles : int
        The most triangles of a mesh by tolerance; 0 for a mesh by resolution.
    file_bytes : int
        Upper bound of the bytes of the file.
    is_certain : bool
        Whether these bounds are final. If not, `check` computes closer bounds from the patches.
    unjoined_memory : int
        The memory in bytes if no members of a group meet; `cost` includes the case that they meet.
    cost : Cost
    metres_per_unit : float or None
        The unit of the coordinates of the surface, in metres; None if it is not known.
    orientation : Orientation or None
        What was turned, if the options ask for it; `make_file` sets it.
    """

    options: MeshOptions
    fmt: Format
    encode: EncodeOptions
    limits: Limits
    surface_size: SurfaceSize
    counted_size: SurfaceSize
    distinct_size: SurfaceSize
    size: MeshSize
    stored: MeshSize
    max_triangles: int
    file_bytes: int
    is_certain: bool
    unjoined_memory: int
    cost: Cost
    metres_per_unit: float | None = None
    orientation: Orientation | None = None

    def note_facts(self, mesh: Mesh | Scene) -> Mesh | Scene:
        """The mesh or scene, with the unit and the orientation of the surface in its report."""
        if self.metres_per_unit is None and self.orientation is None:
            return mesh
        report = replace(
            mesh.report, metres_per_unit=self.metres_per_unit, orientation=self.orientation
        )
        return replace(mesh, report=report)

    def check(
        self, model: Model, options: MeshOptions, counts: tuple[Counts, Counts] | None = None
    ) -> None:
        """Refuse a mesh if its patches show that it is impossible or too large.

        `counts` are the bounds of `count_models`, if the caller has already computed them.
        """
        check_model(model, options, self.limits)
        if self.is_certain:
            return
        distinct_counts, all_counts = counts or count_models(model, options)
        size = mesh_size(self.surface_size, options, self.fmt, all_counts)
        check_vertices(size.vertices + size.overlay_points, self.limits)
        if shares_meshes(self.fmt, self.encode):
            size = mesh_size(self.counted_size, options, self.fmt, distinct_counts)
        check_bytes(self.fmt.byte_bound(size, self.encode), self.fmt, self.limits)

    def check_split(self, *models: PatchModel) -> None:
        """Refuse a mesh with too many vertices after the engine split patches to join borders."""
        vertices = sum(predict_size(model, self.options)[0] for model in models)
        check_vertices(vertices, self.limits)
        growth = max(1.0, vertices / max(self.stored.vertices, 1))
        # If `is_certain` is false, `file_bytes` may be far more than the file will have.
        if self.is_certain:
            check_bytes(round(self.file_bytes * growth), self.fmt, self.limits)
        _check_memory(round(self.unjoined_memory * growth), self.limits)

    def encode_mesh(self, mesh: Mesh | Scene) -> Content:
        """Encode the mesh or scene as a file."""
        checkpoint()
        if isinstance(mesh, Mesh):
            return self.fmt.encode(mesh, self.encode)
        return self.fmt.write_scene(mesh, self.encode)


def build_plan(
    surface: SurfaceKind,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
) -> MeshPlan:
    """Plan a mesh: check options and format, estimate the cost, and check the limits.

    Only the shapes of the surface are used. Planning takes microseconds and little memory.

    Raises
    ------
    InvalidRequest
        The options are impossible for this surface.
    TooLarge
        The surface or the mesh exceeds a limit.
    UnsupportedByFormat
        The format cannot store what the options ask for.
    """
    size = surface.size()
    check_brep_options(size, options, fmt, encode)
    options = settle_accuracy(size, options)
    is_oriented = options.orient and size.patches > 0
    # Copies of equal surfaces may be turned in different ways, and are then different surfaces.
    is_shared = size.members > 1 and not is_oriented
    distinct_size = surface.stored_size() if is_shared else size
    plan = plan_sizes(size, distinct_size, options, (fmt, encode), limits)
    if is_oriented:
        orientation = plan_orientation(size, limits, "/orient")
        memory = max(plan.cost.memory, orientation.memory)
        seconds = plan.cost.seconds + orientation.seconds
        plan = replace(plan, cost=replace(plan.cost, memory=memory, seconds=seconds))
        _check_memory(memory, limits)
    return plan if surface.unit is None else replace(plan, metres_per_unit=surface.unit)


@lru_cache(512)
def plan_sizes(
    complete: SurfaceSize,
    distinct: SurfaceSize,
    options: MeshOptions,
    form: tuple[Format, EncodeOptions],
    limits: Limits,
) -> MeshPlan:
    """The plan for a surface of this size; raises the errors of `build_plan`.

    Plans are cached, because most requests repeat the shape of a surface and the format.

    Parameters
    ----------
    complete, distinct : SurfaceSize
        The size of the surface: if all members of a group count, and if equal members count once.
    options : MeshOptions
    form : (Format, EncodeOptions)
    limits : Limits
    """
    fmt, encode = form
    counted_size = distinct if shares_meshes(fmt, encode) and not options.curvatures else complete
    check_surface(distinct, limits)
    check_preparation(distinct, limits)
    check_options(complete, options, fmt, encode)
    size = mesh_size(complete, options, fmt)
    stored = size if counted_size is complete else mesh_size(counted_size, options, fmt)
    request = (options, fmt, encode, limits, complete, counted_size, distinct, size)
    if options.accuracy is not None:
        triangles, file_bytes, cost = adaptive_cost(
            counted_size, options, stored, form, limits, complete=complete, distinct=distinct
        )
        return MeshPlan(*request, stored, triangles, file_bytes, True, cost.memory, cost)
    ru, rv = options.resolution
    # In the other cases bounds from shapes may be far above bounds from patches.
    is_certain = ru == rv and not (complete.curves or (options.curvatures and complete.members > 1))
    file_bytes = fmt.byte_bound(stored, encode)
    if is_certain:
        check_vertices(size.vertices + size.overlay_points, limits)
        check_bytes(file_bytes, fmt, limits)
    else:
        check_vertices(count_samples(complete, options), limits)
        # `MeshPlan.check` refuses a larger mesh before it is built, so the limits are bounds.
        max_vertices = limits.max_vertices
        stored = replace(
            stored,
            vertices=min(stored.vertices, max_vertices),
            triangles=min(stored.triangles, 2 * max_vertices),
            quads=min(stored.quads, max_vertices),
        )
        file_bytes = min(file_bytes, limits.max_bytes)
    cost = mesh_cost(counted_size, options, stored, file_bytes, form)
    if not is_certain:  # the mesh may be far smaller
        cost = replace(cost, response=0, least_seconds=0.0)
    _check_memory(cost.memory, limits)
    unjoined_memory = cost.memory
    if counted_size is not complete and options.weld_tolerance:
        # Members of a group that meet cannot share a mesh, so each of them is stored.
        all_bytes = min(fmt.byte_bound(size, encode), limits.max_bytes)
        separate_memory = mesh_cost(complete, options, size, all_bytes, form).memory
        cost = replace(cost, memory=max(unjoined_memory, min(separate_memory, limits.max_memory)))
    return MeshPlan(*request, stored, 0, file_bytes, is_certain, unjoined_memory, cost)


def _check_memory(byte_bound: int, limits: Limits) -> None:
    instead = "a lower resolution, or another format, takes less"
    limits.check_memory(byte_bound, "The mesh", "/resolution", instead)


def shares_meshes(fmt: Format, encode: EncodeOptions) -> bool:
    """Whether the format stores equal surfaces of a group only once."""
    return fmt.encode_scene is not None and not fmt.repeats_meshes and not encode.exact


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
