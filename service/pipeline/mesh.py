"""The mesh file of a surface, in four steps: lower, check, build, encode."""

from dataclasses import dataclass, fields, replace
from operator import attrgetter

from service.cancellation import checkpoint
from service.encoders.format import EncodeOptions, Format, MeshSize
from service.encoders.split_content import Content
from service.engine.bounds.mesh_deviation import round_up
from service.engine.build import build, build_scene, draw_lines
from service.engine.curvatures.placement_scale import add_stretches
from service.engine.joining.join import Allow, allow_any
from service.engine.mesh.mesh_value import Mesh
from service.engine.mesh.report import MeshReport
from service.engine.models import keep_model_channels
from service.engine.options import MeshOptions
from service.engine.plans.counts import Counts
from service.engine.quantize import quantize
from service.engine.scenes.scene import Scene, move_to_zero
from service.engine.tessellate import predict_size
from service.pipeline.adaptive import AdaptiveMesher, build_within_budget, check_content
from service.pipeline.checks import (
    check_bytes,
    check_model,
    check_vertices,
    count_models,
    require_all_patches,
)
from service.pipeline.cost import Cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.mesh_counts import mesh_size
from service.pipeline.mesh_sizes import estimate_stored_size, plan_sizes, shares_meshes
from service.schemas.options import MeshOptionFields
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sizes import SurfaceKind

PLAIN = EncodeOptions()
"""The default options of a file."""

_get_file_options = attrgetter(*(field.name for field in fields(EncodeOptions)))
"""Reads from the options of a request the values of all fields of `EncodeOptions`, in order."""


@dataclass(frozen=True, eq=False, slots=True)
class MeshFile:
    """A file, the name of its surface, and the report on its mesh.

    A file of exact patches has no mesh; its report is None.
    """

    content: Content
    report: MeshReport | None
    name: str


@dataclass(frozen=True, eq=False, slots=True)
class MeshWork:
    """The work of making a mesh file, and its cost.

    As far as the shapes of the surface show, the mesh is possible and within the limits.

    Attributes
    ----------
    size, stored : MeshSize
        Upper bounds of the counts of the mesh, for all copies of the surfaces in a group; and of
        the counts that the format stores, where copies may share one mesh.
    is_certain : bool
        Whether these bounds are final. If not, `check` computes closer bounds from the patches.
    is_possible : bool
        Whether the lowered surface needs no check by `check_model`.
    unjoined_memory : int
        The memory in bytes if no members of a group meet; `cost` includes the case that they meet.
    """

    surface: SurfaceKind
    options: MeshOptions
    fmt: Format
    encode: EncodeOptions
    limits: Limits
    size: MeshSize
    stored: MeshSize
    is_certain: bool
    is_possible: bool
    unjoined_memory: int
    cost: Cost

    def run(self) -> MeshFile:
        """Make the file: lower, check, build, encode.

        Raises
        ------
        InvalidRequest, TooLarge
            The patches show that the mesh is impossible or too large.
        """
        model, options = self.lower()
        self.check(model, options)
        if self.is_exact:
            return self.encode_patches(model, options)
        if options.accuracy is not None and options.accuracy.is_budgeted:
            mesh, content = build_within_budget(self, model, options, options.accuracy)
        else:
            mesh = self.build(model, options)
            content = self.encode_mesh(mesh)
            if options.accuracy is not None:
                check_content(content, options.accuracy)
        return MeshFile(content, self.report(mesh), self.surface.name)

    @property
    def is_exact(self) -> bool:
        """Whether the file has the patches themselves, not a mesh."""
        return self.fmt.encode_exact is not None and self.encode.exact

    def lower(self) -> tuple[Model, MeshOptions]:
        """Lower the surface; model and options get no data that the format cannot store."""
        return keep_storable_channels(self.surface.lower(), self.options, self.fmt)

    def check(
        self, model: Model, options: MeshOptions, counts: tuple[Counts, Counts] | None = None
    ) -> None:
        """Refuse a mesh if its patches show that it is impossible or too large.

        `counts` are the bounds of `count_models`, if the caller has already computed them.
        """
        if not self.is_possible:
            check_model(model, options, self.limits)
        if self.is_certain:
            return
        distinct_counts, all_counts = counts or count_models(model, options)
        fmt, encode = self.fmt, self.encode
        size = mesh_size(self.surface.size(), options, fmt, all_counts)
        check_vertices(size.vertices + size.overlay_points, self.limits)
        if shares_meshes(fmt, encode):
            size = mesh_size(
                estimate_stored_size(self.surface, options, fmt, encode),
                options,
                fmt,
                distinct_counts,
            )
        check_bytes(fmt.byte_bound(size, encode), fmt, self.limits)

    def check_split(self, *models: PatchModel) -> None:
        """Refuse a mesh with too many vertices after the engine split patches to join borders."""
        vertices = sum(predict_size(model, self.options)[0] for model in models)
        check_vertices(vertices, self.limits)
        growth = max(1.0, vertices / max(self.stored.vertices, 1))
        # If `is_certain` is false, `cost.bytes` may be far more than the file will have.
        if self.is_certain:
            check_bytes(round(self.cost.bytes * growth), self.fmt, self.limits)
        instead = "a lower resolution, or another format, takes less"
        self.limits.check_memory(
            round(self.unjoined_memory * growth), "The mesh", "/resolution", instead
        )

    def build(self, model: Model, options: MeshOptions) -> Mesh | Scene:
        """Build the mesh; or, for a group in a format with nodes, a scene of several meshes."""
        if options.accuracy is not None:
            return AdaptiveMesher(self, model, options).build(options.accuracy)
        if isinstance(model, GroupModel) and self.fmt.encode_scene is not None:
            is_float32, is_quantized = self.fmt.is_float32, self.encode.quantize
            return build_scene(
                model,
                options,
                is_float32=is_float32,
                is_quantized=is_quantized,
                allow=self.check_split,
            )
        mesh = build_mesh(model, options, self.fmt, self.check_split)
        return quantize(mesh, model, options) if self.encode.quantize else mesh

    def encode_mesh(self, mesh: Mesh | Scene) -> Content:
        """Encode the mesh or scene as a file."""
        checkpoint()
        if isinstance(mesh, Mesh):
            return self.fmt.encode(mesh, self.encode)
        return self.fmt.write_scene(mesh, self.encode)

    def encode_patches(self, model: Model, options: MeshOptions) -> MeshFile:
        """Encode the patches themselves as a file."""
        assert self.fmt.encode_exact is not None
        patches = require_all_patches(model)
        content = self.fmt.encode_exact(patches, draw_lines(patches, options))
        return MeshFile(content, None, self.surface.name)

    def report(self, mesh: Mesh | Scene) -> MeshReport:
        """The report on the mesh; its bound includes the rounding of the vertices in the file."""
        report = mesh.report
        # Only formats that write fewer digits than positions have move vertices; these formats have
        # no scenes.
        if report.deviation_bound is None or isinstance(mesh, Scene) or not self.fmt.coarseness:
            return report
        move_bound = self.fmt.coarseness(mesh, self.encode)
        if not move_bound:
            return report
        return replace(report, deviation_bound=round_up(report.deviation_bound + move_bound))


