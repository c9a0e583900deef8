"""Units of length that files can name."""

from collections.abc import Iterable

MILLIMETRE = 0.001
"""Metres in the unit of models that have none."""

SAME = 1e-12
"""Units that differ by at most this share are one: factors such as 25.4 × 0.001 are rounded."""


def match_unit(metres: float, known: Iterable[float]) -> float | None:
    """The unit of `known`, in metres, that is meant; None if there is none."""
    return next((unit for unit in known if abs(unit - metres) <= SAME * unit), None)
