"""Shells of an outline: which faces hang together, which way they are turned, which are closed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss

from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import expand_runs, row_slices
from service.cancellation import checkpoint
from service.engine.outlines.faces import OutlineFaces
from service.engine.outlines.runs import Runs
from service.engine.vectors import cross
from service.surface.batches import Patches, TrianglePatches

NODES = 12
"""Number of Gauss points along u and along v of each patch, for the sign of a volume."""

CHUNK_NUMBERS = 1 << 18
"""How many numbers of points are evaluated at once."""


@dataclass(frozen=True, eq=False, slots=True)
class OutlineShells:
    """The shells of F faces with K runs.

    Attributes
    ----------
    shell : ndarray of int, shape (F,)
        The shell of each face, numbered in the order of their first faces.
    is_flipped : ndarray of bool, shape (F,)
        Whether the normal of the face is −(du × dv): so that neighbours agree, and normals of
        closed shells point outwards.
    is_closed : ndarray of bool, shape (shells,)
        Whether each edge of the shell is run along twice, in opposite directions.
    is_shared : ndarray of bool, shape (K,)
        Whether the run has its edge in common with exactly one other run, in a shell.
    """

    shell: Ints
    is_flipped: Bools
    is_closed: Bools
    is_shared: Bools


def find_shells(
    faces: OutlineFaces, runs: Runs, batches: Sequence[Patches], middle: FloatArray
) -> OutlineShells:
    """The shells of the faces of a model with these batches; `middle` is a point near the model."""
    count = len(faces.first)
    lines = np.flatnonzero(~runs.is_pole)
    pairs = _find_pairs(runs, lines)
    f, g = runs.face[pairs].T
    # Neighbours agree if their loops run along the edge in opposite directions.
    differs = runs.is_backward[pairs[:, 0]] == runs.is_backward[pairs[:, 1]]
    shell, is_flipped = _spread(count, f, g, differs)
    agrees = differs == (is_flipped[f] ^ is_flipped[g])
    is_shared = np.zeros(len(runs.face), bool)
    is_shared[pairs[agrees]] = True
    is_closed = np.ones(int(shell.max()) + 1, bool)
    is_closed[shell[runs.face[lines[~is_shared[lines]]]]] = False
    if is_closed.any():
        flux = _sum_flux(faces, batches, middle)
        volumes = np.bincount(shell, np.where(is_flipped, -flux, flux))
        is_flipped ^= (is_closed & (volumes < 0))[shell]
    return OutlineShells(shell, is_flipped, is_closed, is_shared)


def _find_pairs(runs: Runs, lines: Ints) -> Ints:
    """The pairs of runs (k, 2) that alone have one edge in common."""
    order = lines[np.argsort(runs.edge[lines], kind="stable")]
    edge = runs.edge[order]
    uses = np.bincount(edge, minlength=1)
    rows = np.flatnonzero(uses[edge] == 2)
    return order[rows].reshape(-1, 2)


def _spread(count: int, f: Ints, g: Ints, differs: Bools) -> tuple[Ints, Bools]:
    """The shell of each face, and whether it is turned against the first face of its shell.

    Faces f and g (k,) are neighbours; `differs` says whether one of them must be turned.
    """
    neighbours: list[list[tuple[int, bool]]] = [[] for _ in range(count)]
    for a, b, must_turn in zip(f.tolist(), g.tolist(), differs.tolist(), strict=True):
        neighbours[a].append((b, must_turn))
        neighbours[b].append((a, must_turn))
    shell, is_flipped = [-1] * count, [False] * count
    shells = 0
    for start in range(count):
        if shell[start] >= 0:
            continue
        shell[start] = shells
        waiting = [start]
        while waiting:
            face = waiting.pop()
            for other, must_turn in neighbours[face]:
                if shell[other] < 0:
                    shell[other], is_flipped[other] = shells, is_flipped[face] ^ must_turn
                    waiting.append(other)
        shells += 1
    return np.array(shell, np.intp), np.array(is_flipped)


def _sum_flux(faces: OutlineFaces, batches: Sequence[Patches], middle: FloatArray) -> FloatArray:
    """∫∫ (S − o) · (S_u × S_v) of each face by Gauss quadrature, (F,): three times its volume.

    The result tells only the sign of a volume, so the points need not be many.
    """
    flux = np.concatenate([_find_flux(batch, middle) for batch in batches])
    counts = faces.rows * faces.columns
    owner, patch = expand_runs(counts, faces.first)
    return np.bincount(owner, flux[patch], len(counts)).astype(np.float64)


def _find_flux(batch: Patches, middle: FloatArray) -> FloatArray:
    """∫∫ (S − o) · (S_u × S_v) of each patch of a batch, (P,)."""
    tensor = batch.to_tensor() if isinstance(batch, TrianglePatches) else batch
    (p, q), count = tensor.degree, tensor.count
    nodes, shares = leggauss(NODES)
    t = (nodes + 1) / 2
    along_u, along_v = bernstein(p, t), bernstein(q, t)
    slope_u, slope_v = bernstein(p - 1, t), bernstein(q - 1, t)
    flux = np.empty(count)
    for chunk in row_slices(count, 16 * NODES**2, CHUNK_NUMBERS):
        checkpoint()
        weights = None if tensor.weights is None else tensor.weights[chunk]
        net = to_homogeneous(tensor.points[chunk] - middle, weights)
        if weights is None:
            net = np.concatenate([net[..., :3], np.ones((*net.shape[:3], 1))], axis=-1)

        def evaluate(net: FloatArray, basis_u: FloatArray, basis_v: FloatArray) -> FloatArray:
            values: FloatArray = np.einsum("ai,bj,pijd->pabd", basis_u, basis_v, net, optimize=True)
            return values

        values = evaluate(net, along_u, along_v)
        du = evaluate(p * np.diff(net, axis=1), slope_u, along_v)
        dv = evaluate(q * np.diff(net, axis=2), along_u, slope_v)
        w = values[..., 3:]
        points = values[..., :3] / w
        du, dv = ((each[..., :3] - points * each[..., 3:]) / w for each in (du, dv))
        density = (points * cross(du, dv, -1)).sum(axis=-1)
        flux[chunk] = np.einsum("a,b,pab->p", shares, shares, density) / 4
    return flux
