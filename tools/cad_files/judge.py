"""Judges the readers of CAD files: what they read, whether solids close, and their volumes.

    python -m tools.cad_files.judge TRUTH FILE …

TRUTH is what `tools.cad_files.open_cascade` printed for the files, or the `expected.jsonl` of
`tools.cad_files.write`. Each file is read in a process
of its own. Its solids, which are parts whose shells are all closed by their own topology, are
meshed at 1e-3 and at 1e-4 of their diagonal: the first must be closed, and the volume of the second
must be that of Open CASCADE, within what the bound of the mesh allows. Faces, units, instances,
names, colours and the box of all vertices are compared, where TRUTH has them. The last line counts,
and the exit code is 1 if anything differs that is not `disputed` in TRUTH.
"""

import json
import sys
import time
import traceback
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.format import FileLimits
from service.decoders.registry import BY_SUFFIX
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.errors import SurfaceError
from service.schemas.brep import BrepDefinition
from tools.building import build
from tools.cad_files.apart import call_apart

SECONDS = 600
"""The longest time for a file."""

CLOSED, MEASURED = 1e-3, 1e-4
"""Tolerances, as shares of the diagonal: at which a mesh must be closed, and its volume right."""

SLACK = 1e-6
"""How far volumes may differ beside what the bound allows, as a share: files have some 8 digits."""

Result: TypeAlias = dict[str, Any]


def judge(name: str) -> Result:
    """The content of a file as it was read, and the meshes of its parts; or why it is refused."""
    try:
        return read_and_mesh(Path(name))
    except SurfaceError as error:
        return {"refused": [f"{i.code} {i.message} {i.got}" for i in error.issues[:3]]}


def read_and_mesh(path: Path) -> Result:
    """The content of a file as it was read, and the meshes of its parts."""
    content = path.read_bytes()
    decoder = BY_SUFFIX[path.suffix.lower().removeprefix(".")]
    start = time.perf_counter()
    decoded = decoder.decode(content, None, FileLimits())
    seconds = time.perf_counter() - start
    surface, reading = decoded.tree, decoded.reading
    assert reading is not None
    definitions = [surface] if surface["type"] == "brep" else surface["definitions"]
    unit = 1e3 * surface.get("metres_per_unit", 1e-3)
    matrices = [[np.eye(4)]] if surface["type"] == "brep" else place(surface, len(definitions))
    scales = [[float(np.linalg.det(m[:3, :3])) for m in of_part] for of_part in matrices]
    parts = [mesh_part(tree, unit) for tree in definitions]
    return {
        "bytes": len(content),
        "seconds": seconds,
        "faces": sum(len(t["faces"]) * len(s) for t, s in zip(definitions, scales, strict=True)),
        "skipped_faces": len(reading["skipped_faces"]),
        "skipped_entities": reading["skipped_entities"],
        "metres_per_unit": surface.get("metres_per_unit"),
        "instances": sum(map(len, matrices)),
        "box": find_box(definitions, matrices, unit),
        "names": find_names(surface),
        "colors": find_colors(surface),
        "volume": sum(
            part["volume"] * abs(scale)
            for part, of_part in zip(parts, scales, strict=True)
            for scale in of_part
            if part["is_solid"]
        ),
        "parts": parts,
    }


def place(group: Mapping[str, Any], count: int) -> list[list[FloatArray]]:
    """For each definition, the matrices of its instances."""
    placed: list[list[FloatArray]] = [[] for _ in range(count)]
    own: list[FloatArray] = []
    for member in group["members"]:
        matrix = np.asarray(member.get("matrix", np.eye(4)))
        parent = member.get("parent")
        own.append(matrix if parent is None else own[parent] @ matrix)
        if "definition" in member:
            placed[member["definition"]].append(own[-1])
    return placed


def find_box(
    trees: Sequence[Mapping[str, Any]], matrices: Sequence[Sequence[FloatArray]], unit: float
) -> list[list[float]]:
    """The box about all placed vertices, in millimetres."""
    points = [
        np.asarray(tree.get("vertices", ())).reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        for tree, of_part in zip(trees, matrices, strict=True)
        for matrix in of_part
    ]
    every = unit * np.concatenate(points)
    return [every.min(axis=0).tolist(), every.max(axis=0).tolist()] if len(every) else []


def find_names(surface: Mapping[str, Any]) -> list[str]:
    """All names of parts and instances."""
    trees = [surface, *surface.get("definitions", ()), *surface.get("members", ())]
    return sorted({tree["name"] for tree in trees if tree.get("name")})


def find_colors(surface: Mapping[str, Any]) -> list[list[float]]:
    """All colours of faces, parts and instances, to four digits."""
    trees = [surface, *surface.get("definitions", ())]
    colored = [face for tree in trees for face in tree.get("faces", ())]
    colored += surface.get("members", ())
    colors = {tuple(np.round(each["color"], 4).tolist()[:3]) for each in colored if "color" in each}
    return sorted(map(list, colors))


