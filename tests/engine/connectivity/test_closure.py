"""Closed surfaces: the continuity of their seams in reports, and their meshes."""

from typing import Any

import numpy as np
import pytest

from service.encoders.content import report_object
from service.engine.connectivity import closure as module
from service.engine.connectivity.closure import SAME_PARTIAL, SAME_PLANE, Closure, find_closure
from service.engine.connectivity.connect import connect
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.examples.catalogue import find
from service.surface.lowered import PatchModel
from tests.engine.meshing import build_mesh, check_sound, check_winding, find_topology
from tests.spline_strategies import random_points, random_weights
from tests.strategies import Array
from tools.examples import lower_patches

ROOT = np.sqrt(0.5)


def build_ring(rows: int = 7, columns: int = 5) -> Array:
    """A control net around a torus: rows around its axis, columns around its tube."""
    a = 2 * np.pi * np.arange(rows)[:, None] / rows
    b = 2 * np.pi * np.arange(columns)[None] / columns
    radius = 3 + np.cos(b)
    return np.stack([radius * np.cos(a), radius * np.sin(a), np.sin(b) + 0 * a], axis=-1)


def repeat_rows(net: Array, count: int = 1) -> Array:
    """The net with its first rows repeated at the end."""
    return np.concatenate([net, net[:count]])


def build_wall(first: Array, last: Array) -> Array:
    """The net of a wall over a closed curve: its polygon begins and ends at (0, 0).

    `first` is the first control point after (0, 0); the last one before it is −`last`.
    """
    polygon = np.array([[0.0, 0], first, [5, 1], [4, 6], [-3, 5], -np.array(last), [0, 0]])
    net = np.zeros((7, 2, 3))
    net[..., :2] = polygon[:, None]
    net[:, 1, 2] = 1
    return net


def build_cylinder(breaks: list[float]) -> BsplineSurface:
    """A cylinder over a full circle of degree 2, as in textbooks; `breaks` are its five knots."""
    corners = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
    net = np.zeros((9, 2, 3))
    net[..., :2] = np.array(corners)[:, None]
    net[:, 1, 2] = 1
    weights = np.array([1, ROOT, 1, ROOT, 1, ROOT, 1, ROOT, 1])[:, None] * [1.0, 1.0]
    vector = np.repeat(breaks, [3, 2, 2, 2, 3])
    return BsplineSurface(net, (2, 1), (vector, "clamped"), weights)


def compute_closure(surface: Any) -> Closure | None:
    """The closure of the lowered surface."""
    model = surface.lower()
    return find_closure(model, connect(model).connectivity)


@pytest.mark.parametrize("is_rational", [False, True])
@pytest.mark.parametrize("degree", [(2, 3), (3, 3), (4, 2)])
def test_surfaces_that_are_periodic_along_u_and_v_close_with_c1(
    degree: tuple[int, int], is_rational: bool
) -> None:
    weights = random_weights(7, 3, 5) if is_rational else None
    surface = BsplineSurface(build_ring(), degree, ("periodic", "periodic"), weights)
    assert compute_closure(surface) == Closure("C1", "C1")
    mesh = build_mesh(surface.lower(), resolution=(3, 4))
    check_sound(mesh)
    check_winding(mesh)
    assert mesh.report.watertight
    assert find_topology(mesh).euler == 0
    # Each position has one normal, also on the seams.
    assert mesh.welds is None


def test_repeating_the_first_row_makes_a_crease() -> None:
    """The seam is C0: the mesh is watertight, and positions on the seam have two normals."""
    surface = BsplineSurface(repeat_rows(build_ring()), knots=("clamped", "periodic"))
    assert compute_closure(surface) == Closure("C0", "C1")
    mesh = build_mesh(surface.lower(), resolution=(3, 4))
    check_sound(mesh)
    assert mesh.report.watertight
    assert mesh.normals is not None
    assert mesh.welds is not None
    repeated = np.flatnonzero(mesh.welds != np.arange(len(mesh.welds)))
    assert len(repeated) == 4 * 5  # four divisions in each of the five spans along the seam
    np.testing.assert_allclose(
        mesh.positions[repeated, 1], mesh.positions[repeated[0], 1], atol=1e-12
    )
    cosines = (mesh.normals[repeated] * mesh.normals[mesh.welds[repeated]]).sum(axis=1)
    assert cosines.max() < np.cos(np.radians(1))  # the default `crease_angle` is 1°
    assert cosines.min() < 0.7


@pytest.mark.parametrize(
    ("first", "last", "expected"),
    [
        ((2.0, -1.0), (2.0, -1.0), "C1"),
        ((2.0, -1.0), (4.0, -2.0), "G1"),
        ((2.0, -1.0), (2.0, -1.1), "C0"),
        ((2.0, -1.0), (-2.0, 1.0), "C0"),
        ((2.0, -1.0), (-4.0, 2.0), "C0"),
        ((2.0, -1.0), (0.0, 0.0), "C0"),
        ((2.0, -1.0), (2.0 + SAME_PARTIAL / 10, -1.0), "C1"),
        ((2.0, -1.0), (2.0, -1.0 + 40 * SAME_PLANE), "C0"),
    ],
)
@pytest.mark.parametrize("is_along_v", [False, True])
def test_the_rows_beside_the_seam_determine_its_continuity(
    first: tuple[float, float], last: tuple[float, float], expected: str, is_along_v: bool
) -> None:
    """Equal differences at both ends give C1, differences of one direction G1, all others C0."""
    net = build_wall(np.array(first), np.array(last))
    degree = 3, 1
    if is_along_v:
        net, degree = net.swapaxes(0, 1), (1, 3)
    for surface in (BsplineSurface(net, degree), BezierSurface(net)):
        actual = compute_closure(surface)
        assert actual is not None
        assert (actual.u, actual.v) == ((None, expected) if is_along_v else (expected, None))


