"""Nearest triangles, compared with all pairs in whole numbers."""

import numpy as np
import pytest

from service.bases.arrays import FloatArray
from service.engine.mesh_distances import nearest as nearest_module
from service.engine.mesh_distances.nearest import find_nearest
from service.engine.mesh_distances.tree import TriangleTree
from tests.engine.mesh_distances.meshes import (
    build_sheet,
    globe,
    measure_exactly,
    sample_triangles,
    wave,
)

SOUPS = ("triangles", "segments and points", "needles", "whole numbers", "one")


def build_soup(kind: str, seed: int) -> FloatArray:
    """Triangles without any order."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(1 if kind == "one" else 40, 3, 3))
    if kind == "segments and points":
        corners[:, 2] = corners[:, 1]
        corners[::3, 1:] = corners[::3, :1]
    if kind == "needles":
        along = rng.uniform(-1, 2, (40, 1)) * (corners[:, 1] - corners[:, 0])
        thickness = 10.0 ** rng.integers(-18, -3, (40, 1))
        corners[:, 2] = corners[:, 0] + along + rng.normal(size=(40, 3)) * thickness
    return np.round(corners) if kind == "whole numbers" else corners


@pytest.mark.parametrize("kind", SOUPS)
@pytest.mark.parametrize(("size", "shift"), [(1.0, 0.0), (1e-30, 3.0), (1e15, 1e3)])
def test_intervals_contain_the_distances(kind: str, size: float, shift: float) -> None:
    soup = build_soup(kind, 3)
    rng = np.random.default_rng(4)
    points = np.concatenate(
        [rng.normal(size=(60, 3)), sample_triangles(soup, 30), soup[:5, 1], soup[:5].mean(axis=1)]
    )
    soup, points = (soup + shift) * size, (points + shift) * size
    nearest = find_nearest(TriangleTree(soup), points)
    distances = measure_exactly(points, soup)
    least = distances.min(axis=1)
    assert (nearest.low <= least).all()
    assert (least <= nearest.high).all()
    width = 1e-12 * (10 + shift) * size
    assert (nearest.high - nearest.low).max() < width
    own = distances[np.arange(len(points)), nearest.triangle]
    assert (own - least).max() < width
    corners = soup[nearest.triangle]
    places = (corners * nearest.weights[..., np.newaxis]).sum(axis=1)
    assert np.abs(places - nearest.position).max() < width
    assert np.abs(np.linalg.norm(places - points, axis=1) - least).max() < width
    assert nearest.weights.min() >= 0
    assert np.allclose(nearest.weights.sum(axis=1), 1, rtol=0, atol=1e-14)


def test_a_guess_changes_nothing() -> None:
    mesh, points = build_sheet(globe, 20, 30), sample_triangles(build_sheet(globe, 9, 7), 500)
    tree = TriangleTree(mesh)
    nearest = find_nearest(tree, points)
    for guess in (nearest.triangle, np.arange(500) % len(mesh)):
        again = find_nearest(tree, points, guess)
        assert (again.triangle == nearest.triangle).all()
        assert (again.high == nearest.high).all()


def test_the_lowest_number_wins_among_equal_triangles() -> None:
    mesh = build_sheet(wave, 5, 5)
    points = sample_triangles(mesh, 200)
    once, twice = TriangleTree(mesh), TriangleTree(np.concatenate([mesh, mesh]))
    assert (find_nearest(twice, points).triangle == find_nearest(once, points).triangle).all()


def test_points_that_are_equally_near_to_all_triangles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nearest_module, "MAX_PAIRS", 500)
    mesh = build_sheet(globe, 5, 6)
    points = np.random.default_rng(1).normal(size=(90, 3)) * 1e-9
    nearest = find_nearest(TriangleTree(mesh), points)
    least = measure_exactly(points, mesh).min(axis=1)
    assert (nearest.low <= least).all()
    assert (least <= nearest.high).all()


def test_no_points_and_no_triangles() -> None:
    tree = TriangleTree(build_sheet(wave, 2, 2))
    assert find_nearest(tree, np.zeros((0, 3))).position.shape == (0, 3)
    with pytest.raises(ValueError, match="needs a triangle"):
        TriangleTree(np.zeros((0, 3, 3)))
