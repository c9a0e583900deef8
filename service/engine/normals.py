"""Unit normals at any parameter of a patch, poles and other degenerate points included.

The normal is S_u × S_v made unit. Where that vector vanishes the limit from inside the patch is
taken, and for that N = S_u × S_v itself is written in the Bernstein basis: its derivatives, and so
the lowest term that does not vanish, are then known and need not be guessed from neighbours.

Slow beside `service.engine.evaluate`, which therefore sends only those samples here whose normals
it cannot vouch for.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein
from service.engine.degenerate import VANISHING, limit_normals
from service.engine.nets import PatchNets
from service.engine.vectors import cross
from service.surface.lowered import TensorPatches

CHUNK_BYTES = 8 << 20
"""Working memory for one round of gathered nets."""

CHUNK_SAMPLES = 1024
"""Samples of one patch that are worked on at a time."""


def unit_normals(
    patches: TensorPatches, index: NDArray[np.intp], u: FloatArray, v: FloatArray
) -> tuple[FloatArray, int]:
    """Unit normals of patch `index[m]` at (u[m], v[m]), and how many of them are limits.

    Parameters
    ----------
    patches : TensorPatches
    index : ndarray of int, shape (m,)
    u, v : ndarray of float64, shape (m,)
        Parameters in [0, 1].

    Returns
    -------
    normals : ndarray of float64, shape (m, 3)
        Unit length, never NaN. A patch without area has no normals: it gets a unit vector
        perpendicular to its extent.
    limits : int
        Samples at which S_u × S_v vanishes.

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., on degenerate patches, has the case of one
    collapsed side; the general one is the Taylor expansion of N.
    """
    p, q = patches.degree
    net_bytes = 8 * 4 * 3 * (3 * p + 1) * (3 * q + 1)
    normals = np.empty((len(index), 3))
    limits = 0
    for rows in _rounds(index, max(1, CHUNK_BYTES // net_bytes)):
        used, which = np.unique(index[rows], return_inverse=True)
        nets = PatchNets(patches, used)
        for first in range(0, len(rows), CHUNK_SAMPLES):
            part = slice(first, first + CHUNK_SAMPLES)
            here = rows[part]
            normals[here], found = _chunk(nets, (p, q), which[part], u[here], v[here])
            limits += found
    return normals, limits


def _rounds(index: NDArray[np.intp], step: int) -> Iterator[NDArray[np.intp]]:
    """Samples to be treated together: all those of one patch, or a few of several patches.

    The nets of a patch with many samples are prepared once and need not be gathered.
    """
    order = np.argsort(index, kind="stable")
    _, first, counts = np.unique(index[order], return_index=True, return_counts=True)
    many = counts > step
    for begin, count in zip(first[many].tolist(), counts[many].tolist(), strict=True):
        yield order[begin : begin + count]
    rest = order[~np.repeat(many, counts)]
    for begin in range(0, len(rest), step):
        yield rest[begin : begin + step]


def _chunk(
    nets: PatchNets, degree: tuple[int, int], which: NDArray[np.intp], u: FloatArray, v: FloatArray
) -> tuple[FloatArray, int]:
    p, q = degree
    du, dv = nets.partials(
        which, (bernstein(p, u), bernstein(p - 1, u)), (bernstein(q, v), bernstein(q - 1, v))
    )
    vectors = cross(du, dv)
    lengths, length_u, length_v = (np.linalg.norm(rows, axis=-1) for rows in (vectors, du, dv))
    vanishes = lengths <= VANISHING * length_u * length_v
    vanishes |= length_u <= VANISHING * nets.longest_u[which]
    vanishes |= length_v <= VANISHING * nets.longest_v[which]
    zero = np.flatnonzero(vanishes)
    lengths[zero] = 1.0
    normals = vectors / lengths[:, None]
    if len(zero):
        normals[zero] = limit_normals(nets, which[zero], u[zero], v[zero])
    return normals, len(zero)
