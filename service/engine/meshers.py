"""The mesher of a model of any form: all that its meshes by tolerance share is computed once.

The goal of a group is converted to the units of each model; meshes of models become a scene.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from math import pi
from typing import Protocol

from service.engine.accuracy import Accuracy
from service.engine.adaptive.borders.curves import SideNormals, build_side_normals
from service.engine.adaptive.limits import Effort
from service.engine.adaptive.meshing import ModelMesher
from service.engine.adaptive.tolerances import build_model_goals, separate_copies
from service.engine.bounds.goal import Goal
from service.engine.brep.mesher import BrepMesher
from service.engine.brep.preparation.prepare import prepare
from service.engine.brep.prepared import PreparedBrep
from service.engine.joining.join import join
from service.engine.joining.members import JoinedGroup, join_group, separate_members
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.quantize import find_grid_steps
from service.engine.round_sweeps.mesher import SweepMesher
from service.engine.scenes.flattening import flatten
from service.engine.scenes.scene import Scene, arrange, round_to_single
from service.engine.stored_positions import Storage
from service.errors import InvalidRequest
from service.surface.brep_model import BrepModel
from service.surface.curve_model import SweepModel
from service.surface.lowered import GroupModel, Model, SingleModel

COPY_WEIGHT = 1 / 16
"""The weight of a copy in the limits of triangles and vertices, if the file stores its mesh only
once."""


def weigh_copies(copies: int) -> float:
    """The number by which a mesh counts in these limits, if this number of copies share it."""
    return max(1.0, copies * COPY_WEIGHT)


class Mesher(Protocol):
    """Builds meshes of one model by tolerance."""

    @property
    def model(self) -> Model:
        """The model, with the boxes of prepared breps: goals are shares of its diagonal."""
        ...

    def build_mesh(self, goal: Goal, most: int, effort: Effort | None = None) -> Mesh | Scene:
        """The mesh that meets a goal, in the coordinates of the model.

        Parameters
        ----------
        goal : Goal
        most : int
            Largest number of triangles.
        effort : Effort, optional
            Limit of the work of all meshes of a request.

        Raises
        ------
        InvalidRequest
            `tolerance_too_small` if the tolerance is below the rounding errors.
        TooLarge
            `too_many_triangles` or `too_costly`, as soon as it is known that a limit is too low.
        """
        ...


class GroupMesher:
    """Builds scenes of a group: each different model is meshed once, for all its copies.

    If the goal has a camera, every copy has a mesh of its own.

    Parameters
    ----------
    joined : JoinedGroup
        A group of any models.
    breps : mapping from int to PreparedBrep
        The prepared breps, by the identity of their models.
    options : MeshOptions
    storage : Storage
    has_nodes : bool
        Whether the format stores meshes and placements separately; otherwise the result is one
        mesh.
    is_quantized : bool
        Whether positions are rounded to grids; only for formats with nodes.
    """

    def __init__(
        self,
        joined: JoinedGroup,
        breps: Mapping[int, PreparedBrep],
        options: MeshOptions,
        storage: Storage,
        *,
        has_nodes: bool,
        is_quantized: bool,
    ) -> None:
        accuracy = options.accuracy or Accuracy()
        has_camera = accuracy.camera is not None or options.places
        # A budget of triangles is for all copies together.
        self._shares_meshes = has_nodes and accuracy.max_triangles is None
        self._joined, self._is_welded = joined, options.weld
        self.model = separate_copies(joined.group) if has_camera else joined.group
        self._storage, self._has_nodes = storage, has_nodes
        # If copies become one mesh, they are placed before they are rounded.
        node_storage = storage if has_nodes else Storage()
        models = self.model.models
        steps = find_grid_steps(self.model, options) if is_quantized else (0.0,) * len(models)
        self._meshers: list[ModelMesher | BrepMesher | SweepMesher] = []
        for model, step in zip(models, steps, strict=True):
            stored = replace(node_storage, step=step)
            if isinstance(model, BrepModel):
                self._meshers.append(BrepMesher(breps[id(model)], options, stored))
            elif isinstance(model, SweepModel):
                self._meshers.append(SweepMesher(model, options, stored))
            else:
                self._meshers.append(ModelMesher(model, options, stored))

    def build_mesh(self, goal: Goal, most: int, effort: Effort | None = None) -> Mesh | Scene:
        """The scene or the mesh that meets a goal; errors are those of `Mesher`."""
        group, low, high = self.model, *self.model.bounds
        is_rounded_last = self._storage.is_float32 and not self._has_nodes
        origin = self._storage.choose_origin(low, high)
        rounding = (
            self._storage.bound_storage_rounding(origin, low, high) if is_rounded_last else 0.0
        )
        goals = build_model_goals(goal, group, rounding)
        copies = Counter(member.model for member in group.members)
        meshes = []
        normals = self._build_normals() if goal.angle < pi else {}
        for number, (mesher, model_goal) in enumerate(zip(self._meshers, goals, strict=True)):
            weight = weigh_copies(copies[number]) if self._shares_meshes else copies[number]
            most_of_copy = int(most / weight)
            if isinstance(mesher, ModelMesher):
                mesh = mesher.build_mesh(model_goal, most_of_copy, effort, normals.get(number))
            else:
                mesh = mesher.build_mesh(model_goal, most_of_copy, effort)
            most -= int(len(mesh.triangles) * weight)
            meshes.append(mesh)
        scene = separate_members(
            arrange(group, tuple(meshes)), self._joined, is_welded=self._is_welded
        )
        if self._has_nodes:
            return scene
        flat_mesh = flatten(scene)
        return round_to_single(flat_mesh, origin) if is_rounded_last else flat_mesh

    def _build_normals(self) -> dict[int, SideNormals]:
        """The normals along the edges of all models of patches, by the numbers of the models."""
        numbers = [k for k, each in enumerate(self._meshers) if isinstance(each, ModelMesher)]
        sides = [
            (each.model.batches, each.seams)
            for each in self._meshers
            if isinstance(each, ModelMesher)
        ]
        return dict(zip(numbers, build_side_normals(sides), strict=True)) if numbers else {}


def build_mesher(
    model: Model,
    options: MeshOptions,
    storage: Storage,
    *,
    has_nodes: bool,
    is_quantized: bool = False,
) -> Mesher:
    """The mesher of a model or group; see `GroupMesher` for the parameters.

    Raises
    ------
    InvalidRequest
        A brep is invalid (`prepare`); pointers are relative to the surface.
    """
    if isinstance(model, GroupModel):
        group, breps = _prepare_breps(model)
        joined = join_group(group, options)
        return GroupMesher(
            joined, breps, options, storage, has_nodes=has_nodes, is_quantized=is_quantized
        )
    if isinstance(model, BrepModel):
        prepared = prepare(model)
        step = find_grid_steps(prepared.model, options)[0] if is_quantized else 0.0
        return BrepMesher(prepared, options, replace(storage, step=step), paints=not has_nodes)
    if isinstance(model, SweepModel):
        step = find_grid_steps(model, options)[0] if is_quantized else 0.0
        return SweepMesher(model, options, replace(storage, step=step))
    model, seams = join(model, options.weld_tolerance)
    step = find_grid_steps(model, options)[0] if is_quantized else 0.0
    return ModelMesher(model, options, replace(storage, step=step), seams)


def _prepare_breps(group: GroupModel) -> tuple[GroupModel, dict[int, PreparedBrep]]:
    """The group with the boxes of its prepared breps, and these, by the identity of their models.

    Models that differ only in their stretch are prepared once.
    """
    breps: dict[int, PreparedBrep] = {}
    prepared_of: dict[int, PreparedBrep] = {}
    models: list[SingleModel] = []
    for number, model in enumerate(group.models):
        if not isinstance(model, BrepModel):
            models.append(model)
            continue
        key = id(model.vertices)
        if key not in prepared_of:
            try:
                prepared_of[key] = prepare(model)
            except InvalidRequest as error:
                raise error.within(group.locate(number)) from None
        low, high = prepared_of[key].box
        boxed = replace(model, prepared_box=(low, high))
        prepared = replace(prepared_of[key], model=boxed)
        breps[id(prepared.model)] = prepared
        models.append(prepared.model)
    return replace(group, models=tuple(models)), breps
