"""Orientation: whether the borders of patches pass along each edge equally in both directions."""

import numpy as np
import pytest

from service.engine.closest.project import ProjectQuery, project_on_surface
from service.engine.connectivity.connect import connect
from service.engine.connectivity.orientation import orient_sides
from service.engine.measures.measure import measure
from service.engine.measures.values import MeasureQuery
from service.surface.batches import TensorPatches
from service.surface.lowered import Part, PatchModel

BAG = np.array(
    [
        [[0, 0, 0], [4, 0, 0], [4, 0, 0], [0, 0, 0]],
        [[0, 0, 2], [3, -3, 2], [3, 3, 2], [0, 0, 2]],
        [[0, 0, 4]] * 4,
    ],
    float,
)
"""A closed patch: the sides v = 0 and v = 1 are one edge, the side u = 1 is a point, and the second
half of the side u = 0 returns along its first half."""


@pytest.mark.parametrize(
    ("shift", "passages", "is_closed"),
    [([0, 0, 0], [0, 0, 1, -1], True), ([0.5, 0, 0], [-1, 0, 1, -1], False)],
)
def test_a_side_that_returns_along_itself_does_not_count(
    shift: list[float], passages: list[int], is_closed: bool
) -> None:
    """If a point of the side u = 0 is shifted, its halves differ, and the bag is open there.

    `passages` has for each side +1 along its edge, −1 against it, 0 if the side does not count.
    """
    net = BAG.copy()
    net[0, 1] += shift
    model = PatchModel("bag", (TensorPatches(net[np.newaxis]),), (Part("bag", 0, 1),))
    oriented = orient_sides(connect(model))
    assert oriented.passage.tolist() == [passages]
    assert oriented.is_closed == is_closed
    # Patch 0 belongs to part 0, the only part.
    assert oriented.find_closed_parts(np.zeros(1, int), 1).tolist() == [is_closed]
    assert oriented.find_unbalanced_sides().tolist() == [[not is_closed, False, False, False]]
    assert (measure(model, MeasureQuery(1e-2)).volume is not None) == is_closed
    query_inside = ProjectQuery(np.array([[1.5, 0, 2.0]]), sign=True)
    assert (project_on_surface(model, query_inside)["signs"] == -1).all() == is_closed
