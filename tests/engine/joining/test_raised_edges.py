"""Borders of different degrees are one edge within the tolerance, as those of equal degrees are."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.engine.joining.join import join
from service.surface.bezier import BezierSurface
from service.surface.convert.operations import Elevate, Operation, Reverse, Transpose
from service.surface.convert.table import convert
from service.surface.multipatch import MultipatchSurface
from tests.engine.meshing import build_mesh, check_sound
from tests.strategies import Array, symmetries
from tools.certify.closing import NEARLY_CLOSED, RESOLUTION

WIDTH = 4.0
"""The width of the sheets; their curve has coordinates between −1 and 1."""


def change_form(
    net: Array, weights: Array | None, degrees: tuple[int, int], symmetry: int
) -> BezierSurface:
    """A Bézier surface in other degrees, with u and v reversed or exchanged."""
    choices: list[Operation] = [Reverse("u"), Reverse("v"), Transpose()]
    operations = [operation for k, operation in enumerate(choices) if symmetry >> k & 1]
    result = convert(BezierSurface(net, weights), [Elevate(degrees), *operations])
    assert isinstance(result, BezierSurface)
    return result


def add_noise(rng: np.random.Generator, sheet: BezierSurface, amplitude: float) -> BezierSurface:
    """The sheet with noise on all points and weights, except at the corners."""
    shift = rng.uniform(-1, 1, sheet.control_net.shape) * amplitude
    factor = 1 + amplitude / WIDTH * rng.uniform(-1, 1, shift.shape[:2])
    corners = np.ix_([0, -1], [0, -1])
    shift[corners], factor[corners] = 0, 1
    weights = None if sheet.weights is None else sheet.weights * factor
    return replace(sheet, control_net=sheet.control_net + shift, weights=weights)


@st.composite
def build_fan(draw: st.DrawFn) -> tuple[list[BezierSurface], np.random.Generator]:
    """Two to four sheets along one curve, rational or not, open or closed, in several degrees."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    degree = draw(st.integers(1, 4))
    is_closed = degree > 2 and draw(st.booleans())
    curve = rng.uniform(-1, 1, (degree + 1, 3))
    weights = draw(st.sampled_from([None, rng.uniform(0.4, 2, degree + 1)]))
    if is_closed:
        curve[-1] = curve[0]
    raises = draw(st.lists(st.integers(0, 3), min_size=2, max_size=4))
    sheets = []
    for k, step in enumerate(raises):
        angle = 2 * np.pi * k / len(raises)
        away = WIDTH * np.array([np.cos(angle), np.sin(angle), 0.1 * k])
        # A factor of all weights does not change a surface.
        rows = None if weights is None else np.stack([weights, weights]) * rng.uniform(0.5, 2)
        net = np.stack([curve, curve + away])
        sheets.append(change_form(net, rows, (1, degree + step), draw(symmetries)))
    return sheets, rng


@given(build_fan(), st.sampled_from([1e-13, 1e-9, 1e-7]))
def test_sheets_along_nearly_one_curve_have_one_edge(
    fan: tuple[list[BezierSurface], np.random.Generator], noise: float
) -> None:
    """And they have none if the noise is larger than the tolerance."""
    sheets, rng = fan
    noisy = tuple(add_noise(rng, sheet, noise * WIDTH) for sheet in sheets)
    model = MultipatchSurface(noisy).lower()
    joined, seams = join(model, 4 * noise)
    # The common edge, and three more of each sheet; two of these are one if the curve is closed.
    is_closed = (sheets[0].control_net[0, 0] == sheets[0].control_net[-1, 0]).all() or (
        sheets[0].control_net[0, 0] == sheets[0].control_net[0, -1]
    ).all()
    count = 1 + (2 if is_closed else 3) * len(sheets)
    assert seams.edge_count == count
    assert joined.moved <= 40 * noise * model.diagonal
    has_inner_points = all(max(sheet.degree) > 1 for sheet in sheets)
    if has_inner_points:
        _, seams = join(model, noise / 100)
        assert seams.edge_count > count


@pytest.mark.parametrize("seed", range(0, NEARLY_CLOSED["noisy borders"].count, 9))
def test_noisy_borders_in_pieces_of_other_degrees_close(seed: int) -> None:
    case = NEARLY_CLOSED["noisy borders"].build(seed)
    mesh = build_mesh(
        case.surface.lower(), resolution=RESOLUTION, weld_tolerance=case.weld_tolerance
    )
    check_sound(mesh)
    assert case.accepts(mesh.report.watertight)
