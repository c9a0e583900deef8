"""First guesses of foot points: the nearest points of tables, in a limited memory."""

import numpy as np

from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.foot_grids import find_nearest
from service.engine.trims.surfaces import FaceSurfaces
from tests.engine.brep.solid_documents import lower
from tools.breps import build_sheet
from tools.memory import measure_memory

POINTS = 8
"""Points for each face."""


def test_guesses_are_nearest_points_of_tables_and_take_a_limited_memory() -> None:
    """2,025 faces of 144 points each, in any order of faces."""
    surfaces = ClosedSurfaces.open(FaceSurfaces.of(lower(build_sheet(45, 45)).surfaces, "sheet"))
    rng = np.random.default_rng(3)
    face = rng.permutation(np.repeat(np.arange(45 * 45), POINTS))
    points = np.stack([face // 45, face % 45, np.zeros(len(face))], axis=1)
    points += rng.uniform(0, 1, points.shape)
    found = find_nearest(surfaces, face, points)
    distance = np.linalg.norm(surfaces.evaluate(face, found) - points, axis=1)
    share = (np.arange(12) + 0.5) / 12
    for u in share[::4]:
        for v in share[::3]:
            place = np.tile([u, v], (len(face), 1))
            other = np.linalg.norm(surfaces.evaluate(face, place) - points, axis=1)
            assert (distance <= other + 1e-12).all()
    assert measure_memory(lambda: find_nearest(surfaces, face, points)) < 60 << 20
