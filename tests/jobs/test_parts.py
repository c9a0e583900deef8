"""Parts of jobs: every call's examples are parts; ids are of values; errors point into the part."""

from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import orjson
import pytest

from service.api.app import create_app
from service.api.openapi.parameters import REQUESTS
from service.errors import InvalidRequest, SurfaceError, TooLarge, UnknownSurface
from service.jobs.checks import CheckedPart, check_part
from service.jobs.parts import read_part
from service.pipeline.calls import CALLS, CallLimits
from service.pipeline.limits import Limits
from service.settings.values import Settings
from service.surface.examples.catalogue import find
from service.surface.kinds import Surface
from tools.client import Client, start_client

OPERATIONS = {
    "createMesh": "/v1/mesh",
    "createImage": "/v1/image",
    "queryPoints": "/v1/points",
    "createCurve": "/v1/curve",
    "projectPoints": "/v1/project",
    "intersectSurface": "/v1/intersect",
    "measureSurface": "/v1/measure",
    "checkMesh": "/v1/check",
    "convertSurface": "/v1/convert",
}
"""The path of each operation that may be a part."""

EXAMPLES = [
    pytest.param(path, example["value"], id=f"{path} {name}")
    for operation, path in OPERATIONS.items()
    for name, example in REQUESTS[operation].items()
]

LIMITS = CallLimits(result=Limits(max_memory=512 << 20))

SQUARE: dict[str, Any] = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with start_client(create_app(Settings())) as client:
        yield client


def find_none(_: str) -> Surface:
    raise UnknownSurface


def check(path: str, body: object = None, **fields: Any) -> CheckedPart:
    """The checked part of a path and a body."""
    document = {"path": path} | fields | ({} if body is None else {"body": body})
    return check_part(document, LIMITS, find_none)


def run(path: str, body: dict[str, Any] | None = None) -> bytes:
    """The bytes of a part's file."""
    return bytes(read_part(path, body, LIMITS).plan(find_none).run().content)


def test_every_call_can_be_a_part() -> None:
    assert set(OPERATIONS.values()) == CALLS.keys()


@pytest.mark.slow
@pytest.mark.parametrize(("path", "body"), EXAMPLES)
def test_a_part_has_the_bytes_of_the_request(
    path: str, body: dict[str, Any], client: Client
) -> None:
    response = client.post(path, body)
    assert response.status_code == 200
    assert run(path, body) == response.content


@pytest.mark.parametrize(
    "file",
    [
        "mesh.glb?resolution=3",
        "mesh.json?resolution=3",
        "mesh.stl?resolution=3",
        "image.png?width=20&height=20",
    ],
)
def test_a_part_without_a_body_has_the_bytes_of_the_url(file: str, client: Client) -> None:
    path = f"/v1/surfaces/utah-teapot/{file}"
    assert run(path) == client.get(path).content


@pytest.mark.parametrize(("path", "body"), EXAMPLES)
def test_the_id_does_not_depend_on_the_spelling(path: str, body: dict[str, Any]) -> None:
    reversed_keys = orjson.loads(orjson.dumps(body))
    reversed_keys = dict(reversed(reversed_keys.items()))
    floats = _with_floats(deepcopy(body.get("surface", {})))
    spelled = reversed_keys | ({"surface": floats} if "surface" in body else {})
    assert check(path, spelled).id == check(path, body).id
    assert check(path, body, name="another").id == check(path, body).id


def _with_floats(value: Any, key: str = "") -> Any:
    """The value with every coordinate as a number with a fraction."""
    if isinstance(value, dict):
        return {name: _with_floats(item, name) for name, item in value.items()}
    if key == "vertices" and isinstance(value, list) and type(value[0]) is int:
        return value  # the numbers of the two vertices of an edge
    if isinstance(value, list):
        inner = "control_points" if key == "vertices" else key
        return [_with_floats(item, inner) for item in value]
    is_coordinate = key in ("control_net", "control_points") and type(value) is int
    return float(value) if is_coordinate else value


def test_another_value_makes_another_id() -> None:
    moved = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1e-9]]]}
    points = {"surface": SQUARE, "uv": [[0.5, 0.5]]}
    ids = [
        check("/v1/mesh", {"surface": SQUARE}).id,
        check("/v1/mesh?format=glb", {"surface": SQUARE}).id,
        check("/v1/mesh", {"surface": moved}).id,
        check("/v1/mesh", {"surface": SQUARE, "resolution": 8}).id,
        check("/v1/mesh", {"surface": SQUARE, "resolution": [8, 9]}).id,
        check("/v1/points", points).id,
        check("/v1/points", points | {"uv": [[0.5, 0.25]]}).id,
        check("/v1/measure", {"surface": SQUARE}).id,
        check("/v1/surfaces/saddle/mesh.glb").id,
        check("/v1/surfaces/saddle/mesh.json").id,
        check("/v1/surfaces/saddle/image.png").id,
        check("/v1/surfaces/saddle/image.png?edges=true").id,
    ]
    assert len(set(ids)) == len(ids)


