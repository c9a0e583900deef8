"""The measures of a surface as JSON: area, volume, centroid and borders, all with intervals."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from service.encoders.text import LONGEST_ESCAPE, json_document
from service.engine.measures.measure import measure
from service.engine.measures.sources import RequestSide
from service.engine.measures.values import (
    BUDGET,
    MAX_LISTED,
    Interval,
    MeasureQuery,
    Measures,
    PartMeasures,
)
from service.errors import InvalidRequest
from service.measuring import Measured
from service.pipeline.checks import check_surface
from service.pipeline.cost import Cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.query_costs import measure_cost, measure_effort
from service.surface.lowered import PatchModel
from service.surface.sizes import SurfaceKind

PART_BYTES, SIDE_BYTES = 800, 600
"""The most bytes of a response for each part, without its name; and for each side or border."""

POINT_EFFORT = 5000
"""The approximate number of multiplications for each control point of a cell."""


@dataclass(frozen=True, eq=False, slots=True)
class MeasureWork:
    """The work of measuring a surface, and its cost."""

    surface: SurfaceKind
    query: MeasureQuery
    limits: Limits
    cost: Cost

    def run(self) -> bytes:
        """Measure the surface, and write the response as JSON.

        Raises
        ------
        InvalidRequest
            `not_parametric`: a tube or a ribbon has no patches.
        TooLarge
            `too_costly`: too many patches after a split that joins borders; or the tolerance needs
            too many cells.
        """
        try:
            lowered = self.surface.lower()
            with Measured("measure"):
                return json_document(
                    measures_object(measure(lowered, self.query, self._check_split_model))
                )
        except InvalidRequest as error:
            raise error.within("/surface") from None

    def _check_split_model(self, model: PatchModel) -> None:
        """Refuse a model that has too many patches after a split that joins borders."""
        degrees = [batch.side_degrees for batch in model.batches]
        # Sides 2 and 3 run along u, sides 0 and 1 along v.
        p, q = max(max(sides[2:]) for sides in degrees), max(max(sides[:2]) for sides in degrees)
        _check_effort(model.patch_count, (p, q), self.limits)


def plan_measure(
    surface: SurfaceKind, query: MeasureQuery, limits: Limits = DEFAULT_LIMITS
) -> MeasureWork:
    """Plan the measures: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The surface exceeds a limit.
    """
    size = surface.size()
    check_surface(size, limits)
    _check_effort(size.patches, size.degree, limits)
    file_bytes = (
        1000
        + PART_BYTES * size.parts
        + LONGEST_ESCAPE * size.name_bytes
        + 2 * SIDE_BYTES * MAX_LISTED
    )
    limits.check_bytes(file_bytes, "The response could become too large.", "/surface")
    # The budget is a number of control points.
    query = replace(query, budget=min(BUDGET, limits.max_multiplications // POINT_EFFORT))
    cost = measure_cost(size, query.budget, file_bytes)
    limits.check_memory(cost.memory, "The response", "/surface", "a smaller surface")
    return MeasureWork(surface, query, limits, cost)


def _check_effort(patches: int, degree: tuple[int, int], limits: Limits) -> None:
    """Refuse a surface with too many patches for its degree."""
    message = "The surface has more patches than this service measures at once."
    effort = patches * measure_effort(degree)
    limits.check_effort(effort, message, "/surface", "fewer patches, or patches of a lower degree")


def measures_object(measures: Measures) -> dict[str, Any]:
    """The measures as a JSON object; open surfaces have no volume and no centroid."""
    return {
        "area": _interval_object(measures.area),
        **_solid_object(measures.volume, measures.centroid),
        "closed": measures.closed,
        "boundary_length": _interval_object(measures.boundary_length),
        "boundary_count": measures.boundary_count,
        "boundaries": [
            {
                "length": _interval_object(each.length),
                "edges": each.edges,
                "closed": each.closed,
                "first_edge": _side_object(each.first),
            }
            for each in measures.boundaries
        ],
        "open_edges": measures.open_edges,
        "inconsistent_edges": measures.inconsistent_edges,
        "faulty_edges": [
            {"open": each.is_open, **_side_object(each.request_side)}
            for each in measures.faulty_edges
        ],
        "parts": [_part_object(part) for part in measures.parts],
        "reached": measures.reached,
        "moved": measures.moved,
    }


def _part_object(part: PartMeasures) -> dict[str, Any]:
    solid = _solid_object(part.volume, part.centroid)
    return {"name": part.name, "area": _interval_object(part.area), **solid}


def _solid_object(
    volume: Interval | None, centroid: tuple[Interval, ...] | None
) -> Mapping[str, Any]:
    solid: dict[str, Any] = {}
    if volume is not None:
        solid["volume"] = _interval_object(volume)
    if centroid is not None:
        solid["centroid"] = [_interval_object(coordinate) for coordinate in centroid]
    return solid


def _interval_object(interval: Interval) -> dict[str, float]:
    return {"value": interval.value, "low": interval.low, "high": interval.high}


def _side_object(request_side: RequestSide) -> dict[str, Any]:
    side: dict[str, Any] = {"side": request_side.side, "uv": request_side.uv}
    if request_side.patch is not None:
        side = {"patch": request_side.patch, **side}
    return side if request_side.surface is None else {"surface": request_side.surface, **side}
