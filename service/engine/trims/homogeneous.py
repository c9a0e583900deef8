"""Points and weights of given spans and patches, a little beyond them too; bounds of speeds."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import expand_runs, row_slices
from service.engine.nets.patch_nets import PatchNets
from service.engine.trims.slack import bound_lengths
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces

CHUNK = 1 << 17
"""Numbers in the nets of one chunk."""


def evaluate_spans(
    splines: Splines, curve: Ints, span: Ints, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points (m, D) of given spans of curves at t (m,), and their weights (m,)."""
    at = splines.first_break[curve] + span
    low = splines.breaks[at]
    x = (t - low) / (splines.breaks[at + 1] - low)
    column = splines.row[curve] + span
    points, weights = np.empty((len(curve), splines.dimension)), np.ones(len(curve))
    for nets, rows in splines.split(curve):
        basis = bernstein(nets.degree, x[rows]).T[:, np.newaxis]
        value = (nets.values.take(column[rows], axis=2) * basis).sum(axis=0)
        if nets.is_rational:
            weights[rows] = value[-1]
            value = value[:-1] / value[-1]
        points[rows] = value.T
    return points, weights


def evaluate_patches(
    nets: PatchNets, patch: Ints, local: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points (m, 3) of patches at their own parameters (2, m), and their weights (m,)."""
    points, weights = np.empty((len(patch), 3)), np.ones(len(patch))
    for group, indices in nets.split_by_group(patch):
        p, q = group.degree
        for chunk in row_slices(len(indices), group.values[..., 0].size, CHUNK):
            rows = indices[chunk]
            value = group.values.take(nets.row[patch[rows]], axis=3)
            value = (value * bernstein(q, local[1, rows]).T[:, np.newaxis]).sum(axis=1)
            value = (value * bernstein(p, local[0, rows]).T[:, np.newaxis]).sum(axis=0)
            if group.is_rational:
                weights[rows] = value[3]
                value = value[:3] / value[3]
            points[rows] = (value + nets.middles[:, patch[rows]]).T
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
            steps = np.abs(np.diff(points, axis=0)).max(axis=0)
            steps += reach * np.abs(np.diff(weights, axis=0)).max(axis=0)
            steps /= weights.min(axis=0)
        else:
            steps = np.abs(np.diff(values, axis=0)).max(axis=0)
        bounds[:, rows] = nets.degree * steps / width[rows]
    return bounds


def bound_partials(surfaces: FaceSurfaces) -> FloatArray:
    """Bounds (2, P) of |S_u| and |S_v| over each patch, for parameters of the surfaces."""
    nets, faces, breaks = surfaces.nets, surfaces.faces, surfaces.breaks
    bounds = np.empty((2, len(nets.row)))
    for group in nets.groups:
        bounds[:, group.patches] = bound_lengths(group, np.arange(len(group.patches)))
    face, number = expand_runs(faces.spans.prod(axis=0))
    patch = faces.first[face] + number
    for axis, span in enumerate(np.divmod(number, faces.spans[1, face])):
        at = breaks.first[2 * face + axis] + span
        bounds[axis, patch] /= breaks.values[at + 1] - breaks.values[at]
    return bounds
