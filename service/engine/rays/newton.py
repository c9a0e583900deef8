"""Newton's method for the hits of rays: finds roots in settled cells, and the ends of strips."""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.cells import models as model_rows
from service.engine.cells.tree import CellTree
from service.engine.nets.partials import net_partials
from service.engine.rays.bounds import Rays, RootBounds
from service.engine.rays.grazing import Strips
from service.engine.rays.hits import NO_HITS, Evidence, Hits, Kind, RayPoints
from service.engine.vectors import UNIT, cross, dot, length

MAX_STEPS = 8
"""The most steps of Newton's method in a cell; after these, the cell is halved."""

STRIP_STEPS = 4
"""How many steps Newton's method takes to find each of the two ends of a strip."""

MIN_SLANT = 1 / 2
"""A strip, which follows the line x = x₀ + x₁ y in its cell, may end at a side x = ±1 if |x₁| is at
least this: then x is monotone along the strip, too."""

MAX_EXACT_ERROR = 4
"""A point counts as exact if its distance from the ray is at most this, in units of the rounding
error."""


@dataclass(frozen=True, eq=False, slots=True)
class _CellPoints(RayPoints):
    """One point of the surface in each of n cells, and its distance from a ray.

    Attributes
    ----------
    cell_parameters : ndarray of float64, shape (2, n)
        The parameters (a, b) ∈ [−1, 1]² of the cells.
    half : ndarray of float64, shape (2, n)
        Half the sides of the cells.
    cross_d : ndarray of float64, shape (3, n)
        (S − o) × d; its length is the distance from the ray.
    rounding : ndarray of float64, shape (n,)
        A bound of the rounding error of the distance from the ray.
    """

    cell_parameters: FloatArray
    half: FloatArray
    cross_d: FloatArray
    rounding: FloatArray

    def move(self, cell_parameters: FloatArray, d: FloatArray) -> "_CellPoints":
        """Move by a small step to `cell_parameters`; the tangent plane replaces the surface.

        The partials and the distance from the ray stay those of the old points.
        """
        step = self.half * (cell_parameters - self.cell_parameters)
        difference = step[0] * self.du + step[1] * self.dv
        parameters = np.clip(self.parameters + step, 0.0, 1.0)
        position, t = self.position + difference, self.t + dot(difference, d)
        return replace(
            self, cell_parameters=cell_parameters, parameters=parameters, position=position, t=t
        )

    def to_hits(self, low: FloatArray, high: FloatArray, evidence: Evidence) -> Hits:
        """The points as hits with this evidence, and with these ends of their intervals of t."""
        point = self.ray, self.net, self.parameters, self.position
        labels, side = np.full(len(low), evidence), np.zeros(len(low))
        ends = self.du, self.dv, self.t, self.residual, low, high
        return Hits(*point, *ends, labels, side, np.zeros(len(low), bool))


def _evaluate_points(
    cells: CellTree, rays: Rays, ray: Ints, cell: Ints, cell_parameters: FloatArray
) -> _CellPoints:
    """Evaluate the surface at `cell_parameters` (2, n), with its distances from rays."""
    rectangle, net = cells.rectangle[:, cell], cells.net[cell]
    low, half = rectangle[::2], (rectangle[1::2] - rectangle[::2]) / 2
    parameters = low + half * (cell_parameters + 1)
    cell_parameters = (parameters - low) / half - 1  # again, because `parameters` were rounded
    position, du, dv = net_partials(cells.nets, net, parameters, 1)
    d = rays.direction[:, ray]
    from_origin = position - rays.origin[:, ray]
    t, cross_d = dot(from_origin, d), cross(from_origin, d)
    rounding = cells.errors[net] + rays.slack[ray]
    point = ray, net, parameters, position, du, dv, t, length(cross_d)
    return _CellPoints(*point, cell_parameters, half, cross_d, rounding)


@dataclass(frozen=True, eq=False, slots=True)
class Roots:
    """The hits that Newton's method finds for N settled pairs.

    Attributes
    ----------
    hits : Hits
        n hits.
    row : ndarray of int, shape (n,)
        The pair of each hit.
    radius : ndarray of float64, shape (n,)
        In the parameters (a, b) of the cell, no component of the root is further away than this.
    is_done : ndarray of bool, shape (N,)
        Which pairs are decided; the cells of the others must be halved.
    """

    hits: Hits
    row: Ints
    radius: FloatArray
    is_done: Bools


