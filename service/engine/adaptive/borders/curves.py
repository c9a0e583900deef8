"""Chains as curves, the turns of normals along them, and the trees of their halves.

The normals of all models of a request count together: edges of two models with equal control points
are one edge here, and are divided in the same way.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, unique_rows
from service.engine.adaptive.borders.chains import Chains
from service.engine.adaptive.borders.curve_shapes import bound_net_rounding
from service.engine.bounds.faces import SPAN
from service.engine.connectivity.seams import Seams
from service.engine.evaluation.normals import evaluate_scattered_normals
from service.engine.nets.subdivision import halve
from service.engine.vectors import length
from service.surface.batches import Patches


@dataclass(frozen=True, eq=False, slots=True)
class SideNormals:
    """Sides of patches along the edges of a model, and of all models that are meshed with it.

    Attributes
    ----------
    batches : tuple of TensorPatches or TrianglePatches
        The patches of all models, numbered from one batch to the next.
    side, backward : ndarray of int and of bool, shape (N,)
        Sides of patches (4 p + s) that are not points, sorted by their edges; whether a side runs
        against its edge.
    start, count : ndarray of int, shape (D,)
        The first side of each distinct edge, and the number of its sides.
    number : ndarray of int, shape (E,)
        The number of the distinct edge of each edge of the model.
    """

    batches: tuple[Patches, ...]
    side: Ints
    backward: Bools
    start: Ints
    count: Ints
    number: Ints

    def measure_turns(
        self, edge: Ints, against: Bools, begin: FloatArray, end: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Turns of unit normals along M parts of edges, as distances of unit vectors.

        On each patch at the edge, the normals at both ends of a part are compared with the normal
        in its middle. Returns the larger of the two distances (M,), and their sum (M,); each is the
        largest of all patches. `begin` and `end` (M,) are parameters in [0, 1]; `against` (M,) says
        whether they are counted against the direction of the edge.
        """
        distinct = self.number[edge]
        part, row = expand_runs(self.count[distinct], self.start[distinct])
        patch, side = np.divmod(self.side[row], 4)
        t = np.stack([begin, begin + (end - begin) / 2, end], axis=1)[part]
        along = np.where((against[part] ^ self.backward[row])[:, None], 1.0 - t, t)
        # Sides 0 and 1 are u = 0 and u = 1, sides 2 and 3 are v = 0 and v = 1.
        across = np.broadcast_to((side % 2.0)[:, None], along.shape)
        along_v = side[:, None] < 2
        u, v = np.where(along_v, across, along), np.where(along_v, along, across)
        normals, _ = evaluate_scattered_normals(
            self.batches, np.repeat(patch, 3), u.ravel(), v.ravel()
        )
        steps = length(np.diff(normals.reshape(-1, 3, 3), axis=1), -1)
        half, total = np.zeros(len(edge)), np.zeros(len(edge))
        np.maximum.at(half, part, steps.max(axis=1))
        np.maximum.at(total, part, steps.sum(axis=1))
        return half, total


def build_side_normals(models: Sequence[tuple[Sequence[Patches], Seams]]) -> list[SideNormals]:
    """The normals along the edges of each model, given its batches and its seams."""
    numbers = _number_different_edges([seams for _, seams in models])
    sides, backward, edges, patches_before = [], [], [], 0
    for number, (_, seams) in zip(numbers, models, strict=True):
        own = np.flatnonzero(~seams.collapsed)  # sides of this model (4 p + s) that are not points
        sides.append(4 * patches_before + own)
        backward.append(seams.backward.ravel()[own])
        edges.append(number[seams.edge.ravel()[own]])
        patches_before += len(seams.edge)
    edge = np.concatenate(edges)
    order = np.argsort(edge, kind="stable")
    count = np.bincount(edge, minlength=1 + max(int(n.max(initial=-1)) for n in numbers))
    all_models = SideNormals(
        batches=tuple(batch for model_batches, _ in models for batch in model_batches),
        side=np.concatenate(sides)[order],
        backward=np.concatenate(backward)[order],
        start=np.cumsum(count) - count,
        count=count,
        number=numbers[0],
    )
    return [replace(all_models, number=number) for number in numbers]


def _number_different_edges(seams: Sequence[Seams]) -> list[Ints]:
    """Numbers of the edges (E,) of each model, equal for equal curves."""
    numbers = [np.zeros(model_seams.edge_count, np.intp) for model_seams in seams]
    sizes = {group.points.shape[1] for model_seams in seams for group in model_seams.curves}
    count = 0
    for size in sorted(sizes):
        ids, rows = [], []
        for number, model_seams in zip(numbers, seams, strict=True):
            for group in model_seams.curves:
                if group.points.shape[1] == size:
                    edges = len(group.points)
                    weights = np.ones((edges, size)) if group.weights is None else group.weights
                    rows.append(
                        np.concatenate([group.points.reshape(edges, 3 * size), weights], axis=1)
                    )
                    ids.append((number, group.ids))
        first, row_number = unique_rows(np.concatenate(rows))
        begin = 0
        for number, edge in ids:
            number[edge] = count + row_number[begin : begin + len(edge)]
            begin += len(edge)
        count += len(first)
    return numbers


