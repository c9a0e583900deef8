"""The surfaces whose meshes are judged, with the files from which other makers read them."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracles.brep_documents import Net
from service.decoders.format import FileLimits
from service.decoders.registry import BY_SUFFIX
from service.encoders.cad.registry import DEFINITIONS_BY_NAME
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.errors import SurfaceError
from service.pipeline.mesh import render
from service.schemas.document import DocumentLimits
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.batches import TensorPatches
from service.surface.brep import BrepSurface
from service.surface.bspline import BsplineSurface
from service.surface.examples.catalogue import EXAMPLES
from service.surface.group import GroupSurface
from service.surface.multipatch import MultipatchSurface
from service.surface.sizes import SurfaceKind
from tools.certify import surfaces
from tools.judge_peers.names import FAMILIES, PARTS, SAME_SHAPE, SEEDS

Array: TypeAlias = NDArray[np.float64]

SAMPLES = 48
"""Divisions of a net, in each direction, for differences of its points."""

MILLIMETRE = 1e-3
"""Metres for each unit of all files, so that no maker changes coordinates."""


@dataclass(frozen=True, eq=False)
class Case:
    """A surface, and the files that makers read.

    Attributes
    ----------
    group : "examples", "families" or "parts"
    step : Path or None
        None for surfaces that no CAD file can hold: tubes and ribbons.
    nets : Path or None
        Its control nets for `tools.judge_peers.makers.grids`; None for trimmed faces, triangular
        patches, groups, tubes and ribbons.
    bends : float
        The largest Duu + 2 Duv + Dvv of the sampled second derivatives of the nets, whose domains
        are the unit square; 0 without nets.
    patches : int
        The number of nets.
    diagonal : float
        Of the box of a mesh.
    is_closed : bool
        Whether the mesh of the service has no boundary.
    """

    name: str
    group: str
    surface: SurfaceKind
    step: Path | None
    nets: Path | None
    bends: float
    patches: int
    diagonal: float
    is_closed: bool


def list_surfaces(parts: Path) -> Iterator[tuple[str, str, SurfaceKind, Path | None]]:
    """Names, groups, surfaces and, for the parts in a folder, their files."""
    for name, example in EXAMPLES.items():
        if name not in SAME_SHAPE:
            yield name, "examples", example.surface(), None
    for family in FAMILIES:
        for seed in range(SEEDS):
            yield f"{family} {seed}", "families", surfaces.FAMILIES[family].surface(seed), None
    for name in PARTS:
        path = parts / f"{name}.step"
        yield f"part {name}", "parts", read_step(path), path


def read_step(path: Path) -> SurfaceKind:
    """The surface of a STEP file, as the service reads it."""
    decoded = BY_SUFFIX["step"].decode(path.read_bytes(), None, FileLimits())
    request = validate_document(SurfaceRequest, {"surface": decoded.tree}, DocumentLimits())
    return request.to_surface()


def build_case(
    name: str, group: str, surface: SurfaceKind, step: Path | None, folder: Path
) -> Case:
    """The case of a surface; its files are written into the folder."""
    stem = folder / name.replace(", ", "-").replace(" ", "-")
    nets = [] if step else list_nets(surface)
    if nets:
        arrays: Any = {f"{k} {key}": x for k, net in enumerate(nets) for key, x in net.items()}
        np.savez(stem.with_suffix(".npz"), **arrays)
    vertices, report = measure(surface)
    return Case(
        name=name,
        group=group,
        surface=surface,
        step=step or write_step(surface, stem.with_suffix(".step")),
        nets=stem.with_suffix(".npz") if nets else None,
        bends=max(map(measure_bends, nets), default=0.0),
        patches=len(nets),
        diagonal=float(np.linalg.norm(np.ptp(vertices, axis=0))),
        is_closed=bool(report["watertight"]),
    )


def write_step(surface: SurfaceKind, path: Path) -> Path | None:
    """The STEP file of a surface, if it can be written."""
    try:
        file = DEFINITIONS_BY_NAME["step"].encode(surface.lower(), MILLIMETRE, lambda _: None)
    except SurfaceError:
        return None
    path.write_bytes(bytes(file.content))
    return path


def measure(surface: SurfaceKind) -> tuple[Array, dict[str, Any]]:
    """The vertices of a coarse mesh, and its report."""
    options = MeshOptions(accuracy=Accuracy(relative_tolerance=1e-2), normals=False)
    content = json.loads(bytes(render(surface, options, BY_NAME["json"])))
    return np.array(content["vertices"]), content["report"]


def mesh_surface(surface: SurfaceKind, tolerance: float) -> tuple[Array, NDArray[np.int64]]:
    """Vertices and triangles of the service, with bounds in both directions."""
    options = MeshOptions(accuracy=Accuracy(tolerance=tolerance, two_sided=True), normals=False)
    content = np.load(BytesIO(bytes(render(surface, options, BY_NAME["npz"]))))
    return content["vertices"].astype(np.float64), content["faces"].astype(np.int64)


def list_nets(surface: SurfaceKind) -> list[dict[str, Array]]:
    """The control nets of a surface; empty if it has more than rectangular nets."""
    if isinstance(surface, MultipatchSurface):
        members = [list_nets(member) for member in surface.surfaces]
        return [net for nets in members for net in nets] if all(members) else []
    if isinstance(surface, BsplineSurface) and _is_clamped(surface):
        net, weights = surface.control_net, surface.weights
        return [_write_net(net, weights, surface.degree, surface.knot_vectors)]
    if isinstance(surface, BrepSurface | GroupSurface):
        return []
    try:
        model = surface.lower()
    except SurfaceError:
        return []
    nets = []
    for batch in getattr(model, "batches", ()):
        if not isinstance(batch, TensorPatches):
            return []
        p, q = batch.degree
        knots = np.repeat([0.0, 1.0], p + 1), np.repeat([0.0, 1.0], q + 1)
        for k, net in enumerate(batch.points):
            weights = None if batch.weights is None else batch.weights[k]
            nets.append(_write_net(net, weights, (p, q), knots))
    return nets


def _is_clamped(surface: BsplineSurface) -> bool:
    """Whether the domain begins at the first knot and ends at the last, as libraries expect."""
    if any(isinstance(knots, str) and knots == "periodic" for knots in surface.knots):
        return False
    pairs = zip(surface.knot_vectors, surface.degree, strict=True)
    return all(knots[0] == knots[p] and knots[-1] == knots[-p - 1] for knots, p in pairs)


def _write_net(
    net: Array, weights: Array | None, degree: tuple[int, int], knots: Any
) -> dict[str, Array]:
    """The arrays of a net; knots are those of a domain from 0 to 1."""
    ends = [(k, k[p], k[-p - 1]) for k, p in zip(knots, degree, strict=True)]
    u, v = ((k - first) / (last - first) for k, first, last in ends)
    w = np.ones(net.shape[:2]) if weights is None else weights
    return {"net": net, "weights": w, "degree": np.array(degree), "knots_u": u, "knots_v": v}


def measure_bends(net: dict[str, Array]) -> float:
    """The largest |Duu| + 2 |Duv| + |Dvv| of a net, by differences of samples."""
    p, q = net["degree"].tolist()
    surface = Net((p, q), (net["knots_u"], net["knots_v"]), net["net"], net["weights"])
    t = np.linspace(0, 1, SAMPLES + 1)
    places = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = surface.at(places).astype(np.float64).reshape(len(t), len(t), 3)
    bends = [
        float(np.linalg.norm(difference, axis=-1).max()) * SAMPLES**2
        for difference in (
            np.diff(grid, 2, axis=0),
            np.diff(np.diff(grid, axis=0), axis=1),
            np.diff(grid, 2, axis=1),
        )
    ]
    return bends[0] + 2 * bends[1] + bends[2]
