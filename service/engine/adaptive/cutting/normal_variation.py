"""Turns of normals within cells, and whether cutting a cell reduces them.

Where the surface is smooth, normals turn half as far in each half of a small cell as in the cell.
At a fold, a cusp or a crease inside a patch, normals turn in one of the halves as far as in the
cell, even in small cells, so no cut helps. Therefore small cells are cut only if that helps or
costs little. Cells that are a large part of their patch may always be cut, because there a narrow
bend may look like a crease.
"""

from dataclasses import dataclass
from math import pi, sin, tan

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.engine.vectors import Vectors, cross, dot, length, project

TINY = 1e-7
"""Partials have no normal if the sine of their angle is below this (at a pole, or along a cusp), or
if one of them is shorter than this share of the longest partial in the cell."""

ROUGH, WIDE = 1 / 32, 1 / 8
"""A cell may always be cut while it is longer than this share of its patch, `ROUGH` in parameters
or `WIDE` in space (2 `WIDE` for turns between points that are not on a line along u or v). Where
weights differ much, its shares in parameters and in space differ much."""

FINEST = 1 / 1024
"""A small cell is not cut for its normals if it is shorter than this in parameters."""

GRAIN = 2.0**-16
"""No cell is cut for its normals if it is shorter than this share of the patch's size in space,
however long it is in parameters."""

FALLING = 0.8
"""Halving helps if normals turn in each half by at most this share of their turn in the whole."""

CORNERS = ((0, 0), (0, 2), (2, 0), (2, 2))
"""Indices (i, j) of the corners among the nine points S(i/2, j/2) of a cell."""

PAIRS = np.array(
    [
        ((i, j), (k, m))
        for i in range(2)
        for j in range(3)
        for k in range(i + 1, 3)
        for m in range(3)
        if m != j
    ]
).transpose(1, 2, 0)
"""All pairs of the nine points S(i/2, j/2) that are not on one line along u or v: indices (i, j) of
the first and the second point, shape (2, 2, 18)."""


@dataclass(frozen=True, eq=False, slots=True)
class Scale:
    """Sizes of m cells.

    Attributes
    ----------
    shares : ndarray of float64, shape (2, m)
        Lengths along u and v, as shares of the knot span.
    size : ndarray of float64, shape (m,)
        Size of the patch, in space.
    """

    shares: FloatArray
    size: FloatArray


def compare_normals(
    points: FloatArray, angle: float, scale: Scale, nets: FloatArray | None = None
) -> tuple[Bools, Bools]:
    """Which cells must be cut for their normals, and whether to halve v, not u.

    The normals at nine points are compared in pairs.

    Parameters
    ----------
    points : ndarray of float64, shape (3, 3, 3, m)
    nets : ndarray of float64, shape (p+1, q+1, D, m), optional
        Nine points and nets of the cells, as for `estimate_normals`.
    angle : float
        Radians that normals may turn by.
    scale : Scale
        Sizes of the cells.
    """
    most = find_chord(angle)
    normals = estimate_normals(points, nets)
    # Along u, then along v: the largest turns in half a line and in a whole line of three points,
    # and the longest half of a line.
    half_turns, turns, half_lengths = [], [], []
    for along, at in ((normals, points), (normals.swapaxes(0, 1), points.swapaxes(0, 1))):
        half_turns.append(_measure_apart(along[:2], along[1:]).max(axis=(0, 1)))
        between_ends = _measure_apart(along[0], along[2]).max(axis=0)
        turns.append(np.maximum(between_ends, half_turns[-1]))
        half_lengths.append(length(at[1:] - at[:2]).max(axis=(0, 1)))
    may_halve = [
        _is_halving_helpful((half_turn, turn), share, 2.0 * half_length, scale.size, other <= most)
        for half_turn, turn, share, half_length, other in zip(
            half_turns, turns, scale.shares, half_lengths, turns[::-1], strict=True
        )
    ]
    # Turns between points that are not on a line. If the corners turn little against the middle,
    # halving both u and v helps.
    across = _measure_apart(normals[*PAIRS[0]], normals[*PAIRS[1]]).max(axis=0)
    to_middle = _measure_apart(normals[::2, ::2], normals[1, 1]).max(axis=(0, 1))
    may_quarter = (
        (to_middle <= FALLING * across)
        | (np.maximum(*scale.shares) > ROUGH)
        | (np.maximum(*half_lengths) > WIDE * scale.size)
    )
    # Turns along u and along v; −1 where halving does not help.
    gains = [np.where(may, turn, -1.0) for may, turn in zip(may_halve, turns, strict=True)]
    exceeds = (gains[0] > most) | (gains[1] > most)
    # A turn across is at most the sum of turns along u and v: one of these has at least half of it.
    exceeds |= may_quarter & (across > most) & (np.maximum(*gains) > 0.5 * most)
    return exceeds, gains[0] < gains[1] * (1.0 - 1e-9)  # not if rounding alone makes v larger


