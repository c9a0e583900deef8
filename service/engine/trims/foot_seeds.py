"""Foot points of seeds: of a few points of each curve, without a parameter curve as a guess.

Seeds are projected to the surface of the face of their curve: from the nearest point of a coarse
table of the surface, and from the foot points of neighbouring seeds. Along closed axes the foot
points are continued without jumps. At poles, where one parameter is free, it is that of the nearest
seed.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import count_runs, find_begins
from service.engine.trims.closure import AT_POLE, ClosedSurfaces
from service.engine.trims.foot_grids import find_nearest, list_near
from service.engine.trims.inversion import find_feet
from service.engine.trims.pole_frames import PoleFrames

FAR, MOST_FAR, STARTS = 1e5, 1024, 8
"""Seeds that are further than `FAR` tolerances from their feet, up to `MOST_FAR` of them, look for
nearer ones from `STARTS`² places: at sharp rims Newton's method may end on the wrong side."""

ROUNDS = 256
"""The most rounds in which seeds are compared with their neighbours."""


def find_seed_feet(
    surfaces: ClosedSurfaces,
    face: Ints,
    points: FloatArray,
    curve: Ints,
    tolerance: float,
    *,
    is_near: Bools,
) -> FloatArray:
    """Foot points (m, 2) of seeds (m, 3) of curves (m,), without a parameter curve as a guess.

    Distances that differ by less than `tolerance` are equal: then the neighbour's foot is taken.
    `is_near` (m,) tells the seeds of curves that pass near a pole.
    """
    feet, distance = find_feet(surfaces, face, points, find_nearest(surfaces, face, points))
    for axis, end in ((0, 0), (0, 1), (1, 0), (1, 1)) if is_near.any() else ():
        rows = (is_near & surfaces.is_pole[face, axis, end]).nonzero()[0]
        if len(rows):
            guess = PoleFrames.of(surfaces, face[rows], axis, end).guess(points[rows])
            other, apart = find_feet(surfaces, face[rows], points[rows], guess)
            is_nearer = apart < distance[rows]
            feet[rows[is_nearer]], distance[rows[is_nearer]] = other[is_nearer], apart[is_nearer]
    far = (distance > FAR * tolerance).nonzero()[0][:MOST_FAR]
    if len(far):
        other, apart = _find_from_everywhere(surfaces, face[far], points[far])
        is_nearer = apart < distance[far] - tolerance
        feet[far[is_nearer]], distance[far[is_nearer]] = other[is_nearer], apart[is_nearer]
    far = (distance > FAR * tolerance).nonzero()[0][:MOST_FAR]
    if len(far):
        other, apart = _find_from_near(surfaces, face[far], points[far])
        is_nearer = apart < distance[far] - tolerance
        feet[far[is_nearer]], distance[far[is_nearer]] = other[is_nearer], apart[is_nearer]
    _compare_neighbours(surfaces, (face, points, curve), (feet, distance), tolerance)
    poles = surfaces.find_poles(face, points, AT_POLE * tolerance)
    feet = _set_poles(surfaces, face, feet, curve, poles)
    return continue_feet(surfaces, face, feet, curve)


def _compare_neighbours(
    surfaces: ClosedSurfaces,
    seeds: tuple[Ints, FloatArray, Ints],
    found: tuple[FloatArray, FloatArray],
    tolerance: float,
) -> None:
    """Replace feet by those found from the feet of the seeds before and after, if these are nearer.

    `seeds` are faces, points and curves, `found` feet (m, 2) and distances (m,). Seeds that are far
    away are compared again when a neighbour has changed: runs of seeds on another turn of a screw
    are set right from their ends.
    """
    (face, points, curve), (feet, distance) = seeds, found
    is_inner = np.append(curve[1:] == curve[:-1], False)
    is_changed = np.ones(len(curve), bool)
    for turn in range(ROUNDS):
        before = is_changed
        is_changed = np.zeros(len(curve), bool)
        for step in (1, -1):
            source = (is_inner if step > 0 else np.roll(is_inner, 1)) & before
            rows = source.nonzero()[0]
            if turn:
                rows = rows[distance[rows + step] > FAR * tolerance]
            to = rows + step
            other, apart = find_feet(surfaces, face[to], points[to], feet[rows])
            is_nearer = apart < distance[to] - tolerance
            chosen = to[is_nearer]
            feet[chosen], distance[chosen] = other[is_nearer], apart[is_nearer]
            is_changed[chosen] = True
        if not is_changed.any():
            break


