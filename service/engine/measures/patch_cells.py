"""Whole patches, and pieces of curves, as cells that are integrated."""

from math import fsum

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.measures.cells import UPWARDS, CellNets, MeasuredCells
from service.engine.measures.quadrature import Integrand, apply_rule
from service.engine.measures.remainders import bound_remainders
from service.engine.nets.query_nets import QueryNets

CHUNK = 1 << 18
"""How many numbers one array has at most, so that it stays in the processor's cache."""


class PatchCells(MeasuredCells):
    """K cells of whole patches, or of curves, with the rules that integrate over them."""

    __slots__ = ()

    def find_exact_rule(self, integrand: Integrand) -> int:
        """The number of nodes of a rule that is exact, or 0 if there is none.

        The flux of a polynomial patch is a polynomial.
        """
        if integrand == "flux" and not self.is_rational:
            return max(2, 2 * max(self.degree))
        return 0

    def chunks(self, count: int) -> list[slice]:
        """Runs of cells whose arrays, of `count`² nodes or of control points, fit the cache."""
        p, q = self.degree
        numbers = 3 * max(count, p + 1) * max(count if q else 1, q + 1)
        step = max(1, CHUNK // numbers)
        return [slice(k, k + step) for k in range(0, len(self), step)]

    def bound_remainders(self, integrand: Integrand, count: int) -> tuple[FloatArray, Bools]:
        """Bounds of the errors of rules of `count` nodes, and along which axis to halve."""
        return bound_remainders(self._localize(integrand), integrand, count)

    def apply_rule(self, integrand: Integrand, count: int) -> tuple[FloatArray, FloatArray]:
        """Sums by rules of `count` nodes, and bounds of their rounding."""
        return apply_rule(self._localize(integrand), integrand, count)

    def _localize(self, integrand: Integrand) -> CellNets:
        """The nets of cells. A flux omits the errors of control points: `solids` adds them."""
        return CellNets(self, self.point_error if integrand == "size" else 0.0)


def group_cells(
    nets: QueryNets, point_error: float, patches: Bools | None = None
) -> list[PatchCells]:
    """The nets of a model as cells, one group for each degree.

    `point_error` is in model units. `patches` (P,) says which patches are taken, by default all.
    """
    groups = []
    for group in nets.groups:
        patch = group.patches
        rows = np.arange(len(patch)) if patches is None else np.flatnonzero(patches[patch])
        if len(rows):
            groups.append(build_cells(group.nets[rows], patch[rows], point_error / nets.scale))
    return groups


def build_cells(nets: FloatArray, patch: Ints, point_error: FloatArray | float) -> PatchCells:
    """Nets (K, p+1, q+1, d) as cells that are not halved yet; `point_error` for all, or for each.

    Homogeneous nets are divided by powers of two, so that weights are as `MeasuredCells` requires.
    """
    ordered = np.ascontiguousarray(nets.transpose(3, 1, 2, 0))
    if len(ordered) == 4:
        _, exponent = np.frexp(ordered[3].max(axis=(0, 1)))
        ordered = np.ldexp(ordered, -exponent)
    errors = np.full(len(patch), point_error)
    return PatchCells(ordered, patch, np.zeros(len(patch), np.intp), errors)


def bound_growth(groups: list[PatchCells]) -> float:
    """Bound the growth of the area if control points move by their errors.

    With A ≥ |S_u| and B ≥ |S_v| over a cell, which become A + a and B + b, |S_u × S_v| grows by at
    most (A + a) (B + b) − A B.
    """
    growths = []
    for cells in groups:
        for rows in cells.chunks(1):
            chunk = cells.take(rows)
            exact_u, exact_v = CellNets(chunk).stretches  # A and B
            moved_u, moved_v = CellNets(chunk, chunk.point_error).stretches  # A + a and B + b
            growths.append(float((moved_u * moved_v - exact_u * exact_v).sum()))
    return fsum(growths) * UPWARDS
