"""Finds members of a group that may have an edge in common, and makes one model of them.

Two members may have an edge in common if a corner of one member is on the border of the other, and
both have the same channels. Members whose bounding box meets no other box are left out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from service.bases.arrays import Ints
from service.engine.clustering import DisjointSets
from service.engine.connectivity.edges import EdgeCurves, join_curves
from service.engine.connectivity.equal_points import compute_weld_distance, find_knot_ratio
from service.engine.connectivity.seams import Seams
from service.engine.joining.near_points import group_near_points
from service.engine.joining.open_edges import (
    MAX_PAIRS,
    OpenEdges,
    find_corner_candidates,
    find_open_edges,
    place_corners,
)
from service.engine.options import MAX_WELD_TOLERANCE
from service.engine.scenes.placing import place_points
from service.surface.batches import Patches
from service.surface.lowered import Domain, GroupModel, Part, PatchModel
from service.surface.multipatch import surfaces_of
from service.surface.placement import is_mirroring, place_box

FEW_MEMBERS = 1024
"""Up to this number of members, all pairs of boxes are compared; with more members, no boxes are
compared, because the number of pairs grows with the square of the number of members."""


def find_neighbours(
    group: GroupModel, seams: Mapping[int, Seams], tolerance: float
) -> list[list[int]]:
    """Lists of members that may meet, directly or through other members of their list.

    Two members may meet if a corner of one member is on the border of the other, and both have the
    same channels. `seams` has the seams of each model by its number; sweeps have none. `tolerance`
    is `MeshOptions.weld_tolerance`; the diagonal is here that of the box about the corners. The
    result has the numbers of members, in order.
    """
    placed: list[OpenEdges] = []
    members_of_borders: list[int] = []
    borders: dict[int, OpenEdges] = {}
    for number in _find_touching(group, seams):
        member = group.members[number]
        if member.model not in borders:
            borders[member.model], _ = find_open_edges(seams[member.model])
        open_border = borders[member.model]
        if len(open_border.corners):
            placed.append(open_border.move(partial(place_points, matrix=member.matrix)))
            members_of_borders.append(number)
    if len(placed) < 2:
        return []
    corners = np.concatenate([border.corners for border in placed])
    diagonal, largest = np.linalg.norm(np.ptp(corners, axis=0)), np.abs(corners).max()
    models = (
        group.models[number] for number in {group.members[k].model for k in members_of_borders}
    )
    ratio = max(find_knot_ratio(model) for model in models if isinstance(model, PatchModel))
    distance = compute_weld_distance(float(diagonal), float(largest), ratio, tolerance)
    members_of_corners = np.repeat(members_of_borders, [len(border.corners) for border in placed])
    first_corner_of_group = group_near_points(corners, distance)
    corner_pairs = np.stack([members_of_corners[first_corner_of_group], members_of_corners], axis=1)
    edge_pairs = np.array(members_of_borders)[_find_corners_on_edges(placed, distance)]
    pairs = np.unique(np.concatenate([corner_pairs, edge_pairs]), axis=0)
    sets = DisjointSets(len(group.members))
    for pair in pairs[pairs[:, 0] != pairs[:, 1]].tolist():
        if _list_channels(group, pair[0]) == _list_channels(group, pair[1]):
            sets.unite(*pair)
    clusters: dict[int, list[int]] = {}
    for number, root in enumerate(sets.list_roots()):
        clusters.setdefault(root, []).append(number)
    return [numbers for numbers in clusters.values() if len(numbers) > 1]


def _find_corners_on_edges(borders: Sequence[OpenEdges], radius: float) -> Ints:
    """Pairs (n, 2) of numbers of borders: a corner of the second border is on an edge of the first.

    The result is empty if more than `MAX_PAIRS` pairs of an edge and a corner must be compared.
    """
    edges, border_of_edge, border_of_corner = _join_open_edges(borders)
    edge, corner = find_corner_candidates(edges, radius)
    pairs: Ints = np.stack([border_of_edge[edge], border_of_corner[corner]], axis=1)
    are_distinct = pairs[:, 0] != pairs[:, 1]
    edge, corner, pairs = edge[are_distinct], corner[are_distinct], pairs[are_distinct]
    if not 0 < len(edge) <= MAX_PAIRS:
        return pairs[:0]
    _, _, is_on = place_corners(edges, edge, edges.corners[corner], radius)
    return pairs[is_on]


def _join_open_edges(borders: Sequence[OpenEdges]) -> tuple[OpenEdges, Ints, Ints]:
    """The open edges of several models; edges and corners are numbered one model after another.

    The other results are the number of the model of each edge, (K,), and of each corner, (C,).
    """
    edge_counts = [border.count for border in borders]
    corner_counts = [len(border.corners) for border in borders]
    first_edges, first_corners = (np.cumsum([0, *n[:-1]]) for n in (edge_counts, corner_counts))
    curves_by_form: dict[tuple[int, bool], list[EdgeCurves]] = {}
    for border, first in zip(borders, first_edges, strict=True):
        for curve in border.curves:
            form = curve.points.shape[1], curve.weights is None
            curves_by_form.setdefault(form, []).append(replace(curve, ids=curve.ids + first))
    edges = OpenEdges(
        curves=tuple(map(join_curves, curves_by_form.values())),
        begin=np.concatenate([b.begin + k for b, k in zip(borders, first_corners, strict=True)]),
        end=np.concatenate([b.end + k for b, k in zip(borders, first_corners, strict=True)]),
        corners=np.concatenate([border.corners for border in borders]),
    )
    numbers = np.arange(len(borders))
    return edges, np.repeat(numbers, edge_counts), np.repeat(numbers, corner_counts)


def _list_channels(group: GroupModel, number: int) -> list[tuple[str, str, int]]:
    """Name, kind and dimension of each channel of a member."""
    model = group.models[group.members[number].model]
    assert isinstance(model, PatchModel)
    return [(c.name, c.kind, c.dimension) for c in model.batches[0].channels]


def _find_touching(group: GroupModel, seams: Mapping[int, Seams]) -> list[int]:
    """Numbers of the members that have open edges and whose box meets the box of another member.

    With more than `FEW_MEMBERS` members, boxes are not compared.
    """
    numbers, boxes = [], []
    visited: set[tuple[int, bytes]] = set()
    for number, member in enumerate(group.members):
        # Copies with equal placements cover each other; they do not meet along an edge. Adding 0.0
        # turns −0.0 into 0.0, because the bytes are compared.
        copy = member.model, b"" if member.matrix is None else (member.matrix + 0.0).tobytes()
        if copy in visited or member.model not in seams:
            continue
        visited.add(copy)
        if seams[member.model].connectivity.open_count:
            numbers.append(number)
            boxes.append(place_box(group.models[member.model].bounds, member.matrix))
    if not 1 < len(numbers) <= FEW_MEMBERS:
        return numbers
    low, high = np.array(boxes).swapaxes(0, 1)
    slack = MAX_WELD_TOLERANCE * np.linalg.norm(high.max(axis=0) - low.min(axis=0))
    boxes_meet = (low[:, None] <= high + slack).all(axis=2)
    boxes_meet &= boxes_meet.T
    # Each box meets itself.
    has_neighbour = np.count_nonzero(boxes_meet, axis=1) > 1
    return [number for number, meets in zip(numbers, has_neighbour, strict=True) if meets]


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
        own_domains = oriented.domains or surfaces_of(oriented)
        domains += [replace(d, first=d.first + first) for d in own_domains]
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
