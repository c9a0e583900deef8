"""What is to be measured, as a document says it: a surface, and how narrow intervals shall be."""

from typing import Annotated

from pydantic import Field

from service.engine.measures.measure import TOLERANCE, WELD_TOLERANCE, MeasureQuery
from service.engine.options import MAX_WELD_TOLERANCE
from service.schemas.request import SurfaceRequest

LEAST_TOLERANCE = 1e-12
"""Narrower intervals would hold nothing but rounding."""


class MeasureRequest(SurfaceRequest):
    """A surface that is measured."""

    tolerance: Annotated[float, Field(ge=LEAST_TOLERANCE, le=0.1)] = Field(
        default=TOLERANCE,
        description="How wide intervals may be: as a part of the area, of the length of all "
        "borders, and of the volume of the whole; those of the centroid as a part of the diagonal "
        "of the box of the control points.",
        examples=[1e-9],
    )
    weld_tolerance: Annotated[float, Field(ge=0, le=MAX_WELD_TOLERANCE)] = Field(
        default=WELD_TOLERANCE,
        description="The share of the diagonal within which control points on borders of patches "
        "count as one, as in a mesh. The intervals of volumes hold whatever lies in the gaps that "
        "were closed so.",
        examples=[1e-6],
    )

    def to_query(self) -> MeasureQuery:
        """How narrow intervals shall be."""
        return MeasureQuery(self.tolerance, self.weld_tolerance)
