"""Borders of models in tests, and checks that hold for every border."""

from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from oracles.exact import curve_point, to_exact_net
from service.engine.adaptive.borders.border import Border, divide_border
from service.engine.bounds.faces import SPAN, Faces, find_faces
from service.engine.bounds.goal import Goal
from service.engine.connectivity.seams import Seams, find_seams
from service.surface.lowered import PatchModel
from tests.strategies import Array, build_model

MOST = 1_000_000
"""Largest number of triangles, for tests that set no other limit."""


class Bordered(NamedTuple):
    """A model, its faces, and the divisions of their sides."""

    model: PatchModel
    seams: Seams
    faces: Faces
    border: Border

    def find_side(self, face: int, side: int) -> tuple[list[int], list[int], Array]:
        """Places along one side, and the vertices and points at them."""
        rows = slice(*self.border.start[4 * face + side : 4 * face + side + 2].tolist())
        vertex = self.border.vertex[rows]
        return self.border.at[rows].tolist(), vertex.tolist(), self.border.points[vertex]

    def list_bits(self) -> list[bytes]:
        """The points of every side, as bytes, in the direction in which the bytes are less."""
        result = []
        for face in range(len(self.faces.first)):
            for side in range(4):
                points = self.find_side(face, side)[2]
                result.append(min(points.tobytes(), points[::-1].tobytes()))
        return result


def build_border(source: PatchModel | list[Array], goal: Goal, most: int = MOST) -> Bordered:
    """The faces of a model, or of a list of nets, and their border; for `most` triangles."""
    model = build_model(source) if isinstance(source, list) else source
    seams = find_seams(model.batches)
    faces = find_faces(model, seams)
    return Bordered(model, seams, faces, divide_border(faces, seams, goal, most))


def check_border(bordered: Bordered, tolerance: float) -> None:
    """Checks the entries of all sides, and compares them with exact points of the sides.

    Places ascend from end to end, vertices are on the side, and the side is within the tolerance of
    its chords.
    """
    border, faces = bordered.border, bordered.faces
    assert np.array_equal(np.unique(border.vertex), np.arange(len(border.points)))
    patches = [(batch, number) for batch in bordered.model.batches for number in range(batch.count)]
    # Along each side: its first patch, the step from patch to patch, and the number of patches.
    begin, step, spans = faces.list_sides()
    for face in range(len(faces.first)):
        for side in range(4):
            at, vertex, points = bordered.find_side(face, side)
            count = int(spans[face, side])
            assert (at[0], at[-1]) == (0, count * SPAN)
            assert at == sorted(set(at))
            side_patches = begin[face, side] + step[face, side] * np.arange(count)
            collapsed = bordered.seams.collapsed[side_patches, side]
            assert collapsed.all() == collapsed.any() == border.collapsed[face, side]
            if border.collapsed[face, side]:
                assert len(at) == 2
                assert vertex[0] == vertex[1]
                continue
            assert all(a != b for a, b in pairwise(vertex))
            curves = []
            for patch in side_patches.tolist():
                batch, row = patches[patch]
                net, weights = batch.side(side)
                curves.append((net[row], None if weights is None else weights[row]))
            size = max(float(np.ptp(net, axis=0).max()) for net, _ in curves)
            # Relative to the size of the side, or to 1/1000 of its coordinates if that is more.
            rounding = 1e-11 * max(size, 1e-3 * float(np.abs(curves[0][0]).max()))
            for place, point in zip(at, points, strict=True):
                true = _evaluate_curves(curves, Fraction(place, SPAN))
                assert np.abs(true - point).max() <= rounding
            for k in range(len(at) - 1):
                between = [
                    _evaluate_curves(
                        curves, Fraction(at[k], SPAN) + Fraction(at[k + 1] - at[k], SPAN) * i / 4
                    )
                    for i in (1, 2, 3)
                ]
                assert max(_measure_gap(p, points[k], points[k + 1]) for p in between) <= tolerance


def _evaluate_curves(curves: list[tuple[Array, Array | None]], t: Fraction) -> Array:
    """A point of Bézier curves one after the other; curve k is over k ≤ t ≤ k + 1."""
    span = min(int(t), len(curves) - 1)
    points, weights = curves[span]
    (net,) = to_exact_net([points], None if weights is None else [weights])
    result = curve_point(net, t - span)
    if weights is not None:
        result = tuple(x / result[3] for x in result[:3])
    return np.array([float(x) for x in result])


def _measure_gap(point: Array, a: Array, b: Array) -> float:
    """The distance of a point from a segment."""
    chord = b - a
    squared = float(chord @ chord)
    # The nearest point of the segment is a + t chord.
    t = min(1.0, max(0.0, float((point - a) @ chord) / squared)) if squared else 0.0
    return float(np.linalg.norm(point - a - t * chord))
