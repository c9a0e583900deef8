"""Breps for files: faces without loops get natural borders, and loops of pcurves get edges."""

from typing import Any

import numpy as np
import pytest

from oracles.solids import read_solid
from service.engine.brep.preparation.prepare import prepare
from service.engine.outlines.complete import MOST, complete
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.brep_model import BrepModel


def lower(document: dict[str, Any]) -> BrepModel:
    model = validate_document(MeshRequest, {"surface": document}).to_surface().lower()
    assert isinstance(model, BrepModel)
    return model


def drop_edges(document: dict[str, Any], *, keeps_loops: bool) -> dict[str, Any]:
    """The faces alone: with loops that are parameter curves, or without loops."""
    for face in document["faces"]:
        for loop in face.get("loops", ()):
            del loop["edges"]
        if not keeps_loops:
            face.pop("loops", None)
    shells = [shell | {"closed": False} for shell in document["shells"]]
    document.pop("vertex_uncertainties")
    return document | {"vertices": [], "edges": [], "shells": shells}


def check_complete(model: BrepModel) -> None:
    """All faces have loops, all loops edges, and the parameter curves follow the edges."""
    assert set(model.loop_faces.tolist()) == set(model.shell_faces.tolist())
    assert (model.coedge_edges >= 0).all()
    assert np.isin(np.arange(len(model.vertices)), model.edge_vertices).all()
    prepared = prepare(model)
    assert not prepared.skipped_faces
    assert not prepared.is_replaced.any()


@pytest.mark.parametrize(("name", "seams", "poles"), [("sphere", 1, 2), ("torus", 2, 0)])
def test_whole_surfaces_get_their_borders_seams_and_poles(
    name: str, seams: int, poles: int
) -> None:
    whole = complete(lower(drop_edges(read_solid(name), keeps_loops=False)))
    check_complete(whole)
    assert len(whole.edge_vertices) == seams + poles
    assert np.count_nonzero(whole.is_degenerate) == poles


@pytest.mark.parametrize("name", ["cylinder", "gear", "impeller", "tee", "ellip"])
def test_loops_of_parameter_curves_get_edges(name: str) -> None:
    document = drop_edges(read_solid(name), keeps_loops=True)
    loops = [loop for face in document["faces"] for loop in face.get("loops", ())]
    model = lower(document)
    whole = complete(model)
    check_complete(whole)
    assert len(whole.edge_vertices) == sum(len(loop["pcurves"]) for loop in loops)
    # Curves of high degrees are not exact compositions: readers do not like them.
    assert whole.curves.degrees.max() <= max(MOST, model.surfaces.degrees.max())


def test_breps_that_are_complete_stay_as_they_are() -> None:
    model = lower(read_solid("plate"))
    assert complete(model) is model
