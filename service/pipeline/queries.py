"""Queries whose answers are JSON: points at parameters, closest points, and hits of rays."""

from dataclasses import replace
from functools import partial

import numpy as np

from service.bases.arrays import AnyArray, FloatArray, Ints
from service.encoders.json_mesh import points_bound
from service.encoders.text import FLOAT64_CHARS, json_document
from service.engine.brep.inside import find_inside
from service.engine.brep.preparation.prepare import prepare
from service.engine.closest.project import ProjectQuery, project_on_curve, project_on_surface
from service.engine.points.evaluate import estimate_effort, evaluate_points
from service.engine.points.places import PointsQuery, locate, locate_numbered
from service.engine.rays.intersect import RayQuery, intersect_rays
from service.engine.trims.inside import INSIDE, OUTSIDE, UNDECIDED
from service.engine.trims.surfaces import FaceSurfaces
from service.errors import InvalidRequest
from service.measuring import Measured
from service.pipeline.brep_checks import check_edges
from service.pipeline.checks import check_surface, number_patches, require_patches
from service.pipeline.cost import Work
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_items
from service.pipeline.query_costs import (
    HIT_JSON_BYTES,
    SearchedNets,
    points_cost,
    project_cost,
    rays_cost,
    searched_nets,
)
from service.surface.brep_model import BrepModel
from service.surface.curve import BezierCurve, BsplineCurve, Curve
from service.surface.sizes import SurfaceKind

MAX_ITEMS = 100_000
"""The most points or rays for which a query searches."""

POINT_NUMBERS = 16
"""The most numbers that a response has for each closest point."""

HITS_PER_RAY, MIN_HITS = 8, 10_000
"""If a request asks for all hits of each ray, the response may list at most `HITS_PER_RAY` times
the number of rays, or at most `MIN_HITS` hits if that is more."""


def plan_points(
    surface: SurfaceKind, query: PointsQuery, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan the points of a surface: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The surface or the query exceeds a limit.
    """
    where, count = f"/{query.field}", len(query.places)
    check_items("too_many_points", count, limits.max_points, where)
    limits.check_bytes(points_bound(count, query.order), where)
    size = check_surface(surface.stored_size(), limits)
    check_edges(size, limits)
    cost = points_cost(size, count, query.order)
    limits.check_memory(cost.memory, "The response", where, "fewer points at once")
    return Work(cost, partial(_evaluate, surface, query, limits))


def _evaluate(surface: SurfaceKind, query: PointsQuery, limits: Limits) -> bytes:
    """Evaluate the surface, and write the response as JSON.

    Raises
    ------
    InvalidRequest
        A place is outside the domain, or its patch does not exist; `not_parametric`; a face of a
        brep is invalid.
    TooLarge
        The patches of these places have too high degrees.
    """
    lowered = surface.lower()
    if isinstance(lowered, BrepModel):
        surfaces = FaceSurfaces.of(lowered.surfaces)
        model = replace(surfaces.model, domains=surfaces.list_domains())
        places, faces = locate_numbered(model, query)
    else:
        model = require_patches(lowered)
        places, faces = locate(model, query), None
    limits.check_effort(
        estimate_effort(model, places, query.order),
        "Patches of so high a degree take long where they are degenerate.",
        f"/{query.field}",
        "fewer points on fewer patches at once",
    )
    with Measured("points"):
        columns = dict(evaluate_points(model, places, query.order))
        if isinstance(lowered, BrepModel) and faces is not None:
            inside = _find_inside(lowered, faces, query.places, columns["positions"])
            return json_document(columns | {"inside": inside})
    return json_document(columns)


def _find_inside(
    model: BrepModel, faces: Ints, parameters: FloatArray, positions: AnyArray
) -> list[bool | None]:
    """Whether points are inside the trims of their faces; None where this is not decided."""
    try:
        prepared = prepare(model)
    except InvalidRequest as error:
        raise error.within("/surface") from None
    points = np.asarray(positions, dtype=np.float64)
    inside = find_inside(prepared, faces, parameters, points)
    answers = {INSIDE: True, OUTSIDE: False, UNDECIDED: None}
    return [answers[each] for each in inside.tolist()]


def plan_project(
    shape: SurfaceKind | Curve, query: ProjectQuery, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan a query for closest points: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The shape or the query exceeds a limit.
    """
    count, where = len(query.points), "/points"
    check_items("too_many_points", count, min(MAX_ITEMS, limits.max_points), where)
    file_bytes = 1000 + count * POINT_NUMBERS * (FLOAT64_CHARS + 2)
    limits.check_bytes(file_bytes, where)
    if isinstance(shape, BezierCurve | BsplineCurve):
        pieces = shape.lower()  # takes no time: the curve was lowered when it was created
        nets = SearchedNets(pieces.count, (pieces.degree, 0), pieces.points.nbytes)
    else:
        nets = searched_nets(check_surface(shape.stored_size(), limits))
    cost = project_cost(nets, count, file_bytes, sign=query.sign)
    instead = "a smaller surface, fewer points at once"
    limits.check_memory(cost.memory, "The response", where, instead)
    return Work(cost, partial(_project, shape, query))


def _project(shape: SurfaceKind | Curve, query: ProjectQuery) -> bytes:
    """Find the closest points, and write the response as JSON.

    Raises
    ------
    InvalidRequest
        `not_parametric`: a tube or a ribbon has no patches.
    """
    if isinstance(shape, BezierCurve | BsplineCurve):
        with Measured("project"):
            return json_document(project_on_curve(shape.lower(), query))
    model = number_patches(shape.lower())
    with Measured("project"):
        return json_document(project_on_surface(model, query))


def plan_intersect(
    surface: SurfaceKind, query: RayQuery, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan the hits of rays: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The surface or the query exceeds a limit.
    """
    max_hits = count = len(query.origins)
    check_items("too_many_rays", count, min(MAX_ITEMS, limits.max_points), "/rays")
    if not query.only_first:
        max_hits = min(max(HITS_PER_RAY * count, MIN_HITS), limits.max_bytes // HIT_JSON_BYTES)
    size = check_surface(surface.stored_size(), limits)
    # The response has the number of hits of each ray.
    file_bytes = 1000 + count * 16 + max_hits * HIT_JSON_BYTES
    cost = rays_cost(searched_nets(size), count, max_hits, file_bytes)
    limits.check_bytes(file_bytes, "/rays")
    instead = "a smaller surface, fewer rays at once"
    limits.check_memory(cost.memory, "The response", "/rays", instead)
    return Work(cost, partial(_intersect, surface, query, max_hits))


def _intersect(surface: SurfaceKind, query: RayQuery, max_hits: int) -> bytes:
    """Find the hits, and write the response as JSON.

    Raises
    ------
    InvalidRequest
        `not_parametric`: a tube or a ribbon has no patches.
    TooLarge
        `too_many_hits`.
    """
    model = number_patches(surface.lower())
    with Measured("intersect"):
        return json_document(intersect_rays(model, query, max_hits))
