"""The JSON language of measures: a surface, and how wide the intervals of its measures may be."""

from typing import Annotated

from pydantic import Field

from service.engine.measures.values import (
    MAX_TOLERANCE,
    TOLERANCE,
    WELD_TOLERANCE,
    MeasureQuery,
)
from service.engine.options import MAX_WELD_TOLERANCE
from service.schemas.request import SurfaceRequest

MIN_TOLERANCE = 1e-12
"""The least tolerance that a request may ask for: rounding alone makes intervals this wide."""


class MeasureRequest(SurfaceRequest):
    """A surface to measure."""

    tolerance: Annotated[float, Field(ge=MIN_TOLERANCE, le=MAX_TOLERANCE)] = Field(
        default=TOLERANCE,
        description="The largest width of intervals: relative to the area, to the length of all "
        "borders and to the volume of the whole surface; for the centroid relative to the diagonal "
        "of the bounding box of the control points. A request for too much work is refused "
        "(`too_costly`); if a larger tolerance can be reached, the error names it.",
        examples=[1e-9],
    )
    weld_tolerance: Annotated[float, Field(ge=0, le=MAX_WELD_TOLERANCE)] = Field(
        default=WELD_TOLERANCE,
        description="A share of the diagonal of the bounding box of the control points. Control "
        "points on borders of patches that are nearer to each other than this count as one point, "
        "as in a mesh. The interval of a volume includes every way to close the gaps between such "
        "points.",
        examples=[1e-6],
    )

    def to_query(self) -> MeasureQuery:
        """The tolerances of the request, for the engine."""
        return MeasureQuery(self.tolerance, self.weld_tolerance)
