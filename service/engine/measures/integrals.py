"""Integrals over the patches of a model: cells are halved until the sum of their errors is small.

Only bounds are computed while cells are halved; the integrals are computed once, at the end. In
each round the cells with the smallest errors are accepted, as long as their errors add up to at
most half of the errors that are still allowed. The other cells are halved, each in the direction in
which its integrand changes more. The interval always includes the errors of all cells, even if the
budget ends before they are small enough.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from math import fsum

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.measures.cells import UPWARDS, CellNets, MeasuredCells
from service.engine.measures.quadrature import Integrand, apply_rule
from service.engine.measures.remainders import bound_remainders
from service.engine.vectors import Items

NODES = 10
"""The number of nodes of a rule in each direction, if no rule is exact."""

ESTIMATE_NODES = 6
"""The number of nodes, in each direction, of the rule that estimates an integral."""

CHUNK = 1 << 18
"""How many numbers one array has at most, so that it stays in the processor's cache."""

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


@dataclass(frozen=True, eq=False, slots=True)
class BoundedCells(MeasuredCells):
    """K cells of one degree, the remainders of their rules, and the directions of halving.

    `errors` (1 or 2, K) are the remainders; `along_v` (K,) says which cells to halve along v.
    """

    errors: FloatArray
    along_v: Bools

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
    exact : list of MeasuredCells
        Cells for which a rule of 2 max(p, q) nodes is exact.
    bounded : list of BoundedCells
        Other cells, for which rules of `NODES` nodes have remainders.
    excess : float
        Sum of the remainders, in units of the allowed errors: above 1 if the budget ended first.
    used_budget : bool
        Whether the budget ended before the cells that it leaves are as they would be without one.
    """

    integrand: Integrand
    exact: list[MeasuredCells]
    bounded: list[BoundedCells]
    excess: float
    used_budget: bool

    def integrate(self) -> Integrals:
        """The integrals over all cells."""
        parts = [_integrate(c, self.integrand, max(2, 2 * max(c.degree))) for c in self.exact]
        parts += [
            _integrate(cells, self.integrand, NODES, cells.errors)
            for cells in self.bounded
            if len(cells)
        ]
        return Integrals.join(parts)


def bound_growth(groups: list[MeasuredCells]) -> float:
    """Bound the growth of the area if control points move by their errors.

    With A ≥ |S_u| and B ≥ |S_v| over a cell, which become A + a and B + b, |S_u × S_v| grows by at
    most (A + a) (B + b) − A B.
    """
    growths = []
    for cells in groups:
        for rows in chunks(cells, 1):
            chunk = cells.take(rows)
            exact_u, exact_v = CellNets(chunk).stretches  # A and B
            moved_u, moved_v = CellNets(chunk, chunk.point_error).stretches  # A + a and B + b
            growths.append(float((moved_u * moved_v - exact_u * exact_v).sum()))
    return fsum(growths) * UPWARDS


def estimate(groups: list[MeasuredCells], integrand: Integrand) -> tuple[FloatArray, FloatArray]:
    """Estimate the integrals by one rule for each patch, and bound the rounding of these rules."""
    parts = [_integrate(cells, integrand, ESTIMATE_NODES) for cells in groups]
    sums = [part.sums.sum(axis=1) for part in parts]
    return np.sum(sums, axis=0), np.sum([part.errors.sum(axis=1) for part in parts], axis=0)


def refine(
    groups: list[MeasuredCells], integrand: Integrand, allowed: FloatArray, budget: int
) -> Refinement:
    """Halve cells until their remainders add up to the allowed errors, or the budget ends.

    Parameters
    ----------
    groups : list of MeasuredCells
        The patches, grouped by degree.
    allowed : ndarray of float64, shape (1,) or (2,)
        The allowed errors of the sum over all cells.
    budget : int
        The most control points of all cells; but at least three times those of the patches.
    """
    # The flux of a polynomial patch is a polynomial, for which a rule is exact.
    has_closed_form = integrand == "flux"
    exact = [cells for cells in groups if has_closed_form and not cells.is_rational]
    open_cells = [
        _bound(cells, integrand) for cells in groups if not has_closed_form or cells.is_rational
    ]
    accepted: list[BoundedCells] = []
    size = sum(bounded.size for bounded in open_cells)
    # `share` of the allowed errors is still allowed; accepted cells have used the rest.
    remaining_points, share, excess = max(budget - size, 2 * size), 1.0, 0.0
    used_budget = False
    for _ in range(MAX_ROUNDS):
        checkpoint()
        errors = np.concatenate(
            [np.zeros(0), *(bounded.relative_errors(allowed) for bounded in open_cells)]
        )
        order = np.argsort(errors, kind="stable")
        summed_errors = np.cumsum(errors[order])
        excess = 1 - share + float(summed_errors[-1]) if len(summed_errors) else 0.0
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
        accepted += [cells.take(~rows) for cells, rows in divided]
        open_cells = [
            half for cells, rows in divided for half in _halve(cells.take(rows), integrand)
        ]
    return Refinement(integrand, exact, [*accepted, *open_cells], excess, used_budget)


def _halve(cells: BoundedCells, integrand: Integrand) -> list[BoundedCells]:
    """The halves of all cells; an empty list without cells."""
    directions = ((0, ~cells.along_v), (1, cells.along_v))
    parts = [cells.take(rows).halve(axis) for axis, rows in directions if rows.any()]
    return [_bound(MeasuredCells.join(parts), integrand)] if parts else []


def _bound(cells: MeasuredCells, integrand: Integrand) -> BoundedCells:
    """The cells with the remainders of their rules."""
    parts = []
    for rows in chunks(cells, 1):
        checkpoint()
        parts.append(bound_remainders(local_nets(cells.take(rows), integrand), integrand, NODES))
    errors, along_v = (np.concatenate(arrays, axis=-1) for arrays in zip(*parts, strict=True))
    return BoundedCells(cells.nets, cells.patch, cells.depth, cells.point_error, errors, along_v)


def _integrate(
    cells: MeasuredCells, integrand: Integrand, count: int, errors: FloatArray | float = 0.0
) -> Integrals:
    """The integrals by rules of `count` nodes, and the sum of their rounding and `errors`."""
    parts = []
    for rows in chunks(cells, count):
        checkpoint()
        chunk = cells.take(rows)
        parts.append(
            Integrals(*apply_rule(local_nets(chunk, integrand), integrand, count), chunk.patch)
        )
    sums = Integrals.join(parts)
    return replace(sums, errors=sums.errors + errors)


def local_nets(cells: MeasuredCells, integrand: Integrand) -> CellNets:
    """The nets of cells. A flux omits the errors of control points: `solids` adds their bound."""
    return CellNets(cells, cells.point_error if integrand == "size" else 0.0)


def chunks(cells: MeasuredCells, count: int) -> list[slice]:
    """Runs of cells whose arrays, of `count`² nodes or of control points, fit the cache."""
    p, q = cells.degree
    numbers = 3 * max(count, p + 1) * max(count if q else 1, q + 1)
    step = max(1, CHUNK // numbers)
    return [slice(k, k + step) for k in range(0, len(cells), step)]
