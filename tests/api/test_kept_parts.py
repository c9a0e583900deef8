"""Prepared breps and parts are kept in the cache of plans: answers have the same bytes."""

from typing import Any

import pytest

from oracles.solids import read_solid
from service.bases.cache import MESH_PLANS
from service.bases.kept import count_bytes, find_arrays
from service.engine.brep.preparation.prepare import prepare
from service.engine.parts.build import build_part
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.brep_model import BrepModel
from service.surface.lowered import GroupModel
from tests.api.test_part_questions import GROUP
from tests.breps import PLATE, build_box
from tools.client import Client

CALLS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("project", {"points": [[1, 2, 3], [0.1, 0.2, 0.3]], "sign": True}),
    ("intersect", {"rays": {"origins": [[1, 2, 90]], "directions": [[0, 0, -1]]}}),
    ("intersect", {"planes": {"points": [[1, 2, 1]], "normals": [[1, 2, 3]]}}),
    ("measure", {}),
    ("mesh?format=json", {"relative_tolerance": 1e-2}),
)
"""All calls that need a prepared part, but `points`."""


def lower(surface: dict[str, Any]) -> BrepModel | GroupModel:
    """The lowered surface of a document, from arrays of its own."""
    model = validate_document(SurfaceRequest, {"surface": surface}).to_surface().lower()
    assert isinstance(model, BrepModel | GroupModel)
    return model


def lower_brep(surface: dict[str, Any]) -> BrepModel:
    """The lowered brep of a document."""
    model = lower(surface)
    assert isinstance(model, BrepModel)
    return model


def ask_all(client: Client, surface: dict[str, Any], *, clears: bool) -> list[bytes]:
    """The answers of all calls, each with an empty cache or after the others."""
    answers = []
    for path, fields in CALLS:
        if clears:
            MESH_PLANS.clear()
        response = client.post(f"/v1/{path}", {"surface": surface, **fields})
        assert response.status_code == 200, response.text
        answers.append(response.content)
    return answers


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plate with a hole", "group", "sphere_hole"])
def test_answers_do_not_depend_on_kept_parts(client: Client, name: str) -> None:
    """With an empty cache, after other calls, and again: byte for byte."""
    surface = {"plate with a hole": PLATE, "group": GROUP}.get(name) or read_solid(name)
    cold = ask_all(client, surface, clears=True)
    assert ask_all(client, surface, clears=False) == cold
    assert ask_all(client, surface, clears=False) == cold


def test_equal_breps_of_two_requests_are_prepared_once() -> None:
    """Their arrays differ, and their numbers are equal; a brep with one other number is another."""
    assert prepare(lower_brep(PLATE)) is prepare(lower_brep(PLATE))
    assert build_part(lower(GROUP)) is build_part(lower(GROUP))
    for field in ({"uncertainty": 1e-3}, {"name": "another"}):
        assert prepare(lower_brep(PLATE)) is not prepare(lower_brep(PLATE | field))


def test_groups_of_very_many_members_are_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their keys would take more memory than a request is known to take."""
    monkeypatch.setattr("service.engine.parts.build.MOST_MEMBERS", 2)
    member = {"surface": build_box((1, 1, 1)) | {"up": "z"}}
    few, many = (
        lower({"type": "group", "up": "z", "members": [member] * count}) for count in (2, 3)
    )
    assert build_part(few) is build_part(few)
    assert build_part(many) is not build_part(many)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tee", "pipe", "sphere_hole"])
def test_a_part_takes_at_most_the_bytes_that_it_counts(client: Client, name: str) -> None:
    """After all calls have computed its properties, too."""
    MESH_PLANS.clear()
    surface = read_solid(name)
    prepared = prepare(lower_brep(surface))
    counted = MESH_PLANS.nbytes
    part = build_part(lower(surface))
    assert counted < MESH_PLANS.nbytes
    counted_part = MESH_PLANS.nbytes - counted
    ask_all(client, surface, clears=False)
    assert prepare(lower_brep(surface)) is prepared
    for value, most in ((prepared, counted), (part, counted_part)):
        arrays, _ = find_arrays(value)
        assert most // 12 < count_bytes(arrays) <= most