AHEAD = 1 << 11
"""Parts of edges are judged at once with their halves, the halves of these, and so on, as long as
all nets together have at most this many coordinates."""


@dataclass(frozen=True, eq=False, slots=True)
class Curves:
    """Chains of edges of one degree.

    Attributes
    ----------
    chain, uses : ndarray of int, shape (C,)
        The numbers of the chains among all chains, and the number of sides along each.
    start : ndarray of int, shape (C+1,)
        Chain c is the edges (rows of `nets`) `start[c]` to `start[c+1]`.
    owner : ndarray of int, shape (N,)
        The chain, one of C, that each edge belongs to.
    nets : ndarray of float64, shape (N, n+1, 3), or (N, n+1, 4) if homogeneous
        Control points of the edges in the direction of the chain, relative to its first point.
    origin, slack : ndarray of float64, shapes (C, 3) and (C,)
        The first points of the chains, and bounds of the rounding of nets.
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


@dataclass(frozen=True, eq=False, slots=True)
class Tree:
    """M pieces, level by level: pieces, their halves, the halves of these, and so on.

    Level k has the rows `level[k]`; each piece is a half of the piece `parent` (M,). A piece of the
    first level is its own parent.
    """

    level: list[slice]
    parent: Ints

    @property
    def depth(self) -> Ints:
        """The level (M,) of each piece."""
        sizes = [rows.stop - rows.start for rows in self.level]
        return np.repeat(np.arange(len(sizes)), sizes)

    def walk(self, bent: Bools, closed: Bools, forced: Bools) -> tuple[Bools, Bools]:
        """Which pieces exist, and which of them are cut; both (M,).

        A piece exists if it is of the first level, or a half of a piece that is cut. It is cut if
        it is marked in `bent` (M,), for its shape; or if it is a half of a piece that is marked in
        `closed` (M,), because that ends in its first point; or if it is of the first level, of n
        pieces, and marked in `forced` (n,).
        """
        exists, cut = np.ones(len(bent), dtype=bool), bent.copy()
        cut[self.level[0]] |= forced
        for rows in self.level[1:]:
            above = self.parent[rows]
            exists[rows] = cut[above]
            cut[rows] = (bent[rows] | closed[above]) & exists[rows]
        return exists, cut


def group_curves(chains: Chains, seams: Seams, normals: SideNormals | None) -> Iterator[Curves]:
    """All chains, grouped by degree."""
    # For each edge of the model, the number of its group in `seams.curves`, and its row there.
    group_number, group_row = (np.empty(seams.edge_count, dtype=np.intp) for _ in range(2))
    for number, group in enumerate(seams.curves):
        group_number[group.ids], group_row[group.ids] = number, np.arange(len(group.ids))
    edge_group = group_number[chains.edge]
    uses, lengths = chains.uses, chains.length
    for number, group in enumerate(seams.curves):
        rows = (edge_group == number).nonzero()[0]
        chain = (edge_group[chains.start[:-1]] == number).nonzero()[0]
        if not len(chain):
            continue
        owner = np.repeat(np.arange(len(chain)), lengths[chain])
        origin = seams.corner_points[chains.corner[chains.start[chain] + chain]]
        chosen, turned = group_row[chains.edge[rows]], chains.backward[rows]
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
            np.concatenate([[0], np.cumsum(lengths[chain])]).astype(np.intp),
            owner,
            to_homogeneous(points, weights),
            origin,
            bound_net_rounding(size, far, points.shape[1] - 1),
            chains.edge[rows],
            chains.backward[rows],
            normals,
        )


def build_halving_tree(count: int, levels: int) -> Tree:
    """The tree of `count` pieces, all halved `levels` − 1 times (0 times if `levels` is 0)."""
    ends = [count * (2**k - 1) for k in range(max(levels, 1) + 1)]
    level = [slice(*pair) for pair in pairwise(ends)]
    number = np.arange(ends[-1])
    parent = number.copy()
    for above, rows in pairwise(level):
        parent[rows].reshape(2, -1)[:] = number[above]
    return Tree(level, parent)


def halve_nets(tree: Tree, at: Ints, depth: int, nets: FloatArray) -> tuple[Ints, FloatArray]:
    """Places (M,) and nets (M, n+1, D) of parts of edges and of all their halves in a tree.

    `at` and `nets` are those of the first level, which are results of `depth` halvings of edges. In
    each level first halves come before second halves.
    """
    if len(tree.level) == 1:
        return at, nets
    places = np.empty(len(tree.parent), dtype=np.intp)
    halves = np.empty((len(places), *nets.shape[1:]))
    places[tree.level[0]], halves[tree.level[0]] = at, nets
    for halvings, (rows, lower) in enumerate(pairwise(tree.level), start=depth + 1):
        both = halves[lower].reshape(2, -1, *nets.shape[1:])
        halve(halves[rows].transpose(1, 2, 0), 0, both.transpose(2, 3, 0, 1))
        places[lower] = (places[rows] + np.array([[0], [SPAN >> halvings]])).ravel()
    return places, halves
