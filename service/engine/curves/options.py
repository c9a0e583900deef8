"""The options of a curve, checked when they are created."""

from dataclasses import dataclass
from math import inf

from service.engine.options import MAX_RESOLUTION
from service.errors import InvalidRequest, Issue


@dataclass(frozen=True, slots=True)
class CurveOptions:
    """The options that choose the samples of a curve, and the data computed for each sample.

    Attributes
    ----------
    resolution : int
        Divisions of every piece. Not used if there is a tolerance.
    tolerance : float or None
        Model units. The curve stays within this distance of the polyline of its samples.
    tangents, arc_lengths : bool
        Whether samples carry unit tangents, and the length of the curve up to them.
    """

    resolution: int = 16
    tolerance: float | None = None
    tangents: bool = True
    arc_lengths: bool = True

    def __post_init__(self) -> None:
        if not 1 <= self.resolution <= MAX_RESOLUTION:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The resolution is the number of divisions of each piece of the curve.",
                    "/resolution",
                    str(self.resolution),
                    f"1 to {MAX_RESOLUTION}",
                )
            )
        if self.tolerance is not None and not 0 < self.tolerance < inf:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The tolerance is a distance.",
                    "/tolerance",
                    f"{self.tolerance:.6g}",
                    "a number above 0",
                )
            )
