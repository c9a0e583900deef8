"""Limits of the work of reading: control points that are made, and visits of entities."""

from service.decoders.format import build_too_many_error
from service.decoders.iges.faults import Fault

VISITS, MORE_VISITS = 8, 1000
"""How many curves are read for each entity of a file, at most, and how many more. In a sound file
each is read once, or a few times."""


class Budget:
    """Counts control points and curves, because many entities may refer to the same ones."""

    __slots__ = ("_max_points", "_points_left", "_visits_left")

    def __init__(self, max_control_points: int, entities: int) -> None:
        self._points_left = max_control_points
        self._max_points = max_control_points
        self._visits_left = VISITS * entities + MORE_VISITS

    def visit(self) -> None:
        """Count a curve that is about to be read.

        Raises
        ------
        Fault
            The same curves have been read again and again.
        """
        self._visits_left -= 1
        if self._visits_left < 0:
            raise Fault("its curves are those of many entities")

    def spend(self, control_points: int) -> None:
        """Count control points that are about to be made.

        Raises
        ------
        InvalidRequest
            `too_many_control_points`.
        """
        self._points_left -= control_points
        if self._points_left < 0:
            raise build_too_many_error("more control points", self._max_points)
