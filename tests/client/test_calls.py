"""Every call of the client, at a service and without one: the same answers, and the same errors."""

import asyncio
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

import httpx
import numpy as np
import pytest

from service.client import (
    AsyncClient,
    Client,
    Local,
    Mesh,
    Part,
    Picture,
    ServiceError,
    bezier,
    bspline,
)
from service.client.bodies import MAX_JSON_NET, NPY, build_request
from service.client.fields import Planes, Rays
from service.client.records import Answer
from tests.cad import TETRAHEDRON

AnyClient: TypeAlias = Client | Local

NET = np.arange(48.0).reshape(4, 4, 3) ** 1.5 % 7
PATCH = bezier(NET, name="patch")
QUARTER = {"control_points": [[1, 0], [1, 1], [0, 1]], "weights": [1, 0.5**0.5, 1]}
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.1]])
RAYS: Rays = {"origins": np.array([[0, 0, 5.0], [0, 3, 5]]), "directions": np.array([[0, 0, -1.0]])}
PLANES: Planes = {"normals": [[0, 0, 1]], "offsets": [0.25]}

PARTS: dict[str, Part[Any]] = {
    "a mesh of a patch": Client.mesh.part(PATCH, resolution=(3, 5), overlays=["control_net"]),
    "a mesh by id": Client.mesh.part("utah-teapot", faces="quads", resolution=3, uvs=True),
    "a mesh by id with a camera": Client.mesh.part(
        "saddle",
        camera={"position": [4, 3, 9], "field_of_view": 0.8, "height": 1080},
        pixel_tolerance=0.5,
    ),
    "a picture of a patch": Client.image.part(PATCH, width=40, height=30, control_net=True),
    "a picture by id": Client.image.part(
        "saddle", width=40, height=30, position=np.array([3.0, 4, 5]), target=[0, 0, 0]
    ),
    "points of a patch": Client.points.part(PATCH, uv=[[0.5, 0.25]], derivatives=2),
    "points by id": Client.points.part("sphere", uv=np.array([[0, 1.0]]), patch=[3]),
    "a curve": Client.curve.part(QUARTER, resolution=4),
    "closest points": Client.project.part(PATCH, points=NET[0], relative_tolerance=1e-6),
    "closest points by id": Client.project.part("sphere", points=NET[0], sign=True),
    "closest points of a curve": Client.project.part(curve=QUARTER, points=[[2, 2]]),
    "rays": Client.intersect.part("sphere", rays=RAYS, hits="all"),
    "sections": Client.intersect.part(PATCH, planes=PLANES),
    "measures": Client.measure.part("sphere", tolerance=1e-3),
    "a check of arrays": Client.check.part(PATCH, (TRIANGLE, [[0, 1, 2]]), distances=True),
    "a check by id": Client.check.part("saddle", (TRIANGLE, np.array([[0, 1, 2]]))),
    "a conversion": Client.convert.part(PATCH, operations=[{"op": "elevate", "degree": 5}]),
    "an estimate": Client.estimate.part(PATCH, resolution=7),
}


@pytest.fixture(scope="module")
def client(server: str) -> Iterator[Client]:
    with Client(server) as client:
        yield client


@pytest.fixture(params=["Client", "Local"])
def either(request: pytest.FixtureRequest, client: Client) -> AnyClient:
    return client if request.param == "Client" else Local()


def flatten(answer: Any) -> Any:
    """The whole content of an answer."""
    if isinstance(answer, Picture):
        return bytes(answer)
    return answer.content if isinstance(answer, Mesh) else answer.to_dict()


@pytest.mark.parametrize("title", PARTS)
def test_answers_are_the_same_with_and_without_a_server(client: Client, title: str) -> None:
    part = PARTS[title]
    answer, local = client.perform(part), Local().perform(part)
    assert flatten(answer) == flatten(local)


def test_the_asynchronous_client_gives_the_same_answers(client: Client, server: str) -> None:
    async def ask() -> list[Any]:
        async with AsyncClient(server) as asynchronous:
            return await asyncio.gather(*map(asynchronous.perform, PARTS.values()))

    answers = asyncio.run(ask())
    assert list(map(flatten, answers)) == [flatten(client.perform(p)) for p in PARTS.values()]


