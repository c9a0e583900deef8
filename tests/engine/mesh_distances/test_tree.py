"""Groups of points, parts of triangles, and the boxes about them."""

import numpy as np
import pytest

from service.bases.arrays import FloatArray
from service.engine.mesh_distances.halving import group_points
from service.engine.mesh_distances.parts import MOST, divide_triangles
from service.engine.mesh_distances.tree import TriangleTree
from tests.engine.mesh_distances.meshes import build_sheet, globe, sample_triangles, wave


def build_needles(count: int) -> FloatArray:
    """Long thin triangles (count, 3, 3) in all directions."""
    rng = np.random.default_rng(2)
    begin = rng.normal(size=(count, 3))
    end = begin + rng.normal(size=(count, 3))
    return np.stack([begin, end, end + 1e-4 * rng.normal(size=(count, 3))], axis=1)


@pytest.mark.parametrize("count", [1, 2, 7, 8, 9, 100, 1000])
def test_groups_have_all_points_and_are_small(count: int) -> None:
    points = np.random.default_rng(0).uniform(size=(3, count))
    groups = group_points(points, 8)
    assert groups.shape[1] <= 8
    assert np.bincount(groups.ravel(), minlength=count).min() == 1
    assert np.bincount(groups.ravel(), minlength=count).max() <= 2
    sides = np.ptp(points[:, groups], axis=2)
    assert sides.mean() < 1.5 / len(groups) ** (1 / 3)


def test_parts_of_long_triangles_cover_them_with_smaller_boxes() -> None:
    needles = build_needles(60)
    owner, boxes = divide_triangles(needles.transpose(1, 2, 0))
    assert set(owner.tolist()) == set(range(60))
    assert 60 < len(owner) <= MOST * 60
    for number, needle in enumerate(needles):
        own = boxes[:, owner == number]
        points = sample_triangles(needle[np.newaxis], 50, number)[..., np.newaxis]
        is_inside = np.all((own[:3] <= points + 1e-14) & (points <= own[3:] + 1e-14), axis=1)
        assert is_inside.any(axis=1).all()
    whole = np.ptp(needles, axis=1).prod(axis=1).sum()
    assert (boxes[3:] - boxes[:3]).prod(axis=0).sum() < 0.1 * whole


def test_triangles_that_fill_their_boxes_are_not_divided() -> None:
    mesh = build_sheet(wave, 9, 9)
    assert len(divide_triangles(mesh.transpose(1, 2, 0))[0]) == len(mesh)


@pytest.mark.parametrize(
    "corners", [build_sheet(globe, 12, 7), build_needles(50), np.ones((1, 3, 3))]
)
def test_boxes_contain_the_boxes_inside(corners: FloatArray) -> None:
    tree = TriangleTree(corners)
    assert tree.levels[0].shape == (6, 1)
    assert sorted(tree.order.tolist()) == list(range(len(corners)))
    assert (tree.order[tree.slots] == np.arange(len(corners))).all()
    assert set(tree.leaves.tolist()) == set(range(len(corners)))
    for level, boxes in enumerate(tree.levels[:-1]):
        numbers = np.arange(boxes.shape[1])
        inner = tree.list_inner(level, numbers)
        assert set(inner.ravel().tolist()) == set(range(tree.levels[level + 1].shape[1]))
        inside = tree.levels[level + 1][:, inner]
        assert (inside[:3] >= boxes[:3, np.newaxis]).all()
        assert (inside[3:] <= boxes[3:, np.newaxis]).all()
    back = tree.from_frame(tree.to_frame(corners.reshape(-1, 3)))
    assert np.allclose(back, corners.reshape(-1, 3), rtol=1e-15, atol=1e-15)
