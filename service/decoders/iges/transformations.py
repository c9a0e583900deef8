"""Transformation matrices: where an entity is, relative to the one it belongs to.

References
----------
IGES 5.3, section 4.21: type 124; section 3.2.4: matrices of subordinate entities.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.iges.entities import IgesFile
from service.decoders.iges.faults import Fault

MAX_NESTING = 32
"""The most matrices that apply one after another."""

MIN_VOLUME = 1e-12
"""The least volume of the unit cube after a matrix, as a share of the product of its edges."""


class Transformations:
    """The matrices of a file, each read once."""

    __slots__ = ("_file", "_matrices")

    def __init__(self, file: IgesFile) -> None:
        self._file = file
        self._matrices: dict[int, FloatArray] = {}

    def find(self, number: int) -> FloatArray | None:
        """The matrix (4, 4) of an entry, with those that apply after it; None if there is none.

        Raises
        ------
        Fault
            It is not a matrix, it has no inverse, or too many apply one after another.
        """
        if not number:
            return None
        chain: list[FloatArray] = []
        entries: list[int] = []
        following = abs(number)
        while following:
            if len(chain) == MAX_NESTING:
                raise Fault("too many matrices apply one after another")
            if following in self._matrices:
                chain.append(self._matrices[following])
                break
            entity = self._file.read(following, 124)
            matrix = np.eye(4)
            matrix[:3] = entity.parameters.numbers(0, 12).reshape(3, 4)
            _check(matrix[:3, :3])
            chain.append(matrix)
            entries.append(following)
            following = abs(entity.matrix)
        product = chain.pop()
        if len(entries) > len(chain):
            self._matrices[entries.pop()] = product
        while chain:
            product = product @ chain.pop()
            self._matrices[entries.pop()] = product
        return product


def combine(outer: FloatArray | None, inner: FloatArray | None) -> FloatArray | None:
    """The matrix that applies `inner` first; None stands for the identity."""
    if outer is None:
        return inner
    return outer if inner is None else outer @ inner


def _check(matrix: FloatArray) -> None:
    lengths = np.sqrt(np.square(matrix).sum(axis=0)).prod()
    if not abs(np.linalg.det(matrix)) > MIN_VOLUME * lengths:
        raise Fault("a transformation matrix has no inverse")