@np.errstate(all="ignore")
def find_roots(cells: CellTree, rays: Rays, bounds: RootBounds) -> Roots:
    """Find the hits of settled pairs by Newton's method.

    A point of the surface counts as a hit if it is as near to the ray as rounding allows; or if it
    is within the thickness and Newton's method cannot come nearer inside the cell. A pair has no
    hit if the bounds of its root (`bounds`), at one of the iterates, prove that the root is
    outside the cell.
    """
    is_done = np.zeros(len(bounds.ray), bool)
    hits_by_step, rows_by_step, radii = [NO_HITS], [np.zeros(0, np.intp)], [np.zeros(0)]
    rows, bound, cell_parameters = np.arange(len(is_done)), bounds, bounds.start
    for remaining_steps in range(MAX_STEPS, 0, -1):
        points = _evaluate_points(cells, rays, bound.ray, bound.cell, cell_parameters)
        # G, with a bound of its error, at the parameters s₀; the root s* is at most `radius` away.
        g = (
            np.stack([dot(bound.first, points.cross_d), dot(bound.second, points.cross_d)])
            / bound.determinant
        )
        error = bound.lengths * points.rounding / np.abs(bound.determinant)
        radius = (np.abs(g) + error).max(axis=0) / (1 - bound.contraction)
        # The components of |s*| are at least `min_root`.
        min_root = np.abs(points.cell_parameters - g) - bound.contraction * radius - error
        is_outside = (min_root > 1 + 64 * UNIT).any(axis=0)
        # Newton's step, with the partials by the parameters of the cell.
        da, db = points.half[0] * points.du, points.half[1] * points.dv
        d = rays.direction[:, bound.ray]
        determinant = dot(cross(da, db), d)
        step = np.stack([dot(db, points.cross_d), -dot(da, points.cross_d)]) / determinant
        step = np.where(np.isfinite(step), step, 0.0)
        next_parameters = np.clip(points.cell_parameters + step, -1.0, 1.0)
        is_stuck = (np.abs(next_parameters - points.cell_parameters) <= 8 * UNIT).all(axis=0) | (
            remaining_steps == 1
        )
        is_exact = points.residual <= MAX_EXACT_ERROR * points.rounding
        is_near = is_exact | is_stuck & (points.residual <= rays.thickness[bound.ray])
        hit_columns = np.flatnonzero(is_near & ~is_outside)
        if len(hit_columns):
            # Exact points make one more step, of the size of rounding errors.
            is_moved = is_exact
            if cells.trims is not None:
                # A step that ends at a side of the cell would lead off the ray, where this is
                # almost parallel to the surface.
                is_moved = is_exact & (np.abs(next_parameters) < 1).all(axis=0)
            points = points.move(np.where(is_moved, next_parameters, points.cell_parameters), d)
            found, radius = points.take(hit_columns), radius[hit_columns]
            is_inside = (np.abs(found.cell_parameters) + radius <= 1).all(axis=0)
            # |S_a| + |S_b| is at most the sum of the lengths of the model's vectors, plus 3 REST;
            # ROUND is 16 u times this sum.
            model = cells.models[: model_rows.ROUND + 1, bound.cell[hit_columns]]
            speed = model[model_rows.ROUND] / (16 * UNIT) + 3 * model[model_rows.REST]
            half_width = radius * speed + found.rounding
            hits = found.to_hits(found.t - half_width, found.t + half_width, Evidence.NEAR)
            hits.label[is_inside] = Evidence.PROVED
            hits.side[is_inside] = np.sign(bound.determinant[hit_columns[is_inside]])
            hits_by_step.append(hits)
            rows_by_step.append(rows[hit_columns])
            radii.append(radius)
        is_done[rows[is_outside | is_near]] = True
        is_open = ~(is_outside | is_near | is_stuck)
        rows, bound, cell_parameters = (
            rows[is_open],
            bound.take(is_open),
            next_parameters[:, is_open],
        )
        if not len(rows):
            break
    row, radius = np.concatenate(rows_by_step), np.concatenate(radii)
    return Roots(Hits.join(hits_by_step), row, radius, is_done)


