"""Which points are inside of parts, compared with closed forms and with the volumes of solids."""

from copy import deepcopy
from typing import Any

import numpy as np
import pytest

from oracles.sheets import Array
from oracles.solids import MEASURES, read_solid
from service.engine.parts import signs
from service.engine.parts.build import build_part
from service.engine.parts.part import Part
from service.engine.parts.signs import compute_part_signs
from tests.breps import PLATE, build_box
from tests.engine.brep.solid_documents import lower
from tests.engine.parts.shapes import Box, Bracket, build_cracked, build_hollow_box
from tests.engine.parts.test_part import MIRROR, lower_group

Document = dict[str, Any]


def sign(part: Part, points: Array, low: float = 1e-12) -> Array:
    distances = np.full(len(points), low)
    result: Array = compute_part_signs(part, part.nets.local(points), distances)
    return result


def scatter(part: Part, count: int, seed: int = 0) -> Array:
    """Points in and about the box of a part."""
    low = part.nets.origin - part.nets.diagonal / 2
    points: Array = low + np.random.default_rng(seed).random((count, 3)) * part.nets.diagonal
    return points


@pytest.mark.parametrize("shape", [Box(np.zeros(3), np.array([2.0, 3, 4])), Bracket()])
def test_signs_are_those_of_closed_forms(shape: Box | Bracket) -> None:
    part = build_part(lower(build_box() if isinstance(shape, Box) else shape.document()))
    points = scatter(part, 2000)
    np.testing.assert_array_equal(sign(part, points), np.where(shape.contains(points), -1, 1))


def test_voids_are_outside() -> None:
    document, outer, inner = build_hollow_box()
    part = build_part(lower(document))
    points = scatter(part, 1000)
    size = inner.high - inner.low
    about = np.random.default_rng(1).uniform(inner.low - size / 4, inner.high + size / 4, (500, 3))
    points = np.concatenate([points, about])
    inside = outer.contains(points) & ~inner.contains(points)
    assert inner.contains(points).sum() > 100
    np.testing.assert_array_equal(sign(part, points), np.where(inside, -1, 1))


def test_grid_points_stand_for_points_that_are_far_from_the_part() -> None:
    shape = Bracket()
    part = build_part(lower(shape.document()))
    points = scatter(part, 500, 3)
    points = points[np.abs(points - 0.0).min(axis=1) > 0.2]
    # All these are further than 0.01 from walls, up to the choice of the seed.
    offsets = np.linspace(-0.01, 0.01, 3)
    shifts = np.stack(np.meshgrid(offsets, offsets, offsets), axis=-1).reshape(-1, 3)
    inside = shape.contains((points[:, np.newaxis] + shifts).reshape(-1, 3)).reshape(-1, 27)
    is_far = inside.all(axis=1) | ~inside.any(axis=1)
    points, inside = points[is_far], inside[is_far, 0]
    found = sign(part, points, 0.01 / part.nets.scale)
    np.testing.assert_array_equal(found, np.where(inside, -1, 1))


@pytest.mark.parametrize("name", ["gear", "sphere_hole", "steinmetz", "torus_cut", "cone"])
def test_the_share_of_points_inside_is_that_of_the_volume(name: str) -> None:
    part = build_part(lower(read_solid(name)))
    low, high = part.members.definitions[0].box
    count = 4000
    points = low + np.random.default_rng(1).random((count, 3)) * (high - low)
    found = sign(part, points)
    assert not np.isnan(found).any()
    expected = MEASURES[name]["volume"] / float(np.prod(high - low))
    spread = (expected * (1 - expected) / count) ** 0.5
    assert abs((found < 0).mean() - expected) < 4 * spread


def test_points_at_edges_and_on_faces_are_uncertain() -> None:
    part = build_part(lower(build_box()))
    points = np.array([[0, 1, 0], [2, 3, 4], [1, 1, 4], [1, 1, 3.9], [1, 1, 4.1], [0, 1e-3, 1e-3]])
    found = sign(part, points)
    np.testing.assert_array_equal(found, [np.nan, np.nan, np.nan, -1, 1, np.nan])
    assert np.isnan(sign(part, points, 0.0)[:3]).all()
    assert (sign(part, np.array([[9.0, 9, 9], [1e9, 0, 0]]), 0.0) == 1).all()


def test_points_within_a_gap_are_uncertain() -> None:
    """The roof of two squares is no solid; the gap of its edge is 1/100."""
    box = build_box((10, 5, 4))
    gap = 0.01
    # The top is 0.01 above the edges around it.
    top = deepcopy(box["faces"][1]["surface"]["control_net"])
    raised = np.array(top) + np.array([0, 0, gap])
    box["faces"][1]["surface"]["control_net"] = raised.tolist()
    part = build_part(lower(box | {"uncertainty": 1.0}))
    assert part.members.definitions[0].gaps.max() >= gap
    points = np.array([[5.0, 0, 4 + gap / 2], [5, 0, 4.1], [5, 0.005, 3.999], [5, 0.1, 3.9]])
    found = sign(part, points)
    np.testing.assert_array_equal(found, [np.nan, 1, np.nan, -1])


def test_open_parts_have_no_inside() -> None:
    points = np.random.default_rng(0).random((20, 3)) * [10, 10, 1]
    for document in (deepcopy(PLATE), build_cracked(1e-3, tilt=0.5)):
        assert np.isnan(sign(build_part(lower(document)), points)).all()
    # Six faces of a box, one of which is a shell of its own.
    box = build_box()
    box["shells"] = [{"faces": [0, 1, 2, 3, 4]}, {"faces": [5]}]
    assert np.isnan(sign(build_part(lower(box)), np.array([[1.0, 1, 1]]))).all()


def test_a_point_is_inside_of_a_group_if_it_is_inside_of_a_member() -> None:
    box: Document = build_box() | {"up": "z"}
    moved = np.eye(4)
    moved[:3, 3] = [1.5, 0, 0]
    group: list[Document] = [{"surface": box}, {"surface": box, "matrix": moved.tolist()}]
    points = np.array([[1, 1, 1], [1.75, 1, 1], [3, 1, 1], [5, 1, 1], [-1.0, 1, 1]])
    part = build_part(lower_group(*group))
    np.testing.assert_array_equal(sign(part, points), [-1, -1, -1, 1, 1])
    part = build_part(lower_group(*group, {"surface": deepcopy(PLATE)}))
    np.testing.assert_array_equal(sign(part, points), [-1, -1, -1, np.nan, np.nan])
    mirrored = {"surface": box, "matrix": MIRROR.tolist()}
    part = build_part(lower_group(group[0], mirrored))
    center = MIRROR[:3, :3] @ [1, 1, 1] + MIRROR[:3, 3]
    np.testing.assert_array_equal(sign(part, np.array([center, [1, 1, 1]])), [-1, -1])


def test_an_unlucky_direction_is_followed_by_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    part = build_part(lower(build_box()))
    points = np.array([[1.0, 1, 1], [1, 1, 5]])
    ways = np.array([[0.0, 1, 0], [1.0, 0, 3], [0, 0, 1.0]])
    # From the first point these meet no edge, an edge at the top, and no edge.
    monkeypatch.setattr(signs, "DIRECTIONS", ways[1:2])
    np.testing.assert_array_equal(sign(part, points), [np.nan, 1])
    monkeypatch.setattr(signs, "DIRECTIONS", ways[1:])
    np.testing.assert_array_equal(sign(part, points), [-1, 1])
