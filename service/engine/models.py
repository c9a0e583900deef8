"""Properties of models of any form, and changes of models before meshing."""

from dataclasses import replace

import numpy as np

from service.engine.options import MeshOptions
from service.engine.scenes.colors import tint
from service.engine.scenes.placing import place_points
from service.engine.wires.draw import find_width
from service.errors import InvalidRequest, Issue
from service.surface.batches import (
    Channel,
    ChannelKind,
    Patches,
    TrianglePatches,
)
from service.surface.brep_model import BrepModel
from service.surface.channels import keep_channels
from service.surface.lowered import (
    Color,
    GroupModel,
    Model,
    Part,
    PatchModel,
    PlacedModel,
    SingleModel,
)
from service.surface.placement import is_mirroring, place_box

NOT_PATCHES = Issue(
    "not_parametric",
    "Tubes and ribbons are meshed along their curves; they are not made of Bézier patches.",
    "",
    "a tube or a ribbon",
    "a surface of patches",
)

TRIMMED = Issue(
    "not_parametric",
    "A brep has no parameters of its own; each of its faces is a part of a surface.",
    "",
    "a brep",
    "the whole surface of one face: POST /v1/convert with the operation `untrim` returns it",
)


def find_largest_coordinate(model: Model, options: MeshOptions) -> float:
    """An upper bound of the absolute coordinates of the patches of a model and of its wires.

    Sweeps have no wires and do not count.
    """
    models = (
        [(model.models[member.model], member.matrix) for member in model.members]
        if isinstance(model, GroupModel)
        else [(model, None)]
    )
    largest = 0.0
    for submodel, matrix in models:
        if isinstance(submodel, PatchModel):
            # A mitre reaches at most √2 radii from the wire, which is less than the wire's width.
            wire_width = find_width(submodel, options)
            low, high = place_box(
                (submodel.bounds[0] - wire_width, submodel.bounds[1] + wire_width), matrix
            )
            largest = max(largest, -float(low.min()), float(high.max()))
    return largest


def keep_model_channels(model: Model, kinds: frozenset[ChannelKind], *, has_nodes: bool) -> Model:
    """The model with only the channels of these kinds.

    If colours are not among the kinds, the base colours of members and those of the faces of breps
    are removed too.

    `has_nodes` says whether the file will have a node with its own mesh for each member of a
    group. If not, the meshes are merged, and only attributes that all members have are kept.
    """
    models = model.models if isinstance(model, GroupModel) else (model,)
    attributes = [_find_attributes(submodel) for submodel in models]
    common = set.union(*attributes) if has_nodes else set.intersection(*attributes)

    def is_kept(channel: Channel) -> bool:
        is_missing = channel.kind == "attribute" and (channel.name, channel.dimension) not in common
        return channel.kind in kinds and not is_missing

    kept_models = tuple(
        keep_channels(each, is_kept)
        if isinstance(each, PatchModel)
        else _keep_colors(each, has_colors="colors" in kinds)
        for each in models
    )
    if not isinstance(model, GroupModel):
        return kept_models[0]
    members = model.members
    if "colors" not in kinds:
        members = tuple(replace(member, color=None) for member in members)
    return replace(model, models=kept_models, members=members)


def _keep_colors(model: SingleModel, *, has_colors: bool) -> SingleModel:
    """The model; a brep without the colours of its faces, if colours are not kept."""
    if has_colors or not isinstance(model, BrepModel):
        return model
    return replace(model, face_colors=np.full(model.face_count, -1))


def to_patches(model: Model) -> PatchModel:
    """The model as Bézier patches in model coordinates.

    A patch is placed by placing its control points: Bézier patches are affinely invariant, also
    rational patches. If a placement mirrors, u and v are exchanged, so that du × dv stays on the
    same side of the surface.

    Raises
    ------
    InvalidRequest
        `not_parametric` for tubes, ribbons and breps; its pointer is relative to the surface.
    """
    if not isinstance(model, GroupModel):
        return _require_patches(model)
    batches: list[Patches] = []
    parts: list[Part] = []
    first = 0
    for member in model.members:
        placed_model = _require_patches(model.models[member.model])
        batches += [_place(batch, member) for batch in placed_model.batches]
        parts.append(Part(member.name, first, first + placed_model.patch_count))
        first += placed_model.patch_count
    return PatchModel(model.name, tuple(batches), tuple(parts), model.up)


def _require_patches(model: SingleModel) -> PatchModel:
    """The model, if it is made of patches."""
    if isinstance(model, PatchModel):
        return model
    raise InvalidRequest(TRIMMED if isinstance(model, BrepModel) else NOT_PATCHES)


def _place(batch: Patches, member: PlacedModel) -> Patches:
    """The patches with their control points placed, in the colour of the member."""
    if is_mirroring(member.matrix):
        # A triangle becomes a tensor-product patch with a collapsed side.
        patches = batch.to_tensor() if isinstance(batch, TrianglePatches) else batch
        batch = patches.exchange_parameters()
    points = place_points(batch.points, member.matrix)
    return replace(batch, points=points, channels=_paint(batch, member.color))


def _paint(batch: Patches, color: Color | None) -> tuple[Channel, ...]:
    """The channels of a batch: colours times a base colour, or the base colour alone."""
    if color is None:
        return batch.channels
    other_channels = tuple(channel for channel in batch.channels if channel.kind != "colors")
    # Without colours: nets of degree 0, white.
    nets = np.ones((batch.count, *((1,) * (batch.points.ndim - 2)), 3))
    for channel in batch.channels:
        if channel.kind == "colors":
            nets = channel.nets
    net_rows = nets.reshape(-1, nets.shape[-1])
    rows = tint(net_rows, np.array(color), len(net_rows))
    painted = rows.astype(np.float64).reshape(*nets.shape[:-1], -1)
    return (*other_channels, Channel(name="colors", kind="colors", nets=painted))


def _find_attributes(model: SingleModel) -> set[tuple[str, int]]:
    """Names and dimensions of the attributes of a model, which all its batches have."""
    channels = model.batches[0].channels if isinstance(model, PatchModel) else ()
    return {(c.name, c.dimension) for c in channels if c.kind == "attribute"}
