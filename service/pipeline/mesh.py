"""The mesh file of a surface, in four steps: lower, check, build, encode."""

from dataclasses import dataclass, fields, replace
from functools import partial
from operator import attrgetter

from service.encoders.format import Content, EncodeOptions, Format
from service.engine.bounds.mesh_deviation import round_up
from service.engine.build import build, build_scene, draw_lines
from service.engine.curvatures.placement_scale import add_stretches
from service.engine.joining.join import Allow, allow_any
from service.engine.mesh.mesh import Mesh, MeshReport
from service.engine.models import keep_model_channels
from service.engine.options import MeshOptions
from service.engine.quantize import quantize
from service.engine.scenes.scene import Scene, move_to_zero
from service.pipeline.adaptive import build_within_budget, check_content, prepare_meshes
from service.pipeline.checks import require_patches
from service.pipeline.cost import Work
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.mesh_plan import PLAIN, MeshPlan, build_plan
from service.pipeline.orienting import orient
from service.schemas.options import MeshOptionFields
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sizes import SurfaceKind

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


def plan_mesh(
    surface: SurfaceKind,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
) -> Work[MeshFile]:
    """Plan a mesh file; raises the errors of `build_plan`."""
    plan = build_plan(surface, options, fmt, encode, limits)
    return Work(plan.cost, partial(make_file, plan, surface))


def make_file(plan: MeshPlan, surface: SurfaceKind) -> MeshFile:
    """Make the file: orient if asked, lower, check, build, encode.

    Raises
    ------
    InvalidRequest, TooLarge
        The patches show that the mesh is impossible or too large.
    """
    fmt, accuracy = plan.fmt, plan.options.accuracy
    if plan.options.orient:
        surface, orientation = orient(surface, plan.options.weld_tolerance)
        plan = replace(plan, orientation=orientation)
    model, options = keep_storable_channels(surface.lower(), plan.options, fmt)
    plan.check(model, options)
    if plan.encode.exact and fmt.encode_exact is not None:
        patches = require_patches(model)
        content: Content = fmt.encode_exact(patches, draw_lines(patches, options))
        return MeshFile(content, None, surface.name)
    if accuracy is not None and accuracy.is_budgeted:
        mesh, content = build_within_budget(plan, model, options, accuracy)
    else:
        mesh = build_planned(plan, model, options)
        content = plan.encode_mesh(mesh)
        check_content(content, accuracy)
    return MeshFile(content, _report(plan, mesh), surface.name)


def build_planned(plan: MeshPlan, model: Model, options: MeshOptions) -> Mesh | Scene:
    """Build the mesh; or, for a group in a format with nodes, a scene of several meshes."""
    if options.accuracy is not None:
        build, _ = prepare_meshes(plan, model, options)
        return build(options.accuracy, None)
    is_quantized = plan.encode.quantize
    if isinstance(model, GroupModel) and plan.fmt.encode_scene is not None:
        scene = build_scene(
            model,
            options,
            is_float32=plan.fmt.is_float32,
            is_quantized=is_quantized,
            allow=plan.check_split,
        )
        return plan.note_facts(scene)
    mesh = build_mesh(model, options, plan.fmt, plan.check_split)
    return plan.note_facts(quantize(mesh, model, options) if is_quantized else mesh)


def _report(plan: MeshPlan, mesh: Mesh | Scene) -> MeshReport:
    """The report on the mesh; its bound includes the rounding of the vertices in the file."""
    report = mesh.report
    # Only formats that write fewer digits than positions have move vertices; these formats have
    # no scenes.
    if report.deviation_bound is None or isinstance(mesh, Scene) or not plan.fmt.coarseness:
        return report
    move_bound = plan.fmt.coarseness(mesh, plan.encode)
    if not move_bound:
        return report
    return replace(report, deviation_bound=round_up(report.deviation_bound + move_bound))


def render(
    surface: SurfaceKind,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
) -> bytes:
    """The mesh file of a surface; raises the errors of `plan_mesh` and `make_file`."""
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
