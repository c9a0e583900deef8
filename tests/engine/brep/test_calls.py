"""The number of array operations of whole meshes hardly depends on the number of faces."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from oracles.solids import read_solid
from service.bases.arrays import Ints
from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.meshing import triangulate_brep
from service.engine.brep.preparation.prepare import prepare, prepare_anew
from service.surface.brep_model import BrepModel
from tests.engine.brep.solid_documents import lower
from tests.engine.trims.test_calls import count_calls

CALLS_PER_FACE = 40
"""The library of triangulations is called face by face; here a call of Python counts, too."""


def repeat(model: BrepModel, count: int) -> BrepModel:
    """Copies of a brep side by side, as one brep."""
    shift = np.zeros((count, 3))
    shift[:, 0] = np.arange(count) * 2 * np.ptp(model.vertices[:, 0])

    def number(rows: Ints, size: int) -> Ints:
        """The rows of all copies; −1 stays."""
        return np.concatenate([np.where(rows < 0, rows, rows + k * size) for k in range(count)])

    vertices, edges, faces = len(model.vertices), len(model.edge_vertices), len(model.surfaces)
    curves, pcurves = model.curves, model.pcurves
    every = np.tile(np.arange(len(curves)), count)
    surfaces = model.surfaces.select(np.tile(np.arange(faces), count))
    curves = curves.select(every)
    curves = replace(curves, points=curves.points + shift.repeat(len(model.curves.points), axis=0))
    surfaces = replace(
        surfaces, points=surfaces.points + shift.repeat(len(model.surfaces.points), axis=0)
    )
    return replace(
        model,
        vertices=np.tile(model.vertices, (count, 1)) + shift.repeat(vertices, axis=0),
        vertex_uncertainties=np.tile(model.vertex_uncertainties, count),
        edge_vertices=number(model.edge_vertices, vertices),
        edge_curves=number(model.edge_curves, len(model.curves)),
        edge_uncertainties=np.tile(model.edge_uncertainties, count),
        is_degenerate=np.tile(model.is_degenerate, count),
        curves=curves,
        surfaces=surfaces,
        face_names=model.face_names * count,
        face_colors=np.tile(model.face_colors, count),
        is_reversed=np.tile(model.is_reversed, count),
        loop_faces=number(model.loop_faces, faces),
        loop_counts=np.tile(model.loop_counts, count),
        coedge_edges=number(model.coedge_edges, edges),
        coedge_reversed=np.tile(model.coedge_reversed, count),
        coedge_pcurves=number(model.coedge_pcurves, len(pcurves)),
        pcurves=pcurves.select(np.tile(np.arange(len(pcurves)), count)),
        shell_counts=np.tile(model.shell_counts, count),
        shell_faces=number(model.shell_faces, faces),
        is_closed=np.tile(model.is_closed, count),
    )


@pytest.mark.parametrize("name", ["cylinder", "frustum"])
def test_calls_do_not_depend_on_the_number_of_edges(name: str) -> None:
    model = lower(read_solid(name))
    goal, limits = Goal(1e-2 * prepare(model).diagonal), MeshLimits(100_000, Effort())
    calls = []
    for count in (2, 6):
        copies = repeat(model, count)
        prepared = prepare(copies)
        steps = partial(prepare_anew, copies), partial(triangulate_brep, prepared, goal, limits)
        calls.append([count_calls(step) for step in steps])
    (few_prepared, few), (many_prepared, many) = calls
    assert few_prepared == many_prepared
    assert many - few <= CALLS_PER_FACE * 4 * len(model.surfaces)
