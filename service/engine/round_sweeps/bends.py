"""How far a sweep bends on cells of its path, and how far it then is from rings of its ends.

Let a cell have the parameter s ∈ [0, 1], and on it v = |C′|, the unit tangent T, the radius r, and

    f(s) = C + r E,   E′ = −(E · T′) T + δ E_φ

a line of the tube, E a unit vector perpendicular to T that turns about the path by δ. Then

    f″ = [v′ − 2 r′ (E·T′) − r (E·T″) − 2 r δ (E_φ·T′)] T
         + (v − r E·T′) T′ + (r″ − r δ²) E + 2 r′ δ E_φ

Proofs in docs/proofs.md: "Turns of a path", "Chords of curves" and "Lines of sweeps".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.round_sweeps.path_nets import PathNets
from service.engine.vectors import Items, cross, dot, length, normalize

MARGIN = 1 + 2.0**-24
"""Factor for the rounding of sums and products of a bound."""

NO_BOUND = 1e100
"""The bound of a turn that has none; its square still is a number."""


@dataclass(frozen=True, eq=False, slots=True)
class Bends(Items):
    """Bounds on cells, shape (M,) each, by the parameter of the cell; in units of the model.

    Attributes
    ----------
    turn : ndarray
        |T′|; `NO_BOUND` if the direction has no bound.
    turn_change : ndarray
        The part of T″ perpendicular to T.
    speed, speed_change : ndarray
        |C′| and | |C′|′ |.
    spread, slope, slope_change : ndarray
        r, |r′| and |r″|; of a ribbon half its width.
    progress : ndarray
        Lower bound of the length of the chord of C along the mean direction of both ends.
    begin, end : ndarray, shape (3, M)
        Unit tangents at the ends of the cell.
    error : ndarray
        Bound of the error of these tangents.
    """

    turn: FloatArray
    turn_change: FloatArray
    speed: FloatArray
    speed_change: FloatArray
    spread: FloatArray
    slope: FloatArray
    slope_change: FloatArray
    progress: FloatArray
    begin: FloatArray
    end: FloatArray
    error: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Crossbars(Items):
    """Bounds of the unit crossbars S of ribbons on cells; see `Bends` for shapes.

    `turn` is |S′|, `turn_change` the part of S″ perpendicular to S; `begin` and `end` are the
    crossbars at the ends, and `error` bounds their errors.
    """

    turn: FloatArray
    turn_change: FloatArray
    begin: FloatArray
    end: FloatArray
    error: FloatArray


def bound_crossbars(cells: PathNets) -> Crossbars:
    """The bounds of crossbars, from the control points of their nets; those of tubes are 0."""
    begin, end = (normalize(cells.crossbars[k]) for k in (0, -1))
    is_zero = (cells.crossbars == 0).all(axis=(0, 1))
    bounds = bound_turns(cells.crossbars, normalize(begin + end), cells.crossbar_error)
    turn, change, error = (np.where(is_zero, 0.0, bound) for bound in bounds)
    return Crossbars(turn, change, begin, end, error)


def bound_bends(cells: PathNets) -> Bends:
    """The bounds of cells, from the control points of their nets."""
    begin, end = (normalize(cells.directions[k]) for k in (0, -1))
    middle = normalize(begin + end)
    turn, turn_change, error = bound_turns(cells.directions, middle, cells.error)
    size, change, weight, weight_change = (
        _largest(cells.velocities),
        _largest(_differ(cells.velocities)),
        cells.weights.max(axis=0),
        np.abs(_differ(cells.weights)).max(axis=0, initial=0.0),
    )
    least = cells.weights.min(axis=0)
    # C′ = V / w², and |C′|′ ≤ |V′| / w² + 2 |V| |w′| / w³.
    speed = cells.width * size / least**2
    speed_change = cells.width * (change / least**2 + 2 * size * weight_change / least**3)
    along = dot(cells.velocities, middle)
    progress = cells.width * (
        np.maximum(along, 0.0).mean(axis=0) / weight**2
        + np.minimum(along, 0.0).mean(axis=0) / least**2
    )
    slopes = _differ(cells.spread)
    return Bends(
        turn,
        turn_change,
        speed,
        speed_change,
        cells.spread.max(axis=0),
        np.abs(slopes).max(axis=0, initial=0.0),
        np.abs(_differ(slopes)).max(axis=0, initial=0.0),
        progress,
        begin,
        end,
        error,
    )


def bound_turns(
    nets: FloatArray, axis: FloatArray, error: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds of |T′|, of the part of T″ perpendicular to T = D / |D|, and of the error of T.

    With the parts D′ ∥ and D′ ⊥ along and across an axis, and σ the largest sine of the angle
    between D and the axis:

        |T′| ≤ (|D′⊥| + σ |D′∥|) / |D|,   |T″⊥| ≤ (|D″⊥| + σ |D″∥| + 2 |D′| |T′|) / |D|

    Parameters
    ----------
    nets : ndarray of float64, shape (m+1, 3, M)
        The nets of D.
    axis : ndarray of float64, shape (3, M)
        Unit vectors.
    error : ndarray of float64, shape (M,)
        Bound of the error of each point of the nets.
    """
    degree = len(nets) - 1
    along = dot(nets, axis)
    across = nets - along[:, None] * axis
    least = along.min(axis=0) - error
    has_bound = least > 0
    least = np.where(has_bound, least, 1.0)
    sine = np.minimum((_largest(across) + error) / least, 1.0)
    first_along, first_across = _differ(along), _differ(across)
    first_error = 4 * degree * error
    change_along = np.abs(first_along).max(axis=0, initial=0.0) + first_error
    change_across = _largest(first_across) + first_error
    turn = (change_across + sine * change_along) / least
    second_error = 4 * degree * first_error
    second_along = np.abs(_differ(first_along)).max(axis=0, initial=0.0) + second_error
    second_across = _largest(_differ(first_across)) + second_error
    change = np.hypot(change_along, change_across)
    turn_change = (second_across + sine * second_along + 2 * change * turn) / least
    return (
        np.where(has_bound, turn * MARGIN, NO_BOUND),
        np.where(has_bound, turn_change * MARGIN, NO_BOUND),
        np.where(has_bound, 2 * error / least, 2.0),
    )