def test_columns_are_arrays_and_missing_fields_are_none(either: AnyClient) -> None:
    points = either.points(PATCH, uv=[[0.5, 0.25], [0, 1]])
    assert points.positions.shape == (2, 3)
    assert points.degenerate is not None
    assert points.degenerate.dtype == np.bool_
    assert points.duu is None
    with pytest.raises(AttributeError, match="Points has no field 'dw'"):
        points.dw  # type: ignore[attr-defined] # noqa: B018
    measures = either.measure(PATCH)
    assert measures.area.low <= measures.area.value <= measures.area.high
    assert measures.volume is None
    assert measures.boundaries[0].length.value > 0
    far: Planes = {"normals": [[0, 0, 1]], "offsets": [99]}
    sections = either.intersect(PATCH, planes=far).sections
    assert sections is not None
    assert sections[0].polylines == []


def test_a_mesh_has_arrays(either: AnyClient) -> None:
    mesh = either.mesh("utah-teapot", resolution=4, overlays=["control_net", "boundary"])
    assert mesh.vertices.dtype == np.float64
    assert mesh.normals is not None
    assert mesh.normals.shape == mesh.vertices.shape
    assert mesh.welded_faces.max() < len(mesh.vertices)
    assert [line.name for line in mesh.lines] == ["control_net", "boundary"]
    assert all(line.segments.max() < len(line.vertices) for line in mesh.lines)
    assert mesh.parts[-1].faces[1] == len(mesh.faces)
    assert mesh.report.watertight is False
    assert mesh.report.closed_u is None


@pytest.mark.parametrize("faces", ["triangles", "quads"])
def test_trimesh_gets_a_closed_mesh(either: AnyClient, faces: Any) -> None:
    loaded = either.mesh("sphere", faces=faces, resolution=6).to_trimesh()
    assert loaded.is_watertight
    assert loaded.volume == pytest.approx(4.19, rel=0.05)


def test_a_picture_is_the_bytes_of_a_file_that_notebooks_show(either: AnyClient) -> None:
    part = Client.image.part("saddle", width=40, height=30)
    picture = either.perform(part)
    assert picture == picture._repr_png_() == either.file(part, "png")
    assert picture[:4] == b"\x89PNG"
    with pytest.raises(ServiceError) as raised:
        either.image("saddle", width=40, look="matt")  # type: ignore[arg-type]
    assert raised.value.errors[0].pointer == "/look"
    with pytest.raises(ServiceError):
        either.file(Client.image.part("saddle"), "glb")
    (result,) = either.job([part])
    assert result == picture


def test_answers_of_convert_and_store_are_surfaces(either: AnyClient) -> None:
    converted = either.convert(PATCH, operations=[{"op": "elevate", "degree": 5}])
    assert np.shape(converted.surface["control_net"]) == (6, 6, 3)
    stored = either.store(converted)
    for surface in (converted, stored, stored.id):
        assert either.mesh(surface, resolution=2).report.vertices == 9
    assert either.points(stored, uv=[[0, 0]]).positions.tolist() == [NET[0, 0].tolist()]


def test_files_are_surfaces(either: AnyClient, tmp_path: Path) -> None:
    np.save(tmp_path / "net.npy", NET)
    (tmp_path / "net.json").write_text(json.dumps({"surface": {"control_net": NET.tolist()}}))
    (tmp_path / "tip.STEP").write_bytes(TETRAHEDRON)
    for file in ("net.npy", "net.json"):
        assert either.mesh(tmp_path / file, resolution=4).report.vertices == 25
        assert either.points(tmp_path / file, uv=[[0, 0]]).positions.tolist() == [
            NET[0, 0].tolist()
        ]
    spline = either.mesh(tmp_path / "net.npy", type="bspline", degree=(3, 2), resolution=1)
    assert spline.report.patches == 2
    part = either.convert(tmp_path / "tip.STEP", name="tip")
    assert part.reading is not None
    assert part.surface["name"] == "tip"
    assert either.mesh(part, tolerance=0.1).report.watertight
    assert either.measure(tmp_path / "tip.STEP").closed
    with pytest.raises(ValueError, match="unknown suffix"):
        either.mesh(tmp_path / "net.txt")


