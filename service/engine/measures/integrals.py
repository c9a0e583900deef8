"""Integrals over the patches of a model: cells are halved until the sum of their errors is small.

Only bounds are computed while cells are halved; the integrals are computed once, at the end. In
each round the cells with the smallest errors are accepted, as long as their errors add up to at
most half of the errors that are still allowed. The other cells are halved, each in the direction in
which its integrand changes more. The interval always includes the errors of all cells, even if the
budget ends before they are small enough.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import fsum
from typing import Protocol, Self

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.measures.quadrature import Integrand
from service.engine.vectors import Items

NODES = 10
"""The number of nodes of a rule in each direction, if no rule is exact."""

ESTIMATE_NODES = 6
"""The number of nodes, in each direction, of the rule that estimates an integral."""

MAX_ROUNDS = 200
"""The most rounds of halving. The budget always ends earlier."""


@dataclass(frozen=True, eq=False, slots=True)
class Integrals(Items):
    """Sums over K cells from `apply_rule`, one column for each cell, and all their errors.

    Attributes
    ----------
    sums : ndarray of float64, shape (1, K), or (4, K): the flux, and the moment's coordinates
    errors : ndarray of float64, shape (1, K), or (2, K): of the flux and of the moment
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
            np.array([[fsum(row[run]) for run in runs] for row in values[:, order]])
            for values in (self.sums, self.errors)
        )
        return sums, errors


class Integrable(Protocol):
    """K cells of one kind and degree that can be halved, and the rules that integrate over them."""

    @property
    def patch(self) -> Ints:
        """Number of the patch, or of another unit of sums, of each cell, (K,)."""

    @property
    def size(self) -> int:
        """Number of control points of all cells."""

    def __len__(self) -> int:
        """K."""

    def take(self, index: Ints | Bools | slice) -> Self:
        """The cells with these indices, or those that a mask marks."""

    @classmethod
    def join(cls, parts: Sequence[Self]) -> Self:
        """The cells of several records, one record after the other."""

    def halve(self, axis: int, /) -> Self:
        """Both halves of every cell along axis 0 or 1: first halves come first."""

    def find_exact_rule(self, integrand: Integrand, /) -> int:
        """The number of nodes of a rule that is exact, or 0 if there is none."""

    def chunks(self, count: int) -> list[slice]:
        """Runs of cells whose arrays, for rules of `count` nodes, fit the processor's cache."""

    def bound_remainders(self, integrand: Integrand, count: int) -> tuple[FloatArray, Bools]:
        """Bounds of the errors of rules of `count` nodes, (1 or 2, K).

        The second result says whether to halve a cell along axis 1, (K,).
        """

    def apply_rule(self, integrand: Integrand, count: int) -> tuple[FloatArray, FloatArray]:
        """Sums by rules of `count` nodes, and bounds of their rounding, as `Integrals` has them."""


@dataclass(frozen=True, eq=False, slots=True)
class BoundedCells:
    """K cells of one degree, the remainders of their rules, and the directions of halving.

    `errors` (1 or 2, K) are the remainders; `along_v` (K,) says which cells to halve along v.
    """

    cells: Integrable
    errors: FloatArray
    along_v: Bools

    @classmethod
    def of(cls, cells: Integrable, integrand: Integrand) -> "BoundedCells":
        """The cells with the remainders of their rules."""
        parts = []
        for rows in cells.chunks(1):
            checkpoint()
            parts.append(cells.take(rows).bound_remainders(integrand, NODES))
        errors, along_v = (np.concatenate(arrays, axis=-1) for arrays in zip(*parts, strict=True))
        return cls(cells, errors, along_v)

    def __len__(self) -> int:
        return len(self.cells)

    @property
    def size(self) -> int:
        """Number of control points of all cells."""
        return self.cells.size

    def take(self, rows: Bools) -> "BoundedCells":
        """The cells that a mask marks."""
        return BoundedCells(self.cells.take(rows), self.errors[:, rows], self.along_v[rows])

    def halve(self, rows: Bools, integrand: Integrand) -> "list[BoundedCells]":
        """The halves of the cells that a mask marks; an empty list without cells."""
        directions = ((0, rows & ~self.along_v), (1, rows & self.along_v))
        parts = [self.cells.take(each).halve(axis) for axis, each in directions if each.any()]
        return [BoundedCells.of(self.cells.join(parts), integrand)] if parts else []

    def relative_errors(self, allowed: FloatArray) -> FloatArray:
        """The errors in units of the allowed errors, the larger of two for each cell, (K,)."""
        relative: FloatArray = (self.errors / allowed[:, np.newaxis]).max(axis=0)
        return relative