def bound_tube_lines(bends: Bends, twist: FloatArray | float = 0.0) -> FloatArray:
    """How far lines of tubes are from chords between the rings at the ends of cells: (M,).

    Parameters
    ----------
    twist : ndarray of float64, shape (M,), or float
        Largest turn of the rings at both ends against each other, beyond the turn of the path:
        δ above.
    """
    turn, spread, slope = bends.turn, bends.spread, bends.slope
    across = (
        (bends.speed + spread * turn) * turn
        + bends.slope_change
        + 2 * slope * twist
        + spread * twist**2
    )
    along = (
        bends.speed_change
        + 2 * slope * turn
        + spread * bends.turn_change
        + 2 * spread * twist * turn
    )
    sine = length(bends.end - bends.begin) / 2  # of half the angle between both tangents
    chord = bends.progress - 2 * spread * (sine + bends.error)
    drift = (bends.speed + spread * turn) * turn / 2 + slope + spread * twist
    return bound_chord_distance(across, along, chord, drift)


def bound_ribbon_lines(bends: Bends, crossbars: Crossbars) -> FloatArray:
    """How far lines C + σ S of ribbons are from chords between crossbars at the ends: (M,).

        (C + σ S)″ = v′ T + v T′ + σ″ S + 2 σ′ S′ + σ S″

    with |σ| at most half the width, and |S″| ≤ |S″⊥| + |S′|².
    """
    turn, spread, slope = crossbars.turn, bends.spread, bends.slope
    across = (
        bends.speed * bends.turn
        + bends.slope_change
        + 2 * slope * turn
        + spread * (turn**2 + crossbars.turn_change)
    )
    sway = slope + spread * turn
    chord, drift = bends.progress - sway, bends.speed * bends.turn / 2 + sway
    return bound_chord_distance(across, bends.speed_change, chord, drift)


def estimate_ribbon_strips(bends: Bends, crossbars: Crossbars) -> FloatArray:
    """About how far bilinear strips between crossbars at ends of cells are from triangles: (M,).

    A strip bends by the turn of its crossbar out of the plane of the crossbar and the path.
    """
    path, bar = (normalize(each.begin + each.end) for each in (bends, crossbars))
    turn = dot(crossbars.end - crossbars.begin, normalize(cross(path, bar)))
    strips: FloatArray = bends.spread * np.abs(turn) / 2
    return strips


def bound_ruled_lines(
    bends: Bends, twist: FloatArray | float, slide: FloatArray, slide_change: FloatArray
) -> FloatArray:
    """How far lines of ruled tubes are from chords between rings that are turned by a twist: (M,).

    A ring in the plane of a mitre has the points r e + (e · σ) T. Without a twist the lines are
    chords.

    Parameters
    ----------
    slide, slide_change : ndarray of float64, shape (M,)
        The largest |σ| at both ends of each cell, and the length of the difference of both.
    """
    across = bends.spread * twist**2 + 2 * bends.slope * twist
    along = 2 * slide_change * twist + slide * twist**2
    drift = bends.slope + bends.spread * twist
    chord = bends.progress - slide_change - slide * twist
    return bound_chord_distance(across, along, chord, drift)


def bound_chord_distance(
    across: FloatArray, along: FloatArray, chord: FloatArray, drift: FloatArray
) -> FloatArray:
    """How far curves are from their chords, and these from the curves: (M,).

    Let f″ = a T + b with |a| ≤ `along` and |b| ≤ `across`, and let T be at most `drift` / `chord`
    in sine from the direction of the chord, which is not shorter than `chord`. If |f″| is at most
    twice the length of the chord, what f″ has along the chord moves points along it, and only the
    rest counts.
    """
    size = np.hypot(across, along)
    is_long = (chord > 0) & (size <= 2 * chord)
    sine = np.minimum(drift / np.where(is_long, chord, 1.0), 1.0)
    bound: FloatArray = np.where(is_long, np.minimum(across + along * sine, size), size) / 8
    return bound * MARGIN


def _differ(nets: FloatArray) -> FloatArray:
    """The nets of derivatives: n times the differences of the points (n+1, …)."""
    return (len(nets) - 1) * np.diff(nets, axis=0)


def _largest(nets: FloatArray) -> FloatArray:
    """The largest length (M,) of the points of nets (n, 3, M); 0 if there are none."""
    if not len(nets):
        return np.zeros(nets.shape[-1])
    largest: FloatArray = length(nets).max(axis=0)
    return largest
