"""The ways to say which mesh is judged, and how each is sent."""

from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest
import trimesh

from service.client import Client, Local, Mesh, ServiceError
from service.client.answers import MeshReport
from service.client.bodies import JSON, Request, build_request
from service.client.given_mesh import MAX_LISTS, MeshFile, read_mesh, write_file

VERTICES = np.array([[0, 0, 0.25], [1, 0, 0.25], [1, 1, 0.25], [0, 1, 1 / 3]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
SQUARE = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
OFF = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


def build(surface: Any, mesh: Any, **fields: Any) -> Request:
    request = build_request(Client.check.part(surface, mesh, **fields))
    assert request is not None
    return request


def build_mesh(faces: Any, normals: Any = None) -> Mesh:
    return Mesh(VERTICES, faces, normals, None, None, {}, None, (), (), MeshReport({}), b"")


def test_arrays_beside_a_definition_are_lists() -> None:
    request = build(SQUARE, (VERTICES, TRIANGLES), distances=True)
    assert (request.url, request.media_type) == ("/v1/check", JSON)
    mesh = {"vertices": VERTICES.tolist(), "faces": TRIANGLES.tolist()}
    assert orjson.loads(request.content) == {"surface": SQUARE, "mesh": mesh, "distances": True}


def test_beside_an_id_a_mesh_is_a_file() -> None:
    request = build("saddle", (VERTICES, TRIANGLES), quad_diagonal="13")
    assert request.query == {"surface": "saddle", "quad_diagonal": "13"}
    assert request.media_type == "model/x-ply"
    read = trimesh.load_mesh(trimesh.util.wrap_as_stream(request.content), "ply", process=False)
    assert np.array_equal(read.vertices, VERTICES)
    assert np.array_equal(read.faces, TRIANGLES)
    # What cannot be written, or is wrong, goes with the definition: the service says what it is.
    for faces in ([[0, 1, 2, 3]], [[0, 1, 9]], [[0, 1, 2], [0, 1, 2, 3]], [[0.5, 1, 2]], []):
        assert build_request(Client.check.part("saddle", (VERTICES, faces))) is None


def test_large_meshes_are_files_in_the_document() -> None:
    triangles = np.tile(TRIANGLES, (MAX_LISTS // 2, 1))
    mesh = orjson.loads(build(SQUARE, (VERTICES, triangles)).content)["mesh"]
    assert mesh.keys() == {"file", "format"}
    assert mesh["format"] == "ply"


def test_files_are_sent_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "mesh.OFF"
    path.write_bytes(OFF)
    request = build("saddle", path)
    assert (request.content, request.media_type) == (OFF, "model/x-off")
    assert build("saddle", {"file": OFF, "format": "off"}) == request
    document = orjson.loads(build(SQUARE, path).content)
    assert document["mesh"] == MeshFile(OFF, "off").to_document()
    (tmp_path / "mesh.json").write_bytes(orjson.dumps({"vertices": [], "faces": []}))
    assert read_mesh(tmp_path / "mesh.json") == {"vertices": [], "faces": []}
    with pytest.raises(ValueError, match=r"mesh\.step is not known"):
        read_mesh(tmp_path / "mesh.step")
    with pytest.raises(ValueError, match="the format is not known"):
        read_mesh({"file": OFF})


def test_meshes_of_this_client_keep_their_normals_and_quads() -> None:
    quads = np.array([[0, 1, 2, 2], [0, 1, 2, 3]], np.uint32)
    normals = np.tile(np.array([0, 0, 1], np.float32), (4, 1))
    given = read_mesh(build_mesh(quads, normals))
    assert isinstance(given, dict)
    assert given["faces"] == [[0, 1, 2], [0, 1, 2, 3]]
    assert given["normals"].tolist() == normals.tolist()
    file = write_file({"vertices": VERTICES, "normals": normals, "faces": TRIANGLES})
    assert file is not None
    assert b"property double nz" in file.content


def test_meshes_of_trimesh_and_files_have_the_same_answer(tmp_path: Path) -> None:
    local = Local()
    arrays = local.check(SQUARE, (VERTICES, TRIANGLES))
    of_trimesh = trimesh.Trimesh(VERTICES, TRIANGLES, process=False)
    of_trimesh.export(tmp_path / "mesh.ply")
    for mesh in (of_trimesh, build_mesh(TRIANGLES), (VERTICES.tolist(), TRIANGLES.tolist())):
        assert local.check(SQUARE, mesh).to_dict() == arrays.to_dict()
    from_file = local.check(SQUARE, tmp_path / "mesh.ply")
    assert from_file.surface_to_mesh.high == pytest.approx(arrays.surface_to_mesh.high, rel=0.1)
    assert (from_file.triangles, from_file.open_edges) == (2, 4)


def test_columns_of_an_answer_are_arrays() -> None:
    answer = Local().check(SQUARE, (VERTICES, TRIANGLES), distances=True)
    assert answer.distances is not None
    assert answer.distances.shape == (4,)
    assert answer.middle_distances is not None
    assert answer.middle_distances.shape == (len(TRIANGLES),)
    assert answer.mesh is not None
    assert np.array_equal(answer.mesh.faces, TRIANGLES)
    assert answer.mesh_to_surface.low <= 1 / 3 <= answer.mesh_to_surface.high
    assert answer.mesh_to_surface.point.shape == (3,)
    assert answer.limit is None


def test_wrong_meshes_are_refused_with_their_places() -> None:
    with pytest.raises(ServiceError) as refusal:
        Local().check("saddle", (VERTICES, [[0, 1, 9]]))
    assert refusal.value.errors[0].pointer == "/mesh/faces/0/2"
