"""Makes vertices from samples: which samples at one position share a vertex, and its normal.

Samples at one position whose normals differ by more than an angle stay separate: creases.
"""

from dataclasses import dataclass
from math import sin

import numpy as np

from service.bases.arrays import FloatArray, IndexArray, Ints, RealArray
from service.engine.clustering import find_leaders
from service.engine.connectivity.incidence import hash_arrays

MIN_SUM = 1e-6
"""If the sum of unit normals is shorter than this, it has no reliable direction."""


@dataclass(frozen=True, eq=False, slots=True)
class Averages:
    """Groups of samples whose normals are averaged.

    Attributes
    ----------
    leaders : ndarray of int, shape (G,)
        The sample that leads each group.
    members : ndarray of int, shape (n,)
        The other samples of all groups.
    slot : ndarray of int, shape (n,)
        The group of each member.
    pair_count : int
        The number of groups with one member, pairs of a leader and a member; these groups and their
        members come first.
    leader_of_member : ndarray of int, shape (n,)
        The leader of the group of each member.
    """

    leaders: Ints
    members: Ints
    slot: Ints
    pair_count: int
    leader_of_member: Ints

    @staticmethod
    def from_leaders(leader: Ints, members: Ints | None = None) -> "Averages":
        """Makes the groups from `leader` (N,), the leader of each sample's group.

        `members` are the samples that are not their own leaders, if the caller knows them.
        """
        if members is None:
            members = np.flatnonzero(leader != np.arange(len(leader)))
        leaders, slot, counts = np.unique(leader[members], return_inverse=True, return_counts=True)
        is_pair = counts == 1
        pair_count, total = int(np.count_nonzero(is_pair)), len(leaders)
        # Groups with one member, and their members, come first.
        new_slot = np.empty(total, np.intp)
        new_slot[is_pair], new_slot[~is_pair] = np.arange(pair_count), np.arange(pair_count, total)
        order = np.argsort(~is_pair[slot], kind="stable")
        members, slot = members[order], new_slot[slot[order]]
        # Among the pairs, group k is the group of member k.
        leaders = np.concatenate([leaders[is_pair][slot[:pair_count]], leaders[~is_pair]])
        slot[:pair_count] = np.arange(pair_count)
        return Averages(leaders, members, slot, pair_count, leaders[slot])


@dataclass(frozen=True, eq=False, slots=True)
class Sharing:
    """Which of the samples at one position share a vertex.

    Attributes
    ----------
    leaders : ndarray of int, shape (n,)
        For each member of the groups of samples at one position, the sample whose vertex it shares.
    key : bytes
        A key that is equal for equal leaders.
    is_averaged : bool
        Whether the normals of the leaders are already the mean normals.
    """

    leaders: Ints
    key: bytes
    is_averaged: bool = False


def chord_length(angle: float) -> float:
    """The distance between the ends of two unit vectors at this angle, in radians."""
    return 2 * sin(angle / 2)


def find_creases(normals: RealArray, groups: Averages, angle: float) -> Sharing | None:
    """Groups samples at one position whose normals differ by at most an angle: they share a vertex.

    At each position, the leader of all its samples leads the first group. The first sample whose
    normal differs from the leader's by more than the angle leads the next group
    (`service.engine.clustering`).

    Parameters
    ----------
    normals : ndarray, shape (N, 3)
    groups : Averages
        The groups of samples at one position.
    angle : float
        Radians.

    Returns
    -------
    Sharing or None
        None if the mesh has no crease: all samples at one position share one vertex.
    """
    sample_normals = normals.take(groups.members, axis=0)
    step = sample_normals - normals.take(groups.leader_of_member, axis=0)
    is_near = np.vecdot(step, step) <= chord_length(angle) ** 2
    if np.count_nonzero(is_near) == len(is_near):
        return None
    # The members that do not share the vertex of their leader are grouped.
    far_rows = np.flatnonzero(~is_near)
    slot_of_far = groups.slot[far_rows]
    first = np.empty(len(groups.leaders), np.intp)
    # `first` is the first of these members in each slot: in reverse order, it is written last, and
    # stays.
    first[slot_of_far[::-1]] = np.arange(len(far_rows))[::-1]
    far_leader = find_leaders(first[slot_of_far], sample_normals[far_rows], chord_length(angle))
    leader = groups.leader_of_member.copy()
    leader[far_rows] = groups.members[far_rows[far_leader]]
    return Sharing(leader, hash_arrays(is_near, far_leader))


