"""Sends random breps to the application: valid ones, changed ones, hostile ones.

    python -m tools.fuzz.breps [COUNT [FIRST [SECONDS]]]

Brep number k is the same in each run: it depends on k alone. A finding is a response with a status
of 500 or more, a response that takes too long, or memory beyond the service's own limit. The
program prints each finding, writes its body to build/fuzz/breps/, and then the number of responses
of each kind. The exit status is 1 if there are findings.
"""

import json
import sys
import time
from collections import Counter
from contextlib import suppress
from typing import Any

import numpy as np

from service.api.app import create_app
from service.bases.arrays import FloatArray
from service.settings.values import Settings
from tools.client import Client, start_client
from tools.fuzz.judge import measure_peak
from tools.fuzz.mutations import Random, draw_brep, mutate
from tools.processes import ROOT

FOLDER = ROOT / "build" / "fuzz" / "breps"
SEED = 20260101
MAX_SECONDS = 30.0
"""Seconds of processor time that one request may take."""

MEMORY = 256 << 20
"""Memory of the service for requests, and the most by which the process may grow."""

SETTINGS = Settings(
    max_vertices=50_000, memory_bytes=MEMORY, request_timeout=120, log_level="error"
)

FORMATS = ("glb", "json", "obj", "ply", "stl", "off", "oogl", "gltf", "npz")


def draw_request(rng: Random) -> tuple[str, dict[str, Any]]:
    """The path of a request, and its document."""
    kind, surface = int(rng.integers(20)), draw_brep(rng)
    is_question = 4 <= kind < 13
    # Most changes make a brep invalid: questions then have no answer.
    for _ in range(int(rng.choice([0, 0, 0, 1] if is_question else [0, 1, 1, 2, 4]))):
        mutate(surface, rng)
    if rng.random() < 0.1:
        member: dict[str, Any] = {"surface": surface}
        if rng.random() < 0.5:
            member["color"] = rng.uniform(size=3).tolist()
        matrix = np.eye(4)
        matrix[:3] += rng.normal(size=(3, 4)) * 0.3
        surface = {"type": "group", "members": [member, member | {"matrix": matrix.tolist()}]}
    match kind:
        case 0:
            return "/v1/estimate", {"surface": surface} | draw_options(rng)
        case 1:
            return "/v1/surfaces", {"surface": surface}
        case 2:
            operation = {"op": "select", "faces": rng.integers(0, 4, 2).tolist()}
            return "/v1/convert", {"surface": surface, "operations": [operation]}
        case 3:
            operation = {"op": "untrim", "face": int(rng.integers(0, 4))}
            return "/v1/convert", {"surface": surface, "operations": [operation]}
        case _ if is_question:
            return draw_question(surface, rng)
        case _:
            name = FORMATS[rng.integers(len(FORMATS))]
            return f"/v1/mesh?format={name}", {"surface": surface} | draw_options(rng)


def draw_question(surface: dict[str, Any], rng: Random) -> tuple[str, dict[str, Any]]:
    """The path of a question to a surface, and its document: points in, on and far from it."""
    count = int(rng.integers(1, 20))
    size = float(rng.choice([1, 1, 10, 100, 1e-3, 1e6]))
    near = draw_vertices(surface, count, rng)
    points = near + rng.normal(size=(count, 3)) * size * rng.choice([0, 1e-9, 1], (count, 1))
    document: dict[str, Any] = {"surface": surface}
    match int(rng.integers(6)):
        case 0:
            uv = rng.uniform(size=(count, 2))
            uv = np.where(rng.random((count, 2)) < 0.1, np.round(uv), uv)
            faces = max(1, len(surface.get("faces") or []))
            patch = rng.integers(0, faces + 1, count) if rng.random() < 0.3 else rng.integers(faces)
            places = {"uv": uv.tolist(), "patch": patch.tolist()}
            return "/v1/points", document | places | {"derivatives": int(rng.integers(3))}
        case 1:
            document |= {"points": points.tolist(), "sign": bool(rng.integers(2))}
            return "/v1/project", document | draw_accuracy("relative_tolerance", rng)
        case 2 | 3:
            aims = draw_vertices(surface, count, rng) - points
            directions = np.where(aims.any(axis=1, keepdims=True), aims, [[0.0, 0.0, 1.0]])
            if rng.random() < 0.3:
                directions = np.eye(3)[rng.integers(0, 3, count)]
            document["rays"] = {"origins": points.tolist(), "directions": directions.tolist()}
            document["hits"] = ("first", "all")[rng.integers(2)]
            return "/v1/intersect", document | draw_accuracy("relative_thickness", rng)
        case 4:
            normals = rng.normal(size=(count, 3))
            if rng.random() < 0.5:
                normals = np.eye(3)[rng.integers(0, 3, count)]
            document["planes"] = {"points": points.tolist(), "normals": normals.tolist()}
            return "/v1/intersect", document | draw_accuracy("relative_tolerance", rng)
        case _:
            return "/v1/measure", document | draw_accuracy("tolerance", rng)


