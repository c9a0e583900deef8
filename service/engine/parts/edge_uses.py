"""How faces use the edges of a brep: open edges, faulty ones, and borders of open shells."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.brep.prepared import PreparedBrep
from service.engine.measures.chains import chain_edges


@dataclass(frozen=True, eq=False)
class EdgeUses:
    """The coedges of a prepared brep, by shells and edges; degenerate edges do not count.

    Attributes
    ----------
    prepared : PreparedBrep
    coedges : ndarray of int, shape (n,)
        The coedges that count.
    pair : ndarray of int, shape (n,)
        The number of each coedge's pair of a shell and an edge.
    shells : ndarray of int, shape (P,)
        The shell of each pair.
    counts, balances : ndarray of int, shape (P,)
        How many coedges a pair has; and how many more of them run along the edge than against it,
        of reversed faces in the other direction.
    """

    prepared: PreparedBrep
    coedges: Ints
    pair: Ints
    shells: Ints
    counts: Ints
    balances: Ints

    @classmethod
    def of(cls, prepared: PreparedBrep) -> "EdgeUses":
        """The uses of all edges of a prepared brep."""
        edge, face = prepared.coedge_edges, prepared.coedge_faces
        coedges = np.flatnonzero(~prepared.is_degenerate[edge])
        size = max(1, len(prepared.edge_curves))
        keys = prepared.model.face_shells[face[coedges]] * size + edge[coedges]
        pairs, pair = np.unique(keys, return_inverse=True)
        direction = 1 - 2 * (prepared.coedge_reversed ^ prepared.is_reversed[face])[coedges]
        balances = np.zeros(len(pairs), np.intp)
        np.add.at(balances, pair, direction)
        counts = np.bincount(pair, minlength=len(pairs))
        return cls(prepared, coedges, pair, pairs // size, counts, balances)

    @cached_property
    def faulty(self) -> Ints:
        """The coedges of edges that are not balanced, ascending."""
        return np.asarray(self.coedges[self.balances[self.pair] != 0])

    @cached_property
    def is_open(self) -> Bools:
        """Whether each coedge of `faulty` is alone on its edge."""
        is_faulty = self.balances[self.pair] != 0
        return np.asarray(self.counts[self.pair[is_faulty]] == 1)

    @cached_property
    def closed_shells(self) -> Bools:
        """Whether all edges of a shell are balanced, and none of its faces is skipped, (H,)."""
        model, prepared = self.prepared.model, self.prepared
        is_closed = model.shell_counts > 0
        is_closed[self.shells[self.balances != 0]] = False
        if model.skipped:  # the shells of these faces are not known
            is_closed &= model.is_closed
        skipped = np.array([each.face for each in prepared.skipped_faces], np.intp)
        shells = model.face_shells[skipped]
        is_closed[shells[shells >= 0]] = False
        return is_closed

    @property
    def is_closed(self) -> bool:
        """Whether all shells are closed, and no face is skipped."""
        return bool(self.closed_shells.all()) and not self.prepared.skipped_faces

    def chain_open(self) -> list[tuple[Ints, bool]]:
        """The open borders, with the faces on their left, seen from the tips of their normals.

        A border is a list of coedges, and whether it is closed.
        """
        prepared = self.prepared
        coedges = self.faulty[self.is_open]
        first, last = prepared.edge_vertices[prepared.coedge_edges[coedges]].T
        is_reversed = prepared.coedge_reversed ^ prepared.is_reversed[prepared.coedge_faces]
        begins = np.where(is_reversed[coedges], last, first)
        ends = np.where(is_reversed[coedges], first, last)
        return [(coedges[chain], is_closed) for chain, is_closed in chain_edges(begins, ends)]
