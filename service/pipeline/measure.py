"""The measures of a surface as JSON: area, volume, centroid and borders, all with intervals."""

from collections.abc import Iterator
from dataclasses import fields, replace
from functools import partial
from typing import Any

from service.encoders.content import list_skipped_faces
from service.encoders.text import LONGEST_ESCAPE, json_document
from service.engine.measures.joined_surface import RequestSide
from service.engine.measures.measure import measure
from service.engine.measures.values import (
    BUDGET,
    MAX_EDGES,
    MAX_LISTED,
    FaceEdge,
    MeasureQuery,
    Measures,
)
from service.engine.parts.measures.measure import measure_part
from service.errors import InvalidRequest
from service.measuring import Measured
from service.pipeline.brep_checks import check_edges
from service.pipeline.checks import check_surface
from service.pipeline.cost import Work
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.parts import require_exact
from service.pipeline.query_costs import (
    measure_budget,
    measure_cost,
    measure_effort,
    measured_points,
    part_budget,
    part_measures_cost,
)
from service.surface.brep_model import BrepModel
from service.surface.lowered import GroupModel, PatchModel
from service.surface.sizes import SurfaceKind

PART_BYTES, SIDE_BYTES = 800, 600
"""The most bytes of a response for each part, without its name; and for each side or border."""

FIRST_PART_POINTS, FIRST_PART_GROWTH = 1 << 16, 64
"""The budget of the first trial for a part is larger by `FIRST_PART_POINTS`, and by
`FIRST_PART_GROWTH` for each piece of a border and each patch of a face: most parts need no second
trial."""

EDGE_BYTES, FACE_BYTES = 130, 500
"""The most bytes of a response for the length of an edge, and for a face that is skipped."""

PANEL_EFFORT = 4
"""How much more work a panel of a trimmed face is than a patch: it is halved a few times."""

POINT_EFFORT = 5000
"""The approximate number of multiplications for each control point of a cell."""

FIRST_POINTS, FIRST_GROWTH, TRIAL_GROWTH = 1024, 32, 16
"""The budget of the first trial is `FIRST_POINTS` control points, and `FIRST_GROWTH` for each
control point of the surface; every further trial has `TRIAL_GROWTH` times as many. So the trials
that fail together take about 1/15 of the time of the one that succeeds."""


def plan_trials(
    surface: SurfaceKind, query: MeasureQuery, limits: Limits = DEFAULT_LIMITS
) -> Iterator[Work[bytes]]:
    """Plan the measures several times, each time with more memory: the last is `plan_measure`.

    How many cells a measure needs is known only afterwards: most surfaces need few, and their
    measures then take some megabytes in place of 200. A trial with too little memory raises
    `BudgetEnded`; one that succeeds has the same result as `plan_measure`.

    Raises
    ------
    TooLarge
        The surface exceeds a limit.
    """
    surface = require_exact(surface)
    last = plan_measure(surface, query, limits)
    size = surface.size()
    budget = FIRST_POINTS + FIRST_GROWTH * measured_points(size)
    if size.faces:
        stored = surface.stored_size()
        pieces = stored.edge_pieces + stored.face_patches
        budget += FIRST_PART_POINTS + FIRST_PART_GROWTH * pieces
    while budget < _max_budget(surface, limits):
        trial = replace(query, budget=budget, is_trial=True)
        yield _plan(surface, trial, limits)
        budget *= TRIAL_GROWTH
    yield last


