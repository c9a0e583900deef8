"""Builds the mesh of a tube or a ribbon: stations, grids of samples, vertices and faces."""

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein
from service.engine.mesh.mesh_value import Mesh
from service.engine.options import MeshOptions
from service.engine.sweeps.paths import Paths, bound_station_count, build_path
from service.engine.sweeps.profiles import build_ribbons, build_tubes
from service.engine.sweeps.rows import SweptGrids
from service.engine.sweeps.swept_mesh import build_swept_mesh
from service.surface.curve_model import Ribbon, SweepModel, Tube

MAX_SLOPE = 1e6
"""The largest derivative of the radius by the length. A steeper tube counts as a step, with a
normal almost like the normal of a disc."""

EFFORT = 40
"""The length up to a station takes about this number times (degree + 1)² multiplications: two rules
of quadrature with together 18 nodes, on up to two intervals, and on more only near cusps."""


def sweep(model: SweepModel, options: MeshOptions, *, is_float32: bool = False) -> Mesh:
    """The mesh of a tube or ribbon, at `resolution[0]` divisions of every piece of its curve."""
    polygon = model.polygon
    swept = sweep_grids(model, options)
    return build_swept_mesh(
        model.name, swept, options, is_float32=is_float32, up=model.up, polygon=polygon
    )


def sweep_grids(model: SweepModel, options: MeshOptions) -> SweptGrids:
    """The samples and faces of a tube or ribbon."""
    divisions, crease = options.resolution[0], options.crease_angle
    paths = build_path(model.pieces, divisions, crease, closed=model.closed)
    profile = model.profile
    # The radius or the width at every station.
    spread = _evaluate(profile.spread, paths.parameters)
    if isinstance(profile, Ribbon):
        facing, camera = profile.facing, profile.camera
        return build_ribbons(paths, spread, facing=facing, camera=camera, faces=options.faces)
    slopes = _slopes(profile, paths)
    caps, faces = profile.caps, options.faces
    return build_tubes(paths, spread, profile.sides, slopes=slopes, caps=caps, faces=faces)


def predict_sweep(model: SweepModel, options: MeshOptions) -> tuple[int, int, int, int]:
    """Upper bounds of the numbers of samples, triangles, quads and grids, without evaluation."""
    stations = bound_station_count(model.pieces, options.resolution[0], options.crease_angle)
    is_tube = isinstance(model.profile, Tube)
    columns = model.profile.sides if isinstance(model.profile, Tube) else 1
    rows = stations + 4 * is_tube  # each of two caps has a rim and a centre
    cells = (rows - 1) * columns
    # Mitred corners, at most one for each station beyond those of a smooth curve, separate runs of
    # stations; each run is a grid.
    runs = stations - model.pieces.count * options.resolution[0]
    grids = runs + 2 * is_tube
    if options.faces == "triangles":
        return rows * (columns + 1), 2 * cells, 0, grids
    # Quads become triangles at pointed stations, and in both caps.
    triangles_at_points = cells if (model.profile.spread == 0).any() else 2 * columns
    return rows * (columns + 1), triangles_at_points, cells, grids


def estimate_effort(model: SweepModel, options: MeshOptions) -> int:
    """The number of multiplications for all lengths, which take most time at high degrees."""
    stations = model.pieces.count * options.resolution[0]
    return stations * EFFORT * (model.pieces.degree + 1) ** 2


def _evaluate(coefficients: FloatArray, t: FloatArray) -> FloatArray:
    """The values of a Bézier function at parameters t; its ends are exact."""
    basis = bernstein(len(coefficients) - 1, t)
    value: FloatArray = (basis * coefficients).sum(axis=1)
    # Rounding must not change a constant, nor exceed the range of the coefficients.
    return np.clip(value, coefficients.min(), coefficients.max())


def _slopes(tube: Tube, paths: Paths) -> FloatArray | None:
    """Derivative of the radius by the length at every station; None if the radius is constant."""
    if len(tube.radii) == 1 or paths.speeds is None:
        return None
    degree = len(tube.radii) - 1
    steps = degree * np.diff(tube.radii)
    rate = (bernstein(degree - 1, paths.parameters) * steps).sum(axis=1)
    min_speed = np.maximum(np.abs(rate) / MAX_SLOPE, np.finfo(np.float64).tiny)
    slopes: FloatArray = rate / np.maximum(paths.speeds, min_speed)
    return slopes
