"""Surfaces close if control points are equal up to rounding, and points move little."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from oracles.deviation import measure_surface_to_mesh
from oracles.sheets import build_sheets
from service.bases.polynomials import elevate
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.joining.join import join
from service.engine.options import MeshOptions
from service.pipeline.mesh import plan_mesh
from service.surface.bezier import BezierSurface
from service.surface.multipatch import MultipatchSurface
from tests.engine.meshing import build_mesh, check_sound, find_topology
from tests.strategies import Array, build_cube, build_model
from tools.certify.closing import NEARLY_CLOSED, RESOLUTION
from tools.certify.nearly import build_closed_spline, separate_patches

COARSE = Accuracy(relative_tolerance=1e-1)


def add_noise(nets: list[Array], amplitude: float) -> list[Array]:
    """The nets with random noise of at most `amplitude` in each coordinate."""
    rng = np.random.default_rng(0)
    return [net + rng.uniform(-amplitude, amplitude, net.shape) for net in nets]


@pytest.mark.parametrize("seed", range(0, NEARLY_CLOSED["noise"].count, 4))
def test_surfaces_with_noise_within_the_tolerance_close(seed: int) -> None:
    """Balls and rings as B-splines or as single patches, with noise of 1e-17 to 1e-9."""
    case = NEARLY_CLOSED["noise"].build(seed)
    model = case.surface.lower()
    mesh = build_mesh(model, resolution=RESOLUTION, weld_tolerance=case.weld_tolerance)
    assert case.accepts(mesh.report.watertight)
    check_sound(mesh)
    if mesh.report.closure is not None and mesh.report.watertight:
        assert mesh.report.closure.u is not None
    strict = build_mesh(model, resolution=RESOLUTION, weld_tolerance=0.0)
    assert strict.report.moved == 0
    assert mesh.report.moved <= 3 * case.weld_tolerance * model.diagonal


@pytest.mark.parametrize(
    ("seed", "options"),
    # Meshes of these surfaces once were not watertight. Seeds may exceed the `count` of a family,
    # which limits only `make certify`.
    [
        *((seed, {"resolution": RESOLUTION}) for seed in (73, 292)),
        *((seed, {"accuracy": COARSE}) for seed in (102, 326)),
    ],
)
def test_surfaces_with_spans_as_short_as_the_tolerance_close(
    seed: int, options: dict[str, Any]
) -> None:
    """Pieces of balls and rings whose knots are 1e-9 to 1e-12 of their range apart."""
    case = NEARLY_CLOSED["crowded knots"].build(seed)
    mesh = build_mesh(case.surface.lower(), **options)
    check_sound(mesh)
    assert (case.is_closed, mesh.report.watertight) == (True, True)
    bound = mesh.report.deviation_bound
    assert bound is not None
    assert 0 < mesh.report.moved <= bound


@pytest.mark.parametrize(
    "options", [{"resolution": (2, 2)}, {"accuracy": Accuracy(tolerance=1e-5)}]
)
def test_the_bound_includes_the_movement(options: dict[str, Any]) -> None:
    """A cube of flat faces with gaps of 4e-7: its deviation comes from the movement of points."""
    model = build_model(add_noise(build_cube(), 4e-7))
    mesh = build_mesh(model, weld_tolerance=1e-6, **options)
    assert (mesh.report.watertight, find_topology(mesh).euler) == (True, 2)
    result = measure_surface_to_mesh(
        build_sheets(model), mesh.positions[mesh.triangles].astype(float), 500
    )
    bound = mesh.report.deviation_bound
    assert bound is not None
    assert 1e-7 < result.distance <= mesh.report.moved + 1e-15 <= bound
    assert not build_mesh(model, **options).report.watertight


def test_equal_points_keep_their_bits_and_others_move_little() -> None:
    """If no points are near, none moves; else positions differ at most by the reported movement."""
    exact = separate_patches(
        build_closed_spline(np.random.default_rng(3), has_poles=False).lower().batches[0]
    ).lower()
    assert join(exact, 1e-12)[0] is exact
    model = build_model(add_noise(build_cube(), 1e-13))
    options: dict[str, Any] = {"resolution": (3, 3), "weld": False}
    joined_mesh = build_mesh(model, **options)
    separate_positions = [
        build_mesh(build_model([net]), **options).positions for net in model.batches[0].points
    ]
    distances = np.linalg.norm(joined_mesh.positions - np.concatenate(separate_positions), axis=1)
    assert 0 < distances.max() <= joined_mesh.report.moved + 1e-16


@pytest.mark.parametrize("amplitude", [0.0, 1e-13, 1e-7])
@pytest.mark.parametrize("is_raised", [False, True])
def test_weights_that_are_equal_up_to_noise_and_a_factor_are_joined(
    amplitude: float, is_raised: bool
) -> None:
    """A ring of rational patches with noise; weights are scaled, and some degrees are elevated."""
    rng = np.random.default_rng(21)
    patches = list(build_rational_ring(rng))
    for k, (net, weights) in enumerate(patches):
        new_net, new_weights = (
            elevate((net, weights), len(net) + 1) if is_raised and k % 2 else (net, weights)
        )
        assert new_weights is not None
        noise = amplitude * rng.uniform(-1, 1, (*new_weights.shape, 4))
        patches[k] = new_net + noise[..., :3], new_weights * (2.7**k) * (1 + noise[..., 3])
    model = MultipatchSurface(tuple(BezierSurface(*patch) for patch in patches)).lower()
    reverse = MultipatchSurface(tuple(BezierSurface(*patch) for patch in patches[::-1])).lower()
    tolerance = max(5 * amplitude, 1e-12)
    joined, seams = join(model, tolerance)
    # Each of the four patches keeps two open sides, at the lower and the upper rim of the ring.
    assert seams.connectivity.open_count == 8
    assert joined.moved <= 20 * amplitude * model.diagonal + 1e-13
    # The order of the patches does not change the positions.
    positions = [
        build_mesh(m, weld_tolerance=tolerance, accuracy=Accuracy(tolerance=0.2)).positions
        for m in (model, reverse)
    ]
    assert len({tuple(sorted(map(tuple, rows.tolist()))) for rows in positions}) == 1


@pytest.mark.parametrize(("amplitude", "factor"), [(4e-13, 1.0), (4e-13, 3.0), (1e-7, 0.3)])
def test_near_weights_become_those_of_polynomial_neighbours(
    amplitude: float, factor: float
) -> None:
    """A closed ring of four patches; every second patch is polynomial."""
    rng = np.random.default_rng(3)
    pieces = []
    for k, (net, _) in enumerate(build_rational_ring(rng)):
        # Weights differ in the middle row alone: the ends have nearly the weights of a polynomial.
        weights = factor * (1 + amplitude * rng.uniform(-1, 1, net.shape[:2]))
        weights[1] *= 1.7
        pieces.append(BezierSurface(net, weights if k % 2 else None))
    for order in (pieces, pieces[::-1]):
        model = MultipatchSurface(tuple(order)).lower()
        joined, seams = join(model, max(1e-12, 5 * amplitude))
        assert seams.connectivity.open_count == 8
        assert 0 < joined.moved <= 20 * amplitude * model.diagonal


@pytest.mark.parametrize(("offset", "open_sides"), [(0.0, 16), (1e6, 8)])
def test_the_tolerance_of_weights_grows_far_from_zero(offset: float, open_sides: int) -> None:
    """The weights of a ring differ by 1e-10, which exceeds the tolerance only near zero."""
    rng = np.random.default_rng(4)
    pieces = [
        BezierSurface(net + offset, weights * (1 + 1e-10 * rng.uniform(-1, 1, weights.shape)))
        for net, weights in build_rational_ring(rng)
    ]
    _, seams = join(MultipatchSurface(tuple(pieces)).lower(), 1e-12)
    assert seams.connectivity.open_count == open_sides


def build_rational_ring(rng: np.random.Generator) -> Iterator[tuple[Array, Array]]:
    """Yields the nets (3, 4, 3) and weights (3, 4) of four patches around a closed ring."""
    angles = np.linspace(0, 2 * np.pi, 9)[:, None]
    radius = rng.uniform(1, 2, 4) * np.where(np.arange(9) % 2, 1.4, 1)[:, None]
    net = np.stack(
        [radius * np.cos(angles), radius * np.sin(angles), 0 * angles + np.arange(4)], -1
    )
    weights = rng.uniform(0.5, 2, (9, 4))
    net[-1], weights[-1] = net[0], weights[0]
    for k in range(0, 8, 2):
        yield net[k : k + 3], weights[k : k + 3]


def test_an_edge_gets_the_net_that_comes_first_in_dictionary_order() -> None:
    """The nets of both sides are compared in both directions."""
    rng = np.random.default_rng(5)
    nets = rng.uniform(0, 1, (2, 4, 4, 3))
    nets[1, -1] = nets[0, 0, ::-1] + rng.uniform(-1e-13, 1e-13, (4, 3))
    # The edge is the first row of net 0, and in reverse direction the last row of net 1.
    lines = [nets[0, 0], nets[0, 0, ::-1], nets[1, -1], nets[1, -1, ::-1]]
    first_line = min(lines, key=lambda line: line.ravel().tolist())
    for order in ([0, 1], [1, 0]):
        (batch,) = join(build_model(list(nets[order])), 1e-12)[0].batches
        first_side, second_side = (
            batch.points[order.index(0), 0],
            batch.points[order.index(1), -1, ::-1],
        )
        np.testing.assert_array_equal(first_side, second_side)
        inner_points = first_side[1:-1]
        assert first_line[1:-1].tolist() in (inner_points.tolist(), inner_points[::-1].tolist())
        # Each end is a corner: of both nets' points there, the first in dictionary order.
        np.testing.assert_array_equal(
            first_side[[0, -1]],
            [min(p.tolist() for p in (lines[0][k], lines[3][k])) for k in (0, -1)],
        )


def test_a_single_patch_with_nearly_equal_sides_closes() -> None:
    net = np.random.default_rng(1).uniform(0, 1, (5, 4, 3))
    net[-1] = net[0] + 1e-13
    report = plan_mesh(BezierSurface(net), MeshOptions((4, 4)), BY_NAME["json"]).run().report
    assert report is not None
    assert report.closure is not None
    assert (report.closure.u, report.closure.v) == ("C0", None)
    assert 0 < report.moved <= 2e-13
