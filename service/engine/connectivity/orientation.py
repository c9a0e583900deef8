"""Whether patches enclose a volume: counts their passages along each edge in both directions.

A walk around the border of a patch with the patch on its left passes along each of its four sides
once. An edge is *balanced* if these walks pass along it as often in one direction as in the other.
Patches whose edges are all balanced enclose a volume, in which a point counts with its winding
number. Two kinds of sides count as no passage: sides that are one point, and sides whose second
half returns along the first.

Proof in docs/proofs.md: "Balanced edges".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.connectivity.seams import Seams

LEFT = np.array([-1, 1, 1, -1])
"""+1 for the sides that have the patch on their left, seen from the normal's tip; else −1."""


@dataclass(frozen=True, eq=False, slots=True)
class OrientedSides:
    """The sides of P patches as passages along edges.

    Attributes
    ----------
    edge : ndarray of int, shape (P, 4)
        Number of the edge of each side.
    passage : ndarray of int, shape (P, 4)
        +1 along the direction of the edge, −1 against it, 0 for sides that do not count.
    is_open : ndarray of bool, shape (P, 4)
        Whether the side counts, and is the only side of its edge that counts.
    """

    edge: Ints
    passage: Ints
    is_open: Bools

    @property
    def is_closed(self) -> bool:
        """Whether every edge is balanced."""
        return not np.bincount(self.edge.ravel(), self.passage.ravel()).any()

    def find_unbalanced_sides(self) -> Bools:
        """Which sides, (P, 4), count and lie on edges that are not balanced."""
        sums = np.bincount(self.edge.ravel(), self.passage.ravel())
        return np.asarray((sums[self.edge] != 0) & (self.passage != 0))

    def find_closed_parts(self, part: Ints, count: int) -> Bools:
        """Whether each of `count` parts has patches and balances all of its edges, shape (count,).

        Patch k belongs to part[k].
        """
        edge_count = int(self.edge.max()) + 1
        # An edge has one key for each part that uses it.
        keys, number = np.unique(part[:, np.newaxis] * edge_count + self.edge, return_inverse=True)
        sums = np.bincount(number.ravel(), self.passage.ravel())
        is_closed = np.zeros(count, dtype=bool)
        is_closed[part] = True
        is_closed[keys[sums != 0] // edge_count] = False
        return is_closed


def orient_sides(seams: Seams) -> OrientedSides:
    """The passages of all sides along the edges of their seams."""
    passage = np.where(seams.backward, -LEFT, LEFT)
    passage[seams.collapsed] = 0
    for group in seams.curves:
        does_return = (group.points == group.points[:, ::-1]).all(axis=(1, 2))
        if group.weights is not None:
            does_return &= (group.weights == group.weights[:, ::-1]).all(axis=1)
        if does_return.any():
            passage[np.isin(seams.edge, group.ids[does_return])] = 0
    is_counted = passage != 0
    counts = np.bincount(seams.edge[is_counted], minlength=seams.edge_count)
    return OrientedSides(seams.edge, passage, (counts[seams.edge] == 1) & is_counted)