def mesh_part(tree: Mapping[str, Any], unit: float) -> Result:
    """The meshes of one part, its lengths in millimetres; `error` if there is none."""
    shells = tree.get("shells", ())
    is_solid = bool(shells) and all(shell["closed"] for shell in shells)
    result: Result = {
        "name": tree.get("name", ""),
        "faces": len(tree["faces"]),
        "is_solid": is_solid,
        "is_closed": False,
        "volume": 0.0,
        "slack": 0.0,
    }
    start = time.perf_counter()
    try:
        model = BrepDefinition.model_validate(tree).to_surface().lower()
        for relative in (CLOSED, MEASURED) if is_solid else (CLOSED,):
            options = MeshOptions(accuracy=Accuracy(relative_tolerance=relative), normals=False)
            mesh = build(model, options)
            report, of_part = mesh.report, mesh.report.brep
            assert of_part is not None
            corners = mesh.positions[mesh.triangles]
            products = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            area = float(np.linalg.norm(products, axis=1).sum()) / 2
            # Sums about the middle of the part, because it may be far from the origin.
            middle = mesh.positions.mean(axis=0)
            volume = float(np.einsum("ij,ij->", corners[:, 0] - middle, products)) / 6
            if relative == CLOSED:
                result["is_closed"] = bool(report.watertight)
                result["skipped"] = len(of_part.skipped_faces)
            bound = (report.deviation_bound or 0.0) + of_part.gap_bound
            result |= {"volume": volume * unit**3, "slack": area * bound * unit**3}
    except SurfaceError as error:
        result["error"] = [f"{i.code} {i.pointer} {i.got}" for i in error.issues[:3]]
    except Exception:  # any fault of the service is a result
        result["error"] = traceback.format_exc().splitlines()[-3:]
    result["seconds"] = time.perf_counter() - start
    return result


def find_faults(result: Result, truth: Mapping[str, Any]) -> Iterable[str]:
    """The faults of a result, in words."""
    if "fault" in result:
        yield f"fault: {result['fault']}"
        return
    if "refused" in result:
        if truth.get("faces", 0):
            yield "refused: " + result["refused"][0]
        return
    if "faces" in truth and truth["faces"] != result["faces"] + result["skipped_faces"]:
        yield f"faces: {result['faces']} + {result['skipped_faces']}, not {truth['faces']}"
    yield from find_structural_faults(result, truth)
    for part in result["parts"]:
        if "error" in part:
            yield f"part of {part['faces']} faces: {part['error']}"
        elif part["is_solid"] and not part["is_closed"]:
            yield f"part of {part['faces']} faces is open, {part['skipped']} skipped"
    expected = sum(map(abs, truth.get("volumes", ())))
    slack = sum(part["slack"] for part in result["parts"]) + SLACK * expected
    is_complete = all(part["is_closed"] for part in result["parts"] if part["is_solid"])
    if is_complete and "volumes" in truth and abs(abs(result["volume"]) - expected) > slack:
        yield f"volume: {result['volume']:.9g}, not {expected:.9g} ± {slack:.3g}"


def find_structural_faults(result: Result, truth: Mapping[str, Any]) -> Iterable[str]:
    """The faults of units, instances, names, colours and placements, in words."""
    unit = truth.get("metres_per_unit")
    if unit is not None and abs(result["metres_per_unit"] - unit) > 1e-12 * unit:
        yield f"unit: {result['metres_per_unit']} m, not {unit} m"
    if truth.get("instances", result["instances"]) != result["instances"]:
        yield f"instances: {result['instances']}, not {truth['instances']}"
    for name in truth.get("names", ()):
        if not any(name in each for each in result["names"]):
            yield f"names: without {name}"
    for color in truth.get("colors", ()):
        if not any(np.allclose(color, each, atol=2e-3) for each in result["colors"]):
            yield f"colors: without {color}"
    if truth.get("box") and result["box"]:
        low, high = np.array(truth["box"])
        slack = 1e-6 * float(np.linalg.norm(high - low)) + 1e-6
        inner_low, inner_high = np.array(result["box"])
        if (inner_low < low - slack).any() or (inner_high > high + slack).any():
            yield f"box: {result['box']}, not in {truth['box']}"


def main(truth_path: str, *paths: str) -> int:
    """Judge all files, and print what is wrong."""
    for decoder in BY_SUFFIX.values():
        with suppress(SurfaceError):
            decoder.decode(b" ", None, FileLimits())  # imports what the reader needs, once
    with open(truth_path) as stream:
        truths = {Path(line["file"]).name: line for line in map(json.loads, stream)}
    counts: Counter[str] = Counter()
    for path in map(Path, paths):
        result = call_apart(judge, str(path), SECONDS)
        truth = truths.get(path.name, {})
        faults = list(find_faults(result, truth))
        disputed = truth.get("disputed", "")
        solids = [part for part in result.get("parts", ()) if part["is_solid"]]
        counts += Counter(
            files=1,
            read="parts" in result,
            disputed=bool(faults and disputed),
            wrong=bool(faults and not disputed),
            solids=len(solids),
            closed=sum(part["is_closed"] for part in solids),
            bytes=result.get("bytes", 0),
            milliseconds=round(1e3 * result.get("seconds", 0)),
        )
        for fault in faults:
            note = f" (disputed: {disputed})" if disputed else ""
            print(f"{path.name}: {fault}{note}", flush=True)
        print(json.dumps({"file": path.name, **result}), file=sys.stderr, flush=True)
    print(", ".join(f"{name} {count}" for name, count in counts.items()))
    return counts["wrong"] > 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
