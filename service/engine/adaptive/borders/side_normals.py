"""How far the normals of each patch turn along its edges.

All models of a request are taken together: edges of two models with equal control points are one
edge, and are divided in the same way.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.bases.unique_rows import unique_rows
from service.engine.evaluation.scattered import scattered_normals
from service.engine.mesh.seams import Seams
from service.surface.batches import Patches


@dataclass(frozen=True, eq=False, slots=True)
class SideNormals:
    """Sides of patches along the edges of a model, and of all models that it is meshed with.

    Attributes
    ----------
    batches : tuple of TensorPatches or TrianglePatches
        The patches of all models, numbered from one batch to the next.
    side, backward : ndarray of int and of bool, shape (N,)
        Sides of patches (4 p + s) that are lines, edge by edge; whether each runs against its edge.
    start, count : ndarray of int, shape (D,)
        The first side of each different edge, and the number of its sides.
    number : ndarray of int, shape (E,)
        The different edge that each edge of the model is.
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
        """Distances of unit normals at both ends of parts of edges from those in the middle.

        Parameters
        ----------
        edge : ndarray of int, shape (M,)
        against : ndarray of bool, shape (M,)
            Whether parameters are counted against the direction of the edge.
        begin, end : ndarray of float64, shape (M,)
            Parameters, in [0, 1].

        Returns
        -------
        half, total : ndarray of float64, shape (M,)
            The larger of the distances |n − n′| between the middle and an end, and their sum; each
            is the largest of all patches at the edge.
        """
        run = self.number[edge]
        part, row = expand_runs(self.count[run], self.start[run])
        patch, side = np.divmod(self.side[row], 4)
        t = np.stack([begin, begin + (end - begin) / 2, end], axis=1)[part]
        along = np.where((against[part] ^ self.backward[row])[:, None], 1.0 - t, t)
        across = np.broadcast_to((side % 2.0)[:, None], along.shape)
        along_v = side[:, None] < 2
        u, v = np.where(along_v, across, along), np.where(along_v, along, across)
        normals, _ = scattered_normals(self.batches, np.repeat(patch, 3), u.ravel(), v.ravel())
        steps = np.sqrt(np.square(np.diff(normals.reshape(-1, 3, 3), axis=1)).sum(axis=2))
        half, total = np.zeros(len(edge)), np.zeros(len(edge))
        np.maximum.at(half, part, steps.max(axis=1))
        np.maximum.at(total, part, steps.sum(axis=1))
        return half, total


def build_side_normals(models: Sequence[tuple[Sequence[Patches], Seams]]) -> list[SideNormals]:
    """The normals along the edges of each model, given its batches and its seams."""
    numbers = _number_different_edges([seams for _, seams in models])
    sides: list[Ints] = []
    backward: list[Bools] = []
    edges: list[Ints] = []
    first = 0
    for number, (_, seams) in zip(numbers, models, strict=True):
        lines = np.flatnonzero(~seams.collapsed)
        sides.append(4 * first + lines)
        backward.append(seams.backward.ravel()[lines])
        edges.append(number[seams.edge.ravel()[lines]])
        first += len(seams.edge)
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
    """Numbers of the edges (E,) of each model, equal where their curves are."""
    numbers = [np.zeros(len(seam.users), np.intp) for seam in seams]
    degrees = {group.points.shape[1] for seam in seams for group in seam.curves}
    count = 0
    for size in sorted(degrees):
        groups = [
            (number, group)
            for number, seam in zip(numbers, seams, strict=True)
            for group in seam.curves
            if group.points.shape[1] == size
        ]
        rows = []
        for _, group in groups:
            weights = np.ones(group.points.shape[:2]) if group.weights is None else group.weights
            points = group.points.reshape(len(weights), 3 * size)
            rows.append(np.concatenate([points, weights], axis=1))
        first, place = unique_rows(np.concatenate(rows))
        ends = np.cumsum([0, *map(len, rows)])
        for k, (number, group) in enumerate(groups):
            number[group.ids] = count + place[ends[k] : ends[k + 1]]
        count += len(first)
    return numbers
