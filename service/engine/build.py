"""Builds the value that a format writes from a model of any form: a mesh, a scene or lines."""

from service.engine.adaptive.meshing import build_mesher
from service.engine.adaptive.tolerances import build_goal
from service.engine.joining.join import Allow, allow_any, join
from service.engine.joining.members import join_group
from service.engine.mesh.mesh_value import Mesh, Overlay
from service.engine.options import MeshOptions
from service.engine.quantize import quantize
from service.engine.scenes.apart import separate_members
from service.engine.scenes.scene import Scene, arrange, flatten, round_to_single
from service.engine.stored_positions import Storage
from service.engine.sweeps.sweep import sweep
from service.engine.tessellate import draw_overlays_alone, tessellate
from service.engine.wires.draw import add_wires, draw_without_faces, line_overlay
from service.engine.wires.isocurves import sample_isocurves
from service.measuring import Measured
from service.surface.curve_model import SweepModel
from service.surface.lowered import GroupModel, Model, PatchModel

MAX_TRIANGLES = 1 << 31
"""The most triangles of a mesh by tolerance: no limit in practice. The limits and budgets of
requests are the task of `service.pipeline.adaptive`, which meshes without this module."""


def build(
    model: Model, options: MeshOptions, *, is_float32: bool = False, allow: Allow = allow_any
) -> Mesh:
    """The model as one mesh.

    Parameters
    ----------
    options : MeshOptions
        Budgets in `options.accuracy` are ignored.
    is_float32 : bool
        Whether positions are float32 about a local origin, else float64 in model coordinates.
    allow : callable
        Raises an error if the cuts along shared borders give a surface too many patches.
    """
    # A sweep has no patches to certify, so its mesh is by resolution.
    if options.accuracy is not None and not isinstance(model, SweepModel):
        storage = Storage(is_float32, has_local_origin=True)
        goal = build_goal(options.accuracy, model)
        mesher = build_mesher(model, options, storage, has_nodes=False)
        result = mesher.build_mesh(goal, MAX_TRIANGLES)
        assert isinstance(result, Mesh)
        return result
    if isinstance(model, GroupModel):
        mesh = flatten(build_scene(model, options, allow=allow))
        return round_to_single(mesh) if is_float32 else mesh
    return _build_single(model, options, is_float32, allow)


def _build_single(
    model: PatchModel | SweepModel, options: MeshOptions, is_float32: bool, allow: Allow
) -> Mesh:
    """The mesh of a model that is not a group."""
    if isinstance(model, SweepModel):
        with Measured("sweep"):
            return sweep(model, options, is_float32=is_float32)
    # Wires and faces are drawn on the same joined model; `tessellate` would join only its own.
    if options.has_wires or not options.has_faces:
        model, _ = join(model, options.weld_tolerance, allow)
    if options.has_faces:
        mesh = tessellate(model, options, is_float32=is_float32, allow=allow)
    else:
        mesh = draw_without_faces(model, options, is_float32=is_float32)
    if options.has_wires:
        curves = sample_isocurves(model, options.resolution, options.isocurves)
        mesh = add_wires(mesh, model, options, curves)
    return mesh


def draw_lines(model: PatchModel, options: MeshOptions) -> tuple[Overlay, ...]:
    """The overlays and isoparametric curves that the options request, for formats without meshes.

    Positions are float64 in model coordinates.
    """
    overlays = draw_overlays_alone(model, options)
    if options.has_wires:
        curves = sample_isocurves(model, options.resolution, options.isocurves)
        overlays = (*overlays, line_overlay(curves))
    return overlays


def build_scene(
    model: GroupModel,
    options: MeshOptions,
    *,
    is_float32: bool = False,
    is_quantized: bool = False,
    allow: Allow = allow_any,
) -> Scene:
    """The scene of a group: the mesh of each distinct model once, and a node for each member.

    Members that meet along edges are meshed together, and then separated into nodes. If
    `is_quantized`, positions are rounded to the 16-bit grids of the models.
    """
    if options.accuracy is not None:
        storage = Storage(is_float32, has_local_origin=True)
        goal = build_goal(options.accuracy, model)
        mesher = build_mesher(model, options, storage, has_nodes=True, is_quantized=is_quantized)
        result = mesher.build_mesh(goal, MAX_TRIANGLES)
        assert isinstance(result, Scene)
        return result
    joined = join_group(model, options, allow)
    meshes = tuple(_build_single(m, options, is_float32, allow) for m in joined.group.models)
    scene = arrange(joined.group, meshes)
    rounded = quantize(scene, joined.group, options) if is_quantized else scene
    assert isinstance(rounded, Scene)
    return separate_members(rounded, joined, is_welded=options.weld)
