"""Where rings of one corner cross: facets that fold there are divided at the crossing.

Where a curved tube is continued to the plane of a mitre, the ring of the mitre is ahead of the last
ring on one side of the axis of the corner, and behind it on the other. So two facets between both
rings have sides that run in opposite directions. Such a facet is two triangles that meet at a point
of the axis, in which the sides of both rings cross. This point becomes a vertex.
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, IndexArray, Ints
from service.engine.round_sweeps.frames_of_cells import CellFrames
from service.engine.sweeps.rows import SweptGrids
from service.engine.vectors import dot


def find_crossings(
    frames: CellFrames, positions: FloatArray
) -> tuple[Bools, list[tuple[tuple[int, ...], int, float]]]:
    """The facets that fold, and the places where they do.

    Parameters
    ----------
    positions : ndarray of float64, shape (m, columns, 3)
        The rings of all frames.

    Returns
    -------
    folds : ndarray of bool, shape (m−1, columns−1)
    crossings : list of (rows, column, share)
        The rows of one corner whose sides from `column` to the next cross, and where on them.
    """
    paths = frames.paths
    folds = np.zeros((len(positions) - 1, positions.shape[1] - 1), dtype=bool)
    crossings: list[tuple[tuple[int, ...], int, float]] = []
    if paths.mitres is None:
        return folds, crossings
    is_strip = (frames.leaf < 0) & (frames.turn == 0) & ~paths.is_mitred[1:]
    has_mitre = (paths.mitres[0] != paths.tangents[0]).any(axis=1)
    corners = [(k - 1, k) for k in np.flatnonzero(paths.is_mitred).tolist()]
    if paths.closed and frames.is_corner[0] and has_mitre[0]:
        corners.append((len(positions) - 1, 0))
    for before, after in corners:
        strips = [before - 1] * bool(before > 0 and is_strip[before - 1])
        strips += [after] * bool(after < len(is_strip) and is_strip[after])
        if not strips:
            continue
        first = strips[0]
        steps = dot(positions[first + 1] - positions[first], paths.tangents[0, first], -1)
        columns = np.flatnonzero(steps[:-1] * steps[1:] < 0)
        rows = {before, after, *strips, *(strip + 1 for strip in strips)}
        for column in columns.tolist():
            share = float(steps[column] / (steps[column] - steps[column + 1]))
            crossings.append((tuple(sorted(rows)), column, share))
            folds[strips, column] = True
    return folds, crossings


def divide_folds(
    grids: SweptGrids,
    crossings: list[tuple[tuple[int, ...], int, float]],
    folds: Bools,
    columns: int,
    first: int,
) -> SweptGrids:
    """The grids with a vertex at each crossing, where folding facets become two triangles.

    Parameters
    ----------
    crossings, folds
        The results of `find_crossings`.
    columns, first : int
        The samples of a row, and the number of the row of the first frame.
    """
    if not crossings:
        return grids
    count = len(grids.positions)
    begins, ends, middles, shares = [], [], [], []
    for number, (rows, column, share) in enumerate(crossings):
        for row in rows:
            begins.append((first + row) * columns + column)
            middles.append(count + number)
            shares.append(share)
        ends.append(begins[-1])
    first_samples, share_of = np.array(ends), np.array([share for *_, share in crossings])[:, None]

    def mix(values: FloatArray) -> FloatArray:
        low, high = values[first_samples], values[first_samples + 1]
        return np.concatenate([values, (1 - share_of) * low + share_of * high])

    begin = np.array(begins)
    order = np.argsort(begin)
    folding_rows, places = np.nonzero(folds)
    low = (first + folding_rows) * columns + places
    diagonals = np.sort(np.stack([low + columns, low + 1], axis=1), axis=1)
    triangles = _split(
        grids.triangles.astype(np.intp), begin[order], np.array(middles)[order], diagonals
    )
    return replace(
        grids,
        positions=mix(grids.positions),
        normals=mix(grids.normals),
        uvs=mix(grids.uvs),
        same_position=np.append(grids.same_position, count + np.arange(len(crossings))),
        triangles=triangles,
    )


def _split(triangles: Ints, begins: Ints, middles: Ints, diagonals: Ints) -> IndexArray:
    """The triangles, with sides from samples `begins` to the next samples divided at `middles`.

    Halves with a diagonal of a folding facet come in pairs that cancel; they are left out.
    """
    parts = []
    kept = np.ones(len(triangles), dtype=bool)
    for corner in range(3):
        a, b, c = (triangles[:, (corner + k) % 3] for k in range(3))
        low = np.minimum(a, b)
        number = np.minimum(np.searchsorted(begins, low), len(begins) - 1)
        rows = np.flatnonzero((begins[number] == low) & (np.abs(a - b) == 1))
        kept[rows] = False
        middle = middles[number[rows]]
        parts.append(np.stack([a[rows], middle, c[rows]], axis=1))
        parts.append(np.stack([middle, b[rows], c[rows]], axis=1))
    halves = np.concatenate(parts)
    span = int(max(triangles.max(), middles.max())) + 1
    codes = diagonals[:, 0] * span + diagonals[:, 1]
    for corner in range(3):
        sides = np.sort(halves[:, [corner - 1, corner]], axis=1)
        halves = halves[~np.isin(sides[:, 0] * span + sides[:, 1], codes)]
    return np.concatenate([triangles[kept], halves]).astype(np.uint32)