def test_defaults_may_be_written_out() -> None:
    plain = check("/v1/mesh", {"surface": SQUARE}).id
    assert check("/v1/mesh?format=json", {"surface": SQUARE, "resolution": [16, 16]}).id == plain
    by_url = check("/v1/surfaces/saddle/mesh.glb?resolution=8").id
    assert check("/v1/surfaces/saddle/mesh.glb?engine=4&resolution=8,8&uvs=false").id == by_url


def test_a_line_is_the_part_with_its_id() -> None:
    part = check("/v1/mesh?format=stl", {"surface": SQUARE}, name="lid")
    assert orjson.loads(part.line) == {
        "id": part.id,
        "name": "lid",
        "path": "/v1/mesh?format=stl",
        "body": {"surface": SQUARE},
    }
    assert part.memory > 0
    assert part.seconds > 0


def test_a_stored_surface_is_asked_for() -> None:
    asked = []

    def find_saddle(id: str) -> Surface:
        asked.append(id)
        surface: Surface = find("saddle").surface()
        return surface

    part = check_part({"path": f"/v1/surfaces/{'a' * 64}/mesh.glb"}, LIMITS, find_saddle)
    assert asked == ["a" * 64]
    assert part.id != check("/v1/surfaces/saddle/mesh.glb").id


@pytest.mark.parametrize(
    ("path", "body", "code", "pointer"),
    [
        ("/v1/nothing", {}, "unknown_path", "/path"),
        ("/v1/mesh", None, "unknown_path", "/path"),
        ("/v1/surfaces", None, "unknown_path", "/path"),
        ("/v1/surfaces/tea/mesh.glb", None, "unknown_path", "/path"),
        ("/v1/surfaces/saddle/mesh.zip", None, "unknown_path", "/path"),
        ("/v1/surfaces/saddle/mesh.png", None, "unknown_path", "/path"),
        ("/v1/surfaces/saddle/image.glb", None, "unknown_path", "/path"),
        ("/v1/surfaces/saddle/mesh.glb?resolution=x", None, "wrong_type", "/path"),
        ("/v1/surfaces/saddle/mesh.glb?engine=1", None, "engine_gone", "/path"),
        ("/v1/surfaces/saddle/mesh.glb", {}, "unknown_path", "/path"),
        ("/v1/mesh?format=zip", {"surface": SQUARE}, "unknown_format", "/path"),
        ("/v1/curve?format=stl", {"curve": {}}, "unsupported_by_format", "/path"),
        ("/v1/mesh?resolution=4", {"surface": SQUARE}, "unknown_field", "/path"),
        ("/v1/points?format=json", {"surface": SQUARE}, "unknown_field", "/path"),
        ("/v1/mesh?format=glb&format=glb", {"surface": SQUARE}, "repeated_key", "/path"),
        ("/v1/mesh", {"surface": SQUARE, "x": 1}, "unknown_field", "/body/x"),
        ("/v1/mesh", {"surface": {}}, "missing_field", "/body/surface/control_net"),
        (
            "/v1/mesh?format=stl",
            {"surface": SQUARE, "faces": "quads"},
            "unsupported_by_format",
            "/body/faces",
        ),
        (
            "/v1/mesh",
            {"surface": SQUARE, "resolution": 60_000},
            "too_many_vertices",
            "/body/resolution",
        ),
    ],
)
def test_errors_point_into_the_part(
    path: str, body: dict[str, Any] | None, code: str, pointer: str
) -> None:
    with pytest.raises(SurfaceError) as caught:
        check(path, body)
    assert [(issue.code, issue.pointer) for issue in caught.value.issues] == [(code, pointer)]


def test_a_surface_that_is_not_stored_is_an_error_of_the_path() -> None:
    with pytest.raises(UnknownSurface):
        check(f"/v1/surfaces/{'0' * 64}/mesh.glb")


def test_the_memory_of_a_part_is_limited() -> None:
    limits = CallLimits(result=Limits(max_memory=1 << 20))
    with pytest.raises(TooLarge):
        check_part({"path": "/v1/surfaces/utah-teapot/mesh.glb"}, limits, find_none)


@pytest.mark.parametrize("document", [None, [], "x", {}, {"path": 1}, {"path": "/v1/mesh", "x": 1}])
def test_other_documents_than_parts_are_refused(document: object) -> None:
    with pytest.raises(InvalidRequest):
        check_part(document, LIMITS, find_none)
