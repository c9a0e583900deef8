"""Makes one model of placed members of a group, which may be mirrored."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.bases.arrays import Ints
from service.bases.triangle import degree_of
from service.bases.triangle_polynomials import exchange_order
from service.engine.scenes.scene import place_points
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import Domain, GroupModel, Part, PatchModel, PlacedModel


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
        is_mirrored = _is_mirror(member)
        are_mirrored.append(is_mirrored)
        oriented, new_numbers = _exchange_parameters(model) if is_mirrored else (model, None)
        # Adding 0.0 turns −0.0 into 0.0, so that equal points have equal bits.
        for batch in oriented.batches:
            placed = place_points(batch.points.reshape(-1, 3), member.matrix)
            batches.append(replace(batch, points=placed.reshape(batch.points.shape) + 0.0))
        for net in oriented.nets:
            placed = place_points(net.points.reshape(-1, 3), member.matrix)
            nets.append(replace(net, points=placed.reshape(net.points.shape) + 0.0, channels=()))
        domains += [replace(d, first=d.first + first) for d in _domains_of(oriented)]
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


def _domains_of(model: PatchModel) -> tuple[Domain, ...]:
    """The domains of a model; without domains, the unit square for each patch."""
    unit = np.array([0.0, 1.0])
    return model.domains or tuple(Domain(unit, unit, k) for k in range(model.patch_count))


def _exchange_triangle(batch: TrianglePatches) -> TrianglePatches:
    """Triangles with s and t exchanged."""
    rows = exchange_order(batch.degree, 1, 2)
    weights = None if batch.weights is None else batch.weights[:, rows]
    channels = tuple(
        replace(c, nets=c.nets[:, exchange_order(degree_of(c.nets.shape[1]), 1, 2)])
        for c in batch.channels
    )
    return TrianglePatches(batch.points[:, rows], weights, channels)


def _exchange_parameters(model: PatchModel) -> tuple[PatchModel, Ints]:
    """The model with u and v exchanged, and the new number of each patch, (P,)."""
    new_numbers = np.arange(model.patch_count)
    domains = []
    for d in model.domains:
        rows, columns = len(d.u) - 1, len(d.v) - 1
        grid = d.first + np.arange(rows * columns).reshape(rows, columns)
        new_numbers[grid.T.ravel()] = d.first + np.arange(grid.size)
        domains.append(Domain(d.v, d.u, d.first))
    source = np.argsort(new_numbers)
    batches: list[Patches] = []
    first = 0
    for batch in model.batches:
        # The patches of a domain are in one batch, so this batch has the same patches as before.
        part = batch.take(source[first : first + batch.count] - first)
        first += batch.count
        if isinstance(part, TrianglePatches):
            batches.append(_exchange_triangle(part))
            continue
        weights = (
            None if part.weights is None else np.ascontiguousarray(part.weights.swapaxes(1, 2))
        )
        channels = tuple(replace(c, nets=c.nets.swapaxes(1, 2)) for c in part.channels)
        points = np.ascontiguousarray(part.points.swapaxes(1, 2))
        batches.append(TensorPatches(points, weights, channels))
    return replace(model, batches=tuple(batches), domains=tuple(domains)), new_numbers


def _is_mirror(member: PlacedModel) -> bool:
    """Whether the placement of a member mirrors."""
    return member.matrix is not None and float(np.linalg.det(member.matrix[:3, :3])) < 0
