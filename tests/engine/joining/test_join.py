"""Borders that are one curve with different knots, degrees or directions become one edge."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BSpline

from oracles.deviation import measure_surface_to_mesh
from oracles.sheets import build_sheets
from service.bases.polynomials import split
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.joining import join as joining
from service.engine.joining.cutting import Lines, cut
from service.engine.joining.join import join
from service.engine.options import MeshOptions
from service.errors import TooLarge
from service.pipeline.limits import DEFAULT_LIMITS
from service.pipeline.mesh import plan_mesh
from service.pipeline.mesh_plan import build_plan
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.examples.catalogue import find
from service.surface.lowered import PatchModel
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from tests.engine.meshing import build_mesh, check_sound, check_values, check_winding, find_topology
from tests.strategies import Array, translate
from tools.certify.closing import NEARLY_CLOSED, RESOLUTION


@pytest.mark.parametrize("seed", range(5))  # `make certify` judges all other seeds
def test_pieces_of_a_closed_body_make_a_watertight_mesh(seed: int) -> None:
    """Balls and rings of B-splines, cut at random places.

    In a third of the bodies one point is moved, so that a gap stays open.
    """
    case = NEARLY_CLOSED["borders"].build(seed)
    mesh = build_mesh(case.surface.lower(), resolution=RESOLUTION)
    check_sound(mesh)
    assert mesh.report.watertight == case.is_closed
    assert mesh.report.moved <= 1e-11
    strict = build_mesh(case.surface.lower(), resolution=RESOLUTION, weld_tolerance=0.0)
    assert strict.report.boundary_edges >= mesh.report.boundary_edges
    assert len(mesh.parts) == len(strict.parts)
    assert [part.name for part in mesh.parts] == [part.name for part in strict.parts]


@pytest.mark.parametrize("family", ["mixed degrees", "crowded knots"])
def test_bodies_of_several_degrees_and_of_crowded_knots_close(family: str) -> None:
    """Takes each 13th surface of a family that `make certify` judges."""
    for seed in range(0, NEARLY_CLOSED[family].count, 13):
        case = NEARLY_CLOSED[family].build(seed)
        mesh = build_mesh(case.surface.lower(), resolution=RESOLUTION)
        check_sound(mesh)
        assert case.accepts(mesh.report.watertight), seed


def build_t_junction(t: float, *, degree: int = 3) -> list[Array]:
    """The nets of a patch and of two neighbours along its edge u = 1.

    The neighbours have the parts v ≤ t and v ≥ t of the edge, and meet each other at v = t.
    """
    rng = np.random.default_rng(degree)
    step = np.array([1.0, 0, 0])
    net = rng.uniform(0, 0.4, (degree + 1, degree + 1, 3))
    net += np.arange(degree + 1)[:, None, None] * step
    net[..., 1] += np.arange(degree + 1)
    nets = [net]
    for line, _ in split((net[-1], None), t):
        nets.append(line + np.arange(degree + 1)[:, None, None] * step)
    return nets


@pytest.mark.parametrize(
    "options", [{"resolution": (4, 2)}, {"accuracy": Accuracy(tolerance=0.02)}]
)
@pytest.mark.parametrize("t", [0.5, 0.3, 1 / 64])
def test_two_short_borders_join_a_long_border(t: float, options: dict[str, Any]) -> None:
    """Three patches become a mesh that is one disc; it keeps their parts, and its bound holds."""
    nets = np.array(build_t_junction(t))
    surface = PatchSurface(
        nets.reshape(-1, 3),
        np.arange(nets[..., 0].size).reshape(nets.shape[:3]),
        parts=(("long and upper", (0, 2)), ("lower", (1,))),
    )
    mesh = build_mesh(surface.lower(), uvs=True, **options)
    check_sound(mesh)
    check_winding(mesh)
    shape = find_topology(mesh)
    assert (shape.components, shape.euler) == (1, 1)
    assert [part.name for part in mesh.parts] == ["long and upper", "lower"]
    assert mesh.report.deviation_bound is not None
    result = measure_surface_to_mesh(
        build_sheets(surface), mesh.positions[mesh.triangles].astype(float), 500
    )
    assert result.distance <= mesh.report.deviation_bound + result.rounding
    # The vertices of the long patch have its own parameters: v is 0 and 1 at the ends of the edge,
    # and t where the two neighbours meet.
    assert mesh.uvs is not None
    triangles = mesh.triangles[slice(*mesh.parts[0].triangles)]
    assert {0.0, 1.0, round(t, 12)} <= set(mesh.uvs[triangles, 1].round(12).ravel().tolist())


def test_a_border_that_meets_itself_with_different_knots_is_joined() -> None:
    """The sides u = 0 and v = 0 of a B-spline are one curve, but have different knots."""
    curve = BSpline([0.0] * 4 + [1] * 4, [(0, 0, 0), (1, 0, 0.5), (2, 0.5, 0), (3, 0, 1)], 3)
    in_u, in_v = curve.insert_knot(0.3), curve.insert_knot(0.6).insert_knot(0.8)
    x, y = np.meshgrid(np.arange(5.0), np.arange(6.0), indexing="ij")
    net = np.stack([x + y, x - y, 0.3 * x * y], axis=-1)
    net[:, 0], net[0] = in_u.c[:5], in_v.c[:6]
    surface = BsplineSurface(net, (3, 3), (in_u.t, in_v.t))
    # Without joining, the surface has 2 × 3 spans and 2 · (2 + 3) edges on its border. Joining
    # gives both directions the knots 0.3, 0.6 and 0.8. Then the surface has 4 × 4 spans, and 4
    # edges on each of the sides u = 1 and v = 1, which stay open.
    for patches, boundary_edges, tolerance in ((16, 8, 1e-12), (6, 10, 0.0)):
        mesh = build_mesh(surface.lower(), resolution=(1, 1), weld_tolerance=tolerance)
        check_values(mesh)
        assert (mesh.report.patches, mesh.report.boundary_edges) == (patches, boundary_edges)


@pytest.mark.parametrize(
    "options", [{"resolution": (4, 4)}, {"accuracy": Accuracy(relative_tolerance=3e-3)}]
)
def test_the_parameters_of_each_vertex_give_its_position(options: dict[str, Any]) -> None:
    """Knots of the wing are very near each other; each surface keeps its own parameters."""
    surface = find("swept-wing").surface()
    mesh = build_mesh(surface.lower(), uvs=True, **options)
    assert mesh.uvs is not None
    for part, sheet in zip(mesh.parts, build_sheets(surface), strict=True):
        vertices = np.unique(mesh.triangles[slice(*part.triangles)])
        # Rounding may put parameters slightly outside of the domain.
        places = sheet.clip_to_domain(mesh.uvs[vertices].astype(float))
        differences = sheet.at(places) + sheet.origin - mesh.positions[vertices]
        assert np.abs(differences).max() < 1e-12


def test_surfaces_with_different_knots_close_around_a_torus() -> None:
    """64 flat pieces around a torus have different knots; each is cut into 81 patches.

    The eight pieces of a row have one inner knot each, at different parameters. The knots of a
    piece cut its neighbours, so that each piece gets all eight knots of its row, and so nine spans.
    """
    angle = np.pi / 4 * np.r_[:8, 0]
    c, s = np.cos(angle), np.sin(angle)
    corners = np.stack([np.outer(c, 3 + c), np.outer(s, 3 + c), np.outer(np.ones(9), s)], axis=-1)
    pieces = []
    for k in range(64):
        i, j, t = k // 8, k % 8, (k + 1) / 65
        knots = np.array([0, 0, t, 1, 1])
        shares = np.array([[1, 0], [1 - t, t], [0, 1]])
        net = np.einsum("ia,jb,abk", shares, shares, corners[i : i + 2, j : j + 2])
        pieces.append(BsplineSurface(net, (1, 1), (knots, knots)))
    model, seams = join(MultipatchSurface(tuple(pieces)).lower(), 1e-12)
    assert model.patch_count == 64 * 81
    assert seams.connectivity.open_count == 0


def test_surfaces_that_only_touch_are_not_cut() -> None:
    """A surface is cut only where borders are one curve; with tolerance 0 it is not cut."""
    nets = build_t_junction(0.5)
    changed_net = nets[1].copy()
    changed_net[0, 1] += 0.01  # an inner point of the common border
    far_net = translate(nets[2], 5.0)
    for nets_of_surface, tolerance in (([nets[0], changed_net, far_net], 1e-12), (nets, 0.0)):
        surface = PatchSurface(
            np.array(nets_of_surface).reshape(-1, 3), np.arange(48).reshape(3, 4, 4)
        )
        model = surface.lower()
        assert join(model, tolerance)[0].patch_count == 3


def build_square_with_strips(columns: int, rows: int, degree: int) -> MultipatchSurface:
    """A unit square of this degree that joining must cut into columns × rows pieces.

    Narrow strips lie along two of its sides.
    """

    def sheet(u: Array, v: Array) -> BezierSurface:
        x, y = np.meshgrid(u, v, indexing="ij")
        return BezierSurface(np.stack([x, y, 0 * x], axis=-1))

    unit = np.linspace(0, 1, degree + 1)
    x, y = np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1)
    above = (sheet(x[k : k + 2], np.array([1.0, 2])) for k in range(columns))
    beside = (sheet(np.array([1.0, 2]), y[k : k + 2]) for k in range(rows))
    return MultipatchSurface((sheet(unit, unit), *above, *beside))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("columns", "rows", "degree", "is_cut"),
    # The docstring states the limits; the strips count, too.
    [
        (118, 70, 1, True),  # 118 · 70 + 188 = 8448 patches = 8192 + 256
        (64, 129, 1, False),  # 64 · 129 + 193 = 8449 patches
        (16, 512, 1, True),  # 16 · 512 + 528 = 8720 patches = 16 · 529 + 256
        (16, 513, 1, False),  # 16 · 513 + 529 = 8737 patches > 16 · 530 + 256
        # Before the cuts the model has 169 + 4 · 56 = 393 points: 13² in the square, 4 in a strip.
        (27, 29, 12, True),  # 27 · 29 · 169 + 4 · 56 = 132,551 points < 16 · 393 + 2^17
        (28, 29, 12, False),  # 28 · 29 · 169 + 4 · 57 = 137,456 points > 16 · 397 + 2^17
    ],
)
def test_a_model_is_cut_only_up_to_limits_of_patches_and_points(
    columns: int, rows: int, degree: int, is_cut: bool
) -> None:
    """P patches of N points may become max(16 P, min(8 P², 8192)) + 256 patches.

    These may have 16 N + 2^17 points.
    """
    surface = build_square_with_strips(columns, rows, degree)
    patch_count = join(surface.lower(), 1e-12)[0].patch_count
    assert patch_count == columns + rows + (columns * rows if is_cut else 1)


@pytest.mark.parametrize(
    "corners",
    [
        [[[4, 3], [1, 5]], [[0, 1], [3, 2]]],
        [[[0, 4], [1, 4]], [[2, 4], [0, 1]], [[0, 4], [0, 3]]],
    ],
)
def test_cutting_ends_if_cuts_never_meet(
    corners: list[list[list[float]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All corners are on one line; each patch is cut where another patch has a corner.

    Each cut makes new corners, at which other patches must be cut. So cutting exceeds its limit of
    8 P² + 256 patches, and the model stays as it was.
    """
    line = np.ones(3)
    surface = MultipatchSurface(tuple(BezierSurface(np.multiply.outer(c, line)) for c in corners))
    patch_counts: list[int] = []

    def cut_and_count(model: PatchModel, lines: Lines) -> PatchModel:
        model = cut(model, lines)
        patch_counts.append(model.patch_count)
        return model

    monkeypatch.setattr(joining, "cut", cut_and_count)
    assert join(surface.lower(), 1e-12)[0].patch_count == len(corners)
    max_patches = 8 * len(corners) ** 2 + 256
    # Cutting ends after the first round above the limit. The corners are chosen so that this round
    # exceeds it only by 3 and by 2 patches: a slightly different limit fails here.
    assert patch_counts[-2] <= max_patches < patch_counts[-1] < max_patches + 4


def test_cut_surfaces_with_too_many_vertices_are_refused() -> None:
    """The error has the code of all meshes with too many vertices."""
    case = NEARLY_CLOSED["borders"].build(1)
    options = MeshOptions((16, 16))
    fmt = BY_NAME["json"]
    vertices = build_plan(case.surface, options, fmt).size.vertices
    # The plan is within this limit; only cutting, during the run, adds vertices.
    limits = replace(DEFAULT_LIMITS, max_vertices=vertices + 1)
    plan_mesh(case.surface, options, fmt).run()
    with pytest.raises(TooLarge) as caught:
        plan_mesh(case.surface, options, fmt, limits=limits).run()
    assert caught.value.issues[0].code == "too_many_vertices"
