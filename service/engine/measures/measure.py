"""Area, lengths of open borders, volume and centroid of a surface, each as an interval.

    area = Σ ∫∫ |N|            volume V = ⅓ Σ ∫∫ (S − o) · N        N = S_u × S_v
                             centroid c = o + ¼ Σ ∫∫ (S − o) ((S − o) · N) / V

over all patches, by Gauss's theorem for the fields x − o and (x − o)(x − o): any origin o will do,
and the middle of the box keeps the numbers small. V is positive where normals point outwards.

Every interval [low, high] holds the truth: the remainders of the rules (`remainders`), all rounding
(`rules`), and what lowering, placing and joining may have done to control points: by at most ε₀.

**Gaps.** Let S_t go along straight lines from closed patches to other closed ones, no point of
which is further than ε₀ from its own. By Gauss's theorem the volume changes by ∮ d · N_t, |d| ≤ ε₀,
and ∫ x dV by ∮ x d · N_t: at most ε₀ times the greatest area on the way, and the greatest |x − o|.
So a solid whose border is anywhere in the gaps that joining closed has a volume in the interval.
"""

from dataclasses import dataclass
from math import inf, nextafter
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.homogeneous import to_homogeneous
from service.engine.joining.join import Allow, allow_any
from service.engine.measures.boundaries import chain_open_sides
from service.engine.measures.cells import Cells, cells_of
from service.engine.measures.integrals import estimate, growth, integrate
from service.engine.measures.local_nets import UPWARDS
from service.engine.measures.sources import SidePlace, Source, sources
from service.engine.mesh.orientation import OrientedSides, orient_sides
from service.engine.options import MeshOptions
from service.engine.queries.nets import QueryNets, frame, surface_nets
from service.surface.lowered import Model, PatchModel

TOLERANCE = 1e-6
"""Relative width of intervals, if nothing is said."""

WELD_TOLERANCE = MeshOptions().weld_tolerance

BUDGET = 1 << 20
"""Control points of the cells of one integral: some seconds."""

MOST_LISTED = 100
"""Edges and loops that an answer lists."""

USED = 0.43
"""Of the width that is asked for, this is what a remainder may be on either side."""


@dataclass(frozen=True, slots=True)
class MeasureQuery:
    """What is asked.

    Attributes
    ----------
    tolerance : float
        How wide an interval may be, relative to the area, the length or the volume of the whole;
        of the centroid relative to the diagonal.
    weld_tolerance : float
        Up to what part of the diagonal borders are joined.
    budget : int
        Control points of the cells of one integral, beyond the whole patches.
    """

    tolerance: float = TOLERANCE
    weld_tolerance: float = WELD_TOLERANCE
    budget: int = BUDGET


@dataclass(frozen=True, slots=True)
class Interval:
    """A value, and two numbers between which the truth is."""

    value: float
    low: float
    high: float

    @staticmethod
    def about(value: float, error: float, unit: float = 1.0, least: float = -inf) -> "Interval":
        """[value − error, value + error], rounded outward, times a power of two."""
        low, high = nextafter(value - error, -inf), nextafter(value + error, inf)
        return Interval(value * unit, max(low * unit, least), high * unit)

    def is_within(self, width: float) -> bool:
        """Whether it is at most as wide."""
        return self.high - self.low <= width


@dataclass(frozen=True, slots=True)
class PartMeasures:
    """Of one part; of an open one without volume and centroid."""

    name: str
    area: Interval
    volume: Interval | None
    centroid: tuple[Interval, ...] | None


@dataclass(frozen=True, slots=True)
class Boundary:
    """An open border: its length, how many edges it has, whether it returns, and its first edge."""

    length: Interval
    edges: int
    closed: bool
    first: SidePlace


@dataclass(frozen=True, slots=True)
class FaultyEdge:
    """A side on an edge for which the surface has no volume: open, or passed in one direction."""

    is_open: bool
    place: SidePlace


@dataclass(frozen=True, slots=True)
class Measures:
    """What is known about a surface.

    `open_edges` counts edges that one side has alone, `inconsistent_edges` sides on others that are
    not passed as often in one direction as in the other; `faulty_edges` are the first of both, and
    `boundaries` the first of `loops`. `reached` says whether all intervals are as narrow as asked.
    """

    area: Interval
    volume: Interval | None
    centroid: tuple[Interval, ...] | None
    closed: bool
    boundary_length: Interval
    loops: int
    boundaries: tuple[Boundary, ...]
    open_edges: int
    inconsistent_edges: int
    faulty_edges: tuple[FaultyEdge, ...]
    parts: tuple[PartMeasures, ...]
    reached: bool
    moved: float


def measure(lowered: Model, query: MeasureQuery, allow: Allow = allow_any) -> Measures:
    """The measures of a surface; `allow` looks at a model that was cut to be joined.

    Raises
    ------
    InvalidRequest
        `not_parametric`, of tubes and ribbons.
    """
    given, part, source = sources(lowered, query.weld_tolerance, allow)
    count = len(given.parts)
    areas = _areas(given, part, source.noise, query)
    oriented = orient_sides(source.seams)
    faults = oriented.unbalanced()
    closed = oriented.is_closed
    closed_parts = oriented.closed_parts(source.part, count)
    solids = _solids(source, closed, closed_parts, areas, query)
    total, boundaries = _boundaries(source, oriented, query)
    own = tuple(
        PartMeasures(each.name, areas[1 + k], *solids[1 + k]) for k, each in enumerate(given.parts)
    )
    sides = np.flatnonzero(faults.ravel())
    is_open = oriented.is_open.ravel()[sides]
    volume, centroid = solids[0]
    width = query.tolerance
    return Measures(
        areas[0],
        volume,
        centroid,
        closed,
        total,
        len(boundaries),
        tuple(boundaries[:MOST_LISTED]),
        int(is_open.sum()),
        int((~is_open).sum()),
        tuple(
            FaultyEdge(bool(alone), source.place(int(side)))
            for side, alone in zip(sides[:MOST_LISTED], is_open, strict=False)
        ),
        own,
        areas[0].is_within(width * areas[0].value)
        and total.is_within(width * total.value)
        and (volume is None or volume.is_within(width * abs(volume.value)))
        and (centroid is None or all(c.is_within(width * given.diagonal) for c in centroid)),
        source.moved,
    )


