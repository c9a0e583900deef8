"""The oracles of breps agree with closed forms and with rational arithmetic."""

from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from oracles.brep_documents import read_curve, read_surface
from oracles.breps import count_cracks, list_free_edges, measure_precisely, sample_face
from oracles.distance import Soup
from oracles.exact import to_exact_net
from oracles.regions import build_region, find_turn
from oracles.solids import INVALID, MEASURES, VALID, read_solid
from oracles.splines import spline_surface_point, to_fractions
from tools.judge.exact import to_fractions as to_exact
from tools.judge.hulls import measure_squared_distance

S = np.sqrt(0.5)
RING = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
ROUND = {"type": "bspline", "degree": 2, "knots": [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4],
         "weights": [1, S, 1, S, 1, S, 1, S, 1]}  # fmt: skip
"""A full circle, without its control points."""

UNIT = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
BORDER = [{"type": "bezier", "control_points": [a, b]} for a, b in pairwise(SQUARE)]


def draw_circle(middle: tuple[float, float], radius: float) -> dict[str, Any]:
    return ROUND | {"control_points": (np.array(middle) + radius * np.array(RING)).tolist()}


def make_face(surface: Any, *loops: Any) -> dict[str, Any]:
    return {"vertices": [], "edges": [], "faces": [{"surface": surface, "loops": list(loops)}]}


def test_places_in_a_square_with_two_round_holes() -> None:
    holes = [((0.3, 0.4), 0.2), ((0.7, 0.6), 0.25)]
    loops = [{"pcurves": [draw_circle(*hole)], "reversed": [True]} for hole in holes]
    region = build_region(make_face(UNIT, {"pcurves": BORDER}, *loops), 0, flatness=1e-5)
    assert region is not None
    rng = np.random.default_rng(3)
    angle, distance = rng.uniform(0, 7, 400), 10 ** rng.uniform(-5, -1, 400)
    near = np.concatenate(
        [
            np.array(middle) + (radius + sign * distance[:, np.newaxis])
            * np.column_stack([np.cos(angle), np.sin(angle)])
            for middle, radius in holes
            for sign in (-1, 1)
        ]
    )  # fmt: skip
    places = np.concatenate([rng.uniform(-0.2, 1.2, (2000, 2)), near])
    is_inside, is_sure = region.find_inside(places)
    expected = np.all((places > 0) & (places < 1), axis=1)
    for middle, radius in holes:
        expected &= np.hypot(*(places - middle).T) > radius
    assert is_sure.mean() > 0.99
    np.testing.assert_array_equal(is_inside[is_sure], expected[is_sure])


@pytest.mark.parametrize("start", [0.0, 1.5, 3.75])
def test_places_of_a_cylinder_whose_loops_run_around_it_without_a_seam(start: float) -> None:
    """The part of a cylinder between two waves, with a hole over its seam."""
    net = np.array([[[x, y, z] for z in (0.0, 5.0)] for x, y in RING])
    weights = [[w, w] for w in [1, S, 1, S, 1, S, 1, S, 1]]
    knots = [ROUND["knots"], [0, 0, 1, 1]]
    cylinder = {"type": "bspline", "degree": [2, 1], "knots": knots,
                "control_net": net.tolist(), "weights": weights}  # fmt: skip

    def wave(height: float) -> dict[str, Any]:
        points = [[start + k, height + 0.1 * (k % 2)] for k in range(5)]
        return {"type": "bspline", "degree": 1, "knots": [0, 0, 1, 2, 3, 4, 4],
                "control_points": points}  # fmt: skip

    loops = [{"pcurves": [wave(0.2)]}, {"pcurves": [wave(0.6)], "reversed": [True]},
             {"pcurves": [draw_circle((4.0, 0.45), 0.1)], "reversed": [True]}]  # fmt: skip
    region = build_region(make_face(cylinder, *loops), 0, flatness=1e-5)
    assert region is not None
    places = np.random.default_rng(4).uniform([0, 0], [4, 1], (3000, 2))
    is_inside, is_sure = region.find_inside(places)
    u, v = places.T
    rise = 0.1 * (1 - np.abs((u - start) % 2 - 1))
    expected = (v > 0.2 + rise) & (v < 0.6 + rise)
    expected &= (np.hypot(u, v - 0.45) > 0.1) & (np.hypot(u - 4, v - 0.45) > 0.1)
    np.testing.assert_array_equal(is_inside[is_sure], expected[is_sure])
    assert is_sure.mean() > 0.99


