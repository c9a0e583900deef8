"""Makes one model of placed members of a group, which may be mirrored."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.bases.arrays import Ints
from service.engine.scenes.placing import place_points
from service.surface.batches import Patches
from service.surface.lowered import Domain, GroupModel, Part, PatchModel
from service.surface.placement import is_mirroring
from service.surface.repatched import surfaces_of


def compose(group: GroupModel, numbers: Sequence[int]) -> tuple[PatchModel, tuple[bool, ...]]:
    """One model of the placed members with these numbers, and whether each was mirrored.

    A patch is placed by placing its control points. If a placement mirrors, u and v are exchanged,
    so that du × dv stays on the same side of the surface. The control nets of the request lose
    their channels, because meshes only draw them as lines.
    """
    batches: list[Patches] = []
    parts: list[Part] = []
    domains: list[Domain] = []
    sequences: list[Ints] = []
    nets: list[Patches] = []
    are_mirrored = []
    first = merged_knots = 0
    distance = 0.0
    for number in numbers:
        member = group.members[number]
        model = group.models[member.model]
        assert isinstance(model, PatchModel)
        is_mirrored = is_mirroring(member.matrix)
        are_mirrored.append(is_mirrored)
        oriented, new_numbers = _exchange_parameters(model) if is_mirrored else (model, None)
        # Adding 0.0 turns −0.0 into 0.0, so that equal points have equal bits.
        batches += [
            replace(b, points=place_points(b.points, member.matrix) + 0.0) for b in oriented.batches
        ]
        nets += [
            replace(n, points=place_points(n.points, member.matrix) + 0.0, channels=())
            for n in oriented.nets
        ]
        domains += [replace(d, first=d.first + first) for d in surfaces_of(oriented)]
        sequence = (
            np.arange(oriented.patch_count) if oriented.sequence is None else oriented.sequence
        )
        sequences.append(first + (sequence if new_numbers is None else new_numbers[sequence]))
        is_single = len(oriented.parts) == 1
        parts += [
            Part(
                member.name if is_single else f"{member.name}/{part.name}",
                part.first + first,
                part.last + first,
            )
            for part in oriented.parts
        ]
        first += oriented.patch_count
        merged_knots += oriented.merged_knots
        stretch = 1.0 if member.matrix is None else float(np.linalg.norm(member.matrix[:3, :3], 2))
        # The last factor makes the distance an upper bound in spite of rounding.
        distance = max(distance, oriented.moved * stretch * (1 + 2.0**-40))
    return (
        PatchModel(
            group.name,
            tuple(batches),
            tuple(parts),
            group.up,
            domains=tuple(domains),
            sequence=np.concatenate(sequences),
            control_nets=tuple(nets),
            merged_knots=merged_knots,
            moved=distance,
        ),
        tuple(are_mirrored),
    )


def _exchange_parameters(model: PatchModel) -> tuple[PatchModel, Ints]:
    """The model with u and v exchanged, and the new number of each patch, (P,)."""
    new_numbers = np.arange(model.patch_count)
    for d in model.domains:
        grid = np.arange(d.patch_count).reshape(len(d.u) - 1, -1)
        new_numbers[d.first + grid.T.ravel()] = d.first + np.arange(grid.size)
    domains = tuple(Domain(d.v, d.u, d.first) for d in model.domains)
    source = np.argsort(new_numbers)
    batches: list[Patches] = []
    first = 0
    for batch in model.batches:
        # The patches of a domain are in one batch, so this batch has the same patches as before.
        part = batch.take(source[first : first + batch.count] - first)
        batches.append(part.exchange_parameters())
        first += batch.count
    return replace(model, batches=tuple(batches), domains=domains), new_numbers