def _groups(nets: QueryNets, noise: float, patches: Bools | None = None) -> list[Cells]:
    """The nets of all patches, or of some, as cells."""
    found = []
    for group in nets.groups:
        patch = nets.patch[group.first : group.first + len(group.nets)]
        rows = np.arange(len(patch)) if patches is None else np.flatnonzero(patches[patch])
        if len(rows):
            found.append(cells_of(group.nets[rows], patch[rows], noise / nets.scale))
    return found


def _areas(model: PatchModel, part: Ints, noise: float, query: MeasureQuery) -> list[Interval]:
    """The area of the whole, then of each part."""
    nets = surface_nets(model.batches)
    groups = _groups(nets, noise)
    return _sizes(groups, part, len(model.parts), nets.scale**2, query)


def _sizes(
    groups: list[Cells], part: Ints, count: int, unit: float, query: MeasureQuery
) -> list[Interval]:
    """The area or the length of all cells, then of each of `count` parts."""
    (about,), (error,) = estimate(groups, "size")
    wanted = np.array([max(USED * query.tolerance * about, error)])
    sums, errors = integrate(groups, "size", wanted, query.budget).over_parts(part, count)
    return [
        Interval.about(value, error, unit, 0.0)
        for value, error in zip(sums[0].tolist(), errors[0].tolist(), strict=True)
    ]


Solid: TypeAlias = tuple[Interval | None, tuple[Interval, ...] | None]
"""Volume and centroid."""


def _solids(
    source: Source, closed: bool, closed_parts: Bools, areas: list[Interval], query: MeasureQuery
) -> list[Solid]:
    """Volume and centroid of the whole and of each part, of those that are closed."""
    known = np.concatenate([[closed], closed_parts])
    if not known.any():
        return [(None, None)] * len(known)
    nets = surface_nets(source.model.batches)
    patches = None if closed else closed_parts[source.part]
    # What joining moved, and once more for the gaps that it closed.
    groups = _groups(nets, source.noise + 2 * source.moved, patches)
    (flux, *_), (error, wrong) = estimate(groups, "flux")
    width = query.tolerance * abs(flux)
    diagonal = nets.diagonal / nets.scale
    wanted = np.array([max(USED * width, error), max(width * diagonal / 4, wrong)])
    found = integrate(groups, "flux", wanted, query.budget)
    sums, errors = found.over_parts(source.part, len(closed_parts))
    noise, more = groups[0].noise, growth(groups)
    largest = np.array([area.high for area in areas]) / nets.scale**2 + more
    errors[0] += 3 * noise * largest
    errors[1] += 4 * noise * largest * (diagonal + noise)
    return [
        _solid(sums[:, k], errors[:, k] * UPWARDS, nets) if is_closed else (None, None)
        for k, is_closed in enumerate(known.tolist())
    ]


def _solid(sums: FloatArray, errors: FloatArray, nets: QueryNets) -> Solid:
    """Volume and centroid, of flux and moment about the origin of the nets."""
    flux, *moment = sums.tolist()
    error, wrong = errors.tolist()
    volume = Interval.about(flux / 3, error / 3, nets.scale**3)
    least = abs(flux) - error
    if least <= 0:
        return volume, None
    centroid = []
    for value, origin in zip(moment, nets.origin.tolist(), strict=True):
        middle = 0.75 * value / flux
        # |G / F − g / f| ≤ (|G − g| + |g / f| |F − f|) / |F|
        off = (0.75 * wrong + abs(middle) * error) / least * (1 + 2.0**-40) + 2.0**-50 * abs(middle)
        place = origin + middle * nets.scale
        centroid.append(Interval.about(place, off * nets.scale + 2.0**-52 * abs(place)))
    return volume, tuple(centroid)


def _boundaries(
    source: Source, oriented: OrientedSides, query: MeasureQuery
) -> tuple[Interval, list[Boundary]]:
    """The length of all open edges, and of each loop of them."""
    chains = chain_open_sides(source.seams, oriented)
    if not chains:
        return Interval(0.0, 0.0, 0.0), []
    edges = np.concatenate([oriented.edge.ravel()[list(chain.sides)] for chain in chains])
    number = np.repeat(np.arange(len(chains)), [len(each.sides) for each in chains])
    owner = np.full(len(source.seams.users), -1)
    owner[edges] = number
    origin, scale, _ = frame(*source.model.bounds)
    noise = (source.noise + source.moved) / scale
    groups = []
    for curves in source.seams.curves:
        rows = owner[curves.ids] >= 0
        if rows.any():
            weights = None if curves.weights is None else curves.weights[rows]
            pieces = to_homogeneous((curves.points[rows] - origin) / scale, weights)
            groups.append(cells_of(pieces[:, :, np.newaxis], owner[curves.ids[rows]], noise))
    total, *each_length = _sizes(groups, np.arange(len(chains)), len(chains), scale, query)
    return total, [
        Boundary(length, len(each.sides), each.is_closed, source.place(each.sides[0]))
        for length, each in zip(each_length, chains, strict=True)
    ]
