"""Requests for checks: meshes as lists and as files, options in documents and in queries."""

from base64 import b64encode
from typing import Any, get_args

import numpy as np
import pytest

from service.decoders.mesh_registry import MESH_BY_NAME
from service.engine.mesh_checks.query import CheckQuery
from service.errors import InvalidRequest
from service.schemas.check import CheckRequest, MeshFile, MeshFormat
from service.schemas.query import values_from_text
from service.schemas.validation import validate_document
from service.storage.canonical import canonical_request

SURFACE = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
MESH = {"vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "faces": [[0, 1, 2, 3]]}
FILE = {"file": b64encode(b"OFF").decode(), "format": "off"}


def read(mesh: Any, **fields: Any) -> CheckRequest:
    return validate_document(CheckRequest, {"surface": SURFACE, "mesh": mesh, **fields})


def test_lists_become_triangles_along_the_diagonal() -> None:
    mesh = read(MESH).to_mesh()
    assert mesh is not None
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    other = read(MESH, quad_diagonal="13")
    mesh = other.to_mesh()
    assert mesh is not None
    assert mesh.triangles.tolist() == [[0, 1, 3], [1, 2, 3]]
    assert mesh is other.to_mesh()
    assert other.to_query() == CheckQuery()


def test_a_file_is_base64_or_bytes_and_not_read_here() -> None:
    for file in (FILE, FILE | {"file": b"OFF"}):
        request = read(file)
        assert isinstance(request.mesh, MeshFile)
        assert (request.mesh.file, request.mesh.format) == (b"OFF", "off")
        assert request.to_mesh() is None
        assert request.build() is request.to_surface()


def test_every_format_of_meshes_has_its_name() -> None:
    assert set(get_args(MeshFormat)) == set(MESH_BY_NAME)


@pytest.mark.parametrize(
    ("mesh", "code", "pointer"),
    [
        (FILE | {"file": "T0Z"}, "wrong_value", "/mesh/file"),
        (FILE | {"file": "T0ZG\n"}, "wrong_value", "/mesh/file"),
        (FILE | {"file": [1]}, "wrong_type", "/mesh/file"),
        (FILE | {"name": "lid"}, "unknown_field", "/mesh/name"),
        (MESH | FILE, "unknown_field", "/mesh/file"),
        (MESH | {"vertices": [[0, 0, 1e39]] * 4}, "coordinate_too_large", "/mesh/vertices/0/2"),
        ([], "wrong_type", "/mesh"),
    ],
)
def test_wrong_meshes_are_refused(mesh: Any, code: str, pointer: str) -> None:
    with pytest.raises(InvalidRequest) as refusal:
        read(mesh).build()
    issue = refusal.value.issues[0]
    assert (issue.code, issue.pointer) == (code, pointer)


def test_a_query_has_the_values_of_a_document() -> None:
    pairs = [("relative_tolerance", "0.02"), ("distances", "true"), ("quad_diagonal", "02")]
    options = values_from_text(pairs)
    assert options == {"relative_tolerance": 0.02, "distances": True, "quad_diagonal": "02"}
    assert read(MESH, **options).to_query() == CheckQuery(0.02, distances=True)


def test_equal_requests_have_equal_contents() -> None:
    arrays = {"vertices": np.array(MESH["vertices"], float), "faces": np.array(MESH["faces"])}
    assert canonical_request(read(MESH)) == canonical_request(read(arrays, distances=False))
    contents = {
        canonical_request(request)
        for request in (
            read(MESH),
            read(MESH, quad_diagonal="13"),
            read(MESH, relative_tolerance=0.2),
            read(FILE),
            read(FILE | {"format": "stl"}),
            read(FILE | {"file": "T0ZH"}),
        )
    }
    assert len(contents) == 6
