"""Sides of borders by angle: halved as often as smooth surfaces need, but not at creases."""

from math import pi

import pytest

from oracles.solids import read_solid
from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep import border_sampling
from service.engine.brep.border_sampling import sample_borders
from service.engine.brep.filling.angles import find_turning_sides
from service.engine.brep.preparation.prepare import prepare
from service.engine.brep.prepared import PreparedBrep
from service.errors import TooLarge
from service.schemas.brep import BrepDefinition


def _prepare(document: dict[str, object]) -> PreparedBrep:
    return prepare(BrepDefinition.model_validate(document).to_surface().lower())


@pytest.mark.parametrize("angle", [0.02, 0.001])
def test_normals_turn_by_at_most_the_angle_along_borders(angle: float) -> None:
    prepared = _prepare(read_solid("cylinder"))
    goal = Goal(0.01 * prepared.diagonal, angle)
    _, border = sample_borders(prepared, goal, MeshLimits())
    assert not len(find_turning_sides(prepared.places, border, angle, pi))
    # Two circles, each once on a plane and once on the cylinder, in powers of two.
    assert len(border.faces) < 4 * 2 * (2 * pi / angle) + 16


def test_an_impossible_angle_soon_takes_too_much_work() -> None:
    prepared = _prepare(read_solid("cylinder"))
    goal = Goal(0.01 * prepared.diagonal, 1e-6)
    with pytest.raises(TooLarge) as caught:
        sample_borders(prepared, goal, MeshLimits(effort=Effort(limit=1e9)))
    assert caught.value.issues[0].code == "too_costly"


@pytest.mark.slow
def test_sides_that_turn_as_at_creases_are_halved_a_few_times(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    prepared = _prepare(read_solid("cylinder"))
    goal = Goal(0.01 * prepared.diagonal, 1e-3)
    smooth = len(sample_borders(prepared, goal, MeshLimits())[1].faces)
    monkeypatch.setattr(border_sampling, "SMOOTH", 0.0)
    _, border = sample_borders(prepared, goal, MeshLimits())
    turning = find_turning_sides(prepared.places, border, goal.angle, pi)
    # All sides on the cylinder, but the two along the seam.
    assert 2 * len(turning) == len(border.faces) - 2
    assert smooth > 2 * len(border.faces)
    assert not len(find_turning_sides(prepared.places, border, goal.angle, goal.angle))
