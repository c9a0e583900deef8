"""Meshes a generated part over HTTP, and compares the mesh with the faces of the part.

The mesh must have no crack: each directed edge occurs as often as its reverse, except along the
free edges of open parts. Points that the winding numbers of the original loops put on the faces
must be within the reported bound of the mesh.
"""

import time
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from oracles.brep_documents import Array, read_surface
from oracles.breps import (
    FaceSamples,
    count_cracks,
    list_free_edges,
    measure_to_mesh,
    sample_face,
)
from oracles.coedges import iterate_coedges
from oracles.distance import Soup
from oracles.regions import find_closed
from tools.certify.part_documents import Document, Part
from tools.certify.parts import build_part
from tools.certify.table import Finding
from tools.certify.written import Written, read_file
from tools.client import Client

SAMPLES = 40, 400
"""Least number of samples of a face, and the number that all faces of a part share."""

COARSEST = 0.02
"""The service meshes no brep more coarsely than this share of its diagonal."""

OWN_GAPS = 0.05
"""Gaps of at most this share of the tolerance must not keep a mesh from reaching it."""

MAX_FACES = 60
"""Most faces of a part that are sampled, at random."""

MAX_TRIANGLES = 400_000
"""Parts with more triangles are judged without distances."""


@dataclass
class PartFinding(Finding):
    """The findings about the mesh of a part; `gap` is the reported bound of its gaps."""

    gap: float = 0.0

    def __str__(self) -> str:
        return f"part {self.kind} {self.seed} at {self.tolerance:g}"


def judge_part(
    client: Client, kind: str, seed: int, samples: tuple[int, int] = SAMPLES
) -> PartFinding:
    """The findings about the mesh of a part of a family."""
    return judge_document(client, build_part(kind, seed), kind=kind, seed=seed, samples=samples)


def judge_document(
    client: Client, part: Part, *, kind: str, seed: int, samples: tuple[int, int] = SAMPLES
) -> PartFinding:
    """The findings about the mesh of a part."""
    finding = PartFinding(kind=kind, seed=seed, tolerance=part.relative)
    request: Document = {"surface": part.document, "normals": False}
    if part.relative <= 1:
        request["relative_tolerance"] = part.relative
    else:
        request["tolerance"] = part.relative * measure_diagonal(part.document)
    start = time.process_time()
    response = client.post("/v1/mesh?format=json", request)
    finding.seconds = time.process_time() - start
    if response.status_code != 200:
        finding.faults.append(f"{response.status_code}: {response.text[:400]}")
        return finding
    mesh = read_file("json", response.content)
    finding.triangles = len(mesh.faces)
    finding.bound = float(mesh.report.get("deviation_bound", np.nan))
    finding.gap = float(mesh.report.get("gap_bound") or 0.0)
    if not finding.triangles or np.isnan(finding.bound):
        finding.faults.append(f"{finding.triangles} triangles, bound {finding.bound}")
        return finding
    allowed = finding.bound + finding.gap + part.slack
    check_cracks(finding, part, mesh, allowed)
    check_report(finding, mesh, measure_diagonal(part.document))
    if finding.triangles <= MAX_TRIANGLES:
        check_distances(finding, part, mesh, allowed, samples)
    return finding


def measure_diagonal(document: Document) -> float:
    """The diagonal of the box of all vertices and control points."""
    points = [np.array(face["surface"]["control_net"]).reshape(-1, 3) for face in document["faces"]]
    curves = [edge["curve"] for edge in document["edges"] if "curve" in edge]
    points += [np.array(curve["control_points"]) for curve in curves]
    points.append(np.array(document["vertices"]).reshape(-1, 3))
    return float(np.linalg.norm(np.ptp(np.concatenate(points), axis=0)))


