"""The modules of the editor that change nets, compared with what the service computes."""

from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import Page

Surface = dict[str, Any]


def call(page: Page, module: str, function: str, *arguments: Any) -> Any:
    """The result of a function in a module of the editor."""
    return page.evaluate(
        """async ([module, name, values]) => {
          const functions = await import(`/page/${module}.js`);
          return functions[name](...values);
        }""",
        [module, function, arguments],
    )


def convert(server: str, surface: Surface, *operations: Surface) -> Surface:
    body = {"surface": surface} | ({"operations": operations} if operations else {})
    answer = httpx.post(f"{server}/v1/convert", json=body)
    assert answer.status_code == 200, answer.text
    result = answer.json()["surface"]
    assert isinstance(result, dict)
    return result


def evaluate(
    server: str, surface: Surface, low: float, high: float, count: int = 6, **more: int
) -> Surface:
    """Points and normals of a surface on a grid of parameters, as the service computes them."""
    places = np.linspace(low, high, count).tolist()
    grid = [[u, v] for u in places for v in places]
    answer = httpx.post(f"{server}/v1/points", json={"surface": surface, "uv": grid, **more})
    assert answer.status_code == 200, answer.text
    return {name: np.array(values) for name, values in answer.json().items()}


def build_spline(rows: int, columns: int, *, is_rational: bool = True) -> Surface:
    rng = np.random.default_rng(7)
    surface: Surface = {
        "type": "bspline",
        "degree": [3, 2],
        "control_net": rng.uniform(-2, 2, (rows, columns, 3)).tolist(),
        "colors": rng.uniform(0, 1, (rows, columns, 3)).tolist(),
        "attributes": {"heat": rng.uniform(0, 9, (2, 2, 1)).tolist()},
    }
    if is_rational:
        surface["weights"] = rng.uniform(0.8, 1.25, (rows, columns)).tolist()
    return surface


@pytest.mark.parametrize("direction", [0, 1])
@pytest.mark.parametrize("is_rational", [False, True])
def test_an_inserted_knot_is_removed_again(
    modules: Page, server: str, direction: int, is_rational: bool
) -> None:
    surface = convert(server, build_spline(6, 6, is_rational=is_rational))
    operation = {"op": "insert", "uv"[direction]: 1.375}
    finer = convert(server, surface, operation)
    line = call(
        modules, "knots", "findLine", finer["knots"][direction], surface["degree"][direction], 1.375
    )
    result = call(modules, "rows", "removeKnot", finer, direction, line)
    assert result["knot"] == 1.375
    assert result["change"] < 1e-12
    coarser = result["surface"]
    assert coarser["knots"] == ["clamped", "clamped"]
    for name in ("control_net", "colors", *(["weights"] if is_rational else [])):
        np.testing.assert_allclose(coarser[name], surface[name], atol=1e-12)
    assert coarser["attributes"] == surface["attributes"]


@pytest.mark.parametrize("direction", [0, 1])
@pytest.mark.parametrize("is_rational", [False, True])
def test_a_removed_knot_moves_no_point_further_than_the_page_says(
    modules: Page, server: str, direction: int, is_rational: bool
) -> None:
    surface = convert(server, build_spline(7, 6, is_rational=is_rational))
    result = call(modules, "rows", "removeKnot", surface, direction, 3)
    before = evaluate(server, surface, 0, 4)["positions"]
    after = evaluate(server, result["surface"], 0, 4)["positions"]
    moved = np.linalg.norm(after - before, axis=1).max()
    assert 0.01 < moved <= result["change"]
    if not is_rational:
        assert result["change"] < 8 * moved
    counts = [7, 6]
    counts[direction] -= 1
    assert np.shape(result["surface"]["control_net"])[:2] == tuple(counts)
    assert np.shape(result["surface"]["colors"])[:2] == tuple(counts)


