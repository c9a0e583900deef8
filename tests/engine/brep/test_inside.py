"""Points near edges that are off their surfaces are neither inside nor outside."""

from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from oracles.solids import read_solid
from service.bases.arrays import FloatArray
from service.engine.brep import edge_tree
from service.engine.brep.inside import find_inside, find_near_edges
from service.engine.brep.preparation.prepare import prepare
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.inside import INSIDE, OUTSIDE, UNDECIDED
from tests.breps import PLATE
from tests.engine.brep.solid_documents import lower
from tests.engine.trims.tables import seeds

Document = dict[str, Any]


def build_apart(gap: float) -> Document:
    """A square of side 10; its edge at y = 0 is at y = `gap`, its pcurve at 0."""
    document = deepcopy(PLATE) | {"uncertainty": 2 * abs(gap)}
    del document["vertex_uncertainties"]
    document["vertices"] = [[0, gap, 0], [10, gap, 0], [10, 10, 0], [0, 10, 0]]
    document["edges"] = document["edges"][:4]
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]).tolist()
    pcurves = [{"control_points": corners[k : k + 2]} for k in range(4)]
    document["faces"][0]["loops"] = [{"edges": [0, 1, 2, 3], "pcurves": pcurves}]
    return document


def ask(prepared: PreparedBrep, uv: FloatArray) -> list[int]:
    face = np.zeros(len(uv), np.intp)
    points = prepared.surfaces.evaluate(face, uv)
    answers: list[int] = find_inside(prepared, face, uv, points).tolist()
    return answers


@pytest.mark.parametrize("gap", [0.5, 0.01, 1e-4, -0.01])
def test_points_nearer_to_an_edge_than_its_gap_are_undecided(gap: float) -> None:
    prepared = prepare(lower(build_apart(gap)))
    assert prepared.pcurves_replaced == 0
    bound = float(prepared.close_gaps.max())
    assert abs(gap) <= bound <= 1.5 * abs(gap)
    u = np.linspace(0.2, 0.8, 13)
    for distance, expected in ((0.9, UNDECIDED), (1.3, INSIDE)):
        y = gap + bound * distance
        assert set(ask(prepared, np.stack([u, np.full(13, y / 10)], axis=1))) == {expected}
    if gap > 0:
        # Between the border on the surface and the edge.
        assert set(ask(prepared, np.stack([u, np.full(13, gap / 20)], axis=1))) == {UNDECIDED}
    assert set(ask(prepared, np.stack([u, np.full(13, 0.5)], axis=1))) == {INSIDE}


def test_gaps_are_distances_in_all_directions() -> None:
    """Boxes about edges reach further along their diagonals than gaps do."""
    prepared = prepare(lower(build_apart(0.5)))
    bound = float(prepared.close_gaps.max())
    way = np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0)
    points = np.array([5.0, 0.5, 0.0]) + bound * np.outer([0.99, 1.01, 1.24, 1.26, 1.4], way)
    is_near = find_near_edges(prepared, np.zeros(len(points), np.intp), points)
    assert is_near[0]
    assert not is_near[3:].any()


def test_edges_on_their_surface_take_nothing_away() -> None:
    prepared = prepare(lower(deepcopy(PLATE)))
    angle = np.linspace(0, 6, 50)
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for radius, expected in ((0.2 - 1e-9, OUTSIDE), (0.2, UNDECIDED), (0.2 + 1e-9, INSIDE)):
        assert set(ask(prepared, 0.5 + radius * way)) == {expected}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["shelled", "tee", "crossholes", "wavy"])
@given(seeds)
def test_distances_agree_with_samples_of_edges(name: str, seed: int) -> None:
    prepared = _PREPARED.setdefault(name, prepare(lower(read_solid(name))))
    rng = np.random.default_rng(seed)
    curve = prepared.edge_curves[prepared.coedge_edges]
    borders = (prepared.is_border & (curve >= 0)).nonzero()[0]
    coedge = rng.choice(borders, COUNT)
    low, high = prepared.edge_ranges[prepared.coedge_edges[coedge]].T
    t = low + rng.random(COUNT) * (high - low)
    size = float(np.abs(prepared.box).max())
    way = rng.normal(size=(COUNT, 3))
    way /= np.linalg.norm(way, axis=1)[:, np.newaxis]
    share = rng.choice([0.5, 0.99, 1.5, 10.0, 1000.0], COUNT)
    gap = prepared.close_gaps[coedge] + 2.0**-42 * size
    points = prepared.curves.evaluate(curve[coedge], t) + way * (gap * share)[:, np.newaxis]
    face = prepared.coedge_faces[coedge]
    is_near = find_near_edges(prepared, face, points)
    assert is_near[share < 1].all()
    for k in np.flatnonzero(share > 1):
        own = borders[prepared.coedge_faces[borders] == face[k]]
        first, last = prepared.edge_ranges[prepared.coedge_edges[own]].T
        shares = np.linspace(0, 1, 2001)
        samples = first[:, np.newaxis] + (last - first)[:, np.newaxis] * shares
        positions = prepared.curves.evaluate(np.repeat(curve[own], 2001), samples.ravel())
        apart = np.linalg.norm(positions - points[k], axis=1).reshape(len(own), 2001)
        reach = prepared.close_gaps[own] + 2.0**-42 * size
        steps = np.linalg.norm(np.diff(positions.reshape(-1, 2001, 3), axis=1), axis=2).max(axis=1)
        if is_near[k]:
            assert (apart.min(axis=1) <= 1.26 * reach + steps).any()
        else:
            assert (apart.min(axis=1) > reach).all()


def test_answers_do_not_depend_on_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    prepared = prepare(lower(build_apart(0.5)))
    uv = np.random.default_rng(2).random((200, 2)) * [1, 0.2]
    expected = ask(prepared, uv)
    assert {INSIDE, UNDECIDED} == set(expected)
    monkeypatch.setattr(edge_tree, "PAIRS", 3)
    monkeypatch.setattr(edge_tree, "CHUNK", 11)
    assert ask(prepared, uv) == expected


_PREPARED: dict[str, PreparedBrep] = {}

COUNT = 40
"""Points near edges in each example."""
