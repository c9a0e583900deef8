"""Joins members of a group into one model where their placed borders share a curve.

Members that have an open edge in common, after they are placed, become one model. So the steps that
join patches also join these members. The mesh of this model is separated afterwards
(`service.engine.scenes.apart`), so that each member is a separate node. A member stays unchanged if
it is a sweep, or if its channels differ from those of its neighbours, because all vertices of one
mesh have the same channels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Ints
from service.engine.connectivity.seams import Seams
from service.engine.joining.join import Allow, allow_any, join, join_each
from service.engine.joining.meeting_members import compose, find_neighbours
from service.engine.options import MeshOptions
from service.surface.curve_model import SweepModel
from service.surface.lowered import GroupModel, Part, PatchModel, PlacedModel


@dataclass(frozen=True, slots=True)
class Cluster:
    """Members that became one model.

    `members` has their numbers in the original group. Member `members[k]` has the parts [ends[k],
    ends[k+1]) of the model. `are_uvs_swapped[k]` says whether its vertices have the parameters (v,
    u) as texture coordinates, because the member was mirrored.
    """

    members: tuple[int, ...]
    ends: tuple[int, ...]
    are_uvs_swapped: tuple[bool, ...]


@dataclass(frozen=True, eq=False, slots=True)
class JoinedGroup:
    """A group with one model for each cluster, and the original members.

    The original member `originals[k]` is in member `new_numbers[k]` of `group`, alone or, if it is
    in one of the `clusters`, together with other members.
    """

    group: GroupModel
    originals: tuple[PlacedModel, ...]
    new_numbers: tuple[int, ...]
    clusters: tuple[Cluster, ...]


def join_group(group: GroupModel, options: MeshOptions, allow: Allow = allow_any) -> JoinedGroup:
    """The group with its members joined, unless lines or wires are drawn on its members.

    A mesh without faces always has lines or wires.
    """
    if options.has_wires or options.overlays:
        joined = join_each(group, options.weld_tolerance)
        return JoinedGroup(joined, group.members, tuple(range(len(group.members))), ())
    return join_members(group, options.weld_tolerance, allow)


def join_members(group: GroupModel, tolerance: float, allow: Allow = allow_any) -> JoinedGroup:
    """The group with its members joined where they meet along an edge.

    Parameters
    ----------
    tolerance : float
        `MeshOptions.weld_tolerance`; with 0 no member is joined.
    allow : callable
        Called with each model that was cut or joined; it raises an error if the model is too large.
    """
    models: list[PatchModel | SweepModel] = []
    seams_of: dict[int, Seams] = {}
    for number, original in enumerate(group.models):
        model = original
        if isinstance(original, PatchModel):
            model, seams = join(original, tolerance, allow)
            seams_of[number] = seams
        models.append(model)
    group = replace(group, models=tuple(models))
    unjoined = JoinedGroup(group, group.members, tuple(range(len(group.members))), ())
    if not tolerance:
        return unjoined
    clusters: list[Cluster] = []
    members: list[PlacedModel] = []
    new_numbers = [-1] * len(group.members)
    for numbers in find_neighbours(group, seams_of, tolerance):
        joined_model, are_mirrored = compose(group, numbers)
        joined_model, seams = join(joined_model, tolerance, allow)
        member_of_patch = _find_owners(joined_model, group, numbers)
        # The lowest and the highest member at each edge. An edge joins two members if it has two
        # sides, one of each. Edges with more sides do not count: copies may lie on each other.
        low, high = np.full(seams.edge_count, len(numbers)), np.full(seams.edge_count, -1)
        is_line = ~seams.collapsed
        np.minimum.at(
            low,
            seams.edge[is_line],
            np.broadcast_to(member_of_patch[:, None], is_line.shape)[is_line],
        )
        np.maximum.at(
            high,
            seams.edge[is_line],
            np.broadcast_to(member_of_patch[:, None], is_line.shape)[is_line],
        )
        if not ((low < high) & (seams.sides_per_edge == 2)).any():
            continue
        allow(joined_model)
        parts = [len(_parts_of(group, n)) for n in numbers]
        has_uvs = any(channel.kind == "uvs" for channel in joined_model.batches[0].channels)
        are_uvs_swapped = tuple(is_mirrored and not has_uvs for is_mirrored in are_mirrored)
        clusters.append(
            Cluster(tuple(numbers), tuple(np.cumsum([0, *parts]).tolist()), are_uvs_swapped)
        )
        for n in numbers:
            new_numbers[n] = len(members)
        members.append(PlacedModel(joined_model.name, len(models)))
        models.append(joined_model)
    if not clusters:
        return unjoined
    for n, member in enumerate(group.members):
        if new_numbers[n] < 0:
            new_numbers[n] = len(members)
            members.append(member)
    used_models = sorted({member.model for member in members})
    # Each joined model alone was allowed above; now all of them together.
    allow(*(model for model in models[len(group.models) :] if isinstance(model, PatchModel)))
    new_model_numbers = {
        old_number: new_number for new_number, old_number in enumerate(used_models)
    }
    return JoinedGroup(
        replace(
            group,
            models=tuple(models[old_number] for old_number in used_models),
            members=tuple(replace(m, model=new_model_numbers[m.model]) for m in members),
        ),
        group.members,
        tuple(new_numbers),
        tuple(clusters),
    )


def _parts_of(group: GroupModel, number: int) -> tuple[Part, ...]:
    """The parts of a member that is not a sweep."""
    model = group.models[group.members[number].model]
    assert isinstance(model, PatchModel)
    return model.parts


def _find_owners(joined_model: PatchModel, group: GroupModel, numbers: Sequence[int]) -> Ints:
    """For each patch of the joined model, the position of its member in `numbers`."""
    sequence = (
        np.arange(joined_model.patch_count)
        if joined_model.sequence is None
        else joined_model.sequence
    )
    parts = np.repeat(np.arange(len(numbers)), [len(_parts_of(group, n)) for n in numbers])
    member_of_patch = np.empty(joined_model.patch_count, dtype=np.intp)
    member_of_patch[sequence] = np.repeat(
        parts, [part.last - part.first for part in joined_model.parts]
    )
    return member_of_patch
