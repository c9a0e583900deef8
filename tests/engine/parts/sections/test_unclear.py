"""Singular cells without arcs: those that the region of a face only crosses count, too."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from service.bases.arrays import FloatArray
from service.engine.parts.build import build_part
from service.engine.parts.part import Part
from service.engine.parts.sections.face_lines import FaceNets
from service.engine.parts.sections.unclear import UnclearCells
from service.engine.sections.borders import ONE
from service.engine.sections.cells import SINGULAR
from service.engine.trims.inside import OUTSIDE
from tests.engine.brep.solid_documents import lower

WIDTH = 1e-4
"""The region is a strip of this width along a diagonal of a square."""


def build_strip() -> Part:
    net = [[[x, y, 0] for y in (0, 1)] for x in (0, 1)]
    low, high, half = 0.1, 0.9, WIDTH / 2
    corners = [[low + half, low - half], [high + half, high - half]]
    corners += [point[::-1] for point in corners[::-1]]
    pcurves = [{"control_points": [corners[k - 1], corners[k]]} for k in range(4)]
    face = {"surface": {"control_net": net}, "loops": [{"pcurves": pcurves}]}
    return build_part(lower({"type": "brep", "up": "z", "vertices": [], "faces": [face]}))


def list_kept(faces: FaceNets, rectangles: FloatArray) -> FloatArray:
    """The middles of the singular cells with these rectangles (4, m) that count."""
    count = rectangles.shape[1]
    whole = np.rint(rectangles * ONE).astype(np.int64)
    zero = np.zeros(count, np.intp)
    cells = SimpleNamespace(kind=np.full(count, SINGULAR), rectangle=whole, net=zero, plane=zero)
    found = SimpleNamespace(cells=cells, arcs=SimpleNamespace(cell=np.zeros(0, np.intp)))
    return UnclearCells.of(faces, cast(Any, found), 0).middles


@pytest.mark.parametrize("size", [1e-3, 1e-2])
def test_a_cell_counts_that_a_region_crosses_between_its_corners_and_its_middle(
    size: float,
) -> None:
    """The corners and the middle of a cell beside the diagonal are all outside of the strip."""
    part = build_strip()
    faces = FaceNets.of(part)
    crossed = np.array([0.5, 0.5 + size, 0.5 + size / 4, 0.5 + size * 5 / 4])
    beside = crossed + np.array([0, 0, 2, 2]) * size
    u, v = crossed[:2], crossed[2:]
    samples = np.array([[a, b] for a in u for b in v] + [[u.mean(), v.mean()]]).T
    zero = np.zeros(5, np.intp)
    assert (part.trims.find_inside(zero, samples) == OUTSIDE).all()
    middles = list_kept(faces, np.stack([crossed, beside], axis=1))
    assert len(middles) == 1
    assert np.abs(middles[0, 0] - middles[0, 1]) < size
