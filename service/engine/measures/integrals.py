"""Integrals over the patches of a model: cells are halved until all errors together are small.

Only bounds are computed while cells are halved; the sums are computed once, in the end. Cells
whose errors are least are kept as long as these add up to half of what is allowed; the others are
halved, each in the direction in which it changes more. Errors that still are too large when there
are as many cells as there may be make the interval wider.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import fsum

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.measures.cells import Cells
from service.engine.measures.local_nets import UPWARDS, LocalNets
from service.engine.measures.remainders import Kind, remainders
from service.engine.measures.rules import apply_rule

NODES = 10
"""Of a rule in each direction, where no rule is exact."""

ROUGH = 6
"""Of the rule that tells about how large an integral is."""

CHUNK = 1 << 18
"""Numbers of one array that are worked on at a time."""

ROUNDS = 200
"""How often cells are halved at most: they are never as small as that."""


@dataclass(frozen=True, eq=False, slots=True)
class Integrals:
    """Sums over cells, one column a cell, as `rules.apply_rule` gives them, and all their errors.

    Attributes
    ----------
    sums : ndarray of float64, shape (1, K) or (4, K)
    errors : ndarray of float64, shape (1, K) or (2, K)
    patch : ndarray of int, shape (K,)
    """

    sums: FloatArray
    errors: FloatArray
    patch: Ints

    def over_parts(self, part: Ints, count: int) -> tuple[FloatArray, FloatArray]:
        """Totals and errors, correctly rounded: of all patches, then of each of `count` parts.

        Patch k belongs to part[k]. Shapes (1 or 4, 1 + count) and (1 or 2, 1 + count).
        """
        number = part[self.patch]
        order = np.argsort(number, kind="stable")
        ends = np.searchsorted(number[order], np.arange(count + 1))
        runs = [slice(None), *(slice(a, b) for a, b in pairwise(ends.tolist()))]
        sums, errors = (
            np.array([[fsum(row[run]) for run in runs] for row in of[:, order]])
            for of in (self.sums, self.errors)
        )
        return sums, errors


def growth(groups: list[Cells]) -> float:
    """How much larger the area may become if control points move by the noise of their cells."""
    total = []
    for cells in groups:
        for rows in chunks(cells, 1):
            plain, moved = (LocalNets(cells.take(rows), by) for by in (0.0, cells.noise))
            (a, b), (c, d) = plain.stretches, moved.stretches
            total.append(float((c * d - a * b).sum()))
    return fsum(total) * UPWARDS


def estimate(groups: list[Cells], kind: Kind) -> tuple[FloatArray, FloatArray]:
    """About what the integrals are, and their rounding: one rule a patch."""
    parts = [_sums(cells, kind, ROUGH, None) for cells in groups]
    sums = [part.sums.sum(axis=1) for part in parts]
    return np.sum(sums, axis=0), np.sum([part.errors.sum(axis=1) for part in parts], axis=0)


def integrate(groups: list[Cells], kind: Kind, wanted: FloatArray, budget: int) -> Integrals:
    """Integrals of `kind` over all cells.

    Parameters
    ----------
    groups : list of Cells
        Whole patches, of one degree each.
    wanted : ndarray of float64, shape (1,) or (2,)
        Errors of the whole that are small enough.
    budget : int
        Control points that all cells may have.
    """
    closed = kind == "flux"
    done = [
        _sums(cells, kind, max(2, 2 * max(cells.degree)), None)
        for cells in groups
        if closed and not cells.is_rational
    ]
    rest = [_bounded(cells, kind) for cells in groups if not closed or cells.is_rational]
    kept: list[_Bounded] = []
    room, share = budget - sum(each.cells.size for each in rest), 1.0
    for _ in range(ROUNDS):
        checkpoint()
        errors = np.concatenate([np.zeros(0), *(each.worst(wanted) for each in rest)])
        order = np.argsort(errors, kind="stable")
        added = np.cumsum(errors[order])
        if not len(added) or added[-1] <= share:
            break
        points = np.concatenate([np.full(len(e.cells), e.cells.size // len(e.cells)) for e in rest])
        few = int(np.searchsorted(added, share / 2, side="right"))
        # The largest come first where there is no room for all.
        few = max(few, len(order) - int((np.cumsum(points[order[::-1]]) <= room).sum()))
        if few == len(order):
            break
        share -= added[few - 1] if few else 0.0
        chosen = np.ones(len(order), dtype=bool)
        chosen[order[:few]] = False
        room -= int(points[chosen].sum())
        ends = np.cumsum([0] + [len(each.cells) for each in rest])
        kept += [e.take(~chosen[a:b]) for e, a, b in zip(rest, ends[:-1], ends[1:], strict=True)]
        rest = [
            half
            for e, a, b in zip(rest, ends[:-1], ends[1:], strict=True)
            for half in e.take(chosen[a:b]).halves(kind)
        ]
    done += [
        _sums(each.cells, kind, NODES, each.errors) for each in (*kept, *rest) if len(each.cells)
    ]
    return Integrals(
        *(
            np.concatenate([getattr(part, name) for part in done], axis=-1)
            for name in Integrals.__slots__
        )
    )


@dataclass(frozen=True, eq=False, slots=True)
class _Bounded:
    """Cells of one degree, what their rules may be wrong by, and how to halve them."""

    cells: Cells
    errors: FloatArray
    along_v: Bools

    def worst(self, wanted: FloatArray) -> FloatArray:
        """Errors in parts of what is wanted, (K,)."""
        parts: FloatArray = (self.errors / wanted[:, np.newaxis]).max(axis=0)
        return parts

    def take(self, rows: Bools) -> "_Bounded":
        """Some of them."""
        return _Bounded(self.cells.take(rows), self.errors[:, rows], self.along_v[rows])

    def halves(self, kind: Kind) -> "list[_Bounded]":
        """All of them, halved."""
        turned = ((0, ~self.along_v), (1, self.along_v))
        parts = [self.cells.take(rows).halved(axis) for axis, rows in turned if rows.any()]
        return [_bounded(Cells.joined(parts), kind)] if parts else []


def _bounded(cells: Cells, kind: Kind) -> _Bounded:
    found = []
    for rows in chunks(cells, 1):
        checkpoint()
        found.append(remainders(local_nets(cells.take(rows), kind), kind, NODES))
    return _Bounded(
        cells,
        np.concatenate([each.errors for each in found], axis=1),
        np.concatenate([each.along_v for each in found]),
    )


def _sums(cells: Cells, kind: Kind, count: int, errors: FloatArray | None) -> Integrals:
    sums, rounding = [], []
    for rows in chunks(cells, count):
        checkpoint()
        each, wrong = apply_rule(local_nets(cells.take(rows), kind), kind, count)
        sums.append(each)
        rounding.append(wrong)
    total = np.concatenate(rounding, axis=1)
    return Integrals(
        np.concatenate(sums, axis=1), total if errors is None else total + errors, cells.patch
    )


def local_nets(cells: Cells, kind: Kind) -> LocalNets:
    """The nets of cells; what control points are wrong by tells on a flux in another way."""
    return LocalNets(cells, cells.noise if kind == "size" else 0.0)


def chunks(cells: Cells, count: int) -> list[slice]:
    """Runs of cells whose arrays, of `count`² nodes or of control points, fit the cache."""
    p, q = cells.degree
    each = 3 * max(count, p + 1) * max(count if q else 1, q + 1)
    step = max(1, CHUNK // each)
    return [slice(k, k + step) for k in range(0, len(cells), step)]
