"""Meshes of groups with definitions: limits of copies, files, reports and costs."""

from typing import Any

import numpy as np
import orjson
import pytest

from oracles.gltf import read_glb
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.errors import InvalidRequest, TooLarge
from service.pipeline.documents import plan_definition
from service.pipeline.estimate import plan_estimate
from service.pipeline.limits import Limits
from service.pipeline.mesh import plan_mesh, render
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.storage.canonical import plan_content
from service.surface.group import GroupSurface
from tests.breps import PLATE, build_box

OPTIONS = MeshOptions(accuracy=Accuracy(tolerance=0.01))


def read(document: dict[str, Any]) -> GroupSurface:
    surface = validate_document(SurfaceRequest, {"surface": document}).to_surface()
    assert isinstance(surface, GroupSurface)
    return surface


def build_copies(count: int, definition: dict[str, Any] = PLATE, **fields: Any) -> GroupSurface:
    """Copies of a brep in a row, below one member."""
    members: list[dict[str, Any]] = [{"name": "row", "color": [0, 1, 0]}]
    for k in range(count):
        matrix = np.eye(4)
        matrix[0, 3] = 20 * k
        members.append({"definition": 0, "parent": 0, "matrix": matrix, "name": f"copy{k}"})
    return read({"type": "group", "definitions": [definition], "members": members, **fields})


def test_placed_faces_are_counted_first() -> None:
    """Each copy counts, in every format, before anything is placed."""
    group = build_copies(30)
    for fmt in FORMATS:
        with pytest.raises(TooLarge) as caught:
            plan_mesh(group, OPTIONS, fmt, limits=Limits(max_placed_faces=29))
        assert caught.value.issues[0].code == "too_many_placed_faces"
    plan_mesh(group, OPTIONS, BY_NAME["glb"], limits=Limits(max_placed_faces=30))


def test_formats_with_nodes_take_sixteen_times_as_many_vertices() -> None:
    """In glTF the mesh is stored once, in other formats for each copy."""
    group = build_copies(64)
    content = render(group, OPTIONS, BY_NAME["glb"])
    report = orjson.loads(render(group, OPTIONS, BY_NAME["json"]))["report"]
    vertices = report["vertices"]
    limits = Limits(max_vertices=vertices // 8)
    assert render(group, OPTIONS, BY_NAME["glb"], limits=limits) == content
    with pytest.raises(TooLarge) as caught:
        render(group, OPTIONS, BY_NAME["obj"], limits=limits)
    assert caught.value.issues[0].code in ("too_many_vertices", "too_many_triangles")
    with pytest.raises(TooLarge):
        render(group, OPTIONS, BY_NAME["glb"], limits=Limits(max_vertices=vertices // 20))


def test_a_budget_of_triangles_is_for_all_copies() -> None:
    group = build_copies(20)
    budget = MeshOptions(accuracy=Accuracy(max_triangles=2000))
    content = render(group, budget, BY_NAME["glb"])
    report = read_glb(content).document["asset"]["extras"]["report"]
    assert report["triangles"] <= 2000
    small = MeshOptions(accuracy=Accuracy(max_triangles=100))
    with pytest.raises(InvalidRequest) as caught:
        render(group, small, BY_NAME["glb"])
    assert caught.value.issues[0].code == "budget_too_small"


@pytest.mark.parametrize("name", BY_NAME)
def test_files_are_within_their_bounds(name: str) -> None:
    """Also names of all faces of all copies, with those of their members."""
    fmt = BY_NAME[name]
    group = build_copies(40, build_box() | {"name": "box"}, name="n" * 100, metres_per_unit=0.0254)
    work = plan_mesh(group, OPTIONS, fmt)
    content = work.run().content
    estimate = orjson.loads(plan_estimate(group, OPTIONS, EncodeOptions(), formats=[fmt]).run())
    assert len(content) <= estimate["bytes"][name]


def test_the_report_repeats_the_unit_and_lists_skipped_faces_once() -> None:
    """The copies of one brep have the same invalid faces."""
    face = PLATE["faces"][0]
    broken = face | {"loops": [{"edges": [0, 2]}], "name": "broken"}
    document = PLATE | {"faces": [face, broken], "invalid_faces": "skip"}
    document = {key: value for key, value in document.items() if key != "shells"}
    group = build_copies(3, document, metres_per_unit=0.001)
    report = orjson.loads(render(group, OPTIONS, BY_NAME["json"]))["report"]
    assert report["metres_per_unit"] == 0.001
    assert [each["face"] for each in report["skipped_faces"]] == [1]
    plain = build_copies(1)
    assert "metres_per_unit" not in orjson.loads(render(plain, OPTIONS, BY_NAME["json"]))["report"]


def test_a_single_brep_has_its_unit() -> None:
    """Only the root's scale in glTF uses it."""
    brep = validate_document(SurfaceRequest, {"surface": PLATE | {"metres_per_unit": 0.5}})
    plain = validate_document(SurfaceRequest, {"surface": PLATE})
    gltf, other = (
        read_glb(render(each.to_surface(), OPTIONS, BY_NAME["glb"])) for each in (brep, plain)
    )
    root, plain_root = gltf.document["nodes"][0], other.document["nodes"][0]
    assert root == plain_root | {"scale": [0.5] * 3}
    report = gltf.document["asset"]["extras"]["report"]
    assert report.pop("metres_per_unit") == 0.5
    assert report == other.document["asset"]["extras"]["report"]
    assert gltf.document["nodes"][1:] == other.document["nodes"][1:]


def test_definitions_are_written_once() -> None:
    """The cost of a document does not grow with the copies of a surface."""
    few, many = build_copies(2), build_copies(2000)
    for plan in (plan_definition, plan_content):
        small, large = plan(few).cost.memory, plan(many).cost.memory
        assert large - small < 2000 * 3 * 2000
    assert len(plan_definition(many).run()) < plan_definition(many).cost.memory


@pytest.mark.slow
def test_faces_of_very_many_copies_are_not_listed() -> None:
    """A report lists 10,000 faces at most; the plan knows this."""
    group = build_copies(10_001)
    content = render(group, OPTIONS, BY_NAME["glb"])
    report = read_glb(content).document["asset"]["extras"]["report"]
    assert "parts" not in report
    few = orjson.loads(render(build_copies(3), OPTIONS, BY_NAME["json"]))
    assert [each["name"] for each in few["report"]["parts"]] == [
        "row/copy0", "row/copy1", "row/copy2"
    ]  # fmt: skip


def test_an_invalid_brep_is_named_by_its_definition() -> None:
    """The pointer leads to the definition of the request, not to the member."""
    crossing = PLATE["faces"][0] | {"loops": [{"edges": [0, 1, 2, 3]}, {"edges": [4]}]}
    document = PLATE | {"faces": [crossing]}
    group = read(
        {
            "type": "group",
            "definitions": [PLATE, document],
            "members": [{"name": "a"}, {"definition": 1, "parent": 0}],
        }
    )
    with pytest.raises(InvalidRequest) as caught:
        render(group, OPTIONS, BY_NAME["glb"])
    assert caught.value.issues[0].pointer.startswith("/surface/definitions/1/faces/0")