@pytest.mark.parametrize("name", ["cylinder", "frustum", "torus", "revolve"])
def test_areas_of_solids(name: str) -> None:
    """The parameters of a grid that are inside have the area that Open CASCADE computed."""
    brep, area = read_solid(name), 0.0
    for k, face in enumerate(brep["faces"]):
        net, region = read_surface(face["surface"]), build_region(brep, k)
        assert region is not None
        grid = np.stack(np.meshgrid(*2 * [(np.arange(40) + 0.5) / 40]), axis=-1).reshape(-1, 2)
        places = region.low + grid * region.size
        is_inside, _ = region.find_inside(places)
        step = 1e-6 * np.ptp(net.domain, axis=1)
        places = places[is_inside].clip(net.domain[:, 0] + step, net.domain[:, 1] - step)
        du, dv = (
            (net.at(places + shift) - net.at(places - shift)) / (2 * shift.sum())
            for shift in np.diag(step)
        )
        lengths = np.linalg.norm(np.cross(du, dv).astype(float), axis=1)
        area += float(lengths.sum() * region.size.prod() / 1600)
    assert area == pytest.approx(MEASURES[name]["area"], rel=0.02)


def test_surfaces_of_documents_are_evaluated_as_in_rational_arithmetic() -> None:
    (surface,) = (face["surface"] for face in read_solid("torus")["faces"])
    net = read_surface(surface)
    exact = to_exact_net(surface["control_net"], surface["weights"])
    knots = to_fractions(net.knots[0]), to_fractions(net.knots[1])
    places = np.random.default_rng(5).uniform(net.domain[:, 0], net.domain[:, 1], (20, 2))
    for place, point in zip(places, net.at(places), strict=True):
        u, v = map(Fraction, place.tolist())
        expected = spline_surface_point(exact, knots, (2, 2), (u, v))
        np.testing.assert_allclose(point.astype(float), [float(x) for x in expected], atol=1e-14)


def test_distances_of_points_from_needles_are_precise() -> None:
    rng = np.random.default_rng(6)
    for _ in range(50):
        corners = rng.uniform(-1, 1, (1, 3, 3))
        corners[0, 2] = corners[0, :2].mean(axis=0) + 1e-7 * rng.uniform(-1, 1, 3)
        point = corners[0].mean(axis=0) + 1e-6 * rng.uniform(-1, 1, 3)
        square = measure_squared_distance(to_exact(point), to_exact(corners[0]))
        distance = measure_precisely(Soup(corners), point.astype(np.longdouble), 1.0)
        assert distance == pytest.approx(float(square) ** 0.5, rel=1e-7)


def test_samples_of_a_face_are_inside_of_its_loops() -> None:
    hole = {"pcurves": [draw_circle((0.4, 0.5), 0.25)], "reversed": [True]}
    face = make_face(UNIT, {"pcurves": BORDER}, hole)
    samples = sample_face(face, 0, 400, np.random.default_rng(7))
    distances = np.hypot(*(samples.places - [0.4, 0.5]).T)
    assert len(samples.points) > 300
    assert distances.min() == pytest.approx(0.25, abs=1e-12)
    np.testing.assert_allclose(samples.points[:, :2].astype(float), samples.places, atol=1e-15)


def test_cracks_and_free_edges_are_found() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    closed = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    assert count_cracks(points, closed) == []
    assert len(count_cracks(points, closed[1:])) == 3
    moved = np.append(points, [[0, 1e-300, 0]], axis=0)
    cracked = closed.copy()
    cracked[0, 0] = 4
    assert len(count_cracks(moved, cracked)) == 4
    assert [len(list_free_edges(read_solid(name))) for name in ("box", INVALID)] == [0, 0]


def test_signs_of_determinants_have_no_rounding() -> None:
    a, b = np.array([0.0, 0.0]), np.array([3.0, 1.0])
    for ulps in (-1, 0, 1):
        p = np.array([1.5 + ulps * 2.0**-52, 0.5])
        assert find_turn(a, b, p) == -ulps


def test_documents_of_the_solids_are_complete() -> None:
    assert len(VALID) == 26
    for name in MEASURES:
        brep = read_solid(name)
        used = [k for face in brep["faces"] for loop in face["loops"] for k in loop["edges"]]
        assert sorted(set(used)) == list(range(len(brep["edges"])))
        for edge in brep["edges"]:
            if not edge.get("degenerate"):
                curve = read_curve(edge["curve"])
                ends = curve.at(np.array(curve.domain)).astype(float)
                corners = np.array(brep["vertices"])[edge["vertices"]]
                size = 0.1 if name == INVALID else 1e-3
                assert np.abs(ends - corners).max() < size * np.ptp(corners, axis=0).max() + 1e-3
