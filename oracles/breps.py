"""Slow truths about meshes of breps: points of trimmed faces, their distances from a mesh, cracks.

Points of a face are taken where the winding number of its loops says that they are inside, also
close to the loops and on them. Distances are computed in float64, and again with 64 bits of
mantissa where they matter: in float64, a triangle whose height is 4e-7 of its length gives false
alarms.
"""

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from oracles.brep_documents import Array, Index, Long, Spline, read_surface
from oracles.coedges import iterate_coedges, read_edge
from oracles.distance import Soup, measure_distances
from oracles.regions import Region, build_region, find_closed
from oracles.topology import weld_by_position

DOUBT = 1e-3
"""Distances above the bound less this share of it are computed with 64 bits of mantissa."""

NEAREST, FARTHEST = 1e-8, 1e-1
"""Least and largest distance of samples near a loop, as shares of the box of the loops."""


@dataclass(frozen=True, eq=False)
class FaceSamples:
    """Parameters (m, 2) inside of the loops of a face, and the points (m, 3) there."""

    face: int
    places: Array
    points: Long


def sample_face(
    brep: dict[str, Any],
    face: int,
    count: int,
    rng: np.random.Generator,
    region: Region | None = None,
) -> FaceSamples:
    """About `count` points of a face: half in its middle, half near its loops and on them.

    `region` is the region of the face, if it is not that of the loops of the document.
    """
    net = read_surface(brep["faces"][face]["surface"])
    region = region or build_region(brep, face)
    domain = net.domain
    if region is None:
        shares = np.concatenate([rng.random((count, 2)), rng.integers(0, 2, (9, 2))])
        shares[: count // 4, 0] = shares[: count // 4, 0].round()
        shares[: count // 8] = shares[: count // 8, ::-1]
        places = domain[:, 0] + shares * np.ptp(domain, axis=1)
        return FaceSamples(face, places, net.at(np.clip(places, domain[:, 0], domain[:, 1])))
    inside = _sample_middle(region, count // 2, rng)
    near = _sample_near_loops(region, count // 4, rng)
    on = region.low + region.starts[rng.integers(0, len(region.starts), count // 4)] * region.size
    places = np.concatenate([inside, near, on])
    for axis in np.flatnonzero(find_closed(net)):
        first, last = domain[axis]
        is_out = (places[:, axis] < first) | (places[:, axis] > last)
        places[is_out, axis] = first + (places[is_out, axis] - first) % (last - first)
    slack = 1e-9 * np.ptp(domain, axis=1)
    is_in_domain = ((places >= domain[:, 0] - slack) & (places <= domain[:, 1] + slack)).all(axis=1)
    places = np.clip(places[is_in_domain], domain[:, 0], domain[:, 1])
    return FaceSamples(face, places, net.at(places))


def _sample_middle(region: Region, count: int, rng: np.random.Generator) -> Array:
    """Places in the box of the loops that are surely inside."""
    found: list[Array] = [np.empty((0, 2))]
    for _ in range(6):
        unit = region.box[0] + rng.random((count, 2)) * np.ptp(region.box, axis=0)
        places = region.low + unit * region.size
        is_inside, is_sure = region.find_inside(places)
        found.append(places[is_inside & is_sure])
        if sum(map(len, found)) >= count:
            break
    return np.concatenate(found)[:count]


def _sample_near_loops(region: Region, count: int, rng: np.random.Generator) -> Array:
    """Places on the left of pieces, at many distances, that are surely inside."""
    along = region.ends - region.starts
    lengths = np.hypot(*along.T)
    rows = np.concatenate(
        [
            rng.choice(len(along), count, p=lengths / lengths.sum()),
            rng.choice(len(along), count),
        ]
    )
    left = np.column_stack([-along[rows, 1], along[rows, 0]])
    left /= np.maximum(lengths[rows], 1e-300)[:, np.newaxis]
    offset = np.exp(rng.uniform(np.log(NEAREST), np.log(FARTHEST), len(rows)))
    unit = region.starts[rows] + rng.random((len(rows), 1)) * along[rows]
    unit += offset[:, np.newaxis] * left
    unit = unit[((unit >= region.box[0]) & (unit <= region.box[1])).all(axis=1)]
    places = region.low + unit * region.size
    is_inside, is_sure = region.find_inside(places)
    return np.asarray(places[is_inside & is_sure])


def measure_to_mesh(soup: Soup, points: Long, bound: float) -> tuple[float, int]:
    """The largest distance of points (m, 3) from triangles, and the number of this point.

    Where a distance is near the bound or above it, it is computed with 64 bits of mantissa.
    """
    if not len(points):
        return 0.0, -1
    distances, _ = soup.farthest(points.astype(np.float64))
    for row in np.flatnonzero(distances > bound * (1 - DOUBT)):
        distances[row] = measure_precisely(soup, points[row], float(distances[row]))
    worst = int(distances.argmax())
    return float(distances[worst]), worst


def measure_precisely(soup: Soup, point: Long, reach: float) -> float:
    """The distance of a point (3,) from the triangles, with 64 bits of mantissa.

    Only triangles within a little more than `reach` of the point are compared.
    """
    near = [
        triangles[tree.query_ball_point(point.astype(np.float64), reach * (1 + 1e-3) + radius)]
        for tree, triangles, radius in soup.balls
    ]
    corners: Any = soup.corners[np.concatenate(near)].astype(np.longdouble)
    copies: Any = np.repeat(point[np.newaxis], len(corners), axis=0)
    return float(measure_distances(copies, corners).min())


def count_cracks(positions: Array, triangles: Index) -> list[tuple[int, int]]:
    """Directed edges that occur more often than their reverse, as numbers of two vertices.

    Vertices with the same position are one. A closed mesh has no such edge, an open one has those
    of its border. An edge that is missing n times is listed n times.
    """
    rows = weld_by_position(positions, triangles)
    ends = np.concatenate([rows[:, [0, 1]], rows[:, [1, 2]], rows[:, [2, 0]]])
    uses = Counter(map(tuple, ends[ends[:, 0] != ends[:, 1]].tolist()))
    return [(a, b) for (a, b), count in uses.items() for _ in range(max(0, count - uses[b, a]))]


def list_free_edges(brep: dict[str, Any]) -> list[Spline]:
    """Curves of the edges that only one coedge uses: the borders of open shells."""
    uses = Counter(
        edge
        for face in brep["faces"]
        for loop in face.get("loops", [])
        for edge in loop.get("edges", [])
    )
    return [
        read_edge(brep, k)
        for k, edge in enumerate(brep["edges"])
        if uses[k] == 1 and not edge.get("degenerate")
    ]


def measure_offsets(brep: dict[str, Any], face: int, samples: int = 65) -> float:
    """Largest sampled distance of the parameter curves of a face, on its surface, from their edges.

    A distance is that of a point from the whole edge, whatever their parameters. It is 0 for
    coedges of which one of both curves is missing.
    """
    entry = brep["faces"][face]
    net, largest = read_surface(entry["surface"]), 0.0
    for loop in entry.get("loops", []):
        if not loop.get("edges") or not loop.get("pcurves"):
            continue
        curves = [each.curve for each in iterate_coedges(brep, entry, loop, net, None)]
        for edge, pcurve, curve in zip(loop["edges"], loop["pcurves"], curves, strict=True):
            if pcurve is None or brep["edges"][edge].get("degenerate"):
                continue
            t = np.linspace(*curve.domain, samples)
            places = np.clip(curve.at(t).astype(np.float64), *net.domain.T)
            space = read_edge(brep, edge)
            largest = max(largest, float(_measure_to_curve(net.at(places), space).max()))
    return largest


def _measure_to_curve(points: Long, curve: Spline) -> Array:
    """Distances (m,) of points (m, 3) from a curve, by ever denser samples around the nearest."""
    first, last = curve.domain
    t = np.tile(np.linspace(first, last, 400), (len(points), 1))
    width = (last - first) / 399
    for _ in range(5):
        samples = curve.at(t.ravel()).reshape(*t.shape, 3)
        distances = np.sqrt(((samples - points[:, np.newaxis]) ** 2).sum(axis=2))
        best = t[np.arange(len(t)), distances.argmin(axis=1)]
        t = np.clip(best[:, np.newaxis] + width * np.linspace(-1, 1, 25), first, last)
        width /= 12
    return np.asarray(distances.min(axis=1), dtype=np.float64)
