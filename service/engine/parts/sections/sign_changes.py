"""The sign changes of polynomials over pieces of curves."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.parts.sections.borders import CurvePieces
from service.engine.sections.cells import THICKNESS
from service.engine.sections.coefficients import find_roots
from service.engine.vectors import Items


@dataclass(frozen=True, eq=False, slots=True)
class SignChanges(Items):
    """k sign changes of polynomials over pieces of curves.

    Attributes
    ----------
    piece, column : ndarray of int, shape (k,)
        The piece, and the number of the plane among those of the call.
    t : ndarray of float64, shape (k,)
        The parameter of the curve.
    from_negative : ndarray of bool, shape (k,)
        Whether the polynomial is negative before the change.
    """

    piece: Ints
    column: Ints
    t: FloatArray
    from_negative: Bools


def find_changes(
    pieces: CurvePieces, rows: Ints, coefficients: FloatArray, weights: FloatArray
) -> SignChanges:
    """The sign changes inside pieces; zero counts as positive, and double roots do not count.

    Parameters
    ----------
    rows : ndarray of int, shape (r,)
        The pieces.
    coefficients : ndarray of float64, shape (n+1, r, m)
    weights : ndarray of float64, shape (n+1, r, 1)
    """
    is_negative = coefficients < 0
    row, column = (is_negative[1:] != is_negative[:-1]).any(axis=0).nonzero()
    chosen = coefficients[:, row, column]
    threshold = THICKNESS * weights[:, row, 0].min(axis=0)
    number, share = find_roots(chosen, threshold)
    same = np.zeros(len(number), bool)
    same[1:] = (number[1:] == number[:-1]) & (share[1:] == share[:-1])
    same[:-1] |= same[1:]
    number, share = number[~same], share[~same]
    before = np.arange(len(number)) - np.searchsorted(number, number)
    from_negative = is_negative[0, row, column][number] ^ (before % 2 == 1)
    piece = rows[row[number]]
    low, high = pieces.low[piece], pieces.high[piece]
    return SignChanges(piece, column[number], low + share * (high - low), from_negative)
