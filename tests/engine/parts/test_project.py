"""Closest points of parts, against dense samples, and against known distances."""

from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from oracles.breps import sample_face
from oracles.coedges import read_edge
from oracles.solids import read_solid
from service.bases.arrays import FloatArray
from service.engine.closest.project import LIMITS, ProjectQuery
from service.engine.parts.build import build_part
from service.engine.parts.part import Part
from service.engine.parts.project import project_on_part
from service.engine.points.surface_columns import Columns
from tests.engine.brep.solid_documents import lower
from tests.engine.brep.test_inside import build_apart
from tests.engine.parts.test_part import MIRROR, SADDLE, lower_group
from tests.engine.trims.test_inside import (
    SQUARE,
    make_circle,
    make_face,
    make_polygon,
)

Document = dict[str, Any]


def sample_part(document: Document, rng: np.random.Generator, count: int) -> FloatArray:
    """Points of all faces and edges, by other code than the service's."""
    faces = range(len(document["faces"]))
    points = [np.array(sample_face(document, k, count, rng).points, float) for k in faces]
    for k, edge in enumerate(document["edges"]):
        if not edge.get("degenerate"):
            curve = read_edge(document, k)
            low, high = curve.domain
            points.append(np.array(curve.at(rng.uniform(low, high, count // 4)), float))
    return np.concatenate(points)


def scatter(part: Part, rng: np.random.Generator, count: int) -> FloatArray:
    low, high = part.members.definitions[0].box
    points: FloatArray = low + (rng.random((count, 3)) * 1.4 - 0.2) * (high - low)
    return points


def check_columns(part: Part, points: FloatArray, columns: Columns) -> None:
    """Positions are those of the parameters of their faces, and distances those of positions."""
    low, high = columns["distance_bounds"].T
    slack = 1e-12 * part.nets.diagonal
    distances = np.linalg.norm(points - columns["positions"], axis=1)
    np.testing.assert_allclose(distances, columns["distances"], atol=slack)
    assert ((low <= high) & (columns["distances"] <= high)).all()
    prepared = part.members.definitions[0]
    face = columns["patch"]
    of_face = prepared.surfaces.evaluate(face, columns["uv"])
    reach = np.where(columns["near_edge"], prepared.gaps.max() * 1.01, 0.0) + 10 * slack
    assert (np.linalg.norm(of_face - columns["positions"], axis=1) <= reach).all()
    np.testing.assert_allclose(np.linalg.norm(columns["normals"], axis=1), 1.0, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cone", "tee", "viviani", "sphere_hole"])
def test_no_sample_is_nearer_than_the_interval(name: str) -> None:
    rng = np.random.default_rng(1)
    document = read_solid(name)
    part = build_part(lower(document))
    points = scatter(part, rng, 150)
    columns = project_on_part(part, ProjectQuery(points))
    low, high = columns["distance_bounds"].T
    nearest, _ = cKDTree(sample_part(document, rng, 1000)).query(points)
    diagonal = part.nets.diagonal
    assert (nearest >= low - 1e-10 * diagonal).all()
    # The samples come near.
    assert (nearest <= high + 0.05 * diagonal).all()
    gaps = part.members.definitions[0].gaps.max()
    assert (high - low <= 1e-9 * diagonal + 1.5 * gaps).all()
    assert not columns["tied"].any()
    check_columns(part, points, columns)


def test_normals_point_out_of_solids() -> None:
    """Normals point to points outside of a convex solid, and away from points inside."""
    rng = np.random.default_rng(2)
    for name in ("cylinder", "frustum", "sphere"):
        part = build_part(lower(read_solid(name)))
        points = scatter(part, rng, 200)
        columns = project_on_part(part, ProjectQuery(points))
        way = points - columns["positions"]
        cosine = (way * columns["normals"]).sum(axis=1) / np.linalg.norm(way, axis=1)
        is_clear = ~columns["near_edge"] & (columns["distances"] > 1e-6)
        np.testing.assert_allclose(np.abs(cosine[is_clear]), 1.0, atol=1e-6)
        # The middle is inside, corners of the box are outside.
        low, high = part.members.definitions[0].box
        ends = np.stack([low + 0.55 * (high - low), high + 1.0, low - 1.0])
        columns = project_on_part(part, ProjectQuery(ends))
        way = ends - columns["positions"]
        assert ((way * columns["normals"]).sum(axis=1) > 0).tolist() == [False, True, True]


def project_plane(document: Document, points: Any) -> Columns:
    return project_on_part(build_part(lower(document)), ProjectQuery(np.array(points, float)))


@pytest.mark.parametrize("apart", [1e-2, 1e-5, 1e-8])
def test_a_hole_near_a_border(apart: float) -> None:
    """A hole in the unit square comes near to its side."""
    radius = 0.2
    x = radius + apart
    document = make_face(make_polygon(SQUARE), make_circle((x, 0.5), radius) | {"reversed": [True]})
    points = [[x, 0.5, 0.1], [x - 0.9 * radius, 0.5, 0.1], [-0.1, 0.5, 0], [0.9, 0.5, -0.3],
              [apart / 2, 0.5, 0.2]]  # fmt: skip
    columns = project_plane(document, points)
    expected = [np.hypot(radius, 0.1), np.hypot(0.1 * radius, 0.1), 0.1, 0.3, 0.2]
    np.testing.assert_allclose(columns["distances"], expected, rtol=1e-9)
    assert columns["near_edge"].tolist() == [True, True, True, False, False]
    assert columns["on_boundary"].tolist() == [True, True, True, False, False]
    assert columns["tied"].tolist() == [True, False, False, False, False]
    # All of the hole is equally near to the first point.
    assert columns["reached"].tolist() == [False, True, True, True, True]


@pytest.mark.parametrize("width", [1e-3, 1e-6, 1e-8])
def test_a_narrow_face(width: float) -> None:
    corners = [[0, 0.5], [1, 0.5], [1, 0.5 + width], [0, 0.5 + width], [0, 0.5]]
    columns = project_plane(
        make_face(make_polygon(corners)), [[0.3, 0.4, 0], [0.3, 0.7, 0], [2, 0.5, 0]]
    )
    np.testing.assert_allclose(columns["distances"], [0.1, 0.2 - width, 1.0], atol=1e-12)
    assert columns["on_boundary"].all()
    assert columns["reached"].all()


@pytest.mark.parametrize("gap", [0.5, 1e-3, -1e-4])
def test_intervals_have_both_sides_of_a_gap(gap: float) -> None:
    """A square of side 10: its edge at y = 0 is at y = `gap`, its border on the surface at 0."""
    columns = project_plane(build_apart(gap), [[5, -3, 0], [5, 5, 2], [5, gap, 0.0]])
    low, high = columns["distance_bounds"].T
    nearest = [3 - max(0.0, -gap), 2.0, 0.0]
    assert (low <= np.array(nearest) + 1e-9).all()
    assert (np.array(nearest) - 1e-9 <= high).all()
    assert (high - low <= 2.1 * abs(gap) + 1e-9).all()
    assert columns["near_edge"].tolist() == [True, False, True]
    assert columns["on_boundary"].tolist() == [True, False, True]


def test_seams_and_poles_are_no_edges() -> None:
    document = read_solid("sphere")
    part = build_part(lower(document))
    south, *_, north = np.array(document["faces"][0]["surface"]["control_net"])[0]
    middle, radius = (south + north) / 2, float((north - south)[2]) / 2
    rng = np.random.default_rng(3)
    angle = rng.uniform(-1.5, 1.5, 50)
    seam = np.stack([np.cos(angle), np.zeros(50), np.sin(angle)], axis=1)
    points = middle + 1.5 * radius * np.concatenate([seam, [[0, 0, 1], [0, 0, -1], [0, -1, 0]]])
    columns = project_on_part(part, ProjectQuery(points))
    np.testing.assert_allclose(columns["distances"], 0.5 * radius, rtol=1e-12)
    for name in ("near_edge", "on_boundary", "tied"):
        assert not columns[name].any()
    assert columns["reached"].all()
    np.testing.assert_allclose(columns["normals"], (points - middle) / (1.5 * radius), atol=1e-8)


def test_an_edge_has_the_face_with_the_lowest_number() -> None:
    document = read_solid("box")
    part = build_part(lower(document))
    low, high = part.members.definitions[0].box
    corners = np.stack(np.meshgrid(*np.stack([low - 1, high + 1], axis=1)), axis=-1).reshape(-1, 3)
    columns = project_on_part(part, ProjectQuery(corners))
    np.testing.assert_allclose(columns["distances"], 3**0.5)
    assert columns["near_edge"].all()
    assert not columns["on_boundary"].any()
    # The least number of the faces of each edge, and its points.
    owners = [
        min(
            k
            for k, face in enumerate(document["faces"])
            if any(number in loop["edges"] for loop in face["loops"])
        )
        for number in range(len(document["edges"]))
    ]
    curves = [read_edge(document, number) for number in range(len(owners))]
    ends = [np.array(curve.at(np.array(curve.domain)), float) for curve in curves]
    for point, patch in zip(np.clip(corners, low, high), columns["patch"], strict=True):
        near = [np.linalg.norm(end - point, axis=1).min() < 1e-9 for end in ends]
        assert patch == min(owner for owner, is_near in zip(owners, near, strict=True) if is_near)


def test_groups_are_nearest_of_their_members() -> None:
    document = read_solid("frustum")
    matrices = (np.eye(4), MIRROR)
    moved = np.diag([3.0, 3, 3, 1])
    moved[:3, 3] = [0, 40, 0]
    part = build_part(
        lower_group(
            {"surface": document},
            {"surface": SADDLE, "matrix": moved.tolist()},
            {"surface": document, "matrix": MIRROR.tolist()},
        )
    )
    rng = np.random.default_rng(4)
    points = rng.uniform(-10, 40, (300, 3))
    columns = project_on_part(part, ProjectQuery(points))
    alone = build_part(lower(deepcopy(document)))
    results = []
    for matrix in matrices:
        scale = np.linalg.norm(matrix[:3, 0])
        local = np.linalg.solve(matrix[:3, :3], (points - matrix[:3, 3]).T).T
        found = project_on_part(alone, ProjectQuery(local))
        results.append((found["distances"] * scale, found, matrix))
    is_saddle = columns["patch"] == 3
    best = np.minimum(results[0][0], results[1][0])
    np.testing.assert_allclose(columns["distances"][~is_saddle], best[~is_saddle], rtol=1e-9)
    assert (columns["distances"][is_saddle] <= best[is_saddle]).all()
    assert 10 < is_saddle.sum() < 200
    for first, (distances, found, matrix) in zip((0, 4), results, strict=True):
        mine = (columns["patch"] >= first) & (columns["patch"] < first + 3)
        assert mine.sum() > 50
        np.testing.assert_allclose(columns["distances"][mine], distances[mine], rtol=1e-9)
        np.testing.assert_array_equal(columns["patch"][mine] - first, found["patch"][mine])
        np.testing.assert_allclose(columns["uv"][mine], found["uv"][mine], atol=1e-6)
        normals = np.linalg.solve(matrix[:3, :3].T, found["normals"][mine].T).T
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        np.testing.assert_allclose(columns["normals"][mine], normals, atol=1e-6)
        np.testing.assert_array_equal(columns["near_edge"][mine], found["near_edge"][mine])


def test_answers_do_not_depend_on_other_points() -> None:
    part = build_part(lower(read_solid("wavy")))
    points = scatter(part, np.random.default_rng(5), 40)
    columns = project_on_part(part, ProjectQuery(points))
    for k in range(0, 40, 13):
        alone = project_on_part(part, ProjectQuery(points[k : k + 1]))
        for name, values in alone.items():
            np.testing.assert_array_equal(values[0], columns[name][k])


@pytest.mark.parametrize("beyond", [1e-12, 2e-10, 1e-8, 1e-3])
def test_points_beside_a_border_have_their_closest_point_on_the_edge(beyond: float) -> None:
    """Also if places cannot tell them from points on the border."""
    corners = np.array([[0, 0], [0.7, 0], [1, 1], [0.2, 0.8], [0, 0]])
    middle, along = np.array([0.85, 0.5]), np.array([0.3, 1.0])
    way = np.array([along[1], -along[0]]) / np.hypot(*along)
    columns = project_plane(make_face(make_polygon(corners)), [[*(middle + beyond * way), 0.0]])
    np.testing.assert_allclose(columns["positions"], [[*middle, 0.0]], atol=1e-15)
    np.testing.assert_allclose(columns["distances"], beyond, rtol=1e-3)
    assert columns["near_edge"].all()
    assert columns["on_boundary"].all()


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {"pairs": 1},
        {"pairs": 400},
        {"pairs": 2000, "of_item": 5},
        {"open": 150},
        {"spheres": 60, "free_spheres": 4},
        {"additions": 100},
    ],
)
def test_intervals_hold_the_distances_also_with_small_limits(changes: dict[str, int]) -> None:
    """Pairs with edges join the search later than those with faces, and get their share."""
    part = build_part(lower(read_solid("steinmetz")))
    points = scatter(part, np.random.default_rng(4), 60)
    low, high = project_on_part(part, ProjectQuery(points))["distance_bounds"].T
    query = ProjectQuery(points, limits=replace(LIMITS, **changes))
    least, most = project_on_part(part, query)["distance_bounds"].T
    assert (least <= high).all()
    assert (most >= low).all()
    assert np.isfinite(most).all()


def test_minima_outside_of_trims_that_are_far_do_not_widen_intervals() -> None:
    """Each point is on a face, so its interval is no wider than rounding makes it."""
    part = build_part(lower(read_solid("nut")))
    points = scatter(part, np.random.default_rng(5), 300)
    positions = project_on_part(part, ProjectQuery(points))["positions"]
    columns = project_on_part(part, ProjectQuery(positions))
    assert columns["reached"].all()
    assert columns["distances"].max() < 1e-9 * part.diagonal
