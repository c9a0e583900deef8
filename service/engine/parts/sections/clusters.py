"""Ends of sections that are at one place of an arc, up to rounding.

Proof in docs/proofs.md: "Sections of parts".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints

CLUSTER = 2.0**-20
"""Ends on an arc that are nearer to each other than this share of the face may be in any order."""


@dataclass(frozen=True, eq=False, slots=True)
class Clusters:
    """Ends that are at one place of an arc, up to rounding: c clusters in the order of the arcs.

    Attributes
    ----------
    arc : ndarray of int, shape (c,)
    first, last : ndarray of int, shape (c + 1,)
        Rows of `end`; those of the last entry have no meaning.
    net : ndarray of int, shape (c,)
        How many more ends enter than leave.
    end : ndarray of int, shape (k,)
        The ends on arcs, cluster after cluster.
    cluster, turn : ndarray of int, shape (k,)
        The cluster of each of these, and its number among those of its cluster that enter, or
        leave, like it.
    enters : ndarray of bool, shape (k,)
    """

    arc: Ints
    first: Ints
    last: Ints
    net: Ints
    end: Ints
    cluster: Ints
    turn: Ints
    enters: Bools

    @classmethod
    def of(cls, arc: Ints, share: FloatArray, enters: Bools, lengths: FloatArray) -> "Clusters":
        """The clusters of ends at shares of arcs; those on no arc are in none."""
        located = (arc >= 0).nonzero()[0]
        end = located[np.lexsort((located, share[located], arc[located]))]
        is_new = np.ones(len(end), bool)
        step = (share[end[1:]] - share[end[:-1]]) * lengths[arc[end[1:]]]
        is_new[1:] = (arc[end[1:]] != arc[end[:-1]]) | (step > CLUSTER)
        first = is_new.nonzero()[0]
        last = np.append(first[1:], len(end)) - 1
        cluster = np.cumsum(is_new) - 1
        own = enters[end]
        net = np.bincount(cluster, np.where(own, 1, -1), minlength=len(first)).astype(np.intp)
        # Number those that enter, and those that leave.
        turn = np.zeros(len(end), np.intp)
        for kind in (own, ~own):
            total = np.cumsum(kind)
            turn[kind] = (total - total[first[cluster]] + kind[first[cluster]])[kind] - 1
        return cls(
            arc[end[first]],
            np.append(first, 0),
            np.append(last, 0),
            net,
            end if len(end) else np.zeros(1, np.intp),
            cluster,
            turn,
            own,
        )

    def order_ends(self, is_inside: Bools, before: Ints) -> Ints:
        """The ends of each cluster in turns: one that enters, one that leaves, and so on.

        Where as many enter as leave, those begin that leave if the arc is inside before, as the
        parts after clusters `before` say; otherwise the more frequent ones begin.
        """
        enters_first = self.net > 0
        rows = (before >= 0) & (self.net[before] == 0 if len(self.net) else False)
        enters_first[before[rows]] = ~is_inside[rows]
        is_late = self.enters != enters_first[self.cluster]
        order = np.lexsort((2 * self.turn + is_late, self.cluster))
        return self.end[order] if len(order) else self.end

    def list_inner(self, ordered: Ints, enters: Bools) -> tuple[Ints, Ints]:
        """Pairs of ends of a cluster, one after the other, between which sections are inside."""
        step = (self.cluster[1:] == self.cluster[:-1]).nonzero()[0]
        one, two = ordered[step], ordered[step + 1]
        is_inside = enters[one] & ~enters[two]
        return one[is_inside], two[is_inside]
