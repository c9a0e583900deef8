"""Builds the mesh or the scene of a model, by resolution or by tolerance, without limits."""

from service.engine import build as by_resolution
from service.engine.adaptive.tolerances import build_goal
from service.engine.mesh.mesh import Mesh
from service.engine.meshers import build_mesher
from service.engine.options import MeshOptions
from service.engine.scenes.scene import Scene
from service.engine.stored_positions import Storage
from service.surface.brep_model import BrepModel
from service.surface.curve_model import SweepModel
from service.surface.lowered import GroupModel, Model, PatchModel

MAX_TRIANGLES = 1 << 31
"""The most triangles of a mesh by tolerance: no limit in practice."""


def build(model: Model, options: MeshOptions, *, is_float32: bool = False) -> Mesh:
    """The model as one mesh; sweeps have meshes by resolution only."""
    if options.accuracy is None or isinstance(model, SweepModel):
        return by_resolution.build(model, options, is_float32=is_float32)
    mesh = _build_by_tolerance(model, options, is_float32=is_float32, has_nodes=False)
    assert isinstance(mesh, Mesh)
    return mesh


def build_scene(model: GroupModel, options: MeshOptions, *, is_float32: bool = False) -> Scene:
    """The scene of a group."""
    if options.accuracy is None:
        return by_resolution.build_scene(model, options, is_float32=is_float32)
    scene = _build_by_tolerance(model, options, is_float32=is_float32, has_nodes=True)
    assert isinstance(scene, Scene)
    return scene


def _build_by_tolerance(
    model: Model, options: MeshOptions, *, is_float32: bool, has_nodes: bool
) -> Mesh | Scene:
    assert options.accuracy is not None
    assert isinstance(model, PatchModel | BrepModel | GroupModel)
    storage = Storage(is_float32, has_local_origin=True)
    mesher = build_mesher(model, options, storage, has_nodes=has_nodes)
    return mesher.build_mesh(build_goal(options.accuracy, model), MAX_TRIANGLES)