@pytest.mark.parametrize("direction", [0, 1])
def test_a_raised_degree_is_lowered_again_and_other_degrees_with_a_bound(
    modules: Page, server: str, direction: int
) -> None:
    rng = np.random.default_rng(5)
    patch = convert(
        server,
        {
            "control_net": rng.uniform(-1, 1, (4, 5, 3)).tolist(),
            "weights": rng.uniform(0.5, 2, (4, 5)).tolist(),
        },
    )
    degree = [3, 4]
    degree[direction] += 1
    raised = convert(server, patch, {"op": "elevate", "degree": degree})
    result = call(modules, "rows", "lowerDegree", raised, direction)
    assert result["change"] < 1e-12
    np.testing.assert_allclose(result["surface"]["control_net"], patch["control_net"], atol=1e-12)
    result = call(modules, "rows", "lowerDegree", patch, direction)
    before, after = (evaluate(server, s, 0, 1)["positions"] for s in (patch, result["surface"]))
    assert 0.01 < np.linalg.norm(after - before, axis=1).max() <= result["change"]
    corners = np.ix_([0, -1], [0, -1])
    old, new = np.array(patch["control_net"]), np.array(result["surface"]["control_net"])
    assert (new[corners] == old[corners]).all()


def test_a_new_knot_is_in_the_middle_of_the_span_of_its_row(modules: Page) -> None:
    clamped = [0, 0, 0, 0, 1, 2, 4, 4, 4, 4]
    places = [call(modules, "knots", "findNewKnot", clamped, 3, line) for line in range(6)]
    assert places == [0.5, 0.5, 1.5, 3, 3, 3]
    uniform = [-2, -1, 0, 1, 2, 3, 4, 5]
    places = [call(modules, "knots", "findNewKnot", uniform, 2, line) for line in (0, 4)]
    assert places == [0.5, 2.5]


def test_rows_of_a_periodic_spline(modules: Page, server: str) -> None:
    surface = convert(server, build_spline(5, 4) | {"knots": ["periodic", "clamped"]})
    finer = call(modules, "rows", "addMeanLine", surface, 0, 4)
    weights = np.array(surface["weights"])[:, :, None]
    points = np.array(surface["control_net"])
    mean = (weights[4] * points[4] + weights[0] * points[0]) / (weights[4] + weights[0])
    np.testing.assert_allclose(finer["control_net"][5], mean)
    assert finer["control_net"][:5] == surface["control_net"]
    assert finer["knots"] == ["periodic", "clamped"]
    coarser = call(modules, "rows", "removeLine", finer, 0, 5)
    assert coarser == surface


@pytest.mark.parametrize(
    ("function", "surface", "reason"),
    [
        ("lowerDegree", {"control_net": [[[0, 0, 0]] * 3] * 2}, "Degree 1 is the lowest"),
        (
            "removeKnot",
            {"type": "bspline", "degree": [1, 1], "knots": ["clamped"] * 2,
             "control_net": [[[0, 0, 0]] * 3] * 2},
            "degree 1 has at least 2 rows",
        ),
        ("removeLine", {"control_net": [[[0, 0, 0]] * 3] * 3}, "at least 3 control points"),
    ],
)  # fmt: skip
def test_reasons_why_a_row_cannot_be_removed(
    modules: Page, function: str, surface: Surface, reason: str
) -> None:
    text = modules.evaluate(
        """async ([name, surface]) => {
          const rows = await import('/page/rows.js');
          try { rows[name](surface, 0, 0); } catch (error) { return error.message; }
        }""",
        [function, surface],
    )
    assert reason in text


def extent(degree: int, count: int, is_periodic: bool = False) -> Surface:
    return {"degree": degree, "count": count, "isPeriodic": is_periodic}


@pytest.mark.parametrize("is_curved", [False, True])
@pytest.mark.parametrize(
    "is_periodic", [(False, False), (True, False), (False, True), (True, True)]
)
def test_new_surfaces_have_normals_that_point_up_or_outwards(
    modules: Page, server: str, is_curved: bool, is_periodic: tuple[bool, bool]
) -> None:
    around = [extent(2 + i, 7 + i, periodic) for i, periodic in enumerate(is_periodic)]
    surface = call(modules, "new-surface", "makeSurface", True, *around, is_curved)
    answer = evaluate(server, surface, 0.5, 3.5)
    positions, normals = answer["positions"], answer["normals"]
    if not any(is_periodic):
        assert (normals[:, 2] > 0.5).all()
        assert (np.ptp(np.array(surface["control_net"]).reshape(-1, 3), axis=0)[:2] == (6, 7)).all()
        return
    outwards = positions * (1, 1, 0)
    if all(is_periodic):  # from the circle in the middle of the torus
        radius = np.linalg.norm(outwards, axis=1, keepdims=True)
        ring = np.array(surface["control_net"])[:, :, :2]
        middle = np.linalg.norm(ring, axis=2).mean()
        outwards = positions - outwards / radius * middle
    assert (np.sum(normals * outwards, axis=1) > 0).all()


