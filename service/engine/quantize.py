"""Meshes with positions on grids: the step of each mesh, and its report.

The step depends on the control points and the width of wires, and not on tolerance or resolution,
except that a mesh which is longer than `grid.MAX_STEPS` steps gets a larger step. Two models of a
group are neighbours if their placements are equal and their patches have a corner in common. Models
that meet along an edge always have such a corner. All models of a chain of neighbours get the
largest of their steps, so that they still meet. All other models have separate steps: so the step
of a small model does not depend on large models in the same group.
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.row_batches import unique_rows
from service.engine.bounds.mesh_deviation import round_up
from service.engine.clustering import DisjointSets
from service.engine.extent import find_extent
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.scenes.placing import scalings
from service.engine.scenes.scene import Scene, arrange, store_positions
from service.engine.stored_positions import (
    MAX_ROUNDING,
    Storage,
    bound_origin_error,
    find_step,
    round_to_grid,
)
from service.engine.vectors import length
from service.engine.wires.draw import find_width
from service.surface.curve_model import SweepModel
from service.surface.lowered import GroupModel, Model, PatchModel, SingleModel


def find_grid_steps(model: Model, options: MeshOptions) -> tuple[float, ...]:
    """The step of each distinct model of a group, or the one step of a single model."""
    if not isinstance(model, GroupModel):
        return (find_step(*_find_bounds(model, options)),)
    steps = np.array([find_step(*_find_bounds(member, options)) for member in model.models])
    chains = DisjointSets(len(steps))
    for first, second in _find_neighbours(model):
        chains.unite(first, second)
    roots = chains.list_roots()
    largest = np.zeros(len(steps))
    np.maximum.at(largest, roots, steps)
    return tuple(largest[roots].tolist())


def find_grid_error(model: Model, options: MeshOptions) -> float:
    """The largest distance, in model units, by which rounding moves a vertex of any member."""
    steps = find_grid_steps(model, options)
    if not isinstance(model, GroupModel):
        return MAX_ROUNDING * steps[0]
    # scalings(…)[1]: the most by which a placement multiplies lengths.
    return max(MAX_ROUNDING * steps[m.model] * scalings(m.matrix)[1] for m in model.members)


def quantize(mesh: Mesh | Scene, model: Model, options: MeshOptions) -> Mesh | Scene:
    """A mesh, or all meshes of a scene, with positions on the grids of their models."""
    steps = find_grid_steps(model, options)
    if isinstance(mesh, Mesh):
        return quantize_mesh(mesh, steps[0])
    if not isinstance(model, GroupModel):
        raise TypeError("A scene is made of a group.")
    return arrange(model, tuple(map(quantize_mesh, mesh.meshes, steps)))


def quantize_mesh(mesh: Mesh, step: float) -> Mesh:
    """The mesh in float32 with all positions, also those of lines, rounded to multiples of a step.

    Every triangle stays, even if two of its corners become one point: so all edges stay, and a
    closed mesh stays closed. The bounds of the deviation grow by the largest distance that a vertex
    moves.
    """
    step = _widen_step(mesh, step)
    storage = Storage(is_float32=True, has_local_origin=True, step=step)
    origin = round_to_grid(mesh.origin, step)
    quantized = store_positions(mesh, storage, origin)
    report = quantized.report
    # Both differences are exact, except for the rounding of coordinates far from zero.
    moves = quantized.positions.astype(np.float64) - mesh.positions.astype(np.float64)
    moves += origin - mesh.origin
    error = float(length(moves, -1).max(initial=0.0)) + bound_origin_error(
        mesh.origin, np.array(report.bounds_min), np.array(report.bounds_max)
    )

    def grow(bound: float | None) -> float | None:
        return None if bound is None else round_up(bound + error)

    return replace(
        quantized,
        parts=tuple(
            replace(part, deviation_bound=grow(part.deviation_bound)) for part in mesh.parts
        ),
        report=replace(
            report,
            deviation_bound=grow(report.deviation_bound),
            mesh_deviation_bound=grow(report.mesh_deviation_bound),
        ),
    )


def _widen_step(mesh: Mesh, step: float) -> float:
    """The step, or a larger one if the mesh with its lines is longer than `MAX_STEPS` steps."""
    arrays = [mesh.positions, *(overlay.positions for overlay in mesh.overlays)]
    # The least, then the greatest coordinates of each array.
    bounds = [np.concatenate(find_extent(rows)) for rows in arrays if len(rows)]
    if not bounds:
        return step
    bounds_in_model = np.array(bounds).reshape(-1, 3).astype(np.float64) + mesh.origin
    return max(step, find_step(bounds_in_model.min(axis=0), bounds_in_model.max(axis=0)))


def _find_bounds(model: SingleModel, options: MeshOptions) -> tuple[FloatArray, FloatArray]:
    """Least and greatest coordinates of a model with its control net and its wires, (3,) each."""
    low, high = model.bounds
    if isinstance(model, SweepModel):
        polygon = model.polygon
        return np.minimum(low, polygon.min(axis=0)), np.maximum(high, polygon.max(axis=0))
    if not isinstance(model, PatchModel):
        return low, high
    lows, highs = zip((low, high), *(net.bounds for net in model.nets), strict=True)
    low, high = np.min(lows, axis=0), np.max(highs, axis=0)
    wire_width = find_width(model, options) if options.has_solid_wires else 0.0
    return low - wire_width, high + wire_width


def _find_neighbours(group: GroupModel) -> Iterator[list[int]]:
    """Pairs of numbers of models that have equal placements and a corner of a patch in common.

    Of several models at one corner, each is paired only with one of them: enough to join all.
    """
    models_by_placement: dict[bytes, set[int]] = defaultdict(set)
    for member in group.members:
        placement = b"" if member.matrix is None else (member.matrix + 0.0).tobytes()
        models_by_placement[placement].add(member.model)
    for model_numbers in models_by_placement.values():
        rows = [(number, _corners(group.models[number])) for number in sorted(model_numbers)]
        model_of_corner = np.concatenate(
            [np.full(len(corners), number) for number, corners in rows]
        )
        first, number = unique_rows(np.concatenate([corners for _, corners in rows]))
        # The first model at each corner, with each model that has this corner.
        pairs = np.stack([model_of_corner[first[number]], model_of_corner], axis=1)
        yield from np.unique(pairs, axis=0).tolist()


def _corners(model: SingleModel) -> FloatArray:
    """The corners of all patches, (N, 3); sweeps and breps have none."""
    if not isinstance(model, PatchModel):
        return np.empty((0, 3))
    return np.concatenate([batch.corners.reshape(-1, 3) for batch in model.batches])