def _find_from_everywhere(
    surfaces: ClosedSurfaces, face: Ints, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The nearest of the feet (m, 2) found from `STARTS`² places of each surface; and how near."""
    share = (np.arange(STARTS) + 0.5) / STARTS
    grid = np.stack(np.meshgrid(share, share, indexing="ij"), axis=-1).reshape(-1, 2)
    count, every = len(grid), np.arange(len(face))
    guess = surfaces.low[face][:, np.newaxis] + surfaces.period[face][:, np.newaxis] * grid
    run = np.repeat(every, count)
    feet, distance = find_feet(surfaces, face[run], points[run], guess.reshape(-1, 2))
    least = distance.reshape(-1, count).argmin(axis=1)
    chosen = every * count + least
    return feet[chosen], distance[chosen]


def _find_from_near(
    surfaces: ClosedSurfaces, face: Ints, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The nearest of the feet (m, 2) found from all near points of a grid; and how near."""
    run, guess = list_near(surfaces, face, points)
    found, distances = find_feet(surfaces, face[run], points[run], guess)
    order = np.lexsort((distances, run))
    chosen = order[find_begins(run[order])]
    feet, distance = np.zeros((len(face), 2)), np.full(len(face), np.inf)
    feet[run[chosen]], distance[run[chosen]] = found[chosen], distances[chosen]
    return feet, distance


def continue_feet(
    surfaces: ClosedSurfaces, face: Ints, feet: FloatArray, curve: Ints
) -> FloatArray:
    """Feet (m, 2), moved by periods, so that none is more than half a period from that before."""
    if not surfaces.is_closed[face].any():
        return feet
    period = surfaces.period[face]
    turns = np.zeros_like(feet)
    turns[1:] = np.rint((feet[:-1] - feet[1:]) / period[1:])
    turns *= surfaces.is_closed[face]
    begins = find_begins(curve)
    turns[begins] = 0.0
    total = np.cumsum(turns, axis=0)
    runs = count_runs(begins, len(curve))
    total -= np.repeat(total[begins], runs, axis=0)
    continued: FloatArray = feet + total * period
    return continued


def _set_poles(
    surfaces: ClosedSurfaces, face: Ints, feet: FloatArray, curve: Ints, pole: tuple[Ints, Ints]
) -> FloatArray:
    """Feet, with those at poles on their sides, at the free parameter of the nearest other seed."""
    axis, end = pole
    at_pole: Bools = axis >= 0
    rows = at_pole.nonzero()[0]
    if not len(rows):
        return feet
    number = np.arange(len(face))
    before = np.maximum.accumulate(np.where(at_pole, -1, number))
    after = np.minimum.accumulate(np.where(at_pole, len(face), number)[::-1])[::-1]
    previous, following = before[rows], np.minimum(after[rows], len(face) - 1)
    has_previous = (previous >= 0) & (curve[previous] == curve[rows])
    has_following = (curve[following] == curve[rows]) & ~at_pole[following]
    near = np.where(
        has_previous & ~(has_following & (following - rows < rows - previous)), previous, following
    )
    feet = feet.copy()
    is_known = has_previous | has_following
    feet[rows[is_known]] = feet[near[is_known]]
    side = np.where(end[rows] == 0, surfaces.low[face[rows], axis[rows]], 0.0)
    side += np.where(end[rows] == 1, surfaces.surfaces.high[face[rows], axis[rows]], 0.0)
    feet[rows, axis[rows]] = side
    return feet
