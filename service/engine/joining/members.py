"""Joins members of a group whose placed borders share a curve to one model.

Members that have an open edge in common after placing become one model, so that the steps that join
patches join the members, too. The mesh is separated afterwards (`service.engine.scenes.apart`), so
that each member is still a separate node. A member stays unchanged if it is swept, or if its
channels differ from those of its neighbours: all vertices of one mesh have the same channels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Ints
from service.engine.joining.composing import compose
from service.engine.joining.join import Allow, allow_any, join, join_each
from service.engine.joining.neighbours import find_neighbours
from service.engine.mesh.seams import Seams
from service.engine.options import MeshOptions
from service.surface.lowered import GroupModel, Part, PatchModel, PlacedModel
from service.surface.sweep_model import SweepModel


@dataclass(frozen=True, slots=True)
class Cluster:
    """Members that became one model.

    `members` are their numbers in the original group. Member k of these has the parts [ends[k],
    ends[k+1]) of the model. `swapped[k]` says whether its texture coordinates are its parameters u
    and v, exchanged.
    """

    members: tuple[int, ...]
    ends: tuple[int, ...]
    swapped: tuple[bool, ...]


@dataclass(frozen=True, eq=False, slots=True)
class JoinedGroup:
    """A group with one model for each cluster, and the original members.

    Original member k, `originals[k]`, is member `at[k]` of `group`, alone or in one of the
    `clusters`.
    """

    group: GroupModel
    originals: tuple[PlacedModel, ...]
    at: tuple[int, ...]
    clusters: tuple[Cluster, ...]


def join_group(group: GroupModel, options: MeshOptions, allow: Allow = allow_any) -> JoinedGroup:
    """The group with its members joined, unless lines or wires are drawn on its members."""
    if options.has_wires or options.overlays or not options.has_faces:
        joined = join_each(group, options.weld_tolerance)
        return JoinedGroup(joined, group.members, tuple(range(len(group.members))), ())
    return join_members(group, options.weld_tolerance, allow)


def join_members(group: GroupModel, tolerance: float, allow: Allow = allow_any) -> JoinedGroup:
    """The group, with members joined where they meet along an edge; parameters as in `join`."""
    models: list[PatchModel | SweepModel] = []
    seams_of: dict[int, Seams] = {}
    for number, placed in enumerate(group.models):
        model = placed
        if isinstance(placed, PatchModel):
            model, seams = join(placed, tolerance, allow)
            seams_of[number] = seams
        models.append(model)
    group = replace(group, models=tuple(models))
    unjoined = JoinedGroup(group, group.members, tuple(range(len(group.members))), ())
    if not tolerance:
        return unjoined
    clusters: list[Cluster] = []
    members: list[PlacedModel] = []
    at = [-1] * len(group.members)
    for numbers in find_neighbours(group, seams_of, tolerance):
        joint, are_mirrored = compose(group, numbers)
        joint, seams = join(joint, tolerance, allow)
        owner = _owners(joint, group, numbers)
        low, high = np.full(len(seams.users), len(numbers)), np.full(len(seams.users), -1)
        lines = ~seams.collapsed
        np.minimum.at(low, seams.edge[lines], np.broadcast_to(owner[:, None], lines.shape)[lines])
        np.maximum.at(high, seams.edge[lines], np.broadcast_to(owner[:, None], lines.shape)[lines])
        if not ((low < high) & (seams.users == 2)).any():
            continue
        allow(joint)
        parts = [len(_parts_of(group, n)) for n in numbers]
        has_uvs = any(channel.kind == "uvs" for channel in joint.batches[0].channels)
        swapped = tuple(each and not has_uvs for each in are_mirrored)
        clusters.append(Cluster(tuple(numbers), tuple(np.cumsum([0, *parts]).tolist()), swapped))
        for n in numbers:
            at[n] = len(members)
        members.append(PlacedModel(joint.name, len(models)))
        models.append(joint)
    if not clusters:
        return unjoined
    for n, member in enumerate(group.members):
        if at[n] < 0:
            at[n] = len(members)
            members.append(member)
    used = sorted({member.model for member in members})
    allow(*(model for model in models[len(group.models) :] if isinstance(model, PatchModel)))
    place = {before: after for after, before in enumerate(used)}
    return JoinedGroup(
        replace(
            group,
            models=tuple(models[before] for before in used),
            members=tuple(replace(m, model=place[m.model]) for m in members),
        ),
        group.members,
        tuple(at),
        tuple(clusters),
    )


def _parts_of(group: GroupModel, number: int) -> tuple[Part, ...]:
    model = group.models[group.members[number].model]
    assert isinstance(model, PatchModel)
    return model.parts


def _owners(joint: PatchModel, group: GroupModel, numbers: Sequence[int]) -> Ints:
    """For every patch of a joint model, the position in `numbers` of its member."""
    listed = np.arange(joint.patch_count) if joint.sequence is None else joint.sequence
    parts = np.repeat(np.arange(len(numbers)), [len(_parts_of(group, n)) for n in numbers])
    owner = np.empty(joint.patch_count, dtype=np.intp)
    owner[listed] = np.repeat(parts, [part.last - part.first for part in joint.parts])
    return owner
