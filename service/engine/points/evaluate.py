"""Positions, partials, normals and curvatures at single points of a model, as columns."""

from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.evaluation.normals import group_by_batch
from service.engine.points.curvatures import MAX_DISTANCE
from service.engine.points.jets import evaluate_jets
from service.engine.points.places import ParameterPoints
from service.surface.batches import Patches, TensorPatches
from service.surface.lowered import PatchModel

Column: TypeAlias = FloatArray | Bools
Columns: TypeAlias = dict[str, Column]

COLUMNS: tuple[tuple[tuple[str, int], ...], ...] = (
    (("positions", 3),),
    (("du", 3), ("dv", 3), ("normals", 3), ("degenerate", 0)),
    (
        ("duu", 3),
        ("duv", 3),
        ("dvv", 3),
        ("gaussian_curvature", 1),
        ("mean_curvature", 1),
        ("principal_curvatures", 2),
    ),
)
"""For each order of derivatives, the names and widths of its columns; width 0 is a column of
bool."""

SERIES_COST = 100_000
"""The least number of multiplications for the power series of curvatures at one parameter at or
near a pole; the degrees of the patch add to it."""


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def evaluate_points(model: PatchModel, places: ParameterPoints, order: int) -> Columns:
    """The columns up to an order of derivatives, in float64, with one row for each place.

    Partials are derivatives by the parameters of the surface: ∂/∂u = (1/width) ∂/∂local. Curvatures
    are NaN where their limit at a pole is infinite or does not exist. Values that float64 cannot
    store are infinite, for example the curvature of a patch that is 1e-200 long.
    """
    count = len(places.patch)
    columns: dict[str, Column] = {
        name: _empty(count, width) for names in COLUMNS[: order + 1] for name, width in names
    }
    for batch, first, rows in group_by_batch(model.batches, places.patch):
        u, v = places.local[rows].T
        jets = evaluate_jets(batch, places.patch[rows] - first, u, v, order)
        wu, wv = places.widths[rows].T[:, :, np.newaxis]
        columns["positions"][rows] = jets.partials[0]
        if jets.normals is not None and jets.degenerate is not None:
            columns["du"][rows] = jets.partials[1] / wu
            columns["dv"][rows] = jets.partials[2] / wv
            columns["normals"][rows] = jets.normals
            columns["degenerate"][rows] = jets.degenerate
        if (curvatures := jets.curvatures) is not None:
            columns["duu"][rows] = jets.partials[3] / wu / wu
            columns["duv"][rows] = jets.partials[4] / wu / wv
            columns["dvv"][rows] = jets.partials[5] / wv / wv
            columns["gaussian_curvature"][rows] = curvatures[0]
            columns["mean_curvature"][rows] = curvatures[1]
            columns["principal_curvatures"][rows] = curvatures[2:].T
    for column in columns.values():
        if column.dtype != np.bool_:
            np.add(column, 0.0, out=column)  # turns −0 into 0
    return columns


def estimate_effort(model: PatchModel, places: ParameterPoints, order: int) -> int:
    """An estimate of the multiplications of a query if S_u × S_v vanishes at all its places.

    It is a sum over the polynomial S_u × S_v of each patch with a place (its degree is about (3p,
    3q) if rational, else (2p, 2q)), its value at each place, and the series of curvatures at poles.
    """
    if order == 0:
        return 0
    total = 0
    for batch, first, rows in group_by_batch(model.batches, places.patch):
        index = places.patch[rows] - first
        p, q = batch.degree if isinstance(batch, TensorPatches) else (batch.degree, batch.degree)
        # S_u × S_v is a polynomial of up to this multiple of the degrees (p, q).
        factor = 2 if batch.weights is None else 3
        # Products of nets of degrees (p, q) and (2p, 2q), for roughly 3**factor pairs of
        # coordinates.
        cost_of_patch = (p + 1) * (q + 1) * (2 * p + 1) * (2 * q + 1) * 3**factor
        cost_of_place = 3 * (factor * p + 1) * (factor * q + 1)
        total += len(np.unique(index)) * cost_of_patch + len(rows) * cost_of_place
        if order == 2:
            is_near = find_near_poles(batch, index, places.local[rows])
            # Rational partials are quotients of series, which take about as long again.
            cost_of_series = SERIES_COST + 100 * (p + 1) * (q + 1)
            total += int(is_near.sum()) * cost_of_series * (1 if batch.weights is None else 2)
    return total


def find_near_poles(batch: Patches, index: Ints, local: FloatArray) -> Bools:
    """Which local parameters (m, 2) of patches `index` are at or near a side that is one point."""
    u, v = local.T
    collapsed = batch.collapsed[index]
    if isinstance(batch, TensorPatches):
        distances = np.stack([u, 1 - u, v, 1 - v], axis=1)
        degree = max(batch.degree)
    else:
        # The fourth side of a triangle is always one corner, where no series is needed.
        distances, collapsed = np.stack([u, 1 - u - v, v], axis=1), collapsed[:, :3]
        degree = batch.degree
    is_near: Bools = np.any(collapsed & (distances <= MAX_DISTANCE / degree), axis=1)
    return is_near


def _empty(count: int, width: int) -> Column:
    """An uninitialised column with `count` rows; width 0 is a column of bool."""
    if width == 0:
        return np.empty(count, dtype=bool)
    return np.empty(count if width == 1 else (count, width))
