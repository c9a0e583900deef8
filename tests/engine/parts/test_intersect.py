"""Hits of rays on parts, compared with closed forms; hits at edges, and through cracks."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from oracles.rays import torus_roots
from oracles.sheets import Array
from oracles.solids import read_solid
from service.engine.parts.build import build_part
from service.engine.parts.intersect import intersect_part
from service.engine.parts.part import Part
from service.engine.parts.signs import compute_part_signs
from service.engine.rays.intersect import LIMITS, RayQuery
from service.errors import TooLarge
from tests.breps import build_box
from tests.engine.brep.solid_documents import lower
from tests.engine.parts.shapes import Box, Bracket, build_cracked
from tests.engine.parts.test_part import MIRROR, SADDLE, lower_group
from tools.certify.part_curves import draw_segments
from tools.certify.part_documents import build_prism

SIZE = (2.0, 3.0, 4.0)
BOX = Box(np.zeros(3), np.array(SIZE))
COLUMNS = ("ray", "t", "t_bounds", "patch", "uv", "kind", "near_edge")


def find_hits(part: Part, origins: Any, directions: Any, hits: str = "all") -> dict[str, Any]:
    o, d = (np.atleast_2d(np.asarray(rows, np.float64)) for rows in (origins, directions))
    return intersect_part(part, RayQuery(o, d, hits == "first"), 10**6)


def scatter_rays(box: Array, count: int, seed: int = 0) -> tuple[Array, Array]:
    """Rays from points near and far, and inside, to random points of a box."""
    low, high = box
    rng = np.random.default_rng(seed)
    reach = float(np.linalg.norm(high - low))
    distance = rng.choice([0.1, 1.0, 10.0], (count, 1))
    origins = (low + high) / 2 + rng.normal(0, reach, (count, 3)) * distance
    return origins, rng.uniform(low, high, (count, 3)) - origins


def check_first(part: Part, origins: Any, directions: Any, every: dict[str, Any]) -> None:
    """The first hits of rays are the first ones of all hits."""
    first = find_hits(part, origins, directions, "first")
    rows = np.flatnonzero(np.diff(every["ray"], prepend=-1))
    for column in COLUMNS:
        np.testing.assert_array_equal(np.asarray(every[column])[rows], first[column])


@pytest.mark.parametrize("shape", [BOX, Bracket()])
def test_hits_of_solids_are_those_of_closed_forms(shape: Box | Bracket) -> None:
    document = build_box(SIZE) if isinstance(shape, Box) else shape.document()
    part = build_part(lower(document))
    origins, directions = scatter_rays(part.members.definitions[0].box, 300)
    result = find_hits(part, origins, directions)
    assert result["reached"].all()
    assert not result["near_edge"].any()
    assert set(result["kind"]) == {"crossing"}
    for k, (o, d) in enumerate(zip(origins, directions, strict=True)):
        rows = np.flatnonzero(result["ray"] == k)
        expected = shape.find_crossings(o, d)
        assert len(rows) == len(expected)
        np.testing.assert_allclose(result["t"][rows], expected, rtol=1e-9, atol=1e-9)
        # A ray that ends outside leaves at its last hit, and enters at every other one before.
        sides = [result["entering"][row] for row in rows]
        assert sides == [(len(rows) - j) % 2 == 0 for j in range(len(rows))]
    d = directions[result["ray"]]
    against = (result["normals"] * d).sum(axis=1) < 0
    assert against.tolist() == result["entering"]
    points = origins[result["ray"]] + result["t"][:, np.newaxis] * d
    np.testing.assert_allclose(points, result["positions"], atol=1e-9)
    prepared = part.members.definitions[0]
    on_faces = prepared.surfaces.evaluate(result["patch"], result["uv"])
    np.testing.assert_allclose(on_faces, points, atol=1e-9)
    check_first(part, origins, directions, result)


EDGES: list[tuple[list[float], list[float], list[tuple[str, bool | None, float, float, bool]]]] = [
    # Through an edge into the box, past it, and through corners.
    ([-1, 1, 5], [1, 0, -1], [("crossing", True, 1, 1, True), ("crossing", False, 3, 3, False)]),
    ([-1, 1, 3], [1, 0, 1], [("touching", None, 1, 1, True)]),
    ([3, 1, 3.5], [-1, 0, -1], [("crossing", True, 1, 1, False), ("crossing", False, 3, 3, False)]),
    ([-1, -1, 5], [1, 1, -1], [("crossing", True, 1, 1, True), ("crossing", False, 3, 3, False)]),
    ([-1, -1, 3], [1, 1, 1], [("touching", None, 1, 1, True)]),
    # From inside of the box through an edge and through a corner.
    ([1, 1, 3], [1, 0, 1], [("crossing", False, 1, 1, True)]),
    ([1, 1, 3], [1, 2, 1], [("crossing", False, 1, 1, True)]),
    # Along an edge, and from one of its points on.
    ([-3, 0, 4], [1, 0, 0], [("along", None, 3, 5, True)]),
    ([1, 0, 4], [1, 0, 0], [("along", None, 0, 1, True)]),
    # Within the plane of a face, and from one of its points on; past a corner of it.
    ([-3, 1, 4], [1, 0, 0], [("along", None, 3, 5, True)]),
    ([-3, 0.4, 4], [1, 0.2, 0], [("along", None, 3, 5, True)]),
    ([1, 1, 4], [1, 0.5, 0], [("along", None, 0, 1, True)]),
    ([-1, 1, 4], [1, -1, 0], [("touching", None, 1, 1, True)]),
    ([-1, -3, 4], [1, 0, 0], []),
    ([-1, 1, 4 + 1e-6], [1, 0, 0], []),
    # From a point of a face, and of an edge.
    ([1, 1, 4], [0, 0, 1], [("crossing", False, 0, 0, False)]),
    ([1, 1, 4], [0, 0, -1], [("crossing", True, 0, 0, False), ("crossing", False, 4, 4, False)]),
    ([0, 1, 4], [1, 0, -1], [("crossing", True, 0, 0, True), ("crossing", False, 2, 2, False)]),
    ([0, 1, 4], [-1, 0, 1], [("crossing", False, 0, 0, True)]),
    # Away from the box.
    ([-1, 1, 5], [-1, 0, 1], []),
]
"""Origin and direction of a ray at a box, and for each hit its kind, whether the ray enters, the
first and the last t, and whether an edge is near."""


def test_hits_at_the_edges_of_a_box_have_the_right_kinds() -> None:
    part = build_part(lower(build_box(SIZE)))
    origins, directions = (np.array([case[k] for case in EDGES], float) for k in (0, 1))
    result = find_hits(part, origins, directions)
    assert result["reached"].all()
    for k, (_, _, expected) in enumerate(EDGES):
        rows = np.flatnonzero(result["ray"] == k)
        found = [
            (result["kind"][row], result["entering"][row], bool(result["near_edge"][row]))
            for row in rows
        ]
        assert found == [(kind, enters, near) for kind, enters, _, _, near in expected], EDGES[k]
        for row, (_, _, begin, end, _) in zip(rows, expected, strict=True):
            low, high = result["t_bounds"][row]
            assert low <= begin <= end <= high
            assert high - low < end - begin + 1e-6
            assert low <= result["t"][row] <= high
            assert abs(result["t"][row] - begin) < 1e-7
            point = origins[k] + result["t"][row] * directions[k]
            np.testing.assert_allclose(result["positions"][row], point, atol=1e-7)
    check_first(part, origins, directions, result)


SEAMS: dict[str, list[tuple[list[float], list[float], list[tuple[str, float, bool]]]]] = {
    "sphere": [
        # Through both poles, through the seam, and to the seam from inside; beside the sphere.
        ([1, 2, 13], [0, 0, -1], [("crossing", 3, False), ("crossing", 17, False)]),
        ([11, 2, 3], [-1, 0, 0], [("crossing", 3, False), ("crossing", 17, False)]),
        ([1, 2, 3], [1, 0, 0], [("crossing", 7, False)]),
        ([8, 2, -9], [0, 0, 1], [("touching", 12, False)]),
    ],
    "cone": [
        # Through the apex, down and up, and past it; along the base, its border and a side.
        ([0, 0, 12], [0, 0, -1], [("crossing", 2, False), ("crossing", 12, False)]),
        ([0, 0, 5], [0, 0, 1], [("crossing", 5, False)]),
        ([-8, 0, 10], [1, 0, 0], [("touching", 8, False)]),
        ([8, 0, 0], [-1, 0, 0], [("along", 2, True)]),
        ([6, 0, -3], [0, 0, 1], [("touching", 3, True)]),
        ([6.6, 0, -1], [-0.6, 0, 1], [("along", 1, True)]),
    ],
    "cylinder": [
        ([8, 0, 5], [-1, 0, 0], [("crossing", 3, False), ("crossing", 13, False)]),
        ([5, 0, -5], [0, 0, 1], [("along", 5, True)]),
        ([0, 0, 20], [0, 0, -1], [("crossing", 8, False), ("crossing", 20, False)]),
    ],
    "torus": [
        ([20, 0, 0], [-1, 0, 0], [("crossing", t, False) for t in (7, 13, 27, 33)]),
        ([13, 0, -9], [0, 0, 1], [("touching", 9, False)]),
        ([10, 0, 9], [0, 0, -1], [("crossing", 6, False), ("crossing", 12, False)]),
    ],
}
"""By solid the origin and the direction of a ray, and for each hit its kind, t, and whether an edge
is near. Seams are where y = 0 and x > 0, from the axis on."""


@pytest.mark.slow
@pytest.mark.parametrize("name", SEAMS)
def test_seams_and_poles_are_no_edges(name: str) -> None:
    part = build_part(lower(read_solid(name)))
    origins, directions = (np.array([case[k] for case in SEAMS[name]], float) for k in (0, 1))
    result = find_hits(part, origins, directions)
    for k, (_, _, expected) in enumerate(SEAMS[name]):
        rows = np.flatnonzero(result["ray"] == k)
        found = [(result["kind"][row], bool(result["near_edge"][row])) for row in rows]
        assert found == [(kind, near) for kind, _, near in expected]
        np.testing.assert_allclose(result["t"][rows], [t for _, t, _ in expected], atol=1e-4)
    check_first(part, origins, directions, result)


@pytest.mark.parametrize("shift", [-1e-6, 1e-6])
def test_a_ray_through_a_seam_has_one_hit_if_its_sides_are_apart_or_overlap(shift: float) -> None:
    document = read_solid("cylinder")
    net = np.array(document["faces"][0]["surface"]["control_net"])
    net[-1, :, 1] += shift
    document["faces"][0]["surface"]["control_net"] = net.tolist()
    part = build_part(lower(document))
    origins = [[9, shift / 2, 1], [9, shift / 2, 7.7], [0, shift / 2, 5], [9, 4 * shift, 5]]
    directions = np.array([[-1.0, 0, 0], [-1, 0, 0], [1, 0, 0], [-1, 0, 0]])
    result = find_hits(part, origins, directions)
    assert result["ray"].tolist() == [0, 0, 1, 1, 2, 3, 3]
    assert result["kind"] == ["crossing"] * 7
    assert result["entering"] == [True, False, True, False, False, True, False]
    near = [True, False, True, False, True, False, False]
    assert result["near_edge"].tolist() == (near if shift < 0 else [False] * 7)
    np.testing.assert_allclose(result["t"], [4, 14, 4, 14, 5, 4, 14], atol=1e-9)
    check_first(part, origins, directions, result)
    # No ray through the seam is certain, so others say what is inside.
    points = np.array([[4.0, shift / 2, 5], [6, shift / 2, 5], [5, shift / 2, 5]])
    found = compute_part_signs(part, part.nets.local(points), np.full(3, 1e-12))
    np.testing.assert_array_equal(found, [-1, 1, np.nan])


def test_hits_of_a_torus_are_its_roots() -> None:
    part = build_part(lower(read_solid("torus")))
    rng = np.random.default_rng(4)
    targets = rng.uniform([-14, -14, -4], [14, 14, 4], (15, 3))
    origins = rng.normal(size=(15, 3)) * 30
    result = find_hits(part, origins, targets - origins)
    for k, (o, d) in enumerate(zip(origins, targets - origins, strict=True)):
        expected = torus_roots(o, d, 10.0, 3.0)
        np.testing.assert_allclose(result["t"][result["ray"] == k], expected, rtol=1e-9, atol=1e-9)


def test_a_ray_follows_a_face_on_both_sides_of_a_notch() -> None:
    """In the plane of the two ends of a U, the hit ends at the notch and begins again behind it."""
    corners = [[0.0, 0], [6, 0], [6, 3], [4, 3], [4, 1], [2, 1], [2, 3], [0, 3]]
    part = build_part(lower(build_prism([draw_segments(np.array(corners))], 1.0, np.zeros(2))))
    result = find_hits(
        part, [[-1, 2, 1], [-1, 2.0, 1], [-1, 0.5, 1]], [[1, 0, 0], [1, 0.1, 0], [1, 0, 0]]
    )
    # From inside of the notch the ray does not follow what is behind its origin.
    notch = find_hits(part, [[3, 2, 1], [2.5, 2, 1]], [[1, 0, 0], [-1, 0.1, 0]])
    np.testing.assert_allclose(notch["t"], [1.0, 0.5], atol=1e-6)
    np.testing.assert_allclose(notch["t_bounds"], [[1.0, 3], [0.5, 2.5]], atol=1e-6)
    assert result["kind"] == ["along"] * 5
    assert result["ray"].tolist() == [0, 0, 1, 1, 2]
    np.testing.assert_allclose(
        result["t_bounds"], [[1, 3], [5, 7], [1, 3], [5, 7], [1, 7]], atol=1e-6
    )
    assert result["near_edge"].all()


@pytest.mark.parametrize("gap", [1e-3, 1e-6])
@pytest.mark.parametrize("tilt", [0.0, 0.5, -0.5])
def test_a_ray_through_a_crack_has_one_hit(gap: float, tilt: float) -> None:
    part = build_part(lower(build_cracked(gap, tilt=tilt)))
    assert part.members.definitions[0].pcurves_replaced == 0
    rng = np.random.default_rng(1)
    count = 100
    y = rng.uniform(0.1, 4.9, count)
    x = 5 + rng.uniform(-0.99, 0.99, count) * gap
    ways = np.column_stack([rng.normal(0, 0.2, (count, 2)), np.full(count, -1.0)])
    targets = np.column_stack([x, y, np.zeros(count)])
    result = find_hits(part, targets - 3 * ways, ways)
    assert result["reached"].all()
    assert result["counts"].tolist() == [1] * count
    assert result["near_edge"].all()
    assert result["kind"] == ["crossing"] * count
    assert all(result["entering"])
    low, high = result["t_bounds"].T
    assert ((low <= 3) & (high >= 3)).all()
    assert (high - low < 10 * gap + 1e-6).all()
    # Farther from the edge the hits are those of the faces alone.
    targets[:, 0] = 5 + rng.choice([-1, 1], count) * gap * rng.uniform(5, 9, count)
    targets[:, 2] = tilt * np.maximum(targets[:, 0] - 5, 0.0)
    result = find_hits(part, targets - 3 * ways, ways)
    assert result["counts"].tolist() == [1] * count
    assert not result["near_edge"].any()
    np.testing.assert_allclose(result["positions"], targets, atol=1e-9)
    np.testing.assert_array_equal(result["patch"], (targets[:, 0] > 5).astype(int))


def test_rays_past_the_ends_of_a_crack_hit_its_vertices() -> None:
    part = build_part(lower(build_cracked(1e-3)))
    origins = [[5, y, 2] for y in (-5e-4, -2e-3, 5 + 5e-4, 5 + 2e-3)]
    result = find_hits(part, origins, [[0, 0, -1]] * 4)
    assert result["counts"].tolist() == [1, 0, 1, 0]
    assert result["near_edge"].all()


@pytest.mark.parametrize("name", ["gear", "viviani", "steinmetz", "tray"])
def test_rays_enter_and_leave_closed_solids_by_turns(name: str) -> None:
    part = build_part(lower(read_solid(name)))
    box = part.members.definitions[0].box
    origins, directions = scatter_rays(box, 400, 3)
    low, high = box
    origins = origins + 20 * (origins - (low + high) / 2)
    directions = directions + (low + high) / 2 - origins + directions
    result = find_hits(part, origins, directions)
    certain = ~np.isin(np.arange(400), result["ray"][result["near_edge"]])
    assert certain.mean() > 0.99
    for k in np.flatnonzero(certain):
        rows = np.flatnonzero(result["ray"] == k)
        sides = [result["entering"][row] for row in rows]
        assert sides == [j % 2 == 0 for j in range(len(rows))]
        assert len(rows) % 2 == 0
    check_first(part, origins, directions, result)


def test_hits_do_not_depend_on_other_rays() -> None:
    part = build_part(lower(read_solid("tee")))
    prepared = part.members.definitions[0]
    origins, directions = scatter_rays(prepared.box, 60, 7)
    curve = prepared.edge_curves[prepared.edge_curves >= 0][:10]
    middles = prepared.curves.evaluate(
        curve, (prepared.curves.start + prepared.curves.end)[curve] / 2
    )
    directions[: len(middles)] = middles - origins[: len(middles)]
    for hits in ("all", "first"):
        every = find_hits(part, origins, directions, hits)
        assert every["near_edge"].any()
        for k in range(2):
            some = find_hits(part, origins[k::4], directions[k::4], hits)
            rows = every["ray"] % 4 == k
            for column in COLUMNS[1:]:
                np.testing.assert_array_equal(np.asarray(every[column])[rows], some[column])


def test_groups_count_the_faces_of_copies_and_patches() -> None:
    box = build_box(SIZE) | {"up": "z"}
    group = lower_group(
        {"surface": box, "matrix": np.eye(4).tolist()},
        {"surface": SADDLE, "matrix": [[1, 0, 0, 10], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]},
        {"surface": box, "matrix": MIRROR.tolist()},
    )
    part = build_part(group)
    second = MIRROR[:3, :3] @ [1, 1.5, 2] + MIRROR[:3, 3]
    result = find_hits(part, [[1, 1.5, 9], [10.5, 0.5, 9], [*second[:2], 9]], [[0, 0, -1]] * 3)
    assert result["ray"].tolist() == [0, 0, 1, 2, 2]
    # The top is the second face of a box, and the bottom the first one; the mirror exchanges them.
    assert result["patch"].tolist() == [1, 0, 6, 7, 8]
    assert result["entering"] == [True, False, True, True, False]
    np.testing.assert_allclose(result["normals"][[0, 1, 3, 4], 2], [1, -1, 1, -1], atol=1e-12)
    np.testing.assert_allclose(result["uv"][2], 0.5, atol=1e-12)


def test_the_work_for_rays_is_bounded() -> None:
    part = build_part(lower(read_solid("wavy")))
    origins, directions = scatter_rays(part.members.definitions[0].box, 50, 2)
    query = RayQuery(origins, directions, only_first=False, limits=replace(LIMITS, pairs=60))
    result = intersect_part(part, query, 1000)
    assert not result["reached"].all()
    with pytest.raises(TooLarge):
        intersect_part(part, replace(query, limits=LIMITS), 5)
