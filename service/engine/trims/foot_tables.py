"""First guesses of foot points along curves of space: from parameter curves, or from tables.

A few points of each curve, its *seeds*, are projected to the surface of its face (`foot_seeds`).
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.trims.closure import AT_POLE, ClosedSurfaces
from service.engine.trims.foot_passes import PoleCuts, find_pole_cuts
from service.engine.trims.foot_seeds import find_seed_feet
from service.engine.trims.splines import Splines
from service.surface.spline_tables import find_starts


@dataclass(frozen=True, eq=False, slots=True)
class FootTable:
    """Parameters of foot points along n curves, between which they are interpolated.

    Attributes
    ----------
    starts : ndarray of int, shape (n+1,)
        The seeds of curve c are rows `starts[c]` to `starts[c + 1]`.
    parameters : ndarray of float64, shape (m,)
        Parameters of the curves, ascending in each.
    feet : ndarray of float64, shape (m, 2)
    keys : ndarray of float64, shape (m,)
        2 · curve + share of the curve's domain.
    """

    starts: Ints
    parameters: FloatArray
    feet: FloatArray
    keys: FloatArray

    def guess(self, curve: Ints, t: FloatArray) -> FloatArray:
        """Guesses (m, 2) of foot points of curves (m,) at t (m,)."""
        first, last = self.starts[curve], self.starts[curve + 1] - 1
        begin, end = self.parameters[first], self.parameters[last]
        key = 2.0 * curve + (t - begin) / (end - begin)
        at = np.searchsorted(self.keys, key, side="right") - 1
        at = np.minimum(np.maximum(at, first), last - 1)
        low, high = self.parameters[at], self.parameters[at + 1]
        share = ((t - low) / (high - low))[:, np.newaxis]
        guess: FloatArray = self.feet[at] + share * (self.feet[at + 1] - self.feet[at])
        return guess


@dataclass(frozen=True, eq=False, slots=True)
class FirstGuesses:
    """First guesses of foot points along n curves: from parameter curves, or from a table.

    Attributes
    ----------
    given : Splines
        Parameter curves.
    number : ndarray of int, shape (n,)
        The parameter curve of each curve in `given`; −1 if there is none.
    row : ndarray of int, shape (n,)
        The number of each curve without a parameter curve in `table`.
    table : FootTable or None
        None if all curves have parameter curves.
    cuts : PoleCuts
        Where the curves are cut for poles of the surfaces that they pass.
    """

    given: Splines
    number: Ints
    row: Ints
    table: FootTable | None
    cuts: PoleCuts

    def guess(self, curve: Ints, t: FloatArray) -> FloatArray:
        """Guesses (m, 2) of foot points of curves (m,) at t (m,)."""
        number = self.number[curve]
        if self.table is None:
            return self.given.evaluate(number, t)
        guess = np.empty((len(curve), 2))
        known, unknown = (number >= 0).nonzero()[0], (number < 0).nonzero()[0]
        if len(known):
            guess[known] = self.given.evaluate(number[known], t[known])
        guess[unknown] = self.table.guess(self.row[curve[unknown]], t[unknown])
        return guess


def make_guesses(
    surfaces: ClosedSurfaces,
    face: Ints,
    curves: Splines,
    known: tuple[Splines, Ints],
    tolerance: float,
) -> FirstGuesses:
    """Guesses for curves; `known` are parameter curves, and the number of one for each, or −1.

    Parameter curves that are near their edges may be far away in the parameters near a pole: there
    they are not used.
    """
    given, number = known
    cuts = find_pole_cuts(surfaces, face, curves, AT_POLE * tolerance)
    number = number.copy()
    number[cuts.curve] = -1
    unknown = (number < 0).nonzero()[0]
    row = np.zeros(len(number), np.intp)
    row[unknown] = np.arange(len(unknown))
    if not len(unknown):
        return FirstGuesses(given, number, row, None, cuts)
    chosen = curves.take(unknown)
    seed, t = _add_seeds(*list_seeds(chosen), cuts, row)
    points = chosen.evaluate(seed, t)
    is_near = np.isin(unknown[seed], cuts.curve)
    feet = find_seed_feet(surfaces, face[unknown[seed]], points, seed, tolerance, is_near=is_near)
    return FirstGuesses(given, number, row, build_table(seed, t, feet), cuts)


def _add_seeds(curve: Ints, t: FloatArray, cuts: PoleCuts, row: Ints) -> tuple[Ints, FloatArray]:
    """Seeds with those at cuts, and between any two of a curve with cuts."""
    if not len(cuts.curve):
        return curve, t
    curve = np.concatenate([curve, row[cuts.curve]])
    t = np.concatenate([t, cuts.t])
    order = np.lexsort((t, curve))
    curve, t = curve[order], t[order]
    is_new = np.append(True, (np.diff(curve) != 0) | (np.diff(t) > 0))
    curve, t = curve[is_new], t[is_new]
    is_cut = np.zeros(len(row), bool)
    is_cut[row[cuts.curve]] = True
    before = (is_cut[curve[1:]] & (np.diff(curve) == 0)).nonzero()[0]
    middles = (t[before] + t[before + 1]) / 2
    return np.insert(curve, before + 1, curve[before]), np.insert(t, before + 1, middles)


def list_seeds(curves: Splines) -> tuple[Ints, FloatArray]:
    """Curve and parameter of each seed, (m,): all breaks, and as many points between them."""
    spans = curves.list_spans()
    between = np.maximum(curves.degree + 1, np.ceil(8 / curves.span_count)).astype(np.intp)
    divisions = between[spans.curve]
    run, number = expand_runs(divisions)
    t = spans.low[run] + (spans.high - spans.low)[run] * (number / divisions[run])
    # The last seed of each curve is its end.
    last = np.cumsum(np.bincount(spans.curve, divisions).astype(np.intp))
    curve = np.repeat(np.arange(len(curves)), np.diff(last, prepend=0) + 1)
    return curve, np.insert(t, last, curves.end)


def build_table(curve: Ints, t: FloatArray, feet: FloatArray) -> FootTable:
    """A table from seeds: curve (m,) ascending, parameter (m,) ascending in each, feet (m, 2)."""
    starts = find_starts(np.bincount(curve))
    begin, end = t[starts[:-1]], t[starts[1:] - 1]
    return FootTable(starts, t, feet, 2.0 * curve + (t - begin[curve]) / (end - begin)[curve])
