"""Chains as curves, and the trees of pieces that repeated halving leads to."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.homogeneous import to_homogeneous
from service.engine.adaptive.borders.chains import Chains
from service.engine.adaptive.borders.curve_shapes import bound_net_rounding
from service.engine.adaptive.borders.side_normals import SideNormals
from service.engine.adaptive.cutting.cells import halve
from service.engine.bounds.faces import SPAN
from service.engine.mesh.seams import Seams

AHEAD = 1 << 11
"""Coordinates of nets up to which parts of edges, and halves of these, are decided at once."""


@dataclass(frozen=True, eq=False, slots=True)
class Curves:
    """Chains of edges of one degree: nets about the first point of the chain, in its direction.

    Attributes
    ----------
    chain, uses : ndarray of int, shape (C,)
        Their numbers among all chains, and the number of sides that run along each.
    start : ndarray of int, shape (C+1,)
        Chain c is the edges (rows of `nets`) `start[c]` to `start[c+1]`.
    owner : ndarray of int, shape (N,)
        The chain, one of C, that each edge belongs to.
    nets : ndarray of float64, shape (N, n+1, 3), or (N, n+1, 4) if homogeneous
    origin, slack : ndarray of float64, shapes (C, 3) and (C,)
        The first points, and bounds of the rounding of nets.
    edge, backward : ndarray of int and of bool, shape (N,)
        The number of each edge, and whether the chain runs against it.
    normals : SideNormals or None
        Normals of the patches at the edges; None if the goal bounds no angle.
    """

    chain: Ints
    uses: Ints
    start: Ints
    owner: Ints
    nets: FloatArray
    origin: FloatArray
    slack: FloatArray
    edge: Ints
    backward: Bools
    normals: SideNormals | None

    def measure_turns(
        self, rows: Ints, begin: FloatArray, end: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """How far normals turn along parts of edges (`SideNormals.turns`); None without angle."""
        if self.normals is None:
            return None
        return self.normals.measure_turns(self.edge[rows], self.backward[rows], begin, end)


@dataclass(frozen=True, eq=False, slots=True)
class Tree:
    """M pieces: level by level their halves, halves of these, and so on.

    Level k is the rows `level[k]`; `parent` (M,) is the piece that each is a half of.
    """

    level: list[slice]
    parent: Ints

    @property
    def depth(self) -> Ints:
        """The level of each, (M,)."""
        sizes = [rows.stop - rows.start for rows in self.level]
        return np.repeat(np.arange(len(sizes)), sizes)

    def walk(self, cut: Bools, closed: Bools, again: Bools) -> tuple[Bools, Bools, Bools]:
        """Which pieces exist, which of them are cut, and which must be cut; all (M,).

        A piece of the first level must be cut if it is marked in `again`, any other piece if it is
        half of a closed piece.
        """
        real, must, cut = np.ones(len(cut), dtype=bool), np.zeros(len(cut), dtype=bool), cut.copy()
        must[self.level[0]] = again
        cut[self.level[0]] |= again
        for rows in self.level[1:]:
            above = self.parent[rows]
            real[rows], must[rows] = cut[above], closed[above]
            cut[rows] = (cut[rows] | must[rows]) & real[rows]
        return real, cut, must


def group_curves(chains: Chains, seams: Seams, normals: SideNormals | None) -> Iterator[Curves]:
    """All chains, those of one degree together."""
    kind, place = (np.empty(len(seams.users), dtype=np.intp) for _ in range(2))
    for number, group in enumerate(seams.curves):
        kind[group.ids], place[group.ids] = number, np.arange(len(group.ids))
    kinds = kind[chains.edge]
    uses, length = chains.uses, chains.length
    for number, group in enumerate(seams.curves):
        rows = (kinds == number).nonzero()[0]
        chain = (kinds[chains.start[:-1]] == number).nonzero()[0]
        if not len(chain):
            continue
        owner = np.repeat(np.arange(len(chain)), length[chain])
        origin = seams.corner_points[chains.corner[chains.start[chain] + chain]]
        chosen, turned = place[chains.edge[rows]], chains.backward[rows]
        points = group.points[chosen]
        points[turned] = points[turned, ::-1]
        points -= origin[owner, None]
        weights = None
        if group.weights is not None:
            weights = group.weights[chosen]
            weights[turned] = weights[turned, ::-1]
        size = np.zeros(len(chain))
        np.maximum.at(size, owner, np.abs(points).max(axis=(1, 2)))
        far = np.abs(origin).max(axis=1) + size
        yield Curves(
            chain,
            uses[chain],
            np.concatenate([[0], np.cumsum(length[chain])]).astype(np.intp),
            owner,
            to_homogeneous(points, weights),
            origin,
            bound_net_rounding(size, far, points.shape[1] - 1),
            chains.edge[rows],
            chains.backward[rows],
            normals,
        )


def build_halving_tree(count: int, levels: int) -> Tree:
    """The tree of pieces that are all halved `levels` − 1 times; it has at least one level."""
    ends = [count * (2**k - 1) for k in range(max(levels, 1) + 1)]
    level = [slice(*pair) for pair in pairwise(ends)]
    number = np.arange(ends[-1])
    parent = number.copy()
    for above, rows in pairwise(level):
        parent[rows].reshape(2, -1)[:] = number[above]
    return Tree(level, parent)


def halve_nets(tree: Tree, at: Ints, depth: int, nets: FloatArray) -> tuple[Ints, FloatArray]:
    """Places and nets (M, n+1, D) of parts of edges and of all their halves in a tree.

    The parts given were halved `depth` times. In each level first halves come before second halves.
    """
    if len(tree.level) == 1:
        return at, nets
    places = np.empty(len(tree.parent), dtype=np.intp)
    halves = np.empty((len(places), *nets.shape[1:]))
    places[tree.level[0]], halves[tree.level[0]] = at, nets
    for number, (rows, below) in enumerate(pairwise(tree.level), start=depth + 1):
        both = halves[below].reshape(2, -1, *nets.shape[1:])
        halve(halves[rows].transpose(1, 2, 0), 0, both.transpose(2, 3, 0, 1))
        places[below] = (places[rows] + np.array([[0], [SPAN >> number]])).ravel()
    return places, halves