def plan_measure(
    surface: SurfaceKind, query: MeasureQuery, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan the measures: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The surface exceeds a limit.
    """
    surface = require_exact(surface)
    return _plan(surface, replace(query, budget=_max_budget(surface, limits)), limits)


def _max_budget(surface: SurfaceKind, limits: Limits) -> int:
    """The most control points of cells: by the time and half the memory that a request may take."""
    size, memory = surface.size(), limits.max_memory // 2
    if size.faces:
        by_memory = part_budget(size, surface.stored_size(), memory)
    else:
        by_memory = measure_budget(size, memory)
    return min(BUDGET, limits.max_multiplications // POINT_EFFORT, by_memory)


def _plan(surface: SurfaceKind, query: MeasureQuery, limits: Limits) -> Work[bytes]:
    """Plan measures with the budget of the query."""
    size = check_surface(surface.size(), limits)
    _check_effort(size.patches, size.degree, limits)
    file_bytes = (
        1000
        + PART_BYTES * size.parts
        + LONGEST_ESCAPE * size.name_bytes
        + 2 * SIDE_BYTES * MAX_LISTED
    )
    if size.faces:
        stored = surface.stored_size()
        check_edges(stored, limits)
        file_bytes += PART_BYTES * MAX_LISTED + FACE_BYTES * stored.faces
        file_bytes += EDGE_BYTES * min(size.edges, MAX_EDGES)
        cost = part_measures_cost(size, stored, query.budget, file_bytes)
    else:
        cost = measure_cost(size, query.budget, file_bytes)
    limits.check_bytes(file_bytes, "/surface")
    limits.check_memory(cost.memory, "The response", "/surface", "a smaller surface")
    return Work(cost, partial(_measure, surface, query, limits))


def _measure(surface: SurfaceKind, query: MeasureQuery, limits: Limits) -> bytes:
    """Measure the surface, and write the response as JSON.

    Raises
    ------
    InvalidRequest
        `not_parametric`: a tube or a ribbon has no patches.
    TooLarge
        `too_costly`: too many patches after a split that joins borders.
    BudgetEnded
        The query is a trial, and needs more cells.
    """

    def check_split(model: PatchModel) -> None:
        degrees = [batch.side_degrees for batch in model.batches]
        # Sides 2 and 3 run along u, sides 0 and 1 along v.
        p, q = max(max(sides[2:]) for sides in degrees), max(max(sides[:2]) for sides in degrees)
        _check_effort(model.patch_count, (p, q), limits)

    panels = PanelEffort(limits)
    try:
        lowered = surface.lower()
        with Measured("measure"):
            if isinstance(lowered, BrepModel) or (
                isinstance(lowered, GroupModel) and lowered.has_breps
            ):
                measures = measure_part(lowered, query, check_split, panels.check)
            else:
                measures = measure(lowered, query, check_split)
            return json_document(_measures_object(measures))
    except InvalidRequest as error:
        raise error.within("/surface") from None


class PanelEffort:
    """The multiplications of all panels of the breps of a request."""

    def __init__(self, limits: Limits) -> None:
        self._limits, self._total = limits, 0

    def check(self, count: int, degree: tuple[int, int]) -> None:
        """Refuse a brep with too many panels, with those of the breps before it."""
        self._total += PANEL_EFFORT * count * measure_effort(degree)
        self._limits.check_effort(
            self._total,
            "The borders of the faces cross more patches than this service measures at once.",
            "/surface",
            "fewer faces, or surfaces with fewer knots",
        )


def _check_effort(patches: int, degree: tuple[int, int], limits: Limits) -> None:
    """Refuse a surface with too many patches for its degree."""
    message = "The surface has more patches than this service measures at once."
    effort = patches * measure_effort(degree)
    limits.check_effort(effort, message, "/surface", "fewer patches, or patches of a lower degree")


def _measures_object(measures: Measures[RequestSide | FaceEdge]) -> dict[str, Any]:
    """The measures as a JSON object; open surfaces have no volume and no centroid."""
    fields_of_measures = _fields_object(measures)
    fields_of_measures.pop("skipped_faces", None)
    return fields_of_measures | {
        "boundaries": [
            {
                "length": each.length,
                "edges": each.edges,
                "closed": each.closed,
                "first_edge": _fields_object(each.first),
            }
            for each in measures.boundaries
        ],
        "faulty_edges": [
            {"open": each.is_open, **_fields_object(each.request_side)}
            for each in measures.faulty_edges
        ],
        "parts": [_fields_object(part) for part in measures.parts],
        **_skipped_fields(measures),
    }


def _skipped_fields(measures: Measures[RequestSide | FaceEdge]) -> dict[str, Any]:
    """The faces of a part that are left out; no field without any."""
    if not measures.skipped_faces:
        return {}
    return {"skipped_faces": list_skipped_faces(measures.skipped_faces, "patch")}


def _fields_object(record: Any) -> dict[str, Any]:
    """The fields of a dataclass in their order, without those that are None."""
    values = {field.name: getattr(record, field.name) for field in fields(record)}
    return {name: value for name, value in values.items() if value is not None}
