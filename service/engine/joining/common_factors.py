"""Common factors of the weights of surfaces: homogeneous coordinates are equal up to a factor.

Two rational surfaces that meet along a curve may give this curve the weights w and λ w. To compare
weights point by point, each surface k gets a factor e^(s_k). After division by these factors, the
weights of surfaces that meet are nearly equal.

Two sides of two surfaces between the same corners give the difference s_k − s_l, if the ratios of
their weights at both corners are nearly equal. A spanning forest of these pairs determines all s_k.
The forest takes the pairs in the order of coordinates, so that the result does not depend on the
order of the patches. A surface whose weights are all 1 on its borders gets the factor 1, since it
may be polynomial. If surfaces form a ring, factors that suit all pairs may not exist; then some
weights stay different.
"""

from collections.abc import Mapping

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.clustering import DisjointSets
from service.engine.connectivity.edge_patterns import EdgePattern
from service.engine.connectivity.incidence import hash_arrays


def find_scales(
    pattern: EdgePattern,
    points: FloatArray,
    logs: FloatArray,
    surface_of_point: Ints,
    tolerance: float,
) -> FloatArray | None:
    """For each border point, the logarithm s_k of the factor of its surface, (B,).

    The result is None if all s_k are 0.

    Parameters
    ----------
    points, logs : ndarray of float64, shapes (B, 3) and (B,)
        The control points on the borders of all patches, and the logarithms of their weights.
        Points of sides that are one edge, and points at one corner, must already be equal.
    surface_of_point : ndarray of int, shape (B,)
        The number of the surface of each border point, in ascending order.
    tolerance : float
        The largest difference of two logarithms that count as nearly equal.
    """
    first_surface, second_surface, shift = _find_meeting_surfaces(
        pattern, points, logs, surface_of_point, tolerance
    )
    if not np.count_nonzero(shift):
        return None
    count = int(surface_of_point[-1]) + 1
    # Pairs whose weights are nearly equal come first.
    order = np.argsort(shift != 0, kind="stable")
    neighbours = _build_spanning_forest(
        count, first_surface[order], second_surface[order], shift[order]
    )
    ends = np.searchsorted(surface_of_point, np.arange(count + 1))
    runs = {k: slice(ends[k], ends[k + 1]) for k in neighbours}
    # Surfaces whose weights are all 1 come first.
    sort_key = {k: (bool(logs[r].any()), hash_arrays(points[r], logs[r])) for k, r in runs.items()}
    scale = np.zeros(count)
    visited: set[int] = set()
    for root in sorted(neighbours, key=lambda k: sort_key[k]):
        stack = [] if root in visited else [root]
        visited.add(root)
        while stack:
            number = stack.pop()
            for neighbour, step in neighbours[number]:
                if neighbour not in visited:
                    visited.add(neighbour)
                    scale[neighbour] = scale[number] + step if sort_key[neighbour][0] else 0.0
                    stack.append(neighbour)
    return scale[surface_of_point]


def _build_spanning_forest(
    count: int, first_surface: Ints, second_surface: Ints, shift: FloatArray
) -> Mapping[int, list[tuple[int, float]]]:
    """For each surface, its neighbours in a spanning forest of the pairs, and the shifts to them.

    The forest takes each pair, in order, that does not close a ring.
    """
    trees = DisjointSets(count)
    neighbours: dict[int, list[tuple[int, float]]] = {}
    for a, b, step in zip(
        first_surface.tolist(), second_surface.tolist(), shift.tolist(), strict=True
    ):
        if trees.unite(a, b):
            neighbours.setdefault(a, []).append((b, step))
            neighbours.setdefault(b, []).append((a, -step))
    return neighbours


def _find_meeting_surfaces(
    pattern: EdgePattern,
    points: FloatArray,
    logs: FloatArray,
    surface_of_point: Ints,
    tolerance: float,
) -> tuple[Ints, Ints, FloatArray]:
    """Pairs of surfaces that meet, and s of the second less s of the first: three arrays (N,).

    A difference near 0 becomes 0. Pairs are in the order of the corners where the surfaces meet.
    """
    # Corners are numbered in the order of their coordinates. Each side gets the direction from its
    # lower to its higher corner.
    ends = np.concatenate([rows[:, [0, -1]] for rows, _ in pattern.sides if rows.shape[1] > 1])
    corners = points[ends.ravel()]
    order = np.lexsort(corners.T[::-1])
    differs = (np.diff(corners[order], axis=0) != 0).any(axis=1)
    corner_number = np.empty(len(order), dtype=np.intp)
    corner_number[order] = np.cumsum(np.append(False, differs))
    corner_pair = corner_number.reshape(-1, 2)
    is_reversed = corner_pair[:, 0] > corner_pair[:, 1]
    # A side that ends at its beginning gets the direction from its lower to its higher weight.
    is_loop = corner_pair[:, 0] == corner_pair[:, 1]
    is_reversed |= is_loop & (logs[ends[:, 0]] > logs[ends[:, 1]])
    corner_pair[is_reversed], ends[is_reversed] = (
        corner_pair[is_reversed, ::-1],
        ends[is_reversed, ::-1],
    )
    # Sides between the same two corners are compared with the first of them, the leader. A side
    # agrees with it if the ratio of their weights is nearly the same at both corners: each of the
    # two logarithms of ratios may be wrong by the tolerance.
    end_logs = logs[ends]
    order = np.lexsort((end_logs[:, 1], end_logs[:, 0], corner_pair[:, 1], corner_pair[:, 0]))
    ends, corner_pair, end_logs = ends[order], corner_pair[order], end_logs[order]
    is_new = np.append(True, (corner_pair[1:] != corner_pair[:-1]).any(axis=1))
    leader = np.flatnonzero(is_new)[np.cumsum(is_new) - 1]
    log_ratios = end_logs - end_logs[leader]
    first_surface, second_surface = surface_of_point[ends[leader, 0]], surface_of_point[ends[:, 0]]
    surfaces_meet = (first_surface != second_surface) & (
        np.abs(log_ratios[:, 0] - log_ratios[:, 1]) <= 2 * tolerance
    )
    shift = log_ratios[surfaces_meet].mean(axis=1)
    shift[np.abs(shift) <= tolerance] = 0.0
    return first_surface[surfaces_meet], second_surface[surfaces_meet], shift
