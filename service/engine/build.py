"""From a model of any form to what formats write: its mesh, its scene or its lines."""

from service.engine.adaptive.meshing import meshing
from service.engine.adaptive.storage import Storage
from service.engine.adaptive.tolerances import goal_of
from service.engine.joining.join import Allow, allow_any, join
from service.engine.joining.members import join_group
from service.engine.mesh.mesh_value import Mesh, Overlay
from service.engine.options import MeshOptions
from service.engine.quantize import gridded
from service.engine.scenes.apart import told_apart
from service.engine.scenes.scene import Scene, arranged, flattened, in_single
from service.engine.sweeps.sweep import sweep
from service.engine.tessellate import overlays_of, tessellate
from service.engine.wires.draw import line_overlay, with_wires, without_faces
from service.engine.wires.isocurves import isocurves
from service.measuring import Measured
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sweep_model import SweepModel

MOST = 1 << 31
"""Triangles of a mesh by tolerance where nobody limits them."""


def build(
    model: Model, options: MeshOptions, *, single: bool = False, allow: Allow = allow_any
) -> Mesh:
    """The model as one mesh; `single` and `allow` as in `tessellate`."""
    if options.accuracy is not None and not isinstance(model, SweepModel):
        storage, goal = Storage(single, local=True), goal_of(options.accuracy, model)
        made = meshing(model, options, storage, nodes=False).made(goal, MOST)
        return flattened(made) if isinstance(made, Scene) else made
    if isinstance(model, GroupModel):
        mesh = flattened(build_scene(model, options, allow=allow))
        return in_single(mesh) if single else mesh
    return _alone(model, options, single, allow)


def _alone(
    model: PatchModel | SweepModel, options: MeshOptions, single: bool, allow: Allow
) -> Mesh:
    """The mesh of a model that is no group."""
    if isinstance(model, SweepModel):
        with Measured("sweep"):
            return sweep(model, options, single=single)
    if options.wired or not options.surface:
        model, _ = join(model, options.weld_tolerance, allow)
    if options.surface:
        mesh = tessellate(model, options, single=single, allow=allow)
    else:
        mesh = without_faces(model, options, single=single)
    if options.wired:
        curves = isocurves(model, options.resolution, options.isocurves)
        mesh = with_wires(mesh, model, options, curves)
    return mesh


def lines_of(model: PatchModel, options: MeshOptions) -> tuple[Overlay, ...]:
    """The lines that are asked for, in float64 and model coordinates, where there is no mesh."""
    overlays = overlays_of(model, options)
    if options.wired:
        curves = isocurves(model, options.resolution, options.isocurves)
        overlays = (*overlays, line_overlay(curves))
    return overlays


def build_scene(
    model: GroupModel,
    options: MeshOptions,
    *,
    single: bool = False,
    quantized: bool = False,
    allow: Allow = allow_any,
) -> Scene:
    """The group with every different model meshed once, members that meet along edges apart.

    `quantized` puts positions on the grids of the models.
    """
    if options.accuracy is not None:
        storage, goal = Storage(single, local=True), goal_of(options.accuracy, model)
        made = meshing(model, options, storage, nodes=True).made(goal, MOST)
        if isinstance(made, Scene):
            return made
    joined = join_group(model, options, allow)
    meshes = tuple(_alone(m, options, single, allow) for m in joined.group.models)
    scene = arranged(joined.group, meshes)
    on = gridded(scene, joined.group, options) if quantized else scene
    assert isinstance(on, Scene)
    return told_apart(on, joined, is_welded=options.weld)
