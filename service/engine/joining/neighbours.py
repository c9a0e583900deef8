"""Finds members of a group that may have an edge in common.

Two members may have an edge in common if a corner of one member is on the border of the other, and
both have the same channels. Members whose bounding box meets no other box are left out.
"""

from collections.abc import Mapping
from functools import partial

import numpy as np

from service.engine.clustering import DisjointSets
from service.engine.connectivity.equal_points import compute_weld_distance, find_knot_ratio
from service.engine.connectivity.seams import Seams
from service.engine.joining.corners_on_edges import find_corners_on_edges
from service.engine.joining.near_points import group_near_points
from service.engine.joining.open_edges import OpenEdges, find_open_edges
from service.engine.options import MAX_WELD_TOLERANCE
from service.engine.scenes.placing import place_points
from service.surface.lowered import GroupModel, PatchModel
from service.surface.placement import place_box

FEW_MEMBERS = 1024
"""Up to this number of members, all pairs of boxes are compared; with more members, no boxes are
compared, because the number of pairs grows with the square of the number of members."""


def find_neighbours(
    group: GroupModel, seams: Mapping[int, Seams], tolerance: float
) -> list[list[int]]:
    """Lists of members that may meet, directly or through other members of their list.

    Two members may meet if a corner of one member is on the border of the other, and both have the
    same channels. `seams` has the seams of each model by its number; sweeps have none. `tolerance`
    is the largest distance of points that count as equal, as a share of the diagonal of the box
    about the corners. The result has the numbers of members, in order.
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
    edge_pairs = np.array(members_of_borders)[find_corners_on_edges(placed, distance)]
    pairs = np.unique(np.concatenate([corner_pairs, edge_pairs]), axis=0)
    sets = DisjointSets(len(group.members))
    for pair in pairs[pairs[:, 0] != pairs[:, 1]].tolist():
        if _list_channels(group, pair[0]) == _list_channels(group, pair[1]):
            sets.unite(*pair)
    clusters: dict[int, list[int]] = {}
    for number, root in enumerate(sets.list_roots()):
        clusters.setdefault(root, []).append(number)
    return [numbers for numbers in clusters.values() if len(numbers) > 1]


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
