"""The number of array operations does not depend on the number of faces, curves or places."""

import gc
import sys
from collections.abc import Callable
from types import FrameType

import numpy as np
import pytest

from service.bases.arrays import Ints
from service.engine.bounds.clip import clip_parts
from service.engine.trims.boxes import find_part_box
from service.engine.trims.clip import clip_segments
from service.engine.trims.places import SIZE, Places
from service.engine.trims.slack import bound_slack
from service.engine.trims.spline_shapes import find_kinks, measure_polygons
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from tests.engine.trims.tables import build_curves, build_surfaces
from tests.engine.trims.test_slack import build_polygons
from tests.engine.trims.test_surfaces import build_planes


def count_calls(function: Callable[[], object]) -> int:
    """Calls of functions, of Python and of libraries."""
    count = 0

    def profile(frame: FrameType, event: str, argument: object) -> None:
        del frame, argument
        nonlocal count
        count += event in {"call", "c_call"}

    function()  # first calls fill caches
    before = sys.getprofile()
    gc.disable()  # libraries have functions that are called after a collection
    sys.setprofile(profile)
    try:
        function()
    finally:
        sys.setprofile(before)
        gc.enable()
    return count


def repeat(times: int) -> dict[str, Callable[[], object]]:
    """All that is done, with `times` times as many faces, curves and places."""
    rng = np.random.default_rng(7)
    numbers = np.tile(np.arange(6), times)
    surface_table = build_surfaces(rng, 6).select(numbers)
    curve_table = build_curves(rng, 6, 2).select(numbers)
    surfaces = FaceSurfaces.of(surface_table)
    places = Places.of(surfaces, surfaces.low, surfaces.high)
    planes = FaceSurfaces.of(build_planes().select(np.zeros(len(numbers), np.intp)))
    splines = Splines.of(curve_table)
    corners: Ints = rng.integers(0, SIZE + 1, (6, 3, 2))[numbers]
    polygons = build_polygons(corners.astype(float))
    face = np.arange(len(numbers))
    triangles: Ints = corners.transpose(1, 2, 0)
    middle = (splines.start + splines.end) / 2
    points = places.evaluate(face, corners[:, 0])
    box = np.zeros((len(face), 2)), np.full((len(face), 2), SIZE / 3.0)
    return {
        "splines": lambda: Splines.of(curve_table),
        "surfaces": lambda: FaceSurfaces.of(surface_table),
        "planes": lambda: planes.move_planes(planes.low - 1, planes.high),
        "places": lambda: Places.of(surfaces, surfaces.low, surfaces.high),
        "points of curves": lambda: splines.evaluate_derivatives(face, middle, 2),
        "cuts of curves": lambda: [*splines.restrict(splines.cut(face, splines.start, middle))],
        "kinks": lambda: find_kinks(splines),
        "lengths": lambda: measure_polygons(splines),
        "other places": lambda: splines.map_points(box[1], box[1]),
        "points": lambda: places.evaluate(face, corners[:, 0]),
        "partials": lambda: places.evaluate_partials(face, corners[:, 0], 2),
        "triangles": lambda: clip_parts(places, face, triangles),
        "segments": lambda: clip_segments(places, face, triangles[:2]),
        "slack": lambda: bound_slack(places, *polygons, np.zeros(3 * len(face), bool)),
        "box": lambda: find_part_box(places, *box, points),
    }


FEW, MANY = repeat(2), repeat(7)


@pytest.mark.parametrize("name", FEW)
def test_calls_do_not_depend_on_the_number_of_faces(name: str) -> None:
    assert count_calls(MANY[name]) == count_calls(FEW[name]) < 2500
