"""Points that count as one."""

from itertools import product

import numpy as np

from service.bases.arrays import FloatArray, Ints


def find_clusters(points: FloatArray, tolerance: float) -> Ints:
    """For each of k points (k, 3) the number of a point that stands for it, at most so far away.

    Points are taken in their order; one that is near none of those before stands for itself.
    """
    count = len(points)
    representatives = np.arange(count)
    # Cells are larger than the tolerance: all near points are in the cells around a point's box.
    size = 4.0 * tolerance
    cells = np.floor(points / size).astype(np.int64)
    low = np.floor((points - tolerance) / size).astype(np.int64)
    high = np.floor((points + tolerance) / size).astype(np.int64)
    is_inner = (low == high).all(axis=1).tolist()
    rows = points.tolist()
    found: dict[tuple[int, int, int], list[int]] = {}
    square = tolerance * tolerance
    lows, highs = low.tolist(), high.tolist()
    for number, (cell, point) in enumerate(zip(cells.tolist(), rows, strict=True)):
        key = (cell[0], cell[1], cell[2])
        x, y, z = point
        keys = [key]
        if not is_inner[number]:
            pairs = zip(lows[number], highs[number], strict=True)
            keys = list(product(*({a, b} for a, b in pairs)))
        for other in (other for each in keys for other in found.get(each, ())):
            a, b, c = rows[other]
            if (a - x) ** 2 + (b - y) ** 2 + (c - z) ** 2 <= square:
                representatives[number] = other
                break
        else:
            found.setdefault(key, []).append(number)
    return representatives