def draw_accuracy(name: str, rng: Random) -> dict[str, float]:
    """An option of this name, or none."""
    return {name: float(10 ** rng.uniform(-9, -3))} if rng.random() < 0.5 else {}


def draw_vertices(surface: dict[str, Any], count: int, rng: Random) -> FloatArray:
    """Vertices of the first brep of a surface, (count, 3); zeros if it has no valid ones."""
    members = surface.get("members")
    brep = members[0].get("surface") if isinstance(members, list) else surface
    vertices = brep.get("vertices") if isinstance(brep, dict) else None
    with suppress(TypeError, ValueError, OverflowError):
        rows = np.array(vertices, dtype=np.float64)
        if rows.ndim == 2 and rows.shape[1] == 3 and np.isfinite(rows).all() and len(rows):
            return np.clip(rows[rng.integers(0, len(rows), count)], -1e30, 1e30)
    return np.zeros((count, 3))


def draw_options(rng: Random) -> dict[str, Any]:
    """Options of a mesh, not all of which fit together."""
    choices: tuple[tuple[str, float, Any], ...] = (
        ("relative_tolerance", 0.8, float(10 ** rng.uniform(-4, 0.5))),
        ("overlays", 0.2, ["boundary"]),
        ("two_sided", 0.1, True),
        ("curvatures", 0.1, True),
        ("uvs", 0.2, True),
        ("normals", 0.2, False),
        ("angle_tolerance", 0.1, float(rng.uniform(0.05, 1))),
        ("max_triangles", 0.1, int(10 ** rng.uniform(1, 4))),
        ("crease_angle", 0.1, float(rng.uniform(0, 3))),
        ("quantize", 0.1, True),
        ("weld", 0.03, False),
        ("resolution", 0.03, 4),
    )
    return {name: value for name, share, value in choices if rng.random() < share}


def send(client: Client, number: int) -> tuple[str, str]:
    """Sends request `number`; returns the kind of its response, and its fault or ""."""
    path, document = draw_request(np.random.default_rng([SEED, number]))
    body = json.dumps(document).encode()  # orjson refuses integers beyond 64 bits
    start, peak = time.process_time(), measure_peak()
    response = client.request("POST", path, body, {"Content-Type": "application/json"})
    seconds, growth = time.process_time() - start, measure_peak() - peak
    fault = ""
    if response.status_code >= 500:
        fault = f"status {response.status_code}"
    elif seconds > MAX_SECONDS:
        fault = f"{seconds:.0f} s"
    elif growth > MEMORY:
        fault = f"{growth >> 20} MiB"
    if fault:
        FOLDER.mkdir(parents=True, exist_ok=True)
        (FOLDER / f"{number}.json").write_bytes(body)
    if response.status_code < 300:
        return path.partition("?")[0], fault
    codes = [error["code"] for error in response.json().get("errors", [])]
    return f"{response.status_code} {codes[0] if codes else ''}", fault


def main(count: int = 1000, first: int = 0, seconds: float = float("inf")) -> bool:
    """Sends requests; returns whether there are no findings."""
    kinds: Counter[str] = Counter()
    findings, sent, end = 0, 0, time.monotonic() + seconds
    with start_client(create_app(SETTINGS)) as client:
        for number in range(first, first + count):
            kind, fault = send(client, number)
            kinds[kind] += 1
            sent += 1
            if fault:
                findings += 1
                print(f"FINDING: brep {number}: {fault}", flush=True)
            if sent % 1000 == 0:
                print(f"{sent} of {count} breps", flush=True)
            if time.monotonic() > end:
                break
    for kind, number in kinds.most_common():
        print(f"{number:7}  {kind}")
    print(f"{sent} breps, {findings} findings")
    return not findings


if __name__ == "__main__":
    arguments = [int(argument) for argument in sys.argv[1:]]
    sys.exit(0 if main(*arguments) else 1)
