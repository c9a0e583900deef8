"""Judges models of many patches: are shared edges joined, and equal in other orders and alone?"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from service.encoders.registry import BY_NAME
from service.engine.adaptive.tolerance_spec import Accuracy
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.lowered import PatchModel
from service.surface.sizes import SurfaceKind, SurfaceSize
from tests.oracles.deviation import measure_each_sheet
from tests.oracles.sheets import Sheet, build_sheets
from tools.certify.models import Complex, Loop, Pair, build_complex
from tools.certify.table import Finding
from tools.certify.written import Array, Rows, Written, list_edges, read

ALONE = 3
"""Number of patches of each model that are also meshed alone."""


@dataclass(frozen=True, eq=False)
class Ready(SurfaceKind):
    """A model that lowers to itself."""

    model: PatchModel
    name: str = "ready"

    def size(self) -> SurfaceSize:
        return SurfaceSize((3, 3), grids=self.model.patch_count)

    def lower(self) -> PatchModel:
        return self.model


@dataclass
class Joint(Finding):
    """The findings about one model: its seams, and its boundary edges."""

    seams: int = 0
    boundary: int = 0

    def __str__(self) -> str:
        return f"{self.kind} {self.seed} at {self.tolerance:g}"


def judge_model(kind: str, seed: int, tolerance: float) -> Joint:
    """Meshes a model, the model in another order, and some of its patches alone."""
    joint = Joint(kind=kind, seed=seed, tolerance=tolerance)
    net_complex = build_complex(kind, seed)
    rng = np.random.default_rng([seed, 1])
    patches = range(len(net_complex.nets))
    try:
        start = time.process_time()
        mesh = _mesh(net_complex.model(patches), tolerance)
        joint.seconds = time.process_time() - start
        again = _mesh(
            net_complex.model(rng.permutation(len(patches)).tolist(), together=False), tolerance
        )
        few = rng.permutation(len(patches))[:ALONE].tolist()
        alone = {k: _mesh(net_complex.model([k]), tolerance) for k in few}
    except Exception as error:  # any error means that no mesh was made
        joint.wrong.append(f"{type(error).__name__}: {error}")
        return joint
    joint.triangles = len(mesh.faces)
    check_order(joint, mesh, again)
    sides = check_seams(joint, net_complex, mesh)
    for k, single in alone.items():
        together = {pair: mesh.vertices[line] for (n, pair), line in sides.items() if n == k}
        _check_alone(joint, net_complex, k, single, together)
    count = int(np.clip(4 * len(mesh.faces) / len(patches), 400, 4000))
    check_deviation(joint, build_sheets(net_complex.model(patches)), mesh, "patch", count)
    return joint


def _mesh(model: PatchModel, tolerance: float) -> Written:
    options = MeshOptions(accuracy=Accuracy(tolerance=tolerance), normals=False)
    return read("json", render(Ready(model), options, BY_NAME["json"]))


def check_order(joint: Joint, mesh: Written, again: Written) -> None:
    """Adds a fault unless each patch has the same triangles in both meshes, bit for bit."""
    for name in mesh.parts:
        if _triangles(mesh, name) != _triangles(again, name):
            joint.wrong.append(f"{name} depends on the order of the patches")


def _triangles(mesh: Written, name: str) -> set[tuple[tuple[float, ...], ...]]:
    """Corners of the triangles of a part, the least corner first."""
    triangles = set()
    for corners in mesh.corners[slice(*mesh.parts[name])].tolist():
        points = [tuple(corner) for corner in corners]
        first = points.index(min(points))
        triangles.add(tuple(points[first:] + points[:first]))
    return triangles


def check_seams(
    joint: Joint, net_complex: Complex, mesh: Written
) -> dict[tuple[int, Pair], list[int]]:
    """Checks that both sides of each seam have the same vertices; returns the vertices of all
    sides."""
    edges, uses = np.unique(np.sort(list_edges(mesh.faces), axis=1), axis=0, return_counts=True)
    times = {(a, b): n for (a, b), n in zip(edges.tolist(), uses.tolist(), strict=True)}
    if uses.max() > 2:
        joint.wrong.append(f"{(uses > 2).sum()} edges of more than two triangles")
    sides: dict[tuple[int, Pair], list[int]] = {}
    for k, loop in enumerate(net_complex.loops):
        lines = _sides(
            mesh.vertices, mesh.faces[slice(*mesh.parts[f"patch {k}"])], net_complex, loop
        )
        if lines is None:
            joint.wrong.append(f"the border of patch {k} does not run from corner to corner")
            return sides
        sides |= {(k, pair): line for pair, line in lines.items()}
    for pair, patches in net_complex.edges().items():
        lines_ = [sides[k, pair] for k in patches]
        if any(line != lines_[0] for line in lines_):
            joint.wrong.append(f"the sides of the seam {pair} differ")
        count = [times[min(a, b), max(a, b)] for a, b in pairwise(lines_[0])]
        if any(n != len(patches) for n in count):
            joint.wrong.append(f"edges on {pair} are used {sorted(set(count))} times")
        if len(patches) > 1:
            joint.seams += 1
        else:
            joint.boundary += len(count)
    if not (uses == 1).sum() == joint.boundary == mesh.report["boundary_edges"]:
        joint.wrong.append(
            f"{(uses == 1).sum()} boundary edges, {joint.boundary} expected, "
            f"{mesh.report['boundary_edges']} reported"
        )
    if mesh.report["watertight"] != (joint.boundary == 0):
        joint.wrong.append(f"watertight is {mesh.report['watertight']}")
    return sides


def _sides(
    vertices: Array, faces: Rows, net_complex: Complex, loop: Loop
) -> dict[Pair, list[int]] | None:
    """Vertices along each side of one patch, from its lower corner to its higher.

    The border of the patch is the edges of one triangle: one loop through its corners in order.
    """
    ends = list_edges(faces)
    _, first, uses = np.unique(np.sort(ends, axis=1), axis=0, return_index=True, return_counts=True)
    following = dict(ends[first[uses == 1]].tolist())
    if len(following) != (uses == 1).sum():
        return None
    near = {tuple(point): row for row, point in enumerate(vertices.tolist())}
    number = {near.get(tuple(net_complex.corners[c].tolist()), -1): c for c in loop}
    if -1 in number:
        return None
    start = at = next(iter(number))
    lines: dict[Pair, list[int]] = {}
    line = [at]
    for _ in following:
        at = following.get(at, start)
        line.append(at)
        if at in number:
            a, b = number[line[0]], number[at]
            lines[min(a, b), max(a, b)] = line if a < b else line[::-1]
            line = [at]
        if at == start:
            break
    expected = {(min(a, b), max(a, b)) for a, b in pairwise([*loop, loop[0]])}
    used = sum(len(line) - 1 for line in lines.values())
    return lines if set(lines) == expected and used == len(following) else None


def _check_alone(
    joint: Joint, net_complex: Complex, k: int, single: Written, sides: Mapping[Pair, Array]
) -> None:
    """Checks that a patch alone has the same vertices on edges with the same numbers (`alike`)."""
    lines = _sides(single.vertices, single.faces, net_complex, net_complex.loops[k])
    if lines is None:
        joint.wrong.append(f"the border of patch {k} alone does not run from corner to corner")
        return
    for pair, line in lines.items():
        is_alike = pair in net_complex.alike and pair in sides
        if is_alike and single.vertices[line].tolist() != sides[pair].tolist():
            joint.wrong.append(f"edge {pair} of patch {k} differs when computed alone")


def check_deviation(
    joint: Joint, sheets: Sequence[Sheet], mesh: Written, part: str, count: int
) -> None:
    """Compares samples of every sheet with the bounds of its part and of the whole mesh."""
    joint.bound = mesh.report.get("deviation_bound", np.nan)
    if not joint.bound <= joint.tolerance:
        joint.wrong.append(f"bound {joint.bound} above the tolerance")
    for k, each in enumerate(measure_each_sheet(sheets, mesh.corners, count)):
        bound = mesh.part_bounds.get(f"{part} {k}", np.nan)
        joint.deviation = max(joint.deviation, each.distance)
        if not each.distance <= bound + each.noise or not bound <= joint.bound:
            joint.wrong.append(f"{part} {k} deviates by {each.distance}, bound {bound}")
