"""The most faces, control points and work that a file may ask for, counted while it is read."""

from service.decoders.format import FileLimits, build_too_many_error, check_faces
from service.errors import InvalidRequest, Issue, TooLarge

MAX_READINGS = 6
"""How often, on average, each character of a file may be parsed, or that it may be as long as work
that takes the time of parsing: entities with many references to them are read again and again."""

FREE_CHARACTERS = 2_000_000
"""Characters that may be parsed in any case."""

CHARACTERS_OF_POINT = 8
"""Looking at a control point takes about as long as parsing 8 characters."""

CHARACTERS_OF_COEDGE = 64
"""The use of an edge in a loop takes about as long as parsing 64 characters."""


class Budget:
    """Counts of faces, of control points and of work; each refuses the file when it is used up."""

    def __init__(self, limits: FileLimits, length: int) -> None:
        """The budget for a file of `length` bytes."""
        self._limits = limits
        self._faces = 0
        self._points = 0
        self._characters_left = MAX_READINGS * length + FREE_CHARACTERS

    def charge_characters(self, count: int) -> None:
        """Count characters that are parsed.

        Raises
        ------
        InvalidRequest
            `too_costly`
        """
        self._characters_left -= count
        if self._characters_left < 0:
            raise InvalidRequest(
                Issue(
                    "too_costly",
                    "The entities of the file refer to the same entities too often.",
                    "",
                    "references to long entities, again and again",
                    f"each character of the file read at most {MAX_READINGS} times on average",
                )
            )

    def charge_look(self, points: int) -> None:
        """Count a look at the control points of a curve that is kept; the errors are the same."""
        self.charge_characters(CHARACTERS_OF_POINT * points)

    def charge_coedges(self, count: int) -> None:
        """Count coedges of a face; the errors are the same."""
        self.charge_characters(CHARACTERS_OF_COEDGE * count)

    def count_points(self, count: int) -> None:
        """Count control points of curves and surfaces of the result.

        Raises
        ------
        InvalidRequest
            `too_many_control_points`
        """
        self._points += count
        if self._points > self._limits.max_control_points:
            raise build_too_many_error("more control points", self._limits.max_control_points)

    def check_members(self, count: int) -> None:
        """Refuse more products than a group may have members.

        Raises
        ------
        TooLarge
            `too_many_members`
        """
        limit = self._limits.max_members
        if count > limit:
            raise TooLarge(
                Issue(
                    "too_many_members",
                    "The file has more products than this service takes.",
                    "",
                    f"{count} products",
                    f"at most {limit} (SURFACE_MAX_MEMBERS)",
                )
            )

    def count_face(self) -> None:
        """Count a face.

        Raises
        ------
        TooLarge
            `too_many_faces`
        """
        self._faces += 1
        self.check_faces(self._faces)

    def check_faces(self, count: int) -> None:
        """Refuse a number of faces, such as those that one shell lists; the error is the same."""
        check_faces(count, self._limits)
