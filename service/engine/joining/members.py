"""Members of a group whose borders are one curve, as one model in its place.

Members that have an open edge in common once they are placed become one model: what joins the
patches of a model joins them, too. Their mesh is told apart afterwards
(`service.engine.scenes.apart`), so that each member is still a node of its own.

A member stays as it is if it is swept, or if it carries other channels than those it meets: the
vertices of one mesh all carry the same.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from service.bases.arrays import Ints
from service.bases.triangle import degree_of
from service.bases.triangle_polynomials import exchange_order
from service.engine.joining.join import Allow, allow_any, join, join_each
from service.engine.joining.near_points import near_groups
from service.engine.joining.shared_curves import OpenBorder, corners_on_edges, open_border
from service.engine.mesh.connect import reach_within
from service.engine.mesh.seams import Seams
from service.engine.options import MAX_WELD_TOLERANCE, MeshOptions
from service.engine.scenes.scene import placed_points
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import Domain, GroupModel, Part, PatchModel, PlacedModel
from service.surface.placement import place_bounds
from service.surface.sweep_model import SweepModel

FEW_MEMBERS = 1024
"""Up to here all pairs of boxes are compared."""


@dataclass(frozen=True, slots=True)
class Cluster:
    """Members that are one model.

    `members` are their numbers in the group that was given; member k of these has the parts
    [ends[k], ends[k+1]) of the model; `swapped` says whether its parameters u and v, which have
    changed places, are its texture coordinates.
    """

    members: tuple[int, ...]
    ends: tuple[int, ...]
    swapped: tuple[bool, ...]


@dataclass(frozen=True, eq=False, slots=True)
class JoinedGroup:
    """A group with clusters as models of their own, and the members that were given.

    Member k of `given` is member `at[k]` of `group`, alone or in one of the `clusters`.
    """

    group: GroupModel
    given: tuple[PlacedModel, ...]
    at: tuple[int, ...]
    clusters: tuple[Cluster, ...]


def join_group(group: GroupModel, options: MeshOptions, allow: Allow = allow_any) -> JoinedGroup:
    """The group with its members joined, unless lines or wires are drawn on each of them."""
    if options.wired or options.overlays or not options.surface:
        joined = join_each(group, options.weld_tolerance)
        return JoinedGroup(joined, group.members, tuple(range(len(group.members))), ())
    return join_members(group, options.weld_tolerance, allow)


def join_members(group: GroupModel, tolerance: float, allow: Allow = allow_any) -> JoinedGroup:
    """The group with members joined that meet along an edge; parameters as of `join`."""
    models: list[PatchModel | SweepModel] = []
    found: dict[int, Seams] = {}
    for number, given in enumerate(group.models):
        model = given
        if isinstance(given, PatchModel):
            model, seams = join(given, tolerance, allow)
            found[number] = seams
        models.append(model)
    group = replace(group, models=tuple(models))
    alone = JoinedGroup(group, group.members, tuple(range(len(group.members))), ())
    if not tolerance:
        return alone
    clusters: list[Cluster] = []
    members: list[PlacedModel] = []
    at = [-1] * len(group.members)
    for numbers in _neighbours(group, found, tolerance):
        joint, turned = _composed(group, numbers)
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
        swapped = tuple(each and not has_uvs for each in turned)
        clusters.append(Cluster(tuple(numbers), tuple(np.cumsum([0, *parts]).tolist()), swapped))
        for n in numbers:
            at[n] = len(members)
        members.append(PlacedModel(joint.name, len(models)))
        models.append(joint)
    if not clusters:
        return alone
    for n, member in enumerate(group.members):
        if at[n] < 0:
            at[n] = len(members)
            members.append(member)
    used = sorted({member.model for member in members})
    allow(*(model for model in models[len(group.models) :] if isinstance(model, PatchModel)))
    place = {old: new for new, old in enumerate(used)}
    return JoinedGroup(
        replace(
            group,
            models=tuple(models[old] for old in used),
            members=tuple(replace(m, model=place[m.model]) for m in members),
        ),
        group.members,
        tuple(at),
        tuple(clusters),
    )


def _beside(group: GroupModel, seams: Mapping[int, Seams]) -> list[int]:
    """Members with open edges, of which the box about one meets that about another."""
    numbers, boxes = [], []
    seen: set[tuple[int, bytes]] = set()
    for number, member in enumerate(group.members):
        # Copies in one place lie upon each other: they do not meet.
        place = member.model, b"" if member.matrix is None else (member.matrix + 0.0).tobytes()
        if place in seen or member.model not in seams:
            continue
        seen.add(place)
        if seams[member.model].connectivity.open_count:
            numbers.append(number)
            boxes.append(place_bounds(group.models[member.model].bounds, member.matrix))
    if not 1 < len(numbers) <= FEW_MEMBERS:
        return numbers
    low, high = np.array(boxes).swapaxes(0, 1)
    slack = MAX_WELD_TOLERANCE * np.linalg.norm(high.max(axis=0) - low.min(axis=0))
    meet = (low[:, None] <= high + slack).all(axis=2)
    meet &= meet.T
    alone = np.count_nonzero(meet, axis=1) < 2
    return [number for number, is_alone in zip(numbers, alone, strict=True) if not is_alone]


def _parts_of(group: GroupModel, number: int) -> tuple[Part, ...]:
    model = group.models[group.members[number].model]
    assert isinstance(model, PatchModel)
    return model.parts


def _owners(joint: PatchModel, group: GroupModel, numbers: Sequence[int]) -> Ints:
    """The member, among these, of every patch of a joint model."""
    listed = np.arange(joint.patch_count) if joint.sequence is None else joint.sequence
    parts = np.repeat(np.arange(len(numbers)), [len(_parts_of(group, n)) for n in numbers])
    owner = np.empty(joint.patch_count, dtype=np.intp)
    owner[listed] = np.repeat(parts, [part.last - part.first for part in joint.parts])
    return owner


def _neighbours(group: GroupModel, seams: Mapping[int, Seams], tolerance: float) -> list[list[int]]:
    """Members that may meet, in their order: a corner of one is on the border of another.

    `seams` are those of every model.
    """
    placed: list[OpenBorder] = []
    owner: list[int] = []
    borders: dict[int, OpenBorder] = {}
    for number in _beside(group, seams):
        member = group.members[number]
        if member.model not in borders:
            borders[member.model] = open_border(seams[member.model])
        own = borders[member.model]
        if len(own.corners):
            placed.append(own.moved(partial(placed_points, matrix=member.matrix)))
            owner.append(number)
    if len(placed) < 2:
        return []
    places = np.concatenate([border.corners for border in placed])
    diagonal, furthest = np.linalg.norm(np.ptp(places, axis=0)), np.abs(places).max()
    reach = reach_within(float(diagonal), float(furthest), tolerance)
    owners = np.repeat(owner, [len(border.corners) for border in placed])
    together = near_groups(places, reach)
    pairs = np.stack([owners[together], owners], axis=1)
    on = np.array(owner)[corners_on_edges(placed, reach)]
    pairs = np.unique(np.concatenate([pairs, on]), axis=0)
    leader = list(range(len(group.members)))

    def eldest(number: int) -> int:
        while leader[number] != number:
            leader[number] = leader[leader[number]]
            number = leader[number]
        return number

    for one, other in pairs[pairs[:, 0] != pairs[:, 1]].tolist():
        if _form(group, one) == _form(group, other):
            first, second = sorted((eldest(one), eldest(other)))
            leader[second] = first
    found: dict[int, list[int]] = {}
    for number in range(len(leader)):
        found.setdefault(eldest(number), []).append(number)
    return [numbers for numbers in found.values() if len(numbers) > 1]


def _form(group: GroupModel, number: int) -> list[tuple[str, str, int]]:
    """What the patches of a member carry."""
    model = group.models[group.members[number].model]
    assert isinstance(model, PatchModel)
    return [(c.name, c.kind, c.dimension) for c in model.batches[0].channels]


def _mirrors(member: PlacedModel) -> bool:
    return member.matrix is not None and float(np.linalg.det(member.matrix[:3, :3])) < 0


def _composed(group: GroupModel, numbers: Sequence[int]) -> tuple[PatchModel, tuple[bool, ...]]:
    """Placed members as one model, and which were mirrored.

    A placed patch is the patch of the placed control points. Where a placement mirrors, u and v
    change places, so that du × dv stays on the side that it was.
    """
    batches: list[Patches] = []
    parts: list[Part] = []
    domains: list[Domain] = []
    listed: list[Ints] = []
    nets: list[Patches] = []
    turned = []
    first = merged = 0
    moved = 0.0
    for number in numbers:
        member = group.members[number]
        model = group.models[member.model]
        assert isinstance(model, PatchModel)
        mirrored = _mirrors(member)
        turned.append(mirrored)
        own, order = _transposed(model) if mirrored else (model, None)
        for batch in own.batches:
            placed = placed_points(batch.points.reshape(-1, 3), member.matrix)
            batches.append(replace(batch, points=placed.reshape(batch.points.shape) + 0.0))
        for net in own.nets:
            placed = placed_points(net.points.reshape(-1, 3), member.matrix)
            nets.append(replace(net, points=placed.reshape(net.points.shape) + 0.0, channels=()))
        domains += [replace(d, first=d.first + first) for d in _domains_of(own)]
        sequence = np.arange(own.patch_count) if own.sequence is None else own.sequence
        listed.append(first + (sequence if order is None else order[sequence]))
        alone = len(own.parts) == 1
        parts += [
            Part(
                member.name if alone else f"{member.name}/{part.name}",
                part.first + first,
                part.last + first,
            )
            for part in own.parts
        ]
        first += own.patch_count
        merged += own.merged_knots
        stretch = 1.0 if member.matrix is None else float(np.linalg.norm(member.matrix[:3, :3], 2))
        moved = max(moved, own.moved * stretch * (1 + 2.0**-40))
    return (
        PatchModel(
            group.name,
            tuple(batches),
            tuple(parts),
            group.up,
            domains=tuple(domains),
            sequence=np.concatenate(listed),
            control_nets=tuple(nets),
            merged_knots=merged,
            moved=moved,
        ),
        tuple(turned),
    )


def _domains_of(model: PatchModel) -> tuple[Domain, ...]:
    unit = np.array([0.0, 1.0])
    return model.domains or tuple(Domain(unit, unit, k) for k in range(model.patch_count))


def _exchanged(batch: TrianglePatches) -> TrianglePatches:
    """Triangles with s and t exchanged."""
    rows = exchange_order(batch.degree, 1, 2)
    weights = None if batch.weights is None else batch.weights[:, rows]
    channels = tuple(
        replace(c, nets=c.nets[:, exchange_order(degree_of(c.nets.shape[1]), 1, 2)])
        for c in batch.channels
    )
    return TrianglePatches(batch.points[:, rows], weights, channels)


def _transposed(model: PatchModel) -> tuple[PatchModel, Ints]:
    """The model with u and v exchanged, and the number that every patch has then."""
    order = np.arange(model.patch_count)
    domains = []
    for d in model.domains:
        rows, columns = len(d.u) - 1, len(d.v) - 1
        grid = d.first + np.arange(rows * columns).reshape(rows, columns)
        order[grid.T.ravel()] = d.first + np.arange(grid.size)
        domains.append(Domain(d.v, d.u, d.first))
    source = np.argsort(order)
    batches: list[Patches] = []
    first = 0
    for batch in model.batches:
        own = batch.take(source[first : first + batch.count] - first)
        first += batch.count
        if isinstance(own, TrianglePatches):
            batches.append(_exchanged(own))
            continue
        weights = None if own.weights is None else np.ascontiguousarray(own.weights.swapaxes(1, 2))
        channels = tuple(replace(c, nets=c.nets.swapaxes(1, 2)) for c in own.channels)
        points = np.ascontiguousarray(own.points.swapaxes(1, 2))
        batches.append(TensorPatches(points, weights, channels))
    return replace(model, batches=tuple(batches), domains=tuple(domains)), order