@np.errstate(all="ignore")
def find_strips(cells: CellTree, rays: Rays, strips: Strips) -> tuple[Hits, Bools]:
    """Find both ends of the strips of thin pairs.

    In the notation of `grazing`, a strip follows the curve P = 0, x ≈ x₀ + x₁ y, where y is the
    parameter a or b along the strip, and x the other one. The curve crosses the cell from y = −1 to
    y = 1, or ends before at a side x = ±1. A pair is done if, at both ends, the surface is within
    the thickness of the ray.

    Returns
    -------
    hits : Hits
        Two for each pair that is done.
    is_done : ndarray of bool, shape (N,)
        The cells of the other pairs must be halved.
    """
    (x0, x1), ray, cell = strips.line, strips.ray, strips.cell
    ends, is_done = [], np.ones(len(ray), bool)
    for y in (-1.0, 1.0):
        x = x0 + x1 * y
        # A slanted curve may leave the cell at x = −1 or x = 1, its lower end at one of these sides
        # and its upper end at the other side.
        side = np.sign(x1) * y
        is_side = (x * side > 1) & (np.abs(x1) >= MIN_SLANT)
        fixed_parameter = np.where(is_side, side, y)
        free_parameter = np.clip(np.where(is_side, (side - x0) / x1, x), -1.0, 1.0)
        # The free parameter is x at an end y = ±1, and y at a side; x is a if y is b.
        is_free_a = strips.is_along_b != is_side
        for remaining_steps in range(STRIP_STEPS, -1, -1):
            cell_parameters = np.where(
                is_free_a,
                np.stack([free_parameter, fixed_parameter]),
                np.stack([fixed_parameter, free_parameter]),
            )
            points = _evaluate_points(cells, rays, ray, cell, cell_parameters)
            if not remaining_steps:
                break
            slope = np.where(is_free_a, points.half[0] * points.du, points.half[1] * points.dv)
            # P = w · (S − o), where w is `strips.across`.
            p = dot(strips.across, points.position - rays.origin[:, ray])
            free_parameter = np.clip(free_parameter - p / dot(strips.across, slope), -1.0, 1.0)
            free_parameter = np.where(np.isfinite(free_parameter), free_parameter, 0.0)
        is_done &= points.residual <= rays.thickness[ray]
        ends.append(points)
    rows = np.flatnonzero(is_done)
    # Points within the thickness may be before or behind the ends: see `Strips.spread`.
    padding = (rays.thickness[ray] * (1 + strips.spread))[rows]
    found = [points.take(rows) for points in ends]
    t = np.stack([points.t for points in found])
    low, high = t.min(axis=0) - padding, t.max(axis=0) + padding
    return Hits.join([points.to_hits(low, high, Evidence.STRIP) for points in found]), is_done


def take_points(cells: CellTree, rays: Rays, ray: Ints, cell: Ints) -> Hits:
    """Take the centres of cells that are much smaller than the thickness as hits."""
    points = _evaluate_points(cells, rays, ray, cell, np.zeros((2, len(ray))))
    # Twice the radius, so that the intervals of neighbours overlap.
    half_width = 2 * cells.models[model_rows.RADIUS, cell] + points.rounding
    return points.to_hits(points.t - half_width, points.t + half_width, Evidence.POINT)


@np.errstate(all="ignore")
def begin_at_origins(cells: CellTree, rays: Rays, hits: Hits) -> Hits:
    """Move hits *along* that begin behind the origin of their ray to this origin.

    The point of the surface at the origin is found by least squares, starting at the hit.
    If this fails, the hit stays where it is. The arrays of `hits` are changed.
    """
    rows = np.flatnonzero((hits.label == Kind.ALONG) & (hits.low < rays.near[hits.ray]))
    if not len(rows):
        return hits
    ray, net = hits.ray[rows], hits.net[rows]
    point = rays.origin[:, ray] + rays.near[ray] * rays.direction[:, ray]
    parameters = hits.parameters[:, rows]
    for _ in range(MAX_STEPS):
        position, du, dv = net_partials(cells.nets, net, parameters, 1)
        y = point - position
        uu, uv, vv, yu, yv = (
            dot(*pair) for pair in ((du, du), (du, dv), (dv, dv), (y, du), (y, dv))
        )
        determinant = uu * vv - uv * uv
        step = np.stack([vv * yu - uv * yv, uu * yv - uv * yu]) / determinant
        parameters = np.clip(parameters + np.where(np.isfinite(step), step, 0.0), 0.0, 1.0)
    position, du, dv = net_partials(cells.nets, net, parameters, 1)
    y = point - position
    is_near = length(y) <= rays.thickness[ray]
    for name, values in (
        ("parameters", parameters),
        ("position", position),
        ("du", du),
        ("dv", dv),
    ):
        getattr(hits, name)[:, rows[is_near]] = values[:, is_near]
    hits.t[rows[is_near]] = rays.near[ray[is_near]]
    return hits
