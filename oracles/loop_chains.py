"""Loops as closed polygons of pieces, also where a loop runs around a closed surface.

A piece (5,) is the start and the end of a segment in unit coordinates, and a radius.
"""

import numpy as np

from oracles.brep_documents import Array, Spline
from oracles.flattening import flatten


def list_pieces(
    loop: list[tuple[Spline, bool, float]], *, low: Array, size: Array, flatness: float
) -> Array:
    """The pieces (n, 5) of a loop in unit coordinates: start, end, radius.

    Each curve comes with two values: whether the loop runs against it, and a number for its radii.
    """
    pieces: list[Array] = []
    for curve, is_reversed, more in loop:
        rows = flatten(curve, low, size, flatness)
        rows[:, 4] += more
        pieces.append(rows[::-1][:, [2, 3, 0, 1, 4]] if is_reversed else rows)
    rows = np.concatenate(pieces)
    # Joins where a piece does not begin at the end of the one before.
    gaps = np.flatnonzero((rows[:-1, 2:4] != rows[1:, :2]).any(axis=1))
    joins = np.column_stack([rows[gaps, 2:4], rows[gaps + 1, :2], rows[gaps, 4]])
    return np.insert(rows, gaps + 1, joins, axis=0)


def measure_area(pieces: Array) -> float:
    a, b = pieces[:, :2], pieces[:, 2:4]
    return float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def close_chains(chains: list[Array], period: Array, first: Array, last: Array) -> list[Array]:
    """Polygons of pieces: chains around a closed direction are completed, others are closed.

    A chain in the positive direction of u has its material above, and is completed by the chain
    above that runs in the negative direction, or else by the border of the surface. Along v, the
    material of a positive chain is below, at smaller u.
    """
    polygons: list[Array] = []
    around: dict[int, list[tuple[int, float, Array]]] = {0: [], 1: []}
    for chain in chains:
        step = chain[-1, 2:4] - chain[0, :2]
        turns = np.where(period < np.inf, np.round(step / np.where(period < np.inf, period, 1)), 0)
        if not turns.any():
            polygons.append(_join([chain]))
            continue
        if np.abs(turns).sum() != 1:
            raise ValueError("a loop that runs around a closed surface in both directions")
        axis = int(np.abs(turns).argmax())
        middle = float((chain[:, 1 - axis] + chain[:, 3 - axis]).mean() / 2)
        around[axis].append((int(turns[axis]), middle, chain))
    for axis, entries in around.items():
        other = 1 - axis
        side = 1 if axis == 0 else -1  # of the material of a positive chain
        used: set[int] = set()
        for sign, middle, chain in entries:
            if sign < 0:
                continue
            candidates = [
                (side * (m + k * period[other] - middle) if k else side * (m - middle), n, k)
                for n, (s, m, _) in enumerate(entries)
                if s < 0
                for k in ((-1, 0, 1) if period[other] < np.inf else (0,))
            ]
            candidates = [each for each in candidates if each[0] > 0]
            if candidates:
                _, n, k = min(candidates)
                used.add(n)
                partner = entries[n][2].copy()
                shift = np.zeros(2)
                shift[other] = k * period[other] if k else 0.0
                shift[axis] = period[axis] * round(
                    float((chain[-1, 2 + axis] - partner[0, axis]) / period[axis])
                )
                partner[:, :4] += np.tile(shift, 2)
            else:
                partner = _run_along_border(chain, other, (last if side > 0 else first)[other])
            polygons.append(_join([chain, partner]))
        for n, (sign, _, chain) in enumerate(entries):
            if sign < 0 and n not in used:
                border = _run_along_border(chain, other, (first if side > 0 else last)[other])
                polygons.append(_join([chain, border]))
    return polygons


def _run_along_border(chain: Array, other: int, value: float) -> Array:
    """One piece along a border of the surface, back from the end of a chain to its beginning."""
    piece = chain[:1].copy()
    piece[0, :2], piece[0, 2:4] = chain[-1, 2:4], chain[0, :2]
    piece[0, [other, 2 + other]] = value
    return piece


def _join(chains: list[Array]) -> Array:
    """The chains as one closed polygon, with straight pieces between them."""
    rows: list[Array] = []
    for chain, following in zip(chains, [*chains[1:], chains[0]], strict=True):
        rows.append(chain)
        end, start = chain[-1, 2:4], following[0, :2]
        if (end != start).any():
            rows.append(np.concatenate([end, start, chain[0, 4:]])[np.newaxis])
    return np.concatenate(rows)
