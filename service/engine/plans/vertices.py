"""Makes vertices from samples: which samples at one position share a vertex, and its normal.

Samples at one position whose normals differ by more than an angle stay separate: creases.
"""

from dataclasses import dataclass
from math import sin

import numpy as np

from service.bases.arrays import AnyInts, Bools, FloatArray, IndexArray, Ints, RealArray
from service.bases.row_batches import first_positions
from service.engine.clustering import find_leaders
from service.engine.connectivity.incidence import hash_arrays

MIN_SUM = 1e-6
"""If the sum of unit normals is shorter than this, it has no reliable direction."""

RUN = 1 << 14
"""The number of pairs whose means are computed together, so that work arrays stay in the
processor's cache."""


@dataclass(frozen=True, eq=False, slots=True)
class Averages:
    """Groups of samples whose normals are averaged.

    Attributes
    ----------
    leaders : ndarray of uint32, shape (G,)
        The sample that leads each group.
    members : ndarray of uint32, shape (n,)
        The other samples of all groups.
    slot : ndarray of uint32, shape (n,)
        The group of each member.
    pair_count : int
        The number of groups with one member, pairs of a leader and a member; these groups and their
        members come first.
    leader_of_member : ndarray of uint32, shape (n,)
        The leader of the group of each member.
    """

    leaders: IndexArray
    members: IndexArray
    slot: IndexArray
    pair_count: int
    leader_of_member: IndexArray

    @property
    def arrays(self) -> tuple[IndexArray, ...]:
        """All arrays."""
        return self.leaders, self.members, self.slot, self.leader_of_member

    @staticmethod
    def from_leaders(leader: AnyInts, members: AnyInts | None = None) -> "Averages":
        """Makes the groups from `leader` (N,), the leader of each sample's group.

        `members` are the samples that are not their own leaders, if the caller knows them.
        """
        if members is None:
            members = np.flatnonzero(leader != np.arange(len(leader), dtype=leader.dtype))
        leader_of_member = leader[members]
        counts = np.bincount(leader_of_member, minlength=len(leader)).astype(np.uint32)
        # Groups with one member, and their members, come first. Among the pairs, group k is the
        # group of member k.
        is_pair = counts[leader_of_member] == 1
        members = np.concatenate([members[is_pair], members[~is_pair]]).astype(np.uint32)
        pairs, others = leader_of_member[is_pair], leader_of_member[~is_pair]
        leader_of_member = np.concatenate([pairs, others]).astype(np.uint32)
        larger_groups = np.flatnonzero(counts > 1)
        leaders = np.concatenate([pairs, larger_groups]).astype(np.uint32)
        slot = np.arange(len(members), dtype=np.uint32)
        # From here on, `counts` has the number of each of the larger groups, by its leader.
        counts[larger_groups] = np.arange(len(pairs), len(leaders), dtype=np.uint32)
        slot[len(pairs) :] = counts[others]
        return Averages(leaders, members, slot, len(pairs), leader_of_member)


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

    leaders: AnyInts
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


def mean_normals(normals: RealArray, averages: Averages) -> RealArray:
    """The mean direction (n_0 + … + n_k) / |n_0 + … + n_k| of each group, (G, 3).

    It is computed in float64 and has the precision of `normals`. Opposite normals have no mean
    direction. If the crease angle lets them share a vertex, the result is the normal of the leader.
    """
    means = np.empty((len(averages.leaders), 3), normals.dtype)
    begin = 0
    while begin + RUN < averages.pair_count:
        means[begin : begin + RUN] = _mean_run(normals, averages, slice(begin, begin + RUN))
        begin += RUN
    means[begin:] = _mean_run(normals, averages, slice(begin, None))
    return means


def _mean_run(normals: RealArray, averages: Averages, run: slice) -> FloatArray:
    """`mean_normals` of a run of groups: some pairs, or all groups from one of the pairs on."""
    first = normals.take(averages.leaders[run], axis=0).astype(np.float64)
    member_normals = normals.take(averages.members[run], axis=0).astype(np.float64)
    pair_count = min(averages.pair_count - run.start, len(first))
    total = np.empty((3, len(first)))
    np.add(member_normals[:pair_count].T, 0.0, out=total[:, :pair_count])  # turns −0 into 0
    if pair_count < len(first):
        slot = averages.slot[averages.pair_count :] - averages.pair_count
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

    vertex: AnyInts
    samples: AnyInts
    welds: AnyInts


def merge_samples(
    same_position: AnyInts,
    normals: RealArray | None,
    crease_angle: float,
    same_values: Ints | None = None,
) -> AnyInts:
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


def number_vertices(same_position: AnyInts, leader: AnyInts, is_used: Bools | None) -> Welding:
    """The vertices of samples; each sample shares the vertex of its `leader`.

    Vertices have the order of their first samples. So the vertices of a single patch have the order
    of its samples. `leader[leader]` equals `leader`, and `same_position` is as in `merge_samples`.
    Samples that are not used in faces become no vertices; without `is_used` (N,), all are used.
    """
    is_kept = leader == np.arange(len(same_position), dtype=leader.dtype)
    if is_used is not None and is_used.any():
        leads_used = np.zeros(len(same_position), dtype=bool)
        leads_used[leader[is_used]] = True
        is_kept &= leads_used
    samples = np.flatnonzero(is_kept).astype(np.uint32)
    position_of_vertex = same_position[samples]
    # The first vertex at each position.
    first = first_positions(position_of_vertex, len(same_position))
    welds = first[position_of_vertex]
    # A sample without a face is not a vertex. `Mesh.grids`, which has a vertex for every sample,
    # gets the first vertex at the same position.
    number = first[same_position]
    number[samples] = np.arange(len(samples), dtype=np.uint32)
    return Welding(number[leader], samples, welds)


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
    kept_welds = welding.welds[kept_vertices]
    first_at_position = first_positions(kept_welds, len(is_used))
    vertex = first_at_position[welding.welds]
    vertex[kept_vertices] = np.arange(len(kept_vertices), dtype=np.uint32)
    return Welding(
        vertex[welding.vertex], welding.samples[kept_vertices], first_at_position[kept_welds]
    )


def find_shared_positions(welding: Welding | None) -> IndexArray | None:
    """For each vertex, the first vertex at its position; None if all positions differ."""
    if welding is None:
        return None
    welds = welding.welds.astype(np.uint32, copy=False)
    return None if (welds == np.arange(len(welds), dtype=np.uint32)).all() else welds


def count_positions(vertices: int, welds: IndexArray | None) -> int:
    """The number of distinct positions."""
    if welds is None:
        return vertices
    return int(np.count_nonzero(welds == np.arange(vertices, dtype=np.uint32)))
