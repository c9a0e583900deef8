"""Bounds of cells, compared with points and partials of the surface at many places of each cell."""

import numpy as np
import pytest

from service.engine.cells import models as model_rows
from service.engine.cells.tree import CellTree, WorkLimits
from service.engine.models import to_patches
from service.engine.nets.partials import ORDERS, net_partials
from service.engine.nets.query_nets import surface_nets
from service.engine.vectors import UNIT
from service.surface.examples.catalogue import EXAMPLES
from tools.certify.surfaces import FAMILIES

SAMPLES = 7
"""Samples of a cell along each of its two directions."""

PAIRS = ((1, 1, 3), (1, 2, 4), (2, 2, 5))
"""S_i, S_j and S_ij among S, S_a, S_b, S_aa, S_ab, S_bb."""


@pytest.mark.parametrize(
    "family", ["bicubic, wild", "rational, weights to 1000", "triangles", "poles", "degree 15"]
)
def test_bounds_of_cells_hold_at_all_samples(family: str) -> None:
    model = to_patches(FAMILIES[family].surface(seed=6).lower())
    cells = CellTree(surface_nets(model.batches), WorkLimits(pairs=0, of_item=0))
    for _ in range(4):  # halves the last 60 cells
        cells.children(np.arange(cells.count)[-60:])
    selected_cells = np.unique(np.linspace(0, cells.count - 1, 60).astype(int))
    # a and b in [−1, 1] are the parameters of a cell.
    a, b = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-1, 1, SAMPLES)] * 2))
    cell = np.repeat(selected_cells, SAMPLES**2)
    a, b = np.tile(a, len(selected_cells)), np.tile(b, len(selected_cells))
    # The rows of `rectangle` are the least and the largest u, then the least and the largest v.
    low, high = cells.rectangle[::2, cell], cells.rectangle[1::2, cell]
    half = (high - low) / 2
    partials = net_partials(cells.nets, cells.net[cell], low + half * np.stack([a + 1, b + 1]))
    scale = np.stack([half[0] ** i * half[1] ** j for i, j in ORDERS[:6]])
    s = partials * scale[:, np.newaxis]  # S and its partials by a and b
    models = cells.models[:, cell]
    # Row k of `s` and `vectors[k − 1]` are the same partial, at the samples and at the centre.
    center, *vectors = (models[k : k + 3] for k in (model_rows.CENTER, *model_rows.VECTORS))
    da, db, daa, dab, dbb, normal = vectors
    offset = s[0] - center
    remainder = offset - (da * a + db * b + daa * a * a / 2 + dab * a * b + dbb * b * b / 2)
    # Pairs of a value at each sample, and the row of the model that bounds it.
    observed = [(np.linalg.norm(offset, axis=0), model_rows.RADIUS)]
    observed += [(np.linalg.norm(remainder, axis=0), model_rows.REST)]
    observed += [(np.abs((remainder * normal).sum(axis=0)), model_rows.REST_LIFT)]
    for k, (i, j, second) in enumerate(PAIRS):
        second_difference = s[second] - vectors[second - 1]
        # The change of S_i · S_j + (S − c) · S_ij from its value at the centre, where S is c.
        spread = (s[i] * s[j] + offset * s[second] - vectors[i - 1] * vectors[j - 1]).sum(axis=0)
        observed += [(np.linalg.norm(second_difference, axis=0), model_rows.BEND_AA + k)]
        observed += [(np.abs((second_difference * normal).sum(axis=0)), model_rows.LIFT_AA + k)]
        observed += [(np.abs(spread), model_rows.SPREAD_AA + k)]
    for value, row in observed:
        slack = 1e-13 * (1 + np.abs(s).max())
        assert (value <= models[row] + slack).all(), row
    # In some cell the last bound, SPREAD_BB, is at most 12 times the largest value: if it were far
    # above all values, the test would prove nothing.
    value, row = observed[-1]
    assert (value.reshape(-1, SAMPLES**2).max(axis=1) > models[row, :: SAMPLES**2] / 12).any()


def test_bounds_count_the_rounding_of_nets_that_come_from_triangles() -> None:
    """For degree n, 9 n units, twice for the weights, before a centre or a point is computed."""
    model = to_patches(EXAMPLES["octahedral-sphere"].build().lower())
    cells = CellTree(surface_nets(model.batches), WorkLimits(pairs=0, of_item=0))
    n, _ = cells.nets.groups[0].degree
    unit = UNIT * cells.largest
    assert (cells.models[model_rows.ERROR, cells.first] >= (2 * (9 + 2) * n + 9) * unit).all()
    assert (cells.errors >= (2 * (9 + 8) * n + 9) * unit).all()
