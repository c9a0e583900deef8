"""Surfaces whose borders are equal up to rounding: closed where they should be, open elsewhere.

A family makes of a seed a surface and says whether its mesh must be closed. Each is meshed by
resolution and by tolerance, in two orders of its patches, and compared with the surface as it was
given.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from scipy.interpolate import BSpline

from service.encoders.registry import BY_NAME
from service.engine.adaptive.tolerance_spec import Accuracy
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.batches import TensorPatches
from service.surface.bspline import BsplineSurface
from service.surface.convert.operations import Elevate, Operation, Restrict, Reverse, Transpose
from service.surface.convert.table import convert
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from tests.oracles.deviation import surface_to_mesh
from tests.oracles.sheets import sheets_of
from tools.certify.table import Finding
from tools.certify.written import Array, Written, read

Pieces: TypeAlias = BsplineSurface | PatchSurface | MultipatchSurface

RESOLUTION = (3, 5)


@dataclass(frozen=True)
class Case:
    """A surface, the tolerance within which points are one, and whether that closes it."""

    surface: Pieces
    weld_tolerance: float
    is_closed: bool | None


@dataclass
class Near(Finding):
    """The findings about one case."""

    moved: float = 0.0
    closed: bool = False

    def __str__(self) -> str:
        return f"{self.kind} {self.seed}"


def noisy(seed: int) -> Case:
    """A ball or a ring, a B-spline or its patches, with noise of 1e-17 to 1e-9 of its size.

    The noise moves no point further than a, so that equal points are at most 2 a apart. Where that
    is near the tolerance, either may be.
    """
    rng = np.random.default_rng(seed)
    amplitude = 10.0 ** -(9 + seed % 9)
    tolerance = 1e-12 if seed % 2 else max(3 * amplitude, 1e-15)
    surface: BsplineSurface | PatchSurface = body(rng, has_poles=bool(seed // 2 % 2))
    if seed // 4 % 2:
        surface = soup(surface.lower().batches[0])
    is_closed = None if amplitude == tolerance else 2 * amplitude < tolerance
    return Case(strewn(rng, surface, amplitude), tolerance, is_closed)


def pieces(seed: int) -> Case:
    """A ball or a ring of B-splines whose borders are pieces of one curve, written differently.

    A body is cut into strips, and these elsewhere each. Then knots are inserted, degrees raised,
    parameters stretched, directions reversed and exchanged. Of every third a point on a border is
    moved: it is open.
    """
    rng = np.random.default_rng([seed, 1])
    whole = body(rng, has_poles=bool(seed % 2))
    found: list[BsplineSurface] = []
    for u in _intervals(rng, whole, 0, 2 + seed // 2 % 2):
        strip = convert(whole, [Restrict(u=u)])
        assert isinstance(strip, BsplineSurface)
        for v in _intervals(rng, strip, 1, int(rng.integers(1, 4))):
            piece = convert(strip, [Restrict(v=v)])
            assert isinstance(piece, BsplineSurface)
            found.append(_rewritten(rng, piece))
    is_closed = seed % 3 > 0
    if not is_closed:
        net = found[0].control_net.copy()
        net[0, 1] += 1e-4 * np.ptp(net) * rng.uniform(0.5, 1, 3)
        found[0] = replace(found[0], control_net=net)
    order = rng.permutation(len(found))
    return Case(MultipatchSurface(tuple(found[k] for k in order)), 1e-12, is_closed)


def _intervals(
    rng: np.random.Generator, surface: BsplineSurface, axis: int, count: int
) -> list[tuple[float, float]]:
    """The domain along an axis in `count` pieces."""
    knots, degree = surface.knot_vectors[axis], surface.degree[axis]
    low, high = float(knots[degree]), float(knots[-1 - degree])
    inner = low + (high - low) * (np.arange(1, count) + rng.uniform(-0.3, 0.3, count - 1)) / count
    ends = [low, *inner.tolist(), high]
    return list(pairwise(ends))


def _rewritten(rng: np.random.Generator, piece: BsplineSurface) -> BsplineSurface:
    """Equal points by other numbers: knots by SciPy, the rest by conversions."""
    rows = np.ones((*piece.control_net.shape[:2], 4))
    if piece.weights is not None:
        rows[..., 3] = piece.weights * rng.uniform(0.5, 2)
    rows[..., :3] = piece.control_net * rows[..., 3:]
    knots = []
    for axis in range(2):
        spline = BSpline(piece.knot_vectors[axis], rows.swapaxes(0, axis), piece.degree[axis])
        low, high = spline.t[spline.k], spline.t[-1 - spline.k]
        for _ in range(int(rng.integers(3))):
            spline = spline.insert_knot(low + (high - low) * rng.uniform(0.1, 0.9))
        rows = spline.c.swapaxes(0, axis)
        knots.append(spline.t * rng.uniform(0.3, 3) + rng.uniform(-2, 2))
    net, weights = rows[..., :3] / rows[..., 3:], rows[..., 3]
    again = BsplineSurface(
        net, piece.degree, (knots[0], knots[1]), None if piece.weights is None else weights
    )
    p, q = piece.degree
    more = rng.integers(0, 4, 2) == 0
    choices: list[Operation] = [Reverse("u"), Reverse("v"), Transpose()]
    chosen = [operation for operation in choices if rng.integers(2)]
    result = convert(again, [Elevate((p + int(more[0]), q + int(more[1]))), *chosen])
    assert isinstance(result, BsplineSurface)
    return result


def body(rng: np.random.Generator, *, has_poles: bool) -> BsplineSurface:
    """A closed B-spline: its last row is its first one, its columns are closed or end in points."""
    p, q = rng.integers(1, 4, 2, endpoint=True).tolist()
    n, m = (int(rng.integers(max(d + 1, 4), d + 6)) for d in (p, q))
    turn = np.linspace(0, 2 * np.pi, n)[:, None]
    across = np.linspace(0, np.pi if has_poles else 2 * np.pi, m)
    radius = (0 if has_poles else 3) + (np.sin(across) if has_poles else np.cos(across))
    height = np.cos(across) if has_poles else np.sin(across)
    net = np.stack(
        np.broadcast_arrays(radius * np.cos(turn), radius * np.sin(turn), height), axis=-1
    )
    net = net * rng.uniform(0.8, 1.2, net.shape) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    weights = rng.uniform(0.5, 2, (n, m)) if rng.integers(2) else None
    for rows in (net,) if weights is None else (net, weights):
        rows[-1] = rows[0]
        if not has_poles:
            rows[:, -1] = rows[:, 0]
    if has_poles:
        net[:, 0], net[:, -1] = net[0, 0], net[0, -1]
    return BsplineSurface(net, (p, q), weights=weights)


def soup(batch: object) -> PatchSurface:
    """Patches that share no vertices."""
    assert isinstance(batch, TensorPatches)
    indices = np.arange(batch.points[..., 0].size).reshape(batch.points.shape[:-1])
    weights = None if batch.weights is None else batch.weights.ravel()
    parts = tuple((f"patch {k}", (k,)) for k in range(batch.count))
    return PatchSurface(batch.points.reshape(-1, 3), indices, weights, parts)


def strewn(
    rng: np.random.Generator, surface: BsplineSurface | PatchSurface, amplitude: float
) -> Pieces:
    """The surface with its points moved by at most a share of its diagonal, weights by as much."""
    points = points_of(surface)
    flat = points.reshape(-1, 3)
    reach = amplitude * np.linalg.norm(np.ptp(flat, axis=0)) * (1 - 2.0**-10)
    away = rng.normal(size=flat.shape)
    away *= reach * rng.uniform(0, 1, (len(flat), 1)) / np.linalg.norm(away, axis=1)[:, None]
    moved = (flat + away).reshape(points.shape)
    weights = surface.weights
    if weights is not None:
        weights = weights * (1 + 0.9 * amplitude * rng.uniform(-1, 1, weights.shape))
    if isinstance(surface, PatchSurface):
        return replace(surface, vertices=moved, weights=weights)
    return replace(surface, control_net=moved, weights=weights)


NEARLY: Mapping[str, tuple[int, Callable[[int], Case]]] = MappingProxyType(
    {"noise": (108, noisy), "borders": (120, pieces)}
)
"""Families: how many of each are looked at, and how they are made."""


def judge_nearly(kind: str, seed: int, tolerance: float) -> Near:
    """Meshes it by resolution and by tolerance, in two orders, and looks at both."""
    case = NEARLY[kind][1](seed)
    near = Near(kind=kind, seed=seed)
    start = time.process_time()
    try:
        for options in (
            MeshOptions(RESOLUTION, weld_tolerance=case.weld_tolerance),
            MeshOptions(
                accuracy=Accuracy(relative_tolerance=tolerance), weld_tolerance=case.weld_tolerance
            ),
        ):
            _judge(near, case, options)
    except Exception as error:  # whatever it is, there is no mesh
        near.wrong.append(f"{type(error).__name__}: {error}")
    near.seconds = time.process_time() - start
    return near


def _judge(near: Near, case: Case, options: MeshOptions) -> None:
    mesh = mesh_of(case.surface, options)
    report = mesh.report
    given = case.surface
    each = _splines(given) if isinstance(given, MultipatchSurface) else [given]
    sheets = [sheet for surface in each for sheet in sheets_of(surface)]
    near.tolerance = float(np.linalg.norm(np.ptp(points_of(case.surface).reshape(-1, 3), axis=0)))
    near.triangles, near.moved = len(mesh.faces), report.get("moved", 0.0)
    near.bound = report["deviation_bound"]
    found = surface_to_mesh(sheets, mesh.corners, 1000)
    near.deviation = found.distance
    if not found.distance <= near.bound + found.noise:
        near.wrong.append(f"deviates by {found.distance}, bound {near.bound}")
    near.closed = report["watertight"]
    if case.is_closed not in (None, report["watertight"]):
        near.wrong.append(f"watertight is {report['watertight']} at {case.weld_tolerance}")
    if near.moved > 2.01 * case.weld_tolerance * near.tolerance:
        near.wrong.append(f"moved by {near.moved}")
    if near.moved > near.bound:
        near.wrong.append(f"moved by {near.moved}, bound {near.bound}")
    if isinstance(case.surface, PatchSurface) and options.accuracy is not None:
        order = np.random.default_rng(near.seed).permutation(len(case.surface.patches))
        again = replace(case.surface, patches=case.surface.patches[order], parts=())
        _compare(near, mesh, again, options)
    if isinstance(case.surface, MultipatchSurface) and options.accuracy is not None:
        _compare(near, mesh, replace(case.surface, surfaces=case.surface.surfaces[::-1]), options)


def _compare(near: Near, mesh: Written, again: Pieces, options: MeshOptions) -> None:
    """Whether the same patches in another order have the same triangles."""
    if triangles_of(mesh_of(again, options)) != triangles_of(mesh):
        near.wrong.append("the order of the patches matters")


def points_of(surface: Pieces) -> Array:
    """All control points."""
    if isinstance(surface, MultipatchSurface):
        return np.concatenate([points_of(s).reshape(-1, 3) for s in _splines(surface)])
    return surface.vertices if isinstance(surface, PatchSurface) else surface.control_net


def _splines(surface: MultipatchSurface) -> list[BsplineSurface]:
    return [s for s in surface.surfaces if isinstance(s, BsplineSurface)]


def mesh_of(surface: Pieces, options: MeshOptions) -> Written:
    """Written as JSON and read."""
    return read("json", render(surface, options, BY_NAME["json"]))


def triangles_of(mesh: Written) -> set[bytes]:
    """All triangles, corners in order of their coordinates."""
    corners = mesh.corners
    order = np.lexsort(corners.transpose(2, 0, 1)[::-1], axis=1)
    return {t.tobytes() for t in np.take_along_axis(corners, order[..., None], axis=1)}