def test_the_continuity_depends_on_the_knots() -> None:
    """A net that is C1 with symmetric knots is only G1 with other knots, which scale partials."""
    net = build_wall(np.array([2.0, -1.0]), np.array([2.0, -1.0]))
    symmetric, asymmetric = (
        np.array([0, 0, 0, 0, *inner, 9, 9, 9, 9]) for inner in ((2, 5, 7), (2, 5, 6))
    )
    assert compute_closure(BsplineSurface(net, (3, 1), (symmetric, "clamped"))) == Closure(
        "C1", None
    )
    assert compute_closure(BsplineSurface(net, (3, 1), (asymmetric, "clamped"))) == Closure(
        "G1", None
    )


def test_weights_may_differ_by_a_factor() -> None:
    """Weights 2^i only change the parametrization of the same curve: it is G1, and not C1."""
    net = np.zeros((4, 2, 3))
    net[:, :, :2] = np.array([[0, 0], [1, 0.5], [-1, -0.5], [0, 0]])[:, None]
    net[:, 1, 2] = 1
    weights = np.array([1.0, 2, 4, 8])[:, None] * [1.0, 1.0]
    assert compute_closure(BezierSurface(net)) == Closure("C1", None)
    assert compute_closure(BezierSurface(net, weights)) == Closure("G1", None)
    weights[-1, 1] = 7
    assert compute_closure(BezierSurface(net, weights)) == Closure(None, None)


def test_parallel_differences_of_varying_ratio_do_not_make_g1() -> None:
    """Tangent planes agree at the control points of the seam, but not between them."""
    net = np.zeros((4, 3, 3))
    net[..., 1] = np.arange(3)
    net[1] += [[1, 0, 1], [1, 0, 2], [1, 0, 1]]
    net[2] -= [[2, 0, 2], [3, 0, 6], [2, 0, 2]]
    assert compute_closure(BezierSurface(net)) == Closure("C0", None)
    net[2] = 2 * net[0] - net[1]
    assert compute_closure(BezierSurface(net)) == Closure("C1", None)


def test_a_surface_with_poles_closes() -> None:
    """At a pole the seam has no tangent plane, so only the points between the poles count."""
    net = build_ring(6, 5)
    net[:, :, 2] = np.arange(5)
    net[:, 0], net[:, -1] = (0, 0, 0), (0, 0, 4)
    for u_knots, points, expected in (("periodic", net, "C1"), ("clamped", repeat_rows(net), "C0")):
        surface = BsplineSurface(points, (3, 3), (u_knots, "clamped"))  # type: ignore[arg-type]
        assert compute_closure(surface) == Closure(expected, None)  # type: ignore[arg-type]
        assert build_mesh(surface.lower(), resolution=(3, 3)).report.watertight


def test_the_continuity_does_not_depend_on_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """The chunks are runs of patches; a difference in the last chunk also counts."""
    monkeypatch.setattr(module, "CHUNK_PATCHES", 1)
    net = build_ring()
    assert compute_closure(BsplineSurface(net, knots=("periodic", "periodic"))) == Closure(
        "C1", "C1"
    )
    wall = np.repeat(build_wall(np.array([2.0, -1.0]), np.array([2.0, -1.0]))[:, :1], 5, axis=1)
    wall[..., 2] = np.arange(5)
    assert compute_closure(BsplineSurface(wall)) == Closure("C1", None)
    wall[1, -1, 1] += 1
    assert compute_closure(BsplineSurface(wall)) == Closure("C0", None)


def test_open_surfaces_are_not_closed() -> None:
    """Open surfaces have no continuity; patches without a common domain have no closure."""
    assert compute_closure(find("saddle").surface()) == Closure(None, None)
    assert compute_closure(BsplineSurface(random_points(6, 1, 5))) == Closure(None, None)
    assert compute_closure(find("torus").surface()) is None


def test_the_report_has_the_continuity_of_each_seam() -> None:
    """An open direction has no continuity; patches that are not one surface have no closure."""

    def read_report(model: PatchModel) -> dict[str, object]:
        report = report_object(build_mesh(model, resolution=(2, 2)).report, ())
        return {key: report[key] for key in report if key.startswith(("clos", "cont"))}

    torus = BsplineSurface(build_ring(), knots=("periodic", "periodic"))
    assert read_report(torus.lower()) == {
        "closed_u": True,
        "closed_v": True,
        "continuity_u": "C1",
        "continuity_v": "C1",
    }
    assert read_report(build_cylinder([0, 1, 2, 3, 5]).lower()) == {
        "closed_u": True,
        "closed_v": False,
        "continuity_u": "G1",
    }
    assert read_report(lower_patches("torus")) == {}
