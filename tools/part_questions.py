"""All questions to a part, as pieces of work: few and many points, rays and planes."""

from collections.abc import Iterator

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.encoders.polylines.registry import SECTIONS_BY_NAME
from service.engine.closest.project import ProjectQuery
from service.engine.measures.values import BudgetEnded, MeasureQuery
from service.engine.points.places import PointsQuery
from service.engine.rays.intersect import RayQuery
from service.engine.sections.values import Planes, SectionTolerance
from service.pipeline.cost import Work
from service.pipeline.measure import plan_trials
from service.pipeline.polylines import plan_sections
from service.pipeline.queries import plan_intersect, plan_points, plan_project
from service.surface.brep import BrepSurface

ITEMS, PLANES = (1, 2000), (1, 30)
"""The numbers of points and rays, and of planes, of a question."""


def list_questions(surface: BrepSurface) -> Iterator[tuple[str, Work[bytes]]]:
    """The questions by name; points and rays are in, on and around the part."""
    low, high = surface.bounds()
    rng = np.random.default_rng(37)
    for count in ITEMS:
        points = rng.uniform(low - (high - low) / 2, high + (high - low) / 2, (count, 3))
        aims = rng.uniform(low, high, (count, 3))
        face = rng.integers(len(surface.surfaces), size=count)
        places = _draw_places(surface, face, rng.random((count, 2)))
        yield f"{count} places", plan_points(surface, PointsQuery(places, face, 2))
        for sign in (False, True):
            query = ProjectQuery(points, sign=sign)
            yield f"{count} points{', signs' * sign}", plan_project(surface, query)
        for only_first in (True, False):
            rays = RayQuery(points, aims - points, only_first)
            yield f"{count} rays{', all hits' * (not only_first)}", plan_intersect(surface, rays)
    for count in PLANES:
        normals = rng.normal(size=(count, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        offsets = (rng.uniform(low, high, (count, 3)) * normals).sum(axis=1)
        cut = Planes(normals, offsets), SectionTolerance()
        yield f"{count} planes", plan_sections(surface, cut, SECTIONS_BY_NAME["json"])
    for work in plan_trials(surface, MeasureQuery()):
        yield "measures", work
        try:
            work.run()
        except BudgetEnded:
            continue
        break


def _draw_places(surface: BrepSurface, face: Ints, shares: FloatArray) -> FloatArray:
    """Parameters of faces at shares (m, 2) of their domains."""
    table = surface.surfaces
    starts = table.knot_starts[:-1].reshape(-1, 2)[face]
    degrees, counts = table.degrees[face], table.counts[face]
    low, high = table.knots[starts + degrees], table.knots[starts + counts]
    return np.asarray(low + shares * (high - low))
