"""Creases: which samples at one place share a vertex, and the mean of their normals."""

from dataclasses import dataclass
from math import sin

import numpy as np

from service.bases.arrays import FloatArray, Ints, RealArray
from service.engine.clustering import find_leaders
from service.engine.mesh.connectivity import hash_arrays

OPPOSITE = 1e-6
"""A sum of unit normals shorter than this has no direction."""


@dataclass(frozen=True, eq=False, slots=True)
class Averages:
    """Groups of samples whose normals are averaged.

    Attributes
    ----------
    leaders : ndarray of int, shape (G,)
        The first sample of each group.
    members : ndarray of int, shape (n,)
        All others.
    slot : ndarray of int, shape (n,)
        The group of each member.
    pairs : int
        The first groups and members, this many, are those of one member.
    first : ndarray of int, shape (n,)
        The first sample of the group of each member.
    """

    leaders: Ints
    members: Ints
    slot: Ints
    pairs: int
    first: Ints

    @staticmethod
    def from_leaders(leader: Ints, members: Ints | None = None) -> "Averages":
        """The groups of samples of which `leader` (N,) names the first one.

        `members` are those that have another leader than themselves, where they are known.
        """
        if members is None:
            members = np.flatnonzero(leader != np.arange(len(leader)))
        first, slot, counts = np.unique(leader[members], return_inverse=True, return_counts=True)
        paired = counts == 1
        pairs = int(np.count_nonzero(paired))
        number = np.empty(len(first), np.intp)
        number[paired], number[~paired] = np.arange(pairs), np.arange(pairs, len(first))
        order = np.argsort(~paired[slot], kind="stable")
        members, slot = members[order], number[slot[order]]
        # Of pairs the groups are in the order of their members.
        first = np.concatenate([first[paired][slot[:pairs]], first[~paired]])
        slot[:pairs] = np.arange(pairs)
        return Averages(first, members, slot, pairs, first[slot])


@dataclass(frozen=True, eq=False, slots=True)
class Sharing:
    """The samples that share their vertex with the first one at their place, or with another.

    Attributes
    ----------
    leaders : ndarray of int, shape (n,)
        For each member of the groups of samples at one place the sample whose vertex it shares.
    key : bytes
        Equal for equal leaders.
    is_averaged : bool
        Whether the normals of the leaders are the means already.
    """

    leaders: Ints
    key: bytes
    is_averaged: bool = False


def chord_length(angle: float) -> float:
    """How far two unit vectors at this angle, in radians, are apart."""
    return 2 * sin(angle / 2)


def find_creases(normals: RealArray, places: Averages, angle: float) -> Sharing | None:
    """Which samples at one place share a vertex: those whose normals are within an angle.

    The first sample of a place leads the first group; the first sample that is further from it
    than the angle leads the next one (`service.engine.clustering`).

    Parameters
    ----------
    normals : ndarray, shape (N, 3)
    places : Averages
        The samples at one place.
    angle : float
        Radians.

    Returns
    -------
    Sharing or None
        None if all samples at one place share their vertex: there is no crease.
    """
    sample_normals = normals.take(places.members, axis=0)
    step = sample_normals - normals.take(places.first, axis=0)
    near = np.vecdot(step, step) <= chord_length(angle) ** 2
    if np.count_nonzero(near) == len(near):
        return None
    rest = np.flatnonzero(~near)
    slot = places.slot[rest]
    first = np.empty(len(places.leaders), np.intp)
    first[slot[::-1]] = np.arange(len(rest))[::-1]  # written backwards, the first one stays
    group = find_leaders(first[slot], sample_normals[rest], chord_length(angle))
    leader = places.first.copy()
    leader[rest] = places.members[rest[group]]
    return Sharing(leader, hash_arrays(near, group))


def mean_normals(normals: RealArray, averages: Averages) -> FloatArray:
    """The mean direction (n_0 + … + n_k) / |n_0 + … + n_k| of each group, (G, 3).

    Opposite normals, which share a vertex because the angle of creases said so, have no mean: the
    first one stands for all.
    """
    first = normals.take(averages.leaders, axis=0).astype(np.float64)
    member_normals = normals.take(averages.members, axis=0).astype(np.float64)
    pairs, total = averages.pairs, np.empty((3, len(first)))
    np.add(member_normals[:pairs].T, 0.0, out=total[:, :pairs])  # turns −0 into 0
    if pairs < len(first):
        slot = averages.slot[pairs:] - pairs
        for axis in range(3):
            total[axis, pairs:] = np.bincount(slot, member_normals[pairs:, axis])
    total += first.T
    squares = total * total
    length = np.sqrt(squares[0] + squares[1] + squares[2])
    unclear = length <= OPPOSITE
    if np.count_nonzero(unclear):
        total[:, unclear], length[unclear] = first[unclear].T, 1.0
    total /= length
    return total.T