def plan_mesh(
    surface: SurfaceKind,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
) -> MeshWork:
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
    distinct_size = size if size.members == 1 else surface.stored_size()
    plan = plan_sizes(size, distinct_size, options, (fmt, encode), limits)
    return MeshWork(surface, options, fmt, encode, limits, *plan)


def render(
    surface: SurfaceKind,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
) -> bytes:
    """Plan and make the mesh file of a surface; raises the errors of `plan_mesh` and `MeshWork`."""
    return bytes(plan_mesh(surface, options, fmt, encode, limits).run().content)


def select_encode_options(options: MeshOptionFields) -> EncodeOptions:
    """The options of a request that the encoders read."""
    return EncodeOptions(*_get_file_options(options))


def build_mesh(model: Model, options: MeshOptions, fmt: Format, allow: Allow = allow_any) -> Mesh:
    """Build the mesh of a model in the precision and coordinates that the format stores.

    `allow` is called with models whose patches were split to join borders; it may refuse them.
    """
    mesh = build(model, options, is_float32=fmt.is_float32, allow=allow)
    return mesh if fmt.has_local_origin else move_to_zero(mesh)


def keep_storable_channels(
    model: Model, options: MeshOptions, fmt: Format
) -> tuple[Model, MeshOptions]:
    """Remove from a model, and from its options, the data that the format cannot store.

    Colours and attributes belong to the surface, not to a request, so a format without them does
    not refuse the surface. If they are removed early, they take no time and duplicate no vertices.
    """
    uvs = options.uvs and "uvs" in fmt.carries
    curvatures = options.curvatures and "attribute" in fmt.carries
    if not (isinstance(model, PatchModel) and not model.batches[0].channels):
        model = keep_model_channels(model, fmt.carries, has_nodes=fmt.encode_scene is not None)
    if options.curvatures:
        # Also for formats without curvatures, so that a request has the same mesh in all formats.
        model = add_stretches(model)
    if (uvs, curvatures) != (options.uvs, options.curvatures):
        options = replace(options, uvs=uvs, curvatures=curvatures)
    return model, options