def test_a_large_net_is_sent_as_an_array(client: Client) -> None:
    net = np.zeros((300, 300, 3)) + np.arange(300)[:, None, None]
    net[..., 1] = np.arange(300)
    assert net.nbytes > MAX_JSON_NET
    for weights in (None, np.ones((300, 300))):
        part = Client.store.part(bspline(net, 2, weights=weights, name="large"))
        request = build_request(part)
        assert request is not None
        assert request.media_type == NPY
        # The same surface as JSON has the same id.
        assert client.perform(part).id == Local().perform(part).id
    with_knots = bspline(net, 1, (np.linspace(0, 1, 302), np.linspace(0, 1, 302)))
    request = build_request(Client.store.part(with_knots))
    assert request is not None
    assert request.media_type != NPY


@pytest.mark.parametrize(
    ("call", "status", "code", "pointer"),
    [
        (lambda c: c.mesh(PATCH, resolution=0), 422, "out_of_range", "/resolution"),
        (
            lambda c: c.mesh({"control_net": [[[0, 0, 0]], [[0, 0, float("nan")]]]}),
            422,
            "not_finite",
            "/surface/control_net/1/0/2",
        ),
        (lambda c: c.mesh("nothing"), 404, "unknown_surface", "/id"),
        (lambda c: c.points("nothing", uv=[[0, 0]]), 404, "unknown_surface", "/id"),
        (lambda c: c.points(PATCH, uv=[["middle", 0]]), 422, "wrong_type", "/uv/0/0"),
        (lambda c: c.mesh({**PATCH, "colour": 1}), 422, "unknown_field", "/surface/colour"),
    ],
)
def test_errors_have_a_status_a_code_and_pointers(
    either: AnyClient, call: Callable[[AnyClient], object], status: int, code: str, pointer: str
) -> None:
    with pytest.raises(ServiceError) as raised:
        call(either)
    error = raised.value
    assert error.status == status
    assert [(issue.code, issue.pointer) for issue in error.errors] == [(code, pointer)]
    assert str(error).startswith(f"{pointer}: ")


def test_a_call_that_the_service_does_not_have_is_an_error(either: AnyClient) -> None:
    with pytest.raises(ServiceError) as raised:
        either.sign("/v1/surfaces/sphere", seconds=60)
    assert (raised.value.status, raised.value.code) == (404, "not_found")


def test_files_in_other_formats(either: AnyClient) -> None:
    assert either.file(Client.mesh.part("saddle", resolution=2), "glb")[:4] == b"glTF"
    assert either.file(Client.mesh.part(PATCH), "stl")
    assert either.file(Client.convert.part("cone"), "step").startswith(b"ISO-10303-21")
    with pytest.raises(ServiceError):
        either.file(Client.mesh.part(PATCH), "fbx")


def test_a_job_returns_answers_and_errors(either: AnyClient) -> None:
    states: list[str] = []
    parts = [
        Client.mesh.part("saddle", resolution=4),
        Client.mesh.part(PATCH, tolerance=1e-18),
        Client.mesh.part(PATCH, resolution=2),
    ]
    first, second, third = either.job(parts, progress=lambda state: states.append(state.state))
    assert isinstance(first, Mesh)
    assert isinstance(second, ServiceError)
    assert second.errors[0].pointer == "/tolerance"
    assert isinstance(third, Mesh)
    assert third.report.vertices == 9
    points = either.job([Client.points.part("sphere", uv=[[0, 0]], patch=0)])
    assert isinstance(points[0], Answer)


def test_a_server_that_does_not_answer_is_an_error() -> None:
    with Client("http://127.0.0.1:9", timeout=2) as client, pytest.raises(ServiceError) as raised:
        client.mesh("sphere")
    assert (raised.value.status, raised.value.code) == (0, "unreachable")
    assert isinstance(raised.value.__cause__, httpx.ConnectError)
    with pytest.raises(ValueError, match="ASCII"):
        Client("http://127.0.0.1:9", key="a key")
