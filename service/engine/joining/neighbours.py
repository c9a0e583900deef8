"""Members of a group that may have an edge in common: a corner of one is on the border of another.

Only members whose boxes meet and that have the same channels are compared.
"""

from collections.abc import Mapping
from functools import partial

import numpy as np

from service.engine.joining.corners_on_edges import find_corners_on_edges
from service.engine.joining.near_points import group_near_points
from service.engine.joining.open_edges import OpenBorder, find_open_border
from service.engine.mesh.equal_points import find_knot_ratio, weld_distance
from service.engine.mesh.seams import Seams
from service.engine.options import MAX_WELD_TOLERANCE
from service.engine.scenes.scene import place_points
from service.surface.lowered import GroupModel, PatchModel
from service.surface.placement import place_bounds

FEW_MEMBERS = 1024
"""Up to this number of members all pairs of boxes are compared."""


def find_neighbours(
    group: GroupModel, seams: Mapping[int, Seams], tolerance: float
) -> list[list[int]]:
    """Members that may meet, in their order: a corner of one is on the border of another.

    `seams` are the seams of every model.
    """
    placed: list[OpenBorder] = []
    owner: list[int] = []
    borders: dict[int, OpenBorder] = {}
    for number in _find_touching(group, seams):
        member = group.members[number]
        if member.model not in borders:
            borders[member.model] = find_open_border(seams[member.model])
        open_border = borders[member.model]
        if len(open_border.corners):
            placed.append(open_border.move(partial(place_points, matrix=member.matrix)))
            owner.append(number)
    if len(placed) < 2:
        return []
    places = np.concatenate([border.corners for border in placed])
    diagonal, largest = np.linalg.norm(np.ptp(places, axis=0)), np.abs(places).max()
    models = (group.models[number] for number in {group.members[k].model for k in owner})
    ratio = max(find_knot_ratio(model) for model in models if isinstance(model, PatchModel))
    distance = weld_distance(float(diagonal), float(largest), ratio, tolerance)
    owners = np.repeat(owner, [len(border.corners) for border in placed])
    together = group_near_points(places, distance)
    pairs = np.stack([owners[together], owners], axis=1)
    on = np.array(owner)[find_corners_on_edges(placed, distance)]
    pairs = np.unique(np.concatenate([pairs, on]), axis=0)
    leader = list(range(len(group.members)))

    def find_leader(number: int) -> int:
        while leader[number] != number:
            leader[number] = leader[leader[number]]
            number = leader[number]
        return number

    for one, other in pairs[pairs[:, 0] != pairs[:, 1]].tolist():
        if _list_channels(group, one) == _list_channels(group, other):
            first, second = sorted((find_leader(one), find_leader(other)))
            leader[second] = first
    clusters: dict[int, list[int]] = {}
    for number in range(len(leader)):
        clusters.setdefault(find_leader(number), []).append(number)
    return [numbers for numbers in clusters.values() if len(numbers) > 1]


def _list_channels(group: GroupModel, number: int) -> list[tuple[str, str, int]]:
    """The channels of the patches of a member."""
    model = group.models[group.members[number].model]
    assert isinstance(model, PatchModel)
    return [(c.name, c.kind, c.dimension) for c in model.batches[0].channels]


def _find_touching(group: GroupModel, seams: Mapping[int, Seams]) -> list[int]:
    """Members with open edges whose boxes meet the box of another member."""
    numbers, boxes = [], []
    visited: set[tuple[int, bytes]] = set()
    for number, member in enumerate(group.members):
        # Copies in one place cover each other; they do not meet along an edge.
        place = member.model, b"" if member.matrix is None else (member.matrix + 0.0).tobytes()
        if place in visited or member.model not in seams:
            continue
        visited.add(place)
        if seams[member.model].connectivity.open_count:
            numbers.append(number)
            boxes.append(place_bounds(group.models[member.model].bounds, member.matrix))
    if not 1 < len(numbers) <= FEW_MEMBERS:
        return numbers
    low, high = np.array(boxes).swapaxes(0, 1)
    slack = MAX_WELD_TOLERANCE * np.linalg.norm(high.max(axis=0) - low.min(axis=0))
    meet = (low[:, None] <= high + slack).all(axis=2)
    meet &= meet.T
    is_single = np.count_nonzero(meet, axis=1) < 2
    return [number for number, is_alone in zip(numbers, is_single, strict=True) if not is_alone]
