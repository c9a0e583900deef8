"""Exhaustive searches over a whole part: nearest points, distances from borders, hits of rays.

Samples are dense on every face and border; local searches (`oracles.descent`) start from those that
are nearest to a point, or from cells that a ray may meet. All that is found is true; a search may
miss one of two hits that are very near each other, and touching points.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from oracles.brep_documents import Array, Index
from oracles.descent import Domain, cross, descend
from oracles.part_samples import divide_box, measure_size, sample_border, sample_places
from oracles.parts import INSIDE, Face, Part

LEAST = 400
"""The least number of samples of a face."""

STARTS = 3
"""Local searches for each point on each face and border."""

RAYS_AT_A_TIME = 100


class Nearest(NamedTuple):
    """The least distances (m,) that were found, with the face and the place (m, 2) there.

    `of_borders` (m,) are the distances of the nearest borders.
    """

    of_faces: Array
    faces: Index
    places: Array
    of_borders: Array


class Hits(NamedTuple):
    """Hits that were found, n of them: ray, t, face, place (n, 2), and the sine of the angle."""

    ray: Index
    t: Array
    face: Index
    places: Array
    sines: Array


class PartSearch:
    """The samples of a part; about `count` on all faces together."""

    def __init__(self, part: Part, count: int, seed: int) -> None:
        self.part = part
        rng = np.random.default_rng(seed)
        sizes = np.array([measure_size(face) for face in part.faces])
        shares = count * sizes / max(sizes.sum(), 1e-300)
        self.faces = [
            sample_places(face, max(LEAST, int(share)), rng)
            for face, share in zip(part.faces, shares, strict=True)
        ]
        self.borders = [sample_border(border) for border in part.borders]

    @cached_property
    def diagonal(self) -> float:
        """The diagonal of the box about the samples."""
        points = np.concatenate([each.points for each in (*self.faces, *self.borders)])
        return float(np.linalg.norm(np.ptp(points, axis=0)))

    def find_nearest(self, points: Array) -> Nearest:
        """The nearest points of the part to points (m, 3)."""
        m = len(points)
        borders = self.find_borders(points)
        result = Nearest(np.full(m, np.inf), np.full(m, -1), np.zeros((m, 2)), borders)
        starts = {k: each.find_nearest(points, STARTS) for k, each in enumerate(self.faces)}
        first = borders.copy()
        for distances, _ in starts.values():
            np.minimum(first, distances[:, 0], out=first)
        for k, (distances, rows) in starts.items():
            near = np.flatnonzero(distances[:, 0] <= first + 2 * self.faces[k].gap)
            if len(near):
                self._search_face(k, points[near], (distances[near], rows[near]), near, result)
        return result

    def _search_face(
        self, k: int, points: Array, starts: tuple[Array, Index], near: Index, result: Nearest
    ) -> None:
        """Puts the nearest points of a face into rows `near` of the result, if they are nearer."""
        face, count = self.part.faces[k], starts[1].shape[1]
        row = np.repeat(near, count)
        begins = self.faces[k].places[starts[1].ravel()]
        target = np.repeat(points, count, axis=0).astype(np.longdouble)
        found, places = descend(face.at, target, begins, find_domain(face))
        # A search that leaves the region has passed a border; its start is still inside.
        is_inside = face.find_inside(places) == INSIDE
        distances = np.where(is_inside, found.astype(np.float64), starts[0].ravel())
        places = np.where(is_inside[:, np.newaxis], places, begins)
        order = np.lexsort((distances, row))
        order = order[np.unique(row[order], return_index=True)[1]]
        better = order[distances[order] < result.of_faces[row[order]]]
        result.of_faces[row[better]] = distances[better]
        result.faces[row[better]] = k
        result.places[row[better]] = places[better]

    def find_borders(self, points: Array) -> Array:
        """The distances (m,) of points (m, 3) from all borders; infinite if there are none."""
        first = np.full(len(points), np.inf)
        starts = [each.find_nearest(points, STARTS) for each in self.borders]
        for distances, _ in starts:
            np.minimum(first, distances[:, 0], out=first)
        result = first.copy()
        for k, (distances, rows) in enumerate(starts):
            near = np.flatnonzero(distances[:, 0] <= first + 2 * self.borders[k].gap)
            if len(near):
                found = self._descend_border(k, points[near], rows[near])
                result[near] = np.minimum(result[near], found)
        return result

    def _descend_border(self, k: int, points: Array, rows: Index) -> Array:
        """Distances (m,) from a border, from the samples (m, s)."""
        border, samples = self.part.borders[k], self.borders[k]
        low, high = (np.array([t]) for t in border.domain)
        domain = Domain(low, high, lambda t: np.clip(t, low, high))
        m, s = rows.shape
        target = np.repeat(points, s, axis=0).astype(np.longdouble)
        found, _ = descend(
            lambda t: border.at(t[:, 0]), target, samples.places[rows.ravel()], domain
        )
        return np.asarray(found.reshape(m, s).min(axis=1), dtype=np.float64)

    def measure_to_borders(self, face: Index, points: Array, reach: Array) -> Array:
        """Distances (m,) of points (m, 3) of faces (m,) from the borders of these.

        A distance above `reach` (m,) may be given as less, but not below `reach`.
        """
        result = np.full(len(points), np.inf)
        for each in np.unique(face):
            rows = np.flatnonzero(face == each)
            for k in self.part.faces[each].borders:
                samples = self.borders[k]
                distances, starts = samples.find_nearest(points[rows], 2)
                is_near = distances[:, 0] <= reach[rows] + 2 * samples.gap
                far = rows[~is_near]
                result[far] = np.minimum(result[far], distances[~is_near, 0] - samples.gap)
                near = rows[is_near]
                if len(near):
                    found = self._descend_border(k, points[near], starts[is_near])
                    result[near] = np.minimum(result[near], found)
        return result

    def find_hits(self, origins: Array, directions: Array, cells: int) -> Hits:
        """All crossings of rays with the surfaces of faces, also outside of the regions."""
        found = []
        of_each = max(64, cells // len(self.part.faces))
        for k, face in enumerate(self.part.faces):
            places = divide_box(face, of_each)
            corners = face.at(places.reshape(-1, 2)).astype(np.float64).reshape(-1, 4, 3)
            middles = places.mean(axis=1)
            for begin in range(0, len(origins), RAYS_AT_A_TIME):
                some = slice(begin, begin + RAYS_AT_A_TIME)
                ray, cell = _find_near_pairs(corners, origins[some], directions[some])
                ray += begin
                rays = origins[ray], directions[ray]
                hits = cross(face.at, rays, middles[cell], find_domain(face))
                number = np.full(len(hits.start), k)
                found.append(Hits(ray[hits.start], hits.t, number, hits.places, hits.sines))
        ray, t, number, places, sines = (np.concatenate(each) for each in zip(*found, strict=True))
        return _drop_copies(self.part.faces, Hits(ray, t, number, places, sines))


def find_domain(face: Face) -> Domain:
    """The parameters of a face; moves are measured by the box of its region."""
    low, high = face.box
    return Domain(low, np.maximum(high, np.nextafter(low, np.inf)), face.move_inside)


def _drop_copies(faces: Sequence[Face], hits: Hits) -> Hits:
    """The hits, each once: those of one ray and face at one place, up to rounding, are one."""
    hits = _take(hits, np.lexsort((hits.t, hits.face, hits.ray)))
    size = np.array([np.ptp(each.domain, axis=0) for each in faces]).reshape(-1, 2)[hits.face]
    period = np.array([each.periods for each in faces]).reshape(-1, 2)[hits.face]
    apart = np.abs(np.diff(hits.places, axis=0))
    apart = np.minimum(apart, np.abs(apart - period[1:]))
    is_copy = (np.diff(hits.ray) == 0) & (np.diff(hits.face) == 0)
    is_copy &= (apart <= 1e-11 * size[1:]).all(axis=1)
    return _take(hits, np.flatnonzero(np.append(True, ~is_copy)[: len(hits.ray)]))


def _take(hits: Hits, rows: Index) -> Hits:
    ray, t, face, places, sines = hits
    return Hits(ray[rows], t[rows], face[rows], places[rows], sines[rows])


def _find_near_pairs(corners: Array, o: Array, d: Array) -> tuple[Index, Index]:
    """Rays and cells, numbers (n,) each, where the ray may meet the cell.

    A cell is projected along the ray. The pair counts if the box of the projection, at twice its
    size, contains the ray.
    """
    axis = np.eye(3)[np.abs(d).argmin(axis=1)]
    first = np.cross(d, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(d, first)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    is_near = np.ones((len(o), len(corners)), bool)
    for each in (first, second):
        offsets = corners.reshape(-1, 3) @ each.T - (o * each).sum(axis=1)
        offsets = offsets.reshape(len(corners), 4, len(o))
        low, high = offsets.min(axis=1), offsets.max(axis=1)
        margin = 0.5 * (high - low)
        is_near &= ((low - margin <= 0) & (high + margin >= 0)).T
    ray, cell = np.nonzero(is_near)
    return ray, cell
