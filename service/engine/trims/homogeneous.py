"""Points and weights of given spans and patches, a little beyond them too; bounds of speeds."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import expand_runs
from service.engine.nets.patch_nets import PatchNets
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces


def evaluate_spans(
    splines: Splines, curve: Ints, span: Ints, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points (r, c, D) of given spans of curves (r,) at t (r, c), and their weights (r, c)."""
    at = splines.first_break[curve] + span
    low = splines.breaks[at]
    x = (t - low[:, np.newaxis]) / (splines.breaks[at + 1] - low)[:, np.newaxis]
    column = splines.row[curve] + span
    points, weights = np.empty((*t.shape, splines.dimension)), np.ones(t.shape)
    for nets, rows in splines.split(curve):
        basis = bernstein(nets.degree, x[rows].ravel()).reshape(len(rows), t.shape[1], -1)
        value = basis @ nets.nets.take(column[rows], axis=0)
        if nets.is_rational:
            weights[rows] = value[..., -1]
            value = value[..., :-1] / value[..., -1:]
        points[rows] = value
    return points, weights


def evaluate_patches(
    nets: PatchNets, patch: Ints, local: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points (r, c, 3) of patches (r,) at their own parameters (2, r, c); their weights (r, c)."""
    shape = local.shape[1:]
    points, weights = np.empty((*shape, 3)), np.ones(shape)
    for group, rows in nets.split_by_group(patch):
        net = group.nets.take(nets.row[patch[rows]], axis=0)
        p, q = group.degree
        if p == q:  # one call for both directions is faster than two
            both = bernstein(p, local[:, rows].ravel()).reshape(2, len(rows), shape[1], -1)
            along_u, along_v = both
        else:
            along_u, along_v = (
                bernstein(n, local[axis, rows].ravel()).reshape(len(rows), shape[1], -1)
                for axis, n in enumerate((p, q))
            )
        lines = along_u @ net.reshape(len(rows), p + 1, -1)
        lines = lines.reshape(len(rows), shape[1], q + 1, -1)
        value = lines[:, :, 0] * along_v[..., :1]
        for j in range(1, q + 1):
            value += lines[:, :, j] * along_v[..., j : j + 1]
        if group.is_rational:
            weights[rows] = value[..., 3]
            value = value[..., :3] / value[..., 3:]
        points[rows] = value + nets.middles[:, patch[rows]].T[:, np.newaxis]
    return points, weights


def find_least_weights(splines: Splines, curve: Ints, span: Ints) -> FloatArray:
    """The least weights (m,) of the nets of spans of curves."""
    column = splines.row[curve] + span
    least = np.ones(len(curve))
    for nets, rows in splines.split(curve):
        if nets.is_rational:
            least[rows] = nets.values[:, -1].min(axis=0)[column[rows]]
    return least


def find_least_patch_weights(nets: PatchNets, patch: Ints) -> FloatArray:
    """The least weights (m,) of the nets of patches."""
    least = np.ones(len(patch))
    for group, rows in nets.split_by_group(patch):
        if group.is_rational:
            least[rows] = group.values[:, :, 3].min(axis=(0, 1))[nets.row[patch[rows]]]
    return least


def bound_speeds(splines: Splines, curve: Ints, span: Ints) -> FloatArray:
    """Bounds (D, m) of the derivatives of each coordinate of curves over spans.

    For C = X / w about the first point, with |C| ≤ r, C′ = (X′ − w′ C) / w is at most
    n (max |ΔX| + r max |Δw|) / min w.
    """
    at = splines.first_break[curve] + span
    width = splines.breaks[at + 1] - splines.breaks[at]
    column = splines.row[curve] + span
    bounds = np.empty((splines.dimension, len(curve)))
    for nets, rows in splines.split(curve):
        values = nets.values.take(column[rows], axis=2)
        size = splines.dimension
        if nets.is_rational:
            weights = values[:, size:]
            points = values[:, :size] - values[:1, :size] / weights[:1] * weights
            reach = np.abs(points / weights).max(axis=0)
            steps = np.abs(points[1:] - points[:-1]).max(axis=0)
            steps += reach * np.abs(weights[1:] - weights[:-1]).max(axis=0)
            steps /= weights.min(axis=0)
        else:
            steps = np.abs(values[1:] - values[:-1]).max(axis=0)
        bounds[:, rows] = nets.degree * steps / width[rows]
    return bounds


def bound_partials(surfaces: FaceSurfaces) -> FloatArray:
    """Bounds (2, P) of |S_u| and |S_v| over each patch, for parameters of the surfaces."""
    nets, faces, breaks = surfaces.nets, surfaces.faces, surfaces.breaks
    bounds = np.empty((2, len(nets.row)))
    for group in nets.groups:
        bounds[:, group.patches] = group.partial_bounds
    face, number = expand_runs(faces.spans.prod(axis=0))
    patch = faces.first[face] + number
    for axis, span in enumerate(np.divmod(number, faces.spans[1, face])):
        at = breaks.first[2 * face + axis] + span
        bounds[axis, patch] /= breaks.values[at + 1] - breaks.values[at]
    return bounds
