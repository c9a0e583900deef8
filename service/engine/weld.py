"""Vertices out of samples: which samples are one vertex, and with which normal."""

from dataclasses import dataclass
from math import sin

import numpy as np

from service.engine.mesh import RealArray
from service.engine.stitch import Ints

MAX_ROUNDS = 64
"""Normals kept apart at one position before the rest of them stay unmerged. Only the apex of a
finely divided cone has so many; more vertices than needed are no error."""


@dataclass(frozen=True, eq=False, slots=True)
class Welding:
    """Samples and the vertices they became.

    `vertex` (N,) is the vertex of each sample; `samples` (V,) the sample that each vertex comes
    from; `welds` (V,) the first vertex at the same position.
    """

    vertex: Ints
    samples: Ints
    welds: Ints

    @property
    def positions(self) -> int:
        """How many different positions the vertices have."""
        return int(np.count_nonzero(self.welds == np.arange(len(self.welds))))


def weld(
    place: Ints, used: Ints | None, normals: RealArray | None, crease_angle: float, merge: bool
) -> Welding:
    """Merges samples at one place whose normals agree; writes their mean into `normals`.

    A vertex stands where its first sample stood, so that the vertices of a patch that meets no
    other keep their order.

    Parameters
    ----------
    place : ndarray of int, shape (N,)
        For each sample, one sample that stands for its position (that one for itself).
    used : ndarray of int, optional
        Samples that occur in faces; all of them if left out.
    normals : ndarray, shape (N, 3), or None
        Unit normals, if vertices have them.
    crease_angle : float
        Radians; normals further apart than this stay apart.
    merge : bool
        False keeps every sample a vertex of its own.
    """
    leader = np.arange(len(place))
    if merge:
        leader = place.copy() if normals is None else _leaders(place, normals, crease_angle)
    alone = leader == np.arange(len(leader))
    if used is not None:
        wanted = np.zeros(len(leader), dtype=bool)
        wanted[leader[used]] = True
        alone &= wanted
    samples = np.flatnonzero(alone)
    number = np.zeros(len(leader), dtype=np.intp)
    number[samples] = np.arange(len(samples))
    # The sample that stands for a place need not have become a vertex: count places afresh.
    # Written backwards, the first vertex at a place is the one that stays.
    first = np.zeros(len(leader), dtype=np.intp)
    first[place[samples[::-1]]] = np.arange(len(samples) - 1, -1, -1)
    return Welding(number[leader], samples, first[place[samples]])


def _leaders(place: Ints, normals: RealArray, crease_angle: float) -> Ints:
    """For each sample the one it is merged with: same place, normal within the crease angle."""
    leader = np.arange(len(place))
    open_ = np.flatnonzero(place != leader)
    if not len(open_):
        return leader
    # Chords instead of cosines: equal normals are at distance 0 exactly, whatever the rounding.
    reach = (2 * sin(crease_angle / 2)) ** 2
    chosen = place[open_]
    for _ in range(MAX_ROUNDS):
        step = normals[open_] - normals[chosen]
        near = np.einsum("nd,nd->n", step, step) <= reach
        leader[open_[near]] = chosen[near]
        open_ = open_[~near]
        if not len(open_):
            break
        # The first sample left at each place leads the next group.
        _, first, back = np.unique(place[open_], return_index=True, return_inverse=True)
        chosen = open_[first][back]
    _average(normals, leader)
    return leader


def _average(normals: RealArray, leader: Ints) -> None:
    """Gives each leader the mean direction of its group, where the group has more than one."""
    members = np.flatnonzero(leader != np.arange(len(leader)))
    leaders = leader[members]
    groups, slot = np.unique(leaders, return_inverse=True)
    total = normals[groups].astype(np.float64)
    for axis in range(3):
        total[:, axis] += np.bincount(slot, normals[members, axis], len(groups))
    length = np.linalg.norm(total, axis=1)
    # Opposite normals, merged because the crease angle said so, have no mean: the first stays.
    clear = length > 1e-6
    normals[groups[clear]] = total[clear] / length[clear, None]
