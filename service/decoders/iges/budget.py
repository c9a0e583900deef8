"""Limits of the work of reading: faces and control points that are made, visits of entities."""

from service.decoders.format import FileLimits, build_too_many_error, check_faces
from service.decoders.iges.faults import Fault

VISITS, MORE_VISITS = 8, 1000
"""How often an entity of a file is read on average, at most, and how often more. In a sound file
each is read once, or a few times."""


class Budget:
    """Counts control points and curves, because many entities may refer to the same ones."""

    __slots__ = ("_faces", "_limits", "_points_left", "_visits_left")

    def __init__(self, limits: FileLimits, entities: int) -> None:
        self._limits = limits
        self._faces = 0
        self._points_left = limits.max_control_points
        self._visits_left = VISITS * entities + MORE_VISITS

    def add_face(self) -> None:
        """Count a face that is about to be read; several solids may have the same shell.

        Raises
        ------
        TooLarge
            `too_many_faces`.
        """
        self._faces += 1
        check_faces(self._faces, self._limits)

    def visit(self, entities: int = 1) -> None:
        """Count curves, or other entities, that are about to be read.

        Raises
        ------
        Fault
            The same entities have been read again and again.
        """
        self._visits_left -= entities
        if self._visits_left < 0:
            raise Fault("its parts are those of many entities")

    def spend(self, control_points: int) -> None:
        """Count control points that are about to be made.

        Raises
        ------
        InvalidRequest
            `too_many_control_points`.
        """
        self._points_left -= control_points
        if self._points_left < 0:
            raise build_too_many_error("more control points", self._limits.max_control_points)
