"""Faces whose surfaces have spans shorter than a unit of places: whole meshes."""

import numpy as np
import pytest

from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.meshing import triangulate_brep
from service.engine.brep.prepare import prepare
from service.surface.brep_model import BrepModel
from service.surface.spline_tables import CurveTable
from tests.engine.trims.test_places import build_curved_strips

NONE = np.zeros(0, np.intp)


def list_no_curves(dimension: int) -> CurveTable:
    no_points = np.zeros((0, dimension))
    return CurveTable(NONE, NONE, no_points, np.zeros(0), np.zeros(0, bool), np.zeros(0))


@pytest.mark.parametrize("exponent", [-29, -31, -33, -39])
@pytest.mark.parametrize("multiplicity", [1, 2])
def test_a_face_is_covered_whatever_the_lengths_of_its_spans(
    exponent: int, multiplicity: int
) -> None:
    """The surface (u, v, about u²) over [0, 1]², with a knot near ½ and one behind it."""
    close = np.repeat(0.5 + 2.0**exponent * np.arange(2), multiplicity)
    model = BrepModel(
        name="strip",
        up="z",
        vertices=np.zeros((0, 3)),
        vertex_uncertainties=np.zeros(0),
        edge_vertices=np.zeros((0, 2), np.intp),
        edge_curves=NONE,
        edge_uncertainties=np.zeros(0),
        is_degenerate=np.zeros(0, bool),
        curves=list_no_curves(3),
        surfaces=build_curved_strips(np.concatenate([[0.25], close, [0.75]])),
        face_names=("",),
        palette=np.zeros((0, 4)),
        face_colors=np.array([-1]),
        is_reversed=np.zeros(1, bool),
        loop_faces=NONE,
        loop_counts=NONE,
        coedge_edges=NONE,
        coedge_reversed=np.zeros(0, bool),
        coedge_pcurves=NONE,
        pcurves=list_no_curves(2),
        shell_counts=np.array([1]),
        shell_faces=np.array([0]),
        is_closed=np.zeros(1, bool),
        uncertainty=1e-6,
    )
    prepared = prepare(model)
    result = triangulate_brep(prepared, Goal(1e-3), MeshLimits(10_000, Effort()))
    assert 0 < result.face_bounds[0] <= 1e-3
    a, b, c = np.moveaxis(result.positions[result.points[result.triangles]][..., :2], 1, 0)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    assert np.sum(ux * vy - uy * vx) / 2 == pytest.approx(1.0, abs=1e-9)
