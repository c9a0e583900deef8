"""Surface and parameters in, points, partials, normals and curvatures out."""

from dataclasses import dataclass

from service.encoders import json_points
from service.engine.points.answer import effort, points
from service.engine.points.places import Places, Query, locate
from service.errors import Issue, TooLarge
from service.measuring import measured
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.memory import answering, check_lowering, model_bytes
from service.pipeline.mesh import Lowerable
from service.pipeline.parametric import parametric
from service.surface.lowered import PatchModel


@dataclass(frozen=True, eq=False, slots=True)
class PointsWork:
    """A query that may be answered: everything is known of it but the numbers."""

    model: PatchModel
    places: Places
    order: int

    @property
    def memory(self) -> int:
        """Bytes that the work takes at most, the model and the answer included."""
        return answering(model_bytes(self.model), len(self.places.patch), self.order)

    def run(self) -> bytes:
        """The answer as JSON."""
        with measured("points"):
            columns = points(self.model, self.places, self.order)
        return json_points.encode(columns)


def plan_points(surface: Lowerable, query: Query, limits: Limits = DEFAULT_LIMITS) -> PointsWork:
    """What is to be computed at places of a surface.

    Raises
    ------
    InvalidRequest
        Where a place lies outside the surface, or on no patch; `not_parametric`.
    TooLarge
        From the number of places, and the degrees of the patches on which they lie.
    """
    _check_points(query, limits)
    check_lowering(surface, limits)
    model = parametric(surface.lower())
    places = locate(model, query)
    count = effort(model, places, query.order)
    limits.check_effort(
        count,
        "Patches of so high a degree take long where they are degenerate.",
        f"/{query.field}",
        "fewer points on fewer patches at once",
    )
    work = PointsWork(model, places, query.order)
    where = f"/{query.field}"
    limits.check_memory(work.memory, "The answer", where, "fewer points at once")
    return work


def _check_points(query: Query, limits: Limits) -> None:
    """Refuses queries of too many points."""
    count = len(query.places)
    if count > limits.max_points:
        raise TooLarge(
            Issue(
                "too_many_points",
                "The query has more points than this service computes at once.",
                f"/{query.field}",
                f"{count} points",
                f"at most {limits.max_points}",
            )
        )
    most = json_points.byte_bound(count, query.order)
    limits.check_bytes(most, "The answer could become too large.", f"/{query.field}")
