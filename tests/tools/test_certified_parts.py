"""Some of the parts that `make certify` judges, and whether its checks detect faults."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from oracles.brep_documents import read_curve, read_surface
from oracles.coedges import read_edge
from service.api.app import create_app
from service.settings.values import Settings
from tools.certify.part_judge import (
    PartFinding,
    check_cracks,
    check_distances,
    judge_document,
    judge_part,
)
from tools.certify.parts import PARTS, build_part
from tools.certify.written import Written, read_file
from tools.client import Client, start_client

SAMPLES = 6, 30


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with start_client(create_app(Settings())) as client:
        yield client


def test_there_are_more_than_a_thousand_parts_each_the_same_every_time() -> None:
    assert sum(family.size for family in PARTS.values()) >= 1000
    for name in PARTS:
        first, second, other = build_part(name, 3), build_part(name, 3), build_part(name, 4)
        assert first == second
        assert first.document != other.document


@pytest.mark.parametrize("name", PARTS)
def test_true_parameter_curves_lie_on_the_edges(name: str) -> None:
    part = build_part(name, 5)
    truth = part.truth or part.document
    share = np.linspace(0, 1, 9)
    for face in truth["faces"]:
        net = read_surface(face["surface"])
        for loop in face["loops"]:
            for edge, pcurve in zip(loop.get("edges", []), loop["pcurves"], strict=False):
                curves = read_edge(truth, edge), read_curve(pcurve)
                space, plane = (
                    c.at((1 - share) * c.domain[0] + share * c.domain[1]) for c in curves
                )
                points = net.at(np.clip(plane.astype(float), *net.domain.T))
                size = max(net.diagonal, float(np.abs(net.points).max()))
                assert np.abs(points - space).max() <= 1e-13 * size


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in PARTS if name != "many holes"])
def test_parts_have_no_cracks_and_deviations_are_within_bounds(client: Client, name: str) -> None:
    assert judge_part(client, name, 2, SAMPLES).faults == []


def write_cylinder(client: Client) -> tuple[Written, float]:
    part = build_part("cut cylinders", 0)
    request = {"surface": part.document, "relative_tolerance": 0.01, "normals": False}
    response = client.post("/v1/mesh?format=json", request)
    mesh = read_file("json", response.content)
    return mesh, float(mesh.report["deviation_bound"])


def test_a_crack_a_missing_triangle_and_a_moved_vertex_are_detected(client: Client) -> None:
    part = build_part("cut cylinders", 0)
    mesh, bound = write_cylinder(client)
    normals = np.cross(
        mesh.corners[:, 1] - mesh.corners[:, 0], mesh.corners[:, 2] - mesh.corners[:, 0]
    )
    largest = int(np.linalg.norm(normals, axis=1).argmax())
    missing = replace(mesh, faces=np.delete(mesh.faces, largest, axis=0))
    vertices = mesh.vertices.copy()
    step = normals[largest] / np.linalg.norm(normals[largest])
    vertices[mesh.faces[largest]] -= 3 * bound * step
    moved = replace(mesh, vertices=vertices)
    finding = PartFinding(kind="cut cylinders", seed=0)
    check_cracks(finding, part, mesh, bound)
    check_distances(finding, part, mesh, bound, (40, 400))
    assert finding.faults == []
    check_cracks(finding, part, missing, bound)
    assert "3 edges without their reverse" in finding.faults
    for wrong in (missing, moved):
        finding.faults.clear()
        check_distances(finding, part, wrong, bound, (400, 4000))
        assert "deviation" in finding.faults[0]


def test_a_refused_part_is_a_fault(client: Client) -> None:
    part = build_part("plates", 1)
    part.document["edges"][0]["vertices"] = [0, 99999]
    (fault,) = judge_document(client, part, kind="plates", seed=1).faults
    assert fault.startswith("422")
