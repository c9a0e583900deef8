"""The models of cells for winding numbers: two triangles, and the areas between sides and chords.

A model has three things: a ball that contains the control points of the cell; the corners of the
cell; and the sum, over its four sides, of a bound A of the area between the side and its chord,

    A = ω³ n h Σ_i δ_i / (n + 1)

Here n is the degree of the side, δ_i are the distances of its control points from the chord, h is
the longest distance from one to the next, and ω is the ratio of the greatest weight to the least.
If two sides that are one edge may differ by a gap g, A grows by ω³ n h g.

Proof in docs/proofs.md: "Winding numbers".
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.cells import models as model_rows
from service.engine.cells.tree import Table
from service.engine.nets.partials import largest_length
from service.engine.vectors import UNIT, dot, length, project

SIZE_A, SIZE_B, AREA, GAP_FACTOR, CORNERS, ROW_COUNT = 5, 6, 7, 8, 9, 21
"""The rows of a model, after ball and error: the lengths along a and b, Σ A without g, the factor
of g, and the corners in the order of the border; and the number of rows."""


def chord_models(nets: FloatArray, depth: Ints, largest: float) -> FloatArray:
    """The models (ROW_COUNT, K) of cells with nets (p+1, q+1, 3 or 4, K).

    `depth` (K,) is the number of halvings of each cell, and no control point is further than
    `largest` from the origin.
    """
    p, q = nets.shape[0] - 1, nets.shape[1] - 1
    points, weights = project(nets), nets[:, :, 3] if nets.shape[2] == 4 else None
    table = np.empty((ROW_COUNT, nets.shape[3]))
    # A bound of the errors of control points: `cell_models` has the proof. Below it is taken twice,
    # for the two cells beside an edge.
    error = 4 * UNIT * largest * (depth + 2) * (p + q + 2)
    corners = points[0, 0], points[-1, 0], points[-1, -1], points[0, -1]
    center = (corners[0] + corners[1] + corners[2] + corners[3]) / 4
    table[:3] = center
    table[3] = largest_length(points - center) + 2 * error
    table[model_rows.ERROR] = error
    table[CORNERS:] = np.concatenate(corners)
    # The first two sides run along b, the other two along a.
    areas_and_lengths = [
        _chord_areas(points[side], None if weights is None else weights[side], 2 * error)
        for side in (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1])
    ]
    areas, lengths = np.array(areas_and_lengths).transpose(1, 0, 2)
    table[AREA], table[GAP_FACTOR] = areas.sum(axis=0), lengths.sum(axis=0)
    table[SIZE_B], table[SIZE_A] = np.maximum(lengths[0], lengths[1]), np.maximum(*lengths[2:])
    return table


CHORDS = Table(chord_models, ROW_COUNT, (SIZE_A, SIZE_B))
"""The table of the models for winding numbers."""


def _chord_areas(
    polygons: FloatArray, weights: FloatArray | None, point_error: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """A without g, and the factor ω³ n h of g, of sides with control points (n+1, 3, K).

    The factor also serves as the length of a side. `point_error` (K,) bounds the rounding errors of
    the control points.
    """
    from_begin = polygons - polygons[0]
    steps = np.diff(from_begin, axis=0)
    longest = length(steps).max(axis=0)
    chord = from_begin[-1]
    squared_length = dot(chord, chord)
    # The parameter of the nearest point of the chord's line: from 0 to 1 on the chord.
    along_chord = dot(from_begin, chord) / np.where(squared_length > 0, squared_length, 1.0)
    from_chord = from_begin - np.clip(along_chord, 0.0, 1.0)[:, np.newaxis] * chord
    mean_distance = length(from_chord).mean(axis=0)
    # The last factor is larger than all rounding in this function.
    lengths = len(steps) * (longest + 2 * point_error) * (1 + 2.0**-40)
    if weights is not None:
        lengths *= (weights.max(axis=0) / weights.min(axis=0)) ** 3
    return lengths * (mean_distance + point_error), lengths
