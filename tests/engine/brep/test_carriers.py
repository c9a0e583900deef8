"""Equal parts whose faces lie on larger surfaces have equal meshes."""

from dataclasses import replace

import numpy as np
import pytest

from oracles.solids import read_solid
from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.meshing import triangulate_brep
from service.engine.brep.preparation.prepare import prepare
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.brep_model import BrepModel
from tests.engine.brep.solid_documents import lower


def enlarge_planes(model: BrepModel, factor: float) -> BrepModel:
    """The brep with all planes `factor` times as long and wide, not about their middles."""
    table = model.surfaces
    points, knots = table.points.copy(), table.knots.copy()
    for face in FaceSurfaces.of(table).is_planar.nonzero()[0]:
        rows = slice(table.point_starts[face], table.point_starts[face] + 4)
        origin, along_v, along_u, _ = points[rows].copy()
        low, high = -0.6 * factor, 0.4 * factor
        points[rows] = [
            origin + u * (along_u - origin) + v * (along_v - origin)
            for u in (low, high)
            for v in (low, high)
        ]
        for axis in range(2):
            first = table.knot_starts[2 * face + axis]
            begin, end = knots[first + 1 : first + 3].copy()
            knots[first : first + 2] = begin + low * (end - begin)
            knots[first + 2 : first + 4] = begin + high * (end - begin)
    return replace(model, surfaces=replace(table, points=points, knots=knots))


@pytest.mark.parametrize("factor", [10.0, 1e4])
def test_meshes_do_not_depend_on_the_size_of_planes(factor: float) -> None:
    model = lower(read_solid("gear"))
    results = []
    for each in (model, enlarge_planes(model, factor)):
        prepared = prepare(each)
        goal = Goal(1e-2 * prepared.diagonal)
        results.append(triangulate_brep(prepared, goal, MeshLimits(10_000, Effort())))
    small, large = results
    np.testing.assert_array_equal(small.triangles, large.triangles)
    np.testing.assert_array_equal(small.positions, large.positions)
    assert large.bound <= goal.tolerance
