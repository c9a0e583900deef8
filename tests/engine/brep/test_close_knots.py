"""Faces whose surfaces have spans shorter than a unit of places: whole meshes."""

import numpy as np
import pytest

from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.meshing import triangulate_brep
from service.engine.brep.preparation.prepare import prepare
from tests.engine.brep.made_breps import build_model
from tests.engine.trims.test_places import build_curved_strips


@pytest.mark.parametrize("exponent", [-29, -31, -33, -39])
@pytest.mark.parametrize("multiplicity", [1, 2])
def test_a_face_is_covered_whatever_the_lengths_of_its_spans(
    exponent: int, multiplicity: int
) -> None:
    """The surface (u, v, about u²) over [0, 1]², with a knot near ½ and one behind it."""
    close = np.repeat(0.5 + 2.0**exponent * np.arange(2), multiplicity)
    surface = build_curved_strips(np.concatenate([[0.25], close, [0.75]]))
    model = build_model(surface, np.zeros(1, bool), ("strip",), ())
    prepared = prepare(model)
    result = triangulate_brep(prepared, Goal(1e-3), MeshLimits(10_000, Effort()))
    assert 0 < result.face_bounds[0] <= 1e-3
    a, b, c = np.moveaxis(result.positions[result.points[result.triangles]][..., :2], 1, 0)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    assert np.sum(ux * vy - uy * vx) / 2 == pytest.approx(1.0, abs=1e-9)