def check_report(finding: PartFinding, mesh: Written, largest_diagonal: float) -> None:
    """Adds faults if the tolerance was not reached, or if the report is not complete.

    The diagonal of a part is at least that of its mesh, and at most `largest_diagonal`. Afterwards
    `tolerance` is absolute, with the former.
    """
    diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    finding.tolerance *= diagonal
    share = min(COARSEST, finding.tolerance / diagonal)
    # Where the gaps of the file are larger, the tolerance may be out of reach.
    has_gaps = finding.gap > OWN_GAPS * share * diagonal
    if not mesh.report.get("reached", False) and not has_gaps:
        finding.faults.append(f"not reached: bound {finding.bound}, gap {finding.gap}")
    largest = 1.1 * share * largest_diagonal + (2 * finding.gap if has_gaps else 0)
    if not finding.bound + finding.gap <= largest:
        finding.faults.append(f"bound {finding.bound} and gap {finding.gap} above {largest}")
    if not mesh.report.get("complete", False) or mesh.report.get("skipped_faces"):
        finding.faults.append("not complete")


def check_cracks(finding: PartFinding, part: Part, mesh: Written, allowed: float) -> None:
    """Adds a fault if a directed edge has no reverse, except near the free edges of open parts."""
    cracks = count_cracks(mesh.vertices, mesh.faces.astype(np.intp))
    has_more = mesh.report.get("non_manifold_edges") or mesh.report.get("double_edges")
    if mesh.report.get("watertight") is not (not cracks) and not has_more:
        finding.faults.append(f"watertight is {mesh.report.get('watertight')}")
    if part.is_closed:
        if cracks:
            finding.faults.append(f"{len(cracks)} edges without their reverse")
        return
    border = list_border_points(part.truth or part.document)
    soup = Soup(np.stack([border[:-1], border[1:], border[1:]], axis=1))
    rows = np.unique(np.array(cracks, dtype=np.intp))
    distances = soup.distances(mesh.vertices[rows]) if len(rows) else np.zeros(0)
    far = distances > allowed + 1e-3 * max(finding.tolerance, allowed)
    size = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    if (far & (distances > 1e-2 * size)).any():
        finding.faults.append(f"{int(far.sum())} vertices of cracks inside of faces")


def list_border_points(document: Document) -> Array:
    """Points along the free edges, loops without edges, and natural borders of a document."""
    points = [spline.at(np.linspace(*spline.domain, 200)) for spline in list_free_edges(document)]
    for face in document["faces"]:
        net = read_surface(face["surface"])
        low, high = net.domain.T
        is_closed = find_closed(net)
        for loop in face.get("loops", []):
            if not loop.get("edges"):
                for coedge in iterate_coedges(document, face, loop, net, None):
                    t = np.linspace(*coedge.curve.domain, 400)
                    places = coedge.curve.at(t).astype(np.float64)
                    inside = low + (places - low) % (high - low)
                    is_out = is_closed & ((places < low) | (places > high))
                    points.append(net.at(np.clip(np.where(is_out, inside, places), low, high)))
        if not face.get("loops"):
            share = np.linspace(0, 1, 400)[:, np.newaxis]
            corners = [low, np.array([high[0], low[1]]), high, np.array([low[0], high[1]]), low]
            for a, b in pairwise(corners):
                points.append(net.at(a + share * (b - a)))
    return np.concatenate(points).astype(np.float64)


def check_distances(
    finding: PartFinding, part: Part, mesh: Written, allowed: float, samples: tuple[int, int]
) -> None:
    """Adds a fault if a point of a face is further from the mesh than allowed."""
    document: dict[str, Any] = part.truth or part.document
    rng = np.random.default_rng(finding.seed)
    count = max(samples[0], samples[1] // len(document["faces"]))
    soup = Soup(mesh.corners)
    rounding = 1e-14 * float(np.abs(mesh.vertices).max())
    faces = rng.permutation(len(document["faces"]))[:MAX_FACES]
    for face in faces.tolist():
        points: FaceSamples = sample_face(document, face, count, rng)
        distance, worst = measure_to_mesh(soup, points.points, allowed)
        finding.deviation = max(finding.deviation, distance)
        if not distance <= allowed + rounding:
            finding.faults.append(
                f"face {face}: deviation {distance} above {allowed} at {points.places[worst]}"
            )
            return