def mean_normals(normals: RealArray, averages: Averages) -> FloatArray:
    """The mean direction (n_0 + … + n_k) / |n_0 + … + n_k| of each group, (G, 3).

    Opposite normals have no mean direction. If the crease angle lets them share a vertex, the
    result is the normal of the leader.
    """
    first = normals.take(averages.leaders, axis=0).astype(np.float64)
    member_normals = normals.take(averages.members, axis=0).astype(np.float64)
    pair_count, total = averages.pair_count, np.empty((3, len(first)))
    np.add(member_normals[:pair_count].T, 0.0, out=total[:, :pair_count])  # turns −0 into 0
    if pair_count < len(first):
        slot = averages.slot[pair_count:] - pair_count
        for axis in range(3):
            total[axis, pair_count:] = np.bincount(slot, member_normals[pair_count:, axis])
    total += first.T
    squares = total * total
    length = np.sqrt(squares[0] + squares[1] + squares[2])
    is_unclear = length <= MIN_SUM
    if np.count_nonzero(is_unclear):
        total[:, is_unclear], length[is_unclear] = first[is_unclear].T, 1.0
    total /= length
    return total.T


@dataclass(frozen=True, eq=False, slots=True)
class Welding:
    """Samples and their vertices.

    `vertex` (N,) is the vertex of each sample, `samples` (V,) the first sample of each vertex, and
    `welds` (V,) the first vertex at the same position.
    """

    vertex: Ints
    samples: Ints
    welds: Ints


def merge_samples(
    same_position: Ints,
    normals: RealArray | None,
    crease_angle: float,
    same_values: Ints | None = None,
) -> Ints:
    """For each sample, the sample whose vertex it shares; writes mean normals into `normals`.

    Parameters
    ----------
    same_position : ndarray of int, shape (N,)
        For each sample, one sample at its position, the same for all samples there.
    normals : ndarray, shape (N, 3), or None
        Unit normals, if vertices have them.
    crease_angle : float
        Radians; samples whose normals are at a larger angle are not merged.
    same_values : ndarray of int, optional
        For each sample, one sample at its position that has equal colours, texture coordinates and
        attributes. Samples with different values become separate vertices, but may share the mean
        of their normals.
    """
    leader = same_position if same_values is None else same_values
    if normals is not None:
        leader = find_leaders(same_position, normals, chord_length(crease_angle))
        averages = Averages.from_leaders(leader)
        normals[averages.leaders] = mean_normals(normals, averages)
        if same_values is not None:
            followers = np.flatnonzero(leader != np.arange(len(leader)))
            normals[followers] = normals[leader[followers]]
            # The values are whole numbers: different ones are further apart than 0.5.
            leader = find_leaders(leader, same_values[:, np.newaxis].astype(np.float64), 0.5)
    return leader


def number_vertices(same_position: Ints, leader: Ints, used_samples: Ints | None) -> Welding:
    """The vertices of samples; each sample shares the vertex of its `leader`.

    Vertices have the order of their first samples. So the vertices of a single patch have the order
    of its samples. `leader[leader]` equals `leader`, and `same_position` is as in `merge_samples`.
    Samples that are not used in faces become no vertices; without `used_samples`, all are used.
    """
    is_kept = leader == np.arange(len(same_position))
    if used_samples is not None and len(used_samples):
        is_used = np.zeros(len(same_position), dtype=bool)
        is_used[leader[used_samples]] = True
        is_kept &= is_used
    samples = np.flatnonzero(is_kept)
    vertices = np.arange(len(samples))
    # The first vertex at each position: in reverse order, it is written last, and stays.
    first = np.zeros(len(same_position), dtype=np.intp)
    first[same_position[samples[::-1]]] = vertices[::-1]
    # A sample without a face is not a vertex. `Mesh.grids`, which has a vertex for every sample,
    # gets the first vertex at the same position.
    number = first[same_position]
    number[samples] = vertices
    return Welding(number[leader], samples, first[same_position[samples]])


def drop_unused(welding: Welding, faces: tuple[IndexArray, IndexArray]) -> Welding:
    """The welding without the vertices that these faces do not use.

    If no face uses any vertex at a position, its vertices stay, because `Mesh.grids` has a vertex
    for every sample.
    """
    is_used = np.zeros(len(welding.samples), dtype=bool)
    for rows in faces:
        is_used[rows] = True
    # Indexed by the first vertex at each position: whether faces use any vertex there.
    is_shown = np.zeros_like(is_used)
    is_shown[welding.welds[is_used]] = True
    is_used |= ~is_shown[welding.welds]
    kept_vertices = np.flatnonzero(is_used)
    number = np.cumsum(is_used) - 1
    first_at_position = np.zeros_like(number)
    first_at_position[welding.welds[kept_vertices[::-1]]] = number[kept_vertices[::-1]]
    vertex = np.where(is_used, number, first_at_position[welding.welds])
    return Welding(
        vertex[welding.vertex],
        welding.samples[kept_vertices],
        first_at_position[welding.welds[kept_vertices]],
    )


def find_shared_positions(welding: Welding | None) -> IndexArray | None:
    """For each vertex, the first vertex at its position; None if all positions differ."""
    if welding is None or bool((welding.welds == np.arange(len(welding.welds))).all()):
        return None
    return welding.welds.astype(np.uint32)


def count_positions(vertices: int, welds: IndexArray | None) -> int:
    """The number of distinct positions."""
    return vertices if welds is None else int(np.count_nonzero(welds == np.arange(vertices)))
