"""Hostile files of meshes through HTTP: refused with a reason, or judged; never a 5xx."""

from collections.abc import Sequence

import pytest

from service.decoders.mesh_registry import MESH_BY_NAME
from tools.client import Client
from tools.hostile.meshes import ANY, MESHES, READ, HostileMesh

MALFORMED = {"malformed_body", "malformed_file"}
"""The codes of files that cannot be read: 400. All others are 422."""


def judge(client: Client, cases: Sequence[HostileMesh]) -> None:
    """Sends files to be compared with a surface, and checks the responses."""
    for case in cases:
        headers = {"Content-Type": MESH_BY_NAME[case.format].media_type}
        query = "surface=saddle&relative_tolerance=0.5"
        response = client.request("POST", f"/v1/check?{query}", case.build(), headers)
        if response.status_code == 200:
            assert case.code in {ANY, READ}, case.name
            continue
        (error,) = response.json()["errors"]
        assert case.code in {ANY, error["code"]}, (case.name, error)
        status = 400 if error["code"] in MALFORMED else 422
        assert response.status_code == status, (case.name, error)
        assert error["pointer"] == "", case.name
        assert error["got"], case.name
        assert error["needed"], case.name


def test_a_few_hostile_meshes_are_refused(client: Client) -> None:
    names = {"glb cut at 0.5", "obj as ply", "nan in STL", "nodes in a circle"}
    judge(client, [case for case in MESHES if case.name in names])


@pytest.mark.slow
def test_hostile_meshes_are_refused(client: Client) -> None:
    judge(client, MESHES[::7])
