"""Builds the mesh of a tube or a ribbon: its path, grids of samples, vertices and faces."""

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.bases.bernstein import bernstein
from service.cancellation import checkpoint
from service.engine.extent import choose_origin, find_stored_bounds
from service.engine.mesh.mesh import Mesh, MeshPart, MeshReport, Overlay
from service.engine.mesh.overlays import draw_polylines
from service.engine.options import MeshOptions
from service.engine.plans.faces import count_borders
from service.engine.plans.vertices import (
    Welding,
    count_positions,
    find_shared_positions,
    merge_samples,
    number_vertices,
)
from service.engine.sweeps.paths import Paths, bound_frame_count, build_path
from service.engine.sweeps.profiles import build_ribbons, build_tubes
from service.engine.sweeps.rows import SweptGrids
from service.surface.checks import Up
from service.surface.curve_model import Ribbon, SweepModel, Tube

MAX_SLOPE = 1e6
"""The largest derivative of the radius by the length. A steeper tube counts as a step, with a
normal almost like the normal of a disc."""

EFFORT = 40
"""The length up to a frame takes about this number times (degree + 1)² multiplications: two rules
of quadrature with together 18 nodes, on up to two intervals, and on more only near cusps."""


def sweep(model: SweepModel, options: MeshOptions, *, is_float32: bool = False) -> Mesh:
    """The mesh of a tube or ribbon, at `resolution[0]` divisions of every piece of its curve."""
    profile, crease_angle = model.profile, options.crease_angle
    # Where control points repeat, only a profile that changes has more than one shape.
    pieces = model.pieces if len(profile.spread) > 1 else model.pieces.drop_single()
    paths = build_path(pieces, options.resolution[0], crease_angle, closed=model.closed)
    # The radius or the width at every frame.
    spread = evaluate_spread(profile.spread, paths.parameters)
    if isinstance(profile, Ribbon):
        facing, camera = profile.facing, profile.camera
        swept = build_ribbons(paths, spread, facing=facing, camera=camera, faces=options.faces)
    else:
        slopes, caps = find_slopes(profile, paths), profile.caps
        swept = build_tubes(
            paths, spread, profile.sides, slopes=slopes, caps=caps, faces=options.faces
        )
    return build_swept_mesh(
        model.name, swept, options, is_float32=is_float32, up=model.up, polygon=model.polygon
    )


def build_swept_mesh(
    name: str,
    swept: SweptGrids,
    options: MeshOptions,
    *,
    is_float32: bool = False,
    up: Up = "y",
    polygon: FloatArray | None = None,
) -> Mesh:
    """The mesh of tubes or ribbons, one part of this name.

    Parameters
    ----------
    options : MeshOptions
        Only normals, uvs, weld, crease_angle and the overlay of the control net are used; `swept`
        already has the faces.
    is_float32 : bool
        Whether positions are float32 about a local origin, else float64 in model coordinates.
    polygon : ndarray of float64, shape (K, 3), optional
        The control polygon of the curve.
    """
    checkpoint()
    normals = swept.normals.copy() if options.normals else None  # `_weld` writes means into them
    welding = _weld(swept, normals, options)
    triangles, quads = (
        welding.vertex[rows].astype(np.uint32, copy=False)
        for rows in (swept.triangles, swept.quads)
    )
    checkpoint()
    positions = swept.positions[welding.samples]
    origin = np.zeros(3)
    if is_float32:
        origin = choose_origin(positions.min(axis=0), positions.max(axis=0))
    dtype = np.float32 if is_float32 else np.float64
    stored: RealArray = (positions - origin).astype(dtype) if is_float32 else positions
    welds = find_shared_positions(welding) if options.weld else None
    checkpoint()
    boundary_edges, watertight = count_borders((triangles, quads), welds)
    low, high = find_stored_bounds(stored, origin)
    overlays: tuple[Overlay, ...] = ()
    if polygon is not None and "control_net" in options.overlays:
        overlays = (draw_polylines("control_net", [polygon[np.newaxis] - origin], dtype),)
    return Mesh(
        name=name,
        positions=stored,
        normals=None if normals is None else normals[welding.samples].astype(dtype),
        uvs=swept.uvs[welding.samples].astype(dtype) if options.uvs else None,
        triangles=triangles,
        quads=quads,
        parts=(MeshPart(name, (0, len(triangles)), (0, len(quads))),),
        grids=tuple(welding.vertex[grid].astype(np.uint32, copy=False) for grid in swept.grids),
        welds=welds,
        overlays=overlays,
        origin=origin,
        up=up,
        report=MeshReport(
            vertices=count_positions(len(stored), welds),
            triangles=len(triangles),
            quads=len(quads),
            patches=0,
            bounds_min=low,
            bounds_max=high,
            watertight=watertight,
            boundary_edges=boundary_edges,
            poles_repaired=0,
        ),
    )


