"""Finds which triangle each pixel of a picture shows, with four samples in each pixel.

A corner of a triangle has homogeneous picture coordinates (X, Y, W): W is the depth in a
perspective picture, and 1 in an orthographic one. Sample (i, j) looks along d = (x_i, y_j, 1). With

    λ_a = d · (b × c),  λ_b = d · (c × a),  λ_c = d · (a × b),  det = a · (b × c)

the sample sees the triangle (a, b, c) if each λ has the sign of det, and then at the barycentric
coordinates λ / Σλ. So triangles that reach behind the eye need no clipping. Along a row of samples
each λ is linear: the samples inside are an interval. Two triangles with a common edge compute the
same end of their intervals, bit for bit, so no sample between them is missed or seen twice.

References
----------
Olano and Greer, Triangle scan conversion using 2D homogeneous coordinates, Graphics Hardware
(1997).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.vectors import cross, dot

SAMPLES = 2
"""The samples of a pixel, in each direction."""

STRIP_PIXELS, FRAGMENTS = 1 << 16, 1 << 18
"""About how many pixels a strip of rows has, and about how many samples of triangles are compared
at once. Together they take less than 64 MB."""


@dataclass(frozen=True, eq=False, slots=True)
class Visible:
    """K pairs of a pixel and a triangle that it shows, in the order of the pixels.

    Attributes
    ----------
    pixel : ndarray of int, shape (K,)
        row · width + column, from the upper left.
    triangle : ndarray of int, shape (K,)
    share : ndarray of float64, shape (K,)
        The share of the samples of the pixel that show the triangle.
    weights : ndarray of float64, shape (3, K)
        Barycentric coordinates in the triangle, the mean over these samples.
    """

    pixel: Ints
    triangle: Ints
    share: FloatArray
    weights: FloatArray


def find_visible(
    corners: FloatArray, depths: FloatArray, triangles: Ints, size: tuple[int, int]
) -> Iterator[Visible]:
    """Find the nearest triangles at all samples, for one strip of rows of pixels after another.

    Parameters
    ----------
    corners : ndarray of float64, shape (3, V)
        Homogeneous coordinates (X, Y, W) of the vertices: X / W and Y / W are pixels from the upper
        left corner of the picture, to the right and down.
    depths : ndarray of float64, shape (V,)
        Distances from the eye along its direction. Only points with a positive depth are seen.
    triangles : ndarray of int, shape (T, 3)
        Both sides of a triangle are seen.
    size : (width, height)
        Pixels.
    """
    width, height = size
    edges = _Edges.of(corners, depths, triangles, size)
    columns = width * SAMPLES
    rows_of_strip = max(1, STRIP_PIXELS // width) * SAMPLES
    for first in range(0, height * SAMPLES, rows_of_strip):
        last = min(first + rows_of_strip, height * SAMPLES)
        strip = _Strip(edges, first, last, columns)
        strip.draw()
        yield _gather(edges, strip, width)


@dataclass(frozen=True, eq=False, slots=True)
class _Edges:
    """The T triangles that a picture may show, in samples in place of pixels.

    Attributes
    ----------
    lines : ndarray of float64, shape (3, 3, T)
        lines[k] are the coefficients (A, B, C) of λ_k = A x + B y + C, with the sign of det.
    depths : ndarray of float64, shape (3, T)
    triangle : ndarray of int, shape (T,)
        Their numbers in the request.
    first_row, last_row : ndarray of int, shape (T,)
        The rows of samples, the last excluded, that the triangle may reach.
    """

    lines: FloatArray
    depths: FloatArray
    triangle: Ints
    first_row: Ints
    last_row: Ints

    @classmethod
    def of(
        cls, corners: FloatArray, depths: FloatArray, triangles: Ints, size: tuple[int, int]
    ) -> "_Edges":
        """The triangles that are in front of the eye and in the rows of the picture."""
        points = corners * np.array([[SAMPLES], [SAMPLES], [1.0]])
        a, b, c = (points[:, row] for row in triangles.T)
        normals = np.stack([cross(b, c), cross(c, a), cross(a, b)])
        side = np.sign(dot(a, normals[0]))
        of_corner = depths[triangles.T]
        low, high = _bound_rows(np.stack([a, b, c]), of_corner, size[1] * SAMPLES)
        seen = (side != 0) & (of_corner > 0).any(axis=0) & (low < high)
        kept = np.flatnonzero(seen)
        return cls(
            normals[:, :, kept] * side[kept], of_corner[:, kept], kept, low[kept], high[kept]
        )


def _bound_rows(points: FloatArray, depths: FloatArray, count: int) -> tuple[Ints, Ints]:
    """The first row (T,), and the row after the last, whose samples are between the corners.

    A triangle that reaches behind the eye may be in any row.
    """
    before = (depths > 0).all(axis=0)
    w = np.where(before, points[:, 2], 1.0)
    y = np.clip(points[:, 1] / w, -1.0, count + 1.0)
    low = np.ceil(y.min(axis=0) - 0.5).astype(np.intp) - 1
    high = np.ceil(y.max(axis=0) - 0.5).astype(np.intp) + 1
    low, high = np.maximum(low, 0), np.minimum(high, count)
    return np.where(before, low, 0), np.where(before, high, count)


class _Strip:
    """The rows [first, last) of samples, with the nearest triangle at each of them.

    `shown` has the row in `edges` of the nearest triangle; the number of triangles where there is
    none.
    """

    def __init__(self, edges: _Edges, first: int, last: int, columns: int) -> None:
        self._edges, self.first, self.last, self._columns = edges, first, last, columns
        self._nearest = np.full((last - first) * columns, np.inf)
        self.shown = np.full((last - first) * columns, len(edges.triangle))

    def draw(self) -> None:
        """Draw all triangles that reach into the strip."""
        edges = self._edges
        low = np.maximum(edges.first_row, self.first)
        high = np.minimum(edges.last_row, self.last)
        chosen = np.flatnonzero(low < high)
        counts = (high - low)[chosen]
        for part in _runs(counts):
            checkpoint()
            lengths = counts[part]
            number = np.repeat(chosen[part], lengths)
            row = np.repeat(low[chosen[part]], lengths) + _count_up(lengths)
            begin, end = _find_intervals(edges.lines[:, :, number], row, self._columns)
            kept = np.flatnonzero(begin < end)
            number, row, begin, end = number[kept], row[kept], begin[kept], end[kept]
            for run in _runs(end - begin):
                self._draw_rows(number[run], row[run], begin[run], end[run])

    def _draw_rows(self, number: Ints, row: Ints, begin: Ints, end: Ints) -> None:
        """Compare the samples [begin, end) of rows of triangles with the nearest so far.

        Of equally near triangles the first is shown.
        """
        edges, lengths = self._edges, end - begin
        index = np.repeat(np.arange(len(number)), lengths)
        column = np.repeat(begin, lengths) + _count_up(lengths)
        sample = (row[index] - self.first) * self._columns + column
        # Σλ z and Σλ along the row are c + a x each.
        lines, depths = edges.lines[:, :, number], edges.depths[:, number]
        a, rest = lines[:, 0], lines[:, 1] * (row + 0.5) + lines[:, 2]
        x = column + 0.5
        above = dot(depths, rest)[index] + dot(depths, a)[index] * x
        below = rest.sum(axis=0)[index] + a.sum(axis=0)[index] * x
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = above / below
        seen = np.flatnonzero(depth > 0)
        sample, depth, index = sample[seen], depth[seen], number[index[seen]]
        before = self._nearest[sample]
        np.minimum.at(self._nearest, sample, depth)
        wins = np.flatnonzero(depth == self._nearest[sample])
        sample, index = sample[wins], index[wins]
        # A sample at which something nearer is seen forgets what it showed.
        self.shown[sample[depth[wins] < before[wins]]] = len(edges.triangle)
        np.minimum.at(self.shown, sample, index)


def _count_up(lengths: Ints) -> Ints:
    """The numbers 0, 1, … of each run of these lengths."""
    return np.arange(int(lengths.sum())) - np.repeat(np.cumsum(lengths) - lengths, lengths)


def _runs(lengths: Ints) -> Iterator[slice]:
    """Runs of rows with about `FRAGMENTS` samples each."""
    ends = np.cumsum(lengths)
    start = 0
    while start < len(lengths):
        before = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, before + FRAGMENTS, side="right")))
        yield slice(start, stop)
        start = stop


def _find_intervals(lines: FloatArray, row: Ints, columns: int) -> tuple[Ints, Ints]:
    """The first column (m,), and that after the last, at which all λ of rows are not negative.

    `lines` is (3, 3, m). An edge that ends one interval begins that of the triangle beside it.
    """
    begin, end = np.zeros(len(row)), np.full(len(row), float(columns))
    for a, b, c in lines:
        rest = b * (row + 0.5) + c
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x = np.clip(np.ceil(-rest / a - 0.5), -1.0, columns + 1.0)
        begin = np.where(a > 0, np.maximum(begin, x), begin)
        end = np.where(a < 0, np.minimum(end, x), end)
        # The edge runs along the row: one of the two triangles at it has the row if rest is 0.
        end = np.where((a == 0) & ((rest < 0) | ((rest == 0) & (b < 0))), 0.0, end)
    return begin.astype(np.intp), end.astype(np.intp)


def _gather(edges: _Edges, strip: _Strip, width: int) -> Visible:
    """The pairs of a pixel and a triangle of a strip."""
    none = len(edges.triangle)
    # Sample k of all pixels in row k, (4, pixels).
    blocks = strip.shown.reshape(-1, SAMPLES, width, SAMPLES).transpose(1, 3, 0, 2)
    samples = blocks.reshape(SAMPLES**2, -1)
    is_whole = (samples[1:] == samples[0]).all(axis=0)
    whole = np.flatnonzero(is_whole & (samples[0] < none))
    mixed = np.flatnonzero(~is_whole)
    pairs = _count_samples(samples[:, mixed].T, none)
    pixel = np.concatenate([whole, mixed[pairs.row]])
    order = np.argsort(pixel, kind="stable")
    pixel = pixel[order]
    number = np.concatenate([samples[0, whole], pairs.number])[order]
    count = np.concatenate([np.full(len(whole), float(SAMPLES**2)), pairs.samples])[order]
    middle = np.full(len(whole), SAMPLES / 2)
    x, y = (np.concatenate([middle, mean])[order] for mean in (pairs.x, pairs.y))
    row, column = np.divmod(pixel, width)
    x += column * SAMPLES
    y += row * SAMPLES + strip.first
    a, b, c = edges.lines[:, :, number].swapaxes(0, 1)
    weights = a * x + b * y + c
    # Rounding may make a weight at an edge negative.
    weights = np.maximum(weights, 0.0)
    weights /= weights.sum(axis=0)
    first = strip.first // SAMPLES * width
    return Visible(first + pixel, edges.triangle[number], count / SAMPLES**2, weights)


class _Pairs(NamedTuple):
    """Rows of samples, numbers that they show, how many samples do, and their mean place (x, y)."""

    row: Ints
    number: Ints
    samples: FloatArray
    x: FloatArray
    y: FloatArray


def _count_samples(samples: Ints, none: int) -> _Pairs:
    """The different numbers below `none` in each row of samples (m, 4)."""
    order = np.argsort(samples, axis=1, kind="stable")
    number = np.take_along_axis(samples, order, axis=1)
    begins = np.ones(number.shape, bool)
    begins[:, 1:] = number[:, 1:] != number[:, :-1]
    run = np.cumsum(begins) - 1
    starts = np.flatnonzero(begins)
    count = np.bincount(run).astype(np.float64)
    column, line = order.ravel() % SAMPLES, order.ravel() // SAMPLES
    x, y = (np.bincount(run, place + 0.5) / count for place in (column, line))
    number = number.ravel()[starts]
    kept = np.flatnonzero(number < none)
    return _Pairs(starts[kept] // SAMPLES**2, number[kept], count[kept], x[kept], y[kept])
