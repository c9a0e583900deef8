"""The question of a tree of cells to trims: which cells are inside, outside, or cut by a border."""

from typing import Protocol

from service.bases.arrays import FloatArray, Ints

INSIDE, OUTSIDE, UNDECIDED = 1, 0, -1
"""Answers to the questions whether a point, or a rectangle, is in a region."""


class CellTrims(Protocol):
    """The trims of the nets of a tree of cells."""

    def classify(self, net: Ints, rectangle: FloatArray) -> Ints:
        """Where rectangles (4, m) of nets (m,) are: `INSIDE`, `OUTSIDE` or `UNDECIDED`.

        A part of a rectangle that is inside is inside, and one of a rectangle outside is outside.
        """
        ...

    def find_inside(self, net: Ints, parameters: FloatArray) -> Ints:
        """Where parameters (2, m) of nets (m,) are: `INSIDE`, `OUTSIDE` or `UNDECIDED`."""
        ...