def predict_sweep(model: SweepModel, options: MeshOptions) -> tuple[int, int, int, int]:
    """Upper bounds of the numbers of samples, triangles, quads and grids, without evaluation.

    A quad of which an edge is a point becomes a triangle, but counts as a quad here.
    """
    frames = bound_frame_count(model.pieces, options.resolution[0], options.crease_angle)
    is_tube = isinstance(model.profile, Tube)
    columns = model.profile.sides if isinstance(model.profile, Tube) else 1
    rows = frames + 4 * is_tube  # each of two caps has a rim and a centre
    cells = (rows - 1) * columns
    # Mitred corners, at most one for each frame beyond those of a smooth curve, separate runs of
    # frames; each run is a grid.
    runs = frames - model.pieces.count * options.resolution[0]
    grids = runs + 2 * is_tube
    if options.faces == "triangles":
        return rows * (columns + 1), 2 * cells, 0, grids
    # Quads become triangles at pointed frames, and in both caps.
    triangles_at_points = cells if (model.profile.spread == 0).any() else 2 * columns
    return rows * (columns + 1), triangles_at_points, cells, grids


def estimate_effort(model: SweepModel, options: MeshOptions) -> int:
    """The number of multiplications for all lengths, which take most time at high degrees."""
    return model.pieces.count * options.resolution[0] * EFFORT * (model.pieces.degree + 1) ** 2


def evaluate_spread(coefficients: FloatArray, t: FloatArray) -> FloatArray:
    """The values of a Bézier function at parameters t; its ends are exact."""
    basis = bernstein(len(coefficients) - 1, t)
    value: FloatArray = (basis * coefficients).sum(axis=1)
    # Rounding must not change a constant, nor exceed the range of the coefficients.
    return np.clip(value, coefficients.min(), coefficients.max())


def find_slopes(tube: Tube, paths: Paths) -> FloatArray | None:
    """Derivative of the radius by the length at every frame; None if the radius is constant."""
    if len(tube.spread) == 1 or paths.speeds is None:
        return None
    degree = len(tube.spread) - 1
    steps = degree * np.diff(tube.spread)
    rate = (bernstein(degree - 1, paths.parameters) * steps).sum(axis=1)
    min_speed = np.maximum(np.abs(rate) / MAX_SLOPE, np.finfo(np.float64).tiny)
    slopes: FloatArray = rate / np.maximum(paths.speeds, min_speed)
    return slopes


def _weld(swept: SweptGrids, normals: RealArray | None, options: MeshOptions) -> Welding:
    """Make vertices from samples: one for each sample, or one for each set of welded samples."""
    own_numbers = np.arange(len(swept.same_position))
    if not options.weld:
        return Welding(vertex=own_numbers, samples=own_numbers, welds=own_numbers)
    is_used = np.zeros(len(swept.same_position), dtype=bool)
    is_used[swept.triangles] = True
    is_used[swept.quads] = True
    # With texture coordinates every sample stays a vertex, because those of a seam differ.
    leader = (
        own_numbers
        if options.uvs
        else merge_samples(swept.same_position, normals, options.crease_angle)
    )
    return number_vertices(swept.same_position, leader, is_used)