def test_a_new_patch_is_flat_or_curved(modules: Page) -> None:
    flat = call(modules, "new-surface", "makeSurface", False, extent(3, 4), extent(2, 3), False)
    assert flat["type"] == "bezier"
    assert np.shape(flat["control_net"]) == (4, 3, 3)
    assert (np.array(flat["control_net"])[:, :, 2] == 0).all()
    curved = call(modules, "new-surface", "makeSurface", False, extent(3, 4), extent(2, 3), True)
    assert np.array(curved["control_net"])[1, 1, 2] > 0.3


def test_points_of_a_group_keep_their_distances_in_the_scene(modules: Page) -> None:
    """Both members are the same patch; the second one is turned about z, and twice as large."""
    patch = {"control_net": [[[0, 0, 0], [0, 1, 0.1]], [[1, 0, 0], [1, 1, 0]]]}
    matrix = [[0, -2, 0, 5], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]
    group = {"type": "group", "members": [{"surface": patch}, {"surface": patch, "matrix": matrix}]}
    net = call(modules, "net", "netOf", group)
    moved = call(modules, "selection", "moveTogether", group, net, [4, 5, 1], [0.2, 1, 0.3])
    first, second = (member["surface"]["control_net"] for member in moved["members"])
    assert first == [[[0, 0, 0], [0.2, 1, 0.3]], [[1, 0, 0], [1, 1, 0]]]
    # (0.2, 0, 0.2) in the scene is (0, −0.1, 0.1) there.
    assert second == [[[0, -0.1, 0.1], [0, 0.9, 0.2]], [[1, 0, 0], [1, 1, 0]]]


def test_points_in_one_line(modules: Page) -> None:
    triangle = [[[0, 0, 0], [0, 1, 0], [0, 2, 0]], [[1, 0, 0], [1, 1, 0]], [[2, 0, 0]]]
    patches = {"type": "patches", "vertices": [[0, 0, 0]] * 4, "patches": [[[0, 1], [2, 3]]]}
    hair = {"type": "tube", "radius": 1, "curve": {"control_points": [[0, 0], [1, 0], [1, 1]]}}
    surface = {
        "type": "group",
        "members": [
            {"surface": {"type": "triangle", "control_net": triangle}},
            {"surface": patches},
            {"surface": hair},
        ],
    }
    net = call(modules, "net", "netOf", surface)
    lines = [
        call(modules, "selection", "lineOf", net, index, direction)
        for index, direction in [(1, 0), (1, 1), (7, 0), (11, 0), (11, 1)]
    ]
    assert lines == [[0, 1, 2], [1, 4], [], [10, 11, 12], [10, 11, 12]]


def test_mirrored_groups_are_placed_without_a_mirror(modules: Page, server: str) -> None:
    """A member that is turned, has its own vertical axis, and a child below it."""
    patch = {"control_net": [[[0, 0, 0], [0, 1, 0.5]], [[1, 0, 0.25], [1, 1, 2]]]}
    matrix = [[0, -1, 0, 5], [1, 0, 0, 2], [0, 0, 1, 1], [0, 0, 0, 1]]
    shift = [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    group = {
        "type": "group",
        "up": "z",
        "definitions": [patch | {"up": "y"}],
        "members": [
            {"definition": 0, "matrix": matrix},
            {"definition": 0, "parent": 0, "matrix": shift},
        ],
    }
    for axis in range(3):
        plane = {"axis": axis, "offset": 0.5}
        mirrored = call(modules, "mirror", "reflect", group, plane)
        for member in mirrored["members"]:
            linear = np.array(member["matrix"])[:3, :3]
            assert np.linalg.det(linear) == pytest.approx(1)
        expected, found = (
            np.concatenate([evaluate(server, s, 0, 1, patch=k)["positions"] for k in (0, 1)])
            for s in (group, mirrored)
        )
        expected[:, axis] = 1 - expected[:, axis]
        np.testing.assert_allclose(found, expected, atol=1e-12)
