"""Bounds of rules over panels and strips: coarse rules against rules over many halves."""

import numpy as np
import pytest

from oracles.solids import read_solid
from service.bases.arrays import FloatArray
from service.engine.brep.preparation.prepare import prepare
from service.engine.measures.integrals import Integrable
from service.engine.measures.quadrature import Integrand
from service.engine.parts.measures.border_pieces import cut_borders
from service.engine.parts.measures.edge_strips import close_faces
from service.engine.parts.measures.placed import PlacedBrep
from service.engine.parts.measures.region_panels import PanelPlan
from tests.engine.brep.solid_documents import lower

NODES = 3
"""Few nodes, so that errors are large."""


def build_cells(name: str) -> tuple[list[Integrable], list[Integrable]]:
    """The panels and the strips of a solid."""
    placed = PlacedBrep(prepare(lower(read_solid(name))))
    borders = cut_borders(placed.prepared)
    panels: list[Integrable] = [*PanelPlan.of(placed, borders).build()]
    strips: list[Integrable] = [*close_faces(placed, borders).strips]
    return panels, strips


def integrate(cells: Integrable, integrand: Integrand, rounds: int) -> FloatArray:
    """The sums of each cell by rules of 10 nodes over halves of halves along both axes."""
    count = len(cells)
    for k in range(rounds):
        cells = cells.halve(k % 2)
    sums, _ = cells.apply_rule(integrand, 10)
    total: FloatArray = sums.reshape(len(sums), 2**rounds, count).sum(axis=1)
    return total


def check_rules(cells: Integrable, integrand: Integrand, rounds: int) -> float:
    """The largest share of the bounds that errors have; they are never beyond."""
    largest = 0.0
    for _ in range(3):
        chosen = np.random.default_rng(len(cells)).permutation(len(cells))[:12]
        few = cells.take(chosen)
        bounds, along_v = few.bound_remainders(integrand, NODES)
        sums, rounding = few.apply_rule(integrand, NODES)
        exact = integrate(few, integrand, rounds)
        # Both sums round.
        slack = 4 * rounding + 1e-14 * np.abs(exact).max()
        errors = np.abs(sums[:1] - exact[:1])
        if integrand == "flux":
            errors = np.concatenate([errors, np.linalg.norm(sums[1:] - exact[1:], axis=0)[None]])
        assert (errors <= bounds + slack).all()
        is_seen = bounds > 1e6 * slack
        largest = max(largest, float((errors / bounds)[is_seen].max(initial=0.0)))
        parts = [few.take(mask).halve(axis) for axis, mask in ((0, ~along_v), (1, along_v))]
        cells = few.join([part for part in parts if len(part)])
    return largest


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ellip", "impeller"])
def test_errors_of_rules_over_panels_are_within_their_bounds(name: str) -> None:
    panels, _ = build_cells(name)
    for integrand in ("size", "flux"):
        shares = [check_rules(cells, integrand, 6) for cells in panels]
        # Bounds are not far from the errors of the worst cells.
        assert max(shares) > 1e-4


def test_errors_of_rules_over_strips_are_within_their_bounds() -> None:
    for name in ("viviani",):
        _, strips = build_cells(name)
        for cells in strips:
            check_rules(cells, "flux", 4)
