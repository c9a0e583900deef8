"""Vertices out of samples: which samples are one vertex, and with which normal."""

from dataclasses import dataclass
from math import sin

import numpy as np

from service.bases.arrays import IndexArray, Ints, RealArray
from service.engine.near import leaders


@dataclass(frozen=True, eq=False, slots=True)
class Welding:
    """Samples and the vertices they became.

    `vertex` (N,) is the vertex of each sample; `samples` (V,) the sample that each vertex comes
    from; `welds` (V,) the first vertex at the same position.
    """

    vertex: Ints
    samples: Ints
    welds: Ints


def weld(
    place: Ints,
    used: Ints | None,
    normals: RealArray | None,
    crease_angle: float,
    merge: bool,
    *,
    alike: Ints | None = None,
) -> Welding:
    """Merges samples at one place whose normals agree; writes their mean into `normals`.

    A vertex stands where its first sample stood, so that the vertices of a patch that meets no
    other keep their order.

    Parameters
    ----------
    place : ndarray of int, shape (N,)
        For each sample, one sample that stands for its position (that one for itself).
    used : ndarray of int, optional
        Samples that occur in faces; all of them if left out or if there are no faces at all.
    normals : ndarray, shape (N, 3), or None
        Unit normals, if vertices have them.
    crease_angle : float
        Radians; normals further apart than this stay apart.
    merge : bool
        False keeps every sample a vertex of its own.
    alike : ndarray of int, optional
        For each sample, one at its place that has the same colour, texture coordinates and so on
        (that one for itself). Others stay apart, though they may share the mean of their normals.
    """
    own = np.arange(len(place))
    leader = own
    if merge:
        leader = place if alike is None else alike
        if normals is not None:
            # Two unit vectors at this angle are this far apart.
            leader = leaders(place, normals, 2 * sin(crease_angle / 2))
            _average(normals, leader)
            if alike is not None:
                shared = np.flatnonzero(leader != own)
                normals[shared] = normals[leader[shared]]
                leader = leaders(leader, alike[:, np.newaxis].astype(np.float64), 0.5)
    kept = leader == own
    if used is not None and len(used):
        wanted = np.zeros(len(place), dtype=bool)
        wanted[leader[used]] = True
        kept &= wanted
    samples = np.flatnonzero(kept)
    # The first vertex at every place; written backwards, it is the one that stays.
    first = np.zeros(len(place), dtype=np.intp)
    first[place[samples[::-1]]] = own[: len(samples)][::-1]
    # A sample in no face is no vertex, but a grid may show it: then another one at its place does.
    number = first[place]
    number[samples] = own[: len(samples)]
    return Welding(number[leader], samples, first[place[samples]])


def without_unused(welding: Welding, faces: tuple[IndexArray, IndexArray]) -> Welding:
    """The welding without vertices that none of these faces has.

    A place that no face has keeps its vertices: a grid may show it.
    """
    used = np.zeros(len(welding.samples), dtype=bool)
    for rows in faces:
        used[rows] = True
    shown = np.zeros_like(used)
    shown[welding.welds[used]] = True
    used |= ~shown[welding.welds]
    kept = np.flatnonzero(used)
    number = np.cumsum(used) - 1
    first = np.zeros_like(number)
    first[welding.welds[kept[::-1]]] = number[kept[::-1]]
    vertex = np.where(used, number, first[welding.welds])
    return Welding(vertex[welding.vertex], welding.samples[kept], first[welding.welds[kept]])


def shared_places(welding: Welding | None) -> IndexArray | None:
    """The first vertex at each vertex's position; None where all positions differ."""
    if welding is None or bool((welding.welds == np.arange(len(welding.welds))).all()):
        return None
    return welding.welds.astype(np.uint32)


def count_places(vertices: int, welds: IndexArray | None) -> int:
    """How many different positions there are."""
    if welds is None:
        return vertices
    return int(np.count_nonzero(welds == np.arange(vertices)))


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