def _is_halving_helpful(
    turn: tuple[FloatArray, FloatArray],
    share: FloatArray,
    extent: FloatArray,
    size: FloatArray,
    is_other_flat: Bools,
) -> Bools:
    """Whether halving cells in one direction may help, given the turns of their normals along it.

    Parameters
    ----------
    turn : (half, total)
        The larger turn of the two halves, and the turn of the whole, shape (m,) each.
    share : ndarray of float64, shape (m,)
        Lengths of the cells in parameters.
    extent, size : ndarray of float64, shape (m,)
        Lengths of the cells in space, and sizes of their patches.
    is_other_flat : ndarray of bool, shape (m,)
        Whether normals turn little enough in the other direction. Then a fold runs along that
        direction, and cutting the cell at the fold again and again adds one cell each time. At a
        fold along neither direction, each time would double the number of cells.
    """
    half, total = turn
    is_cheap = ((half <= FALLING * total) | is_other_flat) & (share > FINEST)
    is_helpful: Bools = (share > ROUGH) | (extent > WIDE * size) | is_cheap
    return is_helpful & (extent > GRAIN * size)


def find_height_limit(angle: float, size: FloatArray, scale: Scale | None = None) -> FloatArray:
    """Heights (m,) above chords of sizes (m,) that prove that normals turn by more than the angle.

    A curve that begins and ends on a chord of length d, and is nowhere steeper against the chord
    than α/2, stays below d tan(α/2) / 2. Heights are measured for the whole net of a cell, but
    normals only at nine points, so this limit finds bends between these points. With a scale, it is
    infinite for small cells: at most `ROUGH` long in parameters, along u or v, or of `size` at most
    `ROUGH` times the size of the patch.
    """
    if angle >= pi:
        return np.full(size.shape, np.inf)
    most = size * (0.5 * tan(angle / 2.0))
    if scale is None:
        return most
    is_small = (np.minimum(*scale.shares) <= ROUGH) | (size <= scale.size * ROUGH)
    return np.where(is_small, np.inf, most)


def estimate_normals(points: FloatArray, nets: FloatArray | None = None) -> FloatArray:
    """Unit normals of biquadratic surfaces at the nine points that define them; 0 for no normal.

    With nets, the normals at the corners are those of the nets. A normal that is missing at the end
    of a line (at a pole) is extrapolated from the other end and the middle of the line.

    Parameters
    ----------
    points : ndarray of float64, shape (3, 3, 3, m)
        Nine points of cells; entry [i, j] is the point at u = i/2, v = j/2.
    nets : ndarray of float64, shape (p+1, q+1, D, m), optional
        Nets of the cells.

    Returns
    -------
    ndarray of float64, shape (3, 3, 3, m)
    """
    u, v = _find_slopes(points), _find_slopes(points.swapaxes(0, 1)).swapaxes(0, 1)
    # Shorter partials count as zero.
    least_u, least_v = (TINY * length(slopes).max(axis=(0, 1)) for slopes in (u, v))
    if nets is not None:
        for i, j in CORNERS:
            u[i, j], v[i, j] = _find_legs(nets, i == 2, j == 2)
    normals = cross(u, v)
    size, long_u, long_v = length(normals), length(u), length(v)
    is_regular = (size > TINY * long_u * long_v) & (long_u > least_u) & (long_v > least_v)
    normals *= (is_regular / np.where(is_regular, size, 1.0))[:, :, np.newaxis]
    for lines in (normals, normals.swapaxes(0, 1)):
        a, b, c = lines
        # The normals that turn from b as far as a or c does, but to the other side.
        mirrored_a = (2.0 * dot(a, b))[:, np.newaxis] * b - a
        mirrored_c = (2.0 * dot(c, b))[:, np.newaxis] * b - c
        has_no_a, has_no_c = ((dot(end, end) == 0.0)[:, np.newaxis] for end in (a, c))
        lines[0], lines[2] = np.where(has_no_a, mirrored_c, a), np.where(has_no_c, mirrored_a, c)
    return normals


def find_chord(angle: float) -> float:
    """The distance of two unit vectors at this angle; at most 2, as for π."""
    return 2.0 * sin(min(angle, pi) / 2.0)


def _measure_apart(a: Vectors, b: Vectors) -> FloatArray:
    """Distances of unit normals (…, 3, m); 0 where a normal is missing."""
    missing = (dot(a, a) == 0.0) | (dot(b, b) == 0.0)
    return np.where(missing, 0.0, length(a - b))


def _find_slopes(points: FloatArray) -> FloatArray:
    """Derivatives (axis 0) at 0, ½ and 1 of quadratic curves, given their points (axis 0) there."""
    a, b, c = points
    return np.array([4.0 * b - 3.0 * a - c, c - a, a + 3.0 * c - 4.0 * b])


def _find_legs(nets: FloatArray, far_u: bool, far_v: bool) -> tuple[Vectors, Vectors]:
    """Vectors along both partials at a corner of nets (p+1, q+1, D, m)."""
    p, q = len(nets) - 1, nets.shape[1] - 1
    rows, columns = (p, p - 1) if far_u else (0, 1), (q, q - 1) if far_v else (0, 1)
    # The corner and its neighbours. At a far end the leg points backwards: minus.
    around = project(nets[np.ix_(rows, columns)])
    along_u, along_v = around[1, 0] - around[0, 0], around[0, 1] - around[0, 0]
    return along_u * (-p if far_u else p), along_v * (-q if far_v else q)
