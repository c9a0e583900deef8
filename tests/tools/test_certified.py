"""Some of the surfaces and models that `make certify` judges, at least one of every family."""

import pytest

from tools.certify.closing import judge_nearly
from tools.certify.judge import Case, judge
from tools.certify.models import BODIES
from tools.certify.seams import judge_model
from tools.certify.surfaces import FAMILIES

SAMPLES = 200, 1000
"""Least and most samples of a surface: fewer than `make certify` takes."""


@pytest.mark.parametrize(("number", "family"), [*enumerate(FAMILIES)])
def test_deviations_are_within_bounds_and_bounds_within_tolerances(
    number: int, family: str
) -> None:
    relative, written_as = ((1e-1, "json"), (1e-2, "glb"))[number % 2]
    verdict = judge(Case(family, 1001, relative, written_as=written_as), SAMPLES)
    assert verdict.faults == []


@pytest.mark.parametrize("family", ["bicubic, wild", "NURBS", "triangles", "cusped"])
def test_the_distance_from_the_mesh_is_bounded_if_requested(family: str) -> None:
    verdict = judge(Case(family, 1003, 3e-2, two_sided=True), SAMPLES)
    assert verdict.faults == []
    assert verdict.mesh_bound > 0


@pytest.mark.parametrize(
    ("family", "seed", "relative"),
    [
        # The deviation of these strips once exceeded the bound of their edges slightly.
        ("flat", 18, 1e-1),
        ("degrees 1 to 8, anywhere", 18, 1e-1),
        # These strips once had triangles without area at a pole, where corners are collinear.
        ("triangles", 30, 1e-3),
    ],
)
def test_strips_along_the_border_are_within_the_bound_and_have_an_area(
    family: str, seed: int, relative: float
) -> None:
    case = Case(family, seed, relative, two_sided=True, written_as="glb")
    assert judge(case, SAMPLES).faults == []


@pytest.mark.parametrize("kind", list(BODIES)[::2])  # `make certify` judges all of them
def test_seams_are_closed_in_any_order_of_patches_and_equal_for_patches_alone(kind: str) -> None:
    assert judge_model(kind, 1001, 0.1).faults == []


def test_surfaces_whose_weights_differ_by_a_factor_are_closed_in_any_order() -> None:
    """At common points, the weights of two surfaces differ by a constant factor."""
    assert judge_nearly("crowded knots", 84, 1e-1).faults == []
