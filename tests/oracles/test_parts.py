"""Searches and measures of whole parts agree with closed forms."""

import numpy as np
import pytest

from oracles.forms import trace_rays
from oracles.part_measures import measure_part
from oracles.part_search import PartSearch
from oracles.parts import INSIDE, OUTSIDE, read_part
from tools.judge.part_cases import build_case


@pytest.mark.parametrize("name", ["solid cone", "form hollow ball"])
def test_searches_find_what_closed_forms_say(name: str) -> None:
    case = build_case(name)
    form = case.form
    assert form is not None
    part = read_part(case.document)
    search = PartSearch(part, 100, seed=1)
    rng = np.random.default_rng(3)
    low, high = part.corners
    points = rng.uniform(low - (high - low) / 4, high, (4, 3))
    nearest = search.find_nearest(points)
    found = np.minimum(nearest.of_faces, nearest.of_borders)
    truth = np.abs(form.measure(points))
    # At the apex of a cone the search cannot move along the surface.
    np.testing.assert_allclose(found, truth, atol=1e-6 * search.diagonal, rtol=0)
    assert (found >= truth - 1e-14 * search.diagonal).all()
    directions = rng.uniform(low, high, (4, 3)) - points
    hits = search.find_hits(points, directions, 400)
    is_inside = np.array(
        [
            part.faces[k].find_inside(place[np.newaxis])[0] == INSIDE
            for k, place in zip(hits.face, hits.places, strict=True)
        ]
    )
    lengths = np.full(4, 3 * search.diagonal)
    ray, t = trace_rays(form, (points, directions), lengths, 1e-6 * search.diagonal)
    for k in range(4):
        expected = np.sort(t[ray == k])
        np.testing.assert_allclose(
            np.sort(hits.t[is_inside & (hits.ray == k)]), expected, rtol=1e-9
        )


def test_places_of_a_trimmed_face_are_inside_or_outside() -> None:
    document = build_case("form plate").document
    face = document["faces"][-1]
    part = read_part(document | {"faces": [face]})
    (top,) = part.faces
    places = np.array(
        [[0.05, 0.05], [1.5, 1.0], [4.0, 1.5], [3.0, 1.0], [1.5, 1e-7], [1.5, 2.5e-6]]
    )
    expected = [INSIDE, OUTSIDE, OUTSIDE, INSIDE, INSIDE, OUTSIDE]
    assert top.find_inside(places).tolist() == expected
    points = top.at(places).astype(np.float64)
    search = PartSearch(part, 100, seed=1)
    numbers = np.zeros(len(places), np.intp)
    distances = search.measure_to_borders(numbers, points, np.ones(len(places)))
    np.testing.assert_allclose(distances[[0, 4, 5]], [0.05, 1e-7, 1.5e-6], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "area", "volume"),
    [
        ("solid cylinder", 170 * np.pi, 300 * np.pi),
        ("solid sphere", 196 * np.pi, 4 / 3 * np.pi * 343),
    ],
)
def test_measures_are_those_of_closed_forms(name: str, area: float, volume: float) -> None:
    part = read_part(build_case(name).document)
    measured = measure_part(part, part.corners.mean(axis=0))
    np.testing.assert_allclose(measured.values[:2], [area, volume], rtol=1e-12)
    assert (measured.errors <= 1e-11 * area).all()