@dataclass(frozen=True, eq=False, slots=True)
class Refinement:
    """Cells that are small enough for their rules, or as small as the budget allows.

    Attributes
    ----------
    integrand : Integrand
    exact : list of Integrable
        Cells that have an exact rule.
    bounded : list of BoundedCells
        Other cells, for which rules of `NODES` nodes have remainders.
    used_budget : bool
        Whether the budget ended before the cells that it leaves are as they would be without one.
    """

    integrand: Integrand
    exact: list[Integrable]
    bounded: list[BoundedCells]
    used_budget: bool

    def integrate(self) -> Integrals:
        """The integrals over all cells."""
        parts = [
            _integrate(cells, self.integrand, cells.find_exact_rule(self.integrand))
            for cells in self.exact
        ]
        parts += [
            _integrate(bounded.cells, self.integrand, NODES, bounded.errors)
            for bounded in self.bounded
            if len(bounded)
        ]
        return Integrals.join(parts)


def estimate(groups: Sequence[Integrable], integrand: Integrand) -> tuple[FloatArray, FloatArray]:
    """Estimate the integrals by one rule for each patch, and bound the rounding of these rules."""
    parts = [_integrate(cells, integrand, ESTIMATE_NODES) for cells in groups]
    sums = [part.sums.sum(axis=1) for part in parts]
    return np.sum(sums, axis=0), np.sum([part.errors.sum(axis=1) for part in parts], axis=0)


def refine(
    groups: Sequence[Integrable], integrand: Integrand, allowed: FloatArray, budget: int
) -> Refinement:
    """Halve cells until their remainders add up to the allowed errors, or the budget ends.

    Parameters
    ----------
    groups : sequence of Integrable
        The patches, grouped by degree.
    allowed : ndarray of float64, shape (1,) or (2,)
        The allowed errors of the sum over all cells.
    budget : int
        The most control points of all cells; but at least three times those of the patches.
    """
    is_exact = [cells.find_exact_rule(integrand) > 0 for cells in groups]
    exact = [cells for cells, has_rule in zip(groups, is_exact, strict=True) if has_rule]
    open_cells = [
        BoundedCells.of(cells, integrand)
        for cells, has_rule in zip(groups, is_exact, strict=True)
        if not has_rule
    ]
    accepted: list[BoundedCells] = []
    size = sum(bounded.size for bounded in open_cells)
    # `share` of the allowed errors is still allowed; accepted cells have used the rest.
    remaining_points, share = max(budget - size, 2 * size), 1.0
    used_budget = False
    for _ in range(MAX_ROUNDS):
        checkpoint()
        errors = np.concatenate(
            [np.zeros(0), *(bounded.relative_errors(allowed) for bounded in open_cells)]
        )
        order = np.argsort(errors, kind="stable")
        summed_errors = np.cumsum(errors[order])
        if not len(summed_errors) or summed_errors[-1] <= share:
            break
        points_of_cells = np.concatenate(
            [np.full(len(bounded), bounded.size // len(bounded)) for bounded in open_cells]
        )
        accepted_count = int(np.searchsorted(summed_errors, share / 2, side="right"))
        # If the budget does not suffice for all cells, the cells with the largest errors are
        # halved. Halving a cell adds as many control points as the cell has.
        affordable_count = int((np.cumsum(points_of_cells[order[::-1]]) <= remaining_points).sum())
        if accepted_count + affordable_count < len(order):
            accepted_count, used_budget = len(order) - affordable_count, True
        if accepted_count == len(order):
            break
        share -= summed_errors[accepted_count - 1] if accepted_count else 0.0
        is_halved = np.ones(len(order), dtype=bool)
        is_halved[order[:accepted_count]] = False
        remaining_points -= int(points_of_cells[is_halved].sum())
        splits = np.cumsum([len(cells) for cells in open_cells])[:-1]
        divided = list(zip(open_cells, np.split(is_halved, splits), strict=True))
        accepted += [bounded.take(~rows) for bounded, rows in divided]
        open_cells = [half for bounded, rows in divided for half in bounded.halve(rows, integrand)]
    return Refinement(integrand, exact, [*accepted, *open_cells], used_budget)


def _integrate(
    cells: Integrable, integrand: Integrand, count: int, errors: FloatArray | float = 0.0
) -> Integrals:
    """The integrals by rules of `count` nodes, and the sum of their rounding and `errors`."""
    parts = []
    for rows in cells.chunks(count):
        checkpoint()
        chunk = cells.take(rows)
        parts.append(Integrals(*chunk.apply_rule(integrand, count), chunk.patch))
    sums = Integrals.join(parts)
    return replace(sums, errors=sums.errors + errors)
