"""Common factors of the weights of surfaces: homogeneous coordinates have a free factor.

Two rational surfaces that meet along a curve may have its weights w and λ w. To compare weights
point by point, each surface k is given a factor e^(s_k), so that weights divided by them are near
where surfaces meet. Two sides between the same two corners give the difference of two of the s, if
the ratios of their weights at both corners are near; a spanning forest of such pairs gives all. The
pairs are taken in the order of coordinates, so that the result does not depend on the order of the
patches. A surface whose weights are all 1 on its borders has the factor 1, since it may be
polynomial. Around a ring of surfaces there may be no such factors; then some weights stay
different.
"""

from collections.abc import Mapping

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.mesh.connectivity import hash_arrays
from service.engine.mesh.edge_patterns import EdgePattern


def find_scales(
    pattern: EdgePattern, points: FloatArray, logs: FloatArray, owner: Ints, tolerance: float
) -> FloatArray | None:
    """The s of the surfaces that border points (B,) belong to, shape (B,); None if all are 0.

    Parameters
    ----------
    points, logs : ndarray of float64, shapes (B, 3) and (B,)
        Border points, equal along one edge and at one corner; and the logarithms of their weights.
    owner : ndarray of int, shape (B,)
        Surfaces, numbered in order.
    tolerance : float
        Logarithms this far apart are near.
    """
    one, other, shift = _find_meeting_surfaces(pattern, points, logs, owner, tolerance)
    if not np.count_nonzero(shift):
        return None
    count = int(owner[-1]) + 1
    # Pairs without a factor first.
    order = np.argsort(shift != 0, kind="stable")
    beside = _span_forest(count, one[order], other[order], shift[order])
    ends = np.searchsorted(owner, np.arange(count + 1))
    runs = {k: slice(ends[k], ends[k + 1]) for k in beside}
    # Surfaces without weights come first.
    content = {k: (bool(logs[r].any()), hash_arrays(points[r], logs[r])) for k, r in runs.items()}
    scale = np.zeros(count)
    visited: set[int] = set()
    for root in sorted(beside, key=lambda k: content[k]):
        waiting = [] if root in visited else [root]
        visited.add(root)
        while waiting:
            number = waiting.pop()
            for neighbour, step in beside[number]:
                if neighbour not in visited:
                    visited.add(neighbour)
                    scale[neighbour] = scale[number] + step if content[neighbour][0] else 0.0
                    waiting.append(neighbour)
    return scale[owner]


def _span_forest(
    count: int, one: Ints, other: Ints, shift: FloatArray
) -> Mapping[int, list[tuple[int, float]]]:
    """For each surface its neighbours in a forest of the first pairs, and the steps to them."""
    leader = list(range(count))

    def find_leader(number: int) -> int:
        while leader[number] != number:
            leader[number] = leader[leader[number]]
            number = leader[number]
        return number

    beside: dict[int, list[tuple[int, float]]] = {}
    for a, b, step in zip(one.tolist(), other.tolist(), shift.tolist(), strict=True):
        first, second = find_leader(a), find_leader(b)
        if first != second:
            leader[first] = second
            beside.setdefault(a, []).append((b, step))
            beside.setdefault(b, []).append((a, -step))
    return beside


def _find_meeting_surfaces(
    pattern: EdgePattern, points: FloatArray, logs: FloatArray, owner: Ints, tolerance: float
) -> tuple[Ints, Ints, FloatArray]:
    """Pairs of surfaces that meet, and the difference of their s; a difference near 0 becomes 0.

    Pairs are in the order of the corners where they meet.
    """
    ends = np.concatenate([rows[:, [0, -1]] for rows, _ in pattern.sides if rows.shape[1] > 1])
    corners = points[ends.ravel()]
    order = np.lexsort(corners.T[::-1])
    differs = (np.diff(corners[order], axis=0) != 0).any(axis=1)
    number = np.empty(len(order), dtype=np.intp)
    number[order] = np.cumsum(np.append(False, differs))
    place = number.reshape(-1, 2)
    back = place[:, 0] > place[:, 1]
    place[back], ends[back] = place[back, ::-1], ends[back, ::-1]
    size = logs[ends]
    order = np.lexsort((size[:, 1], size[:, 0], place[:, 1], place[:, 0]))
    ends, place, size = ends[order], place[order], size[order]
    begins = np.append(True, (place[1:] != place[:-1]).any(axis=1))
    lead = np.flatnonzero(begins)[np.cumsum(begins) - 1]
    step = size - size[lead]
    one, other = owner[ends[lead, 0]], owner[ends[:, 0]]
    meet = (one != other) & (np.abs(step[:, 0] - step[:, 1]) <= 2 * tolerance)
    shift = step[meet].mean(axis=1)
    shift[np.abs(shift) <= tolerance] = 0.0
    return one[meet], other[meet], shift
