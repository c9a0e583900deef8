"""Builds what a format writes from a model of any form, by resolution: a mesh, a scene or lines.

`service.engine.meshers` builds meshes by tolerance.
"""

import numpy as np

from service.engine.extent import AT_ZERO
from service.engine.joining.join import Allow, allow_any, join
from service.engine.joining.members import join_group, separate_members
from service.engine.mesh.mesh import Mesh, Overlay
from service.engine.mesh.overlays import draw_overlays
from service.engine.models import TRIMMED
from service.engine.options import MeshOptions
from service.engine.quantize import quantize
from service.engine.scenes.flattening import flatten
from service.engine.scenes.scene import Scene, arrange, round_to_single
from service.engine.sweeps.sweep import sweep
from service.engine.tessellate import tessellate
from service.engine.wires.draw import add_wires, draw_without_faces, line_overlay
from service.engine.wires.isocurves import sample_isocurves
from service.errors import InvalidRequest
from service.measuring import Measured
from service.surface.brep_model import BrepModel
from service.surface.curve_model import SweepModel
from service.surface.lowered import GroupModel, Model, PatchModel, SingleModel


def build(
    model: Model, options: MeshOptions, *, is_float32: bool = False, allow: Allow = allow_any
) -> Mesh:
    """The model as one mesh.

    Parameters
    ----------
    options : MeshOptions
        With a resolution; `options.accuracy` is ignored.
    is_float32 : bool
        Whether positions are float32 about a local origin, else float64 in model coordinates.
    allow : callable
        Raises an error if the cuts along shared borders give a surface too many patches.
    """
    if isinstance(model, GroupModel):
        mesh = flatten(build_scene(model, options, allow=allow))
        return round_to_single(mesh) if is_float32 else mesh
    return _build_single(model, options, is_float32, allow)


def _build_single(model: SingleModel, options: MeshOptions, is_float32: bool, allow: Allow) -> Mesh:
    """The mesh of a model that is not a group."""
    if isinstance(model, SweepModel):
        with Measured("sweep"):
            return sweep(model, options, is_float32=is_float32)
    if isinstance(model, BrepModel):
        raise InvalidRequest(TRIMMED)  # the pipeline refuses it before
    # Wires and faces are drawn on the same joined model; `tessellate` would join only its own.
    if options.has_wires or not options.has_faces:
        model, _ = join(model, options.weld_tolerance, allow)
    mesh = (
        tessellate(model, options, is_float32=is_float32, allow=allow)
        if options.has_faces
        else draw_without_faces(model, options, is_float32=is_float32)
    )
    if options.has_wires:
        curves = sample_isocurves(model, options.resolution, options.isocurves)
        mesh = add_wires(mesh, model, options, curves)
    return mesh


def draw_lines(model: PatchModel, options: MeshOptions) -> tuple[Overlay, ...]:
    """The overlays and isoparametric curves that the options request, for formats without meshes.

    Positions are float64 in model coordinates.
    """
    overlays = draw_overlays(model, options, AT_ZERO, np.float64)
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
    joined = join_group(model, options, allow)
    meshes = tuple(_build_single(m, options, is_float32, allow) for m in joined.group.models)
    scene = arrange(joined.group, meshes)
    rounded = quantize(scene, joined.group, options) if is_quantized else scene
    assert isinstance(rounded, Scene)
    return separate_members(rounded, joined, is_welded=options.weld)
