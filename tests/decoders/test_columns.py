"""Columns of edges and faces from a child: they make what lists make, and are checked in form."""

from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest

from service.decoders.columns import pack_brep, unpack_brep
from service.decoders.format import FileLimits
from service.decoders.registry import BY_NAME
from service.encoders.text import json_text
from service.errors import InvalidRequest, Issue
from service.schemas.brep_writing import list_columns
from service.schemas.document import DEFAULT_LIMITS, DocumentLimits
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.content_key import content_key
from service.surface.sizes import SurfaceKind

Tree = dict[str, Any]
Change = Callable[[Tree], object]


def build(tree: Tree, limits: DocumentLimits = DEFAULT_LIMITS) -> SurfaceKind:
    return validate_document(SurfaceRequest, {"surface": tree}, limits).to_surface()


def refuse(tree: Tree, limits: DocumentLimits = DEFAULT_LIMITS) -> tuple[Issue, ...]:
    with pytest.raises(InvalidRequest) as caught:
        build(tree, limits)
    return caught.value.issues


@pytest.fixture(scope="module")
def file() -> Tree:
    content = Path("tests/cad_files/plate_faces.igs").read_bytes()
    return BY_NAME["iges"].decode(content, None, FileLimits()).tree


@pytest.fixture
def brep(file: Tree) -> Tree:
    """The document of a brep with all that columns have."""
    tree = deepcopy(file)
    faces, edges = tree["faces"], tree["edges"]
    faces[0] |= {"name": "top", "color": [0.5, 0.25, 0]}
    faces[2] |= {"color": [0.5, 0.25, 0, 0.5], "reversed": not faces[2].get("reversed", False)}
    faces[3]["color"] = faces[0]["color"]
    edges[1]["uncertainty"] = 0.001
    edges.append({"vertices": [1], "degenerate": True})
    loops = [loop for face in faces for loop in face["loops"]]
    assert any("pcurves" in loop for loop in loops)
    assert any("reversed" in loop for loop in loops)
    assert any("weights" in face["surface"] for face in faces)
    assert any("curve" not in edge for edge in edges)
    return tree


def test_columns_make_the_surface_of_the_lists(brep: Tree) -> None:
    packed = pack_brep(brep)
    columns = unpack_brep(packed)
    assert content_key(build(columns)) == content_key(build(brep))
    assert type(columns["faces"]) is not list
    for place in ("edges", "faces"):
        assert {type(value) for value in packed[place].values()} <= {np.ndarray, dict, list}


def test_lists_of_columns_make_the_same_surface(brep: Tree) -> None:
    group = {"type": "group", "definitions": [brep], "members": [{"definition": 0}]}
    columns = list_columns(group | {"definitions": [unpack_brep(pack_brep(brep))]})
    assert content_key(build(orjson.loads(json_text(columns)))) == content_key(build(group))


def test_documents_of_other_surfaces_stay() -> None:
    tree = {"type": "bezier", "control_net": [[[0, 0, 0]]]}
    assert pack_brep(tree) is tree
    assert unpack_brep(tree) is tree
    lists = {"type": "brep", "faces": [{}]}
    assert unpack_brep(lists) is lists


@pytest.mark.parametrize(
    "change",
    [
        lambda faces: faces[0]["surface"]["control_net"].__setitem__((0, 0, 0), np.nan),
        lambda faces: faces[3]["surface"]["knots"][1].__imul__(-1),
        lambda faces: faces[3]["surface"]["knots"][0].fill(np.nan),
        lambda faces: faces[0].update(color=[2, 0, 0]),
        lambda faces: faces[0].update(name="a\nb"),
    ],
)  # fmt: skip
def test_a_wrong_value_has_the_error_that_it_has_in_lists(brep: Tree, change: Change) -> None:
    change(brep["faces"])
    assert refuse(unpack_brep(pack_brep(brep))) == refuse(brep)


@pytest.mark.parametrize("limits", [DocumentLimits(max_faces=3), DocumentLimits(max_degree=1)])
def test_limits_of_documents_hold_for_columns(brep: Tree, limits: DocumentLimits) -> None:
    assert refuse(unpack_brep(pack_brep(brep)), limits) == refuse(brep, limits)


def test_no_faces_are_refused(brep: Tree) -> None:
    empty = brep | {"faces": []}
    assert refuse(unpack_brep(pack_brep(empty))) == refuse(empty)


def _cut(place: Tree, name: str) -> None:
    place[name] = place[name][:-1]


@pytest.mark.parametrize("name", ["degrees", "counts", "points", "is_rational", "weights", "knots"])
@pytest.mark.parametrize("table", ["surfaces", "pcurves", "curves"])
def test_tables_of_another_length_are_refused(brep: Tree, table: str, name: str) -> None:
    packed = pack_brep(brep)
    splines = packed["edges" if table == "curves" else "faces"][table]
    if not len(splines[name]):
        splines[name] = np.ones(1)
    else:
        _cut(splines, name)
    with pytest.raises(ValueError, match="another form"):
        unpack_brep(packed)


@pytest.mark.parametrize(
    "change",
    [
        lambda faces: _cut(faces, "names"),
        lambda faces: faces.update(names=[1] * len(faces["names"])),
        lambda faces: faces.update(names="x" * len(faces["names"])),
        lambda faces: _cut(faces, "colors"),
        lambda faces: faces["has_color"].fill(1),
        lambda faces: _cut(faces, "is_reversed"),
        lambda faces: faces["face_loops"].__setitem__(0, 1 << 40),
        lambda faces: faces["face_loops"].__setitem__(0, -1),
        lambda faces: faces["loop_counts"].__setitem__(0, 0),
        lambda faces: faces["loop_counts"].__setitem__(0, 1 << 30),
        lambda faces: faces["coedge_edges"].__setitem__(0, -1),
        lambda faces: faces.update(coedge_edges=faces["coedge_edges"].astype(np.float64)),
        lambda faces: _cut(faces, "coedge_reversed"),
        lambda faces: faces["has_pcurve"].fill(0),
        lambda faces: faces["surfaces"]["degrees"].__setitem__((0, 0), 0),
        lambda faces: faces["surfaces"]["counts"].__setitem__((0, 0), 1 << 31),
        lambda faces: faces["surfaces"].update(points=faces["surfaces"]["points"].ravel()),
        lambda faces: faces["surfaces"].update(points=None),
    ],
)
def test_faces_of_another_form_are_refused(brep: Tree, change: Change) -> None:
    packed = pack_brep(brep)
    change(packed["faces"])
    with pytest.raises(ValueError, match="another form"):
        unpack_brep(packed)


def test_edges_of_another_form_are_refused(brep: Tree) -> None:
    for name in ("vertices", "has_curve", "uncertainties", "is_degenerate"):
        packed = pack_brep(brep)
        _cut(packed["edges"], name)
        with pytest.raises(ValueError, match="another form"):
            unpack_brep(packed)
    with pytest.raises(LookupError):
        unpack_brep(pack_brep(brep) | {"edges": {}})
