"""Slow truths about surfaces: dense points, and distances of points, without the engine's code."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from oracles.closest import find_nearest
from oracles.deviation import ROUNDING, measure_mesh_to_surface, measure_surface_to_mesh
from oracles.distance import Soup
from oracles.part_search import PartSearch
from oracles.parts import read_part
from oracles.sheets import Sheet
from oracles.sweeps import sample_ribbon, sample_tube
from service.surface.sweeps import TubeSurface

Array: TypeAlias = NDArray[np.float64]
Index: TypeAlias = NDArray[np.int64]

INNER = 4
"""Points of a triangle have barycentric coordinates that are multiples of 1/`INNER`."""

MAX_SEARCHED = 300
"""The most points of a mesh whose distances to a part are searched."""


class Truth(Protocol):
    """A surface that is sampled."""

    @property
    def slack(self) -> float:
        """How far samples may be from the surface: by rounding, and by the gaps of a part."""

    def measure_to_mesh(self, corners: Array) -> float:
        """The largest sampled distance of the surface from triangles (t, 3, 3)."""

    def measure_from_mesh(self, corners: Array, doubt: float) -> float:
        """The largest distance of sampled points of triangles from the surface.

        It may be too large if it is not above `doubt`; above, it is right as far as searches are.
        """

    def measure_points(self, points: Array) -> Array:
        """Upper bounds of the distances of points (m, 3), as small as searches find them."""

    def measure_place(self, point: Array, uv: Array) -> float:
        """An upper bound of the distance of a point (1, 3) that should have these parameters."""


@dataclass(frozen=True, eq=False)
class SheetTruth:
    """A surface that consists of sheets."""

    sheets: list[Sheet]
    samples: int = 1500

    @cached_property
    def slack(self) -> float:
        points = np.concatenate([each.at(each.samples(64)) + each.origin for each in self.sheets])
        return ROUNDING * float(np.abs(points).max())

    def measure_to_mesh(self, corners: Array) -> float:
        each = max(300, self.samples // len(self.sheets))
        return measure_surface_to_mesh(self.sheets, corners, each).distance

    def measure_from_mesh(self, corners: Array, doubt: float) -> float:
        each = max(300, self.samples // len(self.sheets))
        return measure_mesh_to_surface(self.sheets, corners, each, INNER, doubt)

    def measure_points(self, points: Array) -> Array:
        return find_nearest(self.sheets, points, samples=20_000, starts=6)

    def measure_place(self, point: Array, uv: Array) -> float:
        there = [each.at(each.clip_to_domain(uv)) + each.origin for each in self.sheets]
        distances = [float(np.linalg.norm(each - point)) for each in there]
        return min(*distances, float(self.measure_points(point)[0]))


@dataclass(frozen=True, eq=False)
class PartTruth:
    """A brep, whose faces are trimmed by the loops of `truth`, a document with right curves."""

    document: dict[str, Any]
    truth: dict[str, Any] | None = None
    slack: float = 0.0
    samples: int = 4000

    @cached_property
    def search(self) -> PartSearch:
        """The samples of all faces and borders."""
        return PartSearch(read_part(self.document, self.truth), self.samples, seed=1)

    def measure_to_mesh(self, corners: Array) -> float:
        points = np.concatenate([each.points for each in self.search.faces])
        return Soup(corners).farthest(points)[1]

    def measure_from_mesh(self, corners: Array, doubt: float) -> float:
        points = spread_points(corners)
        samples = [each.points for each in (*self.search.faces, *self.search.borders)]
        distances, _ = cKDTree(np.concatenate(samples)).query(points)
        rows = np.argsort(-distances, kind="stable")[:MAX_SEARCHED]
        del doubt
        return float(self.measure_points(points[rows]).max())

    def measure_points(self, points: Array) -> Array:
        found = self.search.find_nearest(points)
        return np.minimum(found.of_faces, found.of_borders)

    def measure_place(self, point: Array, uv: Array) -> float:
        del uv
        return float(self.measure_points(point)[0])


@dataclass(frozen=True, eq=False)
class SweptTruth:
    """A tube or a ribbon, of which only points are known."""

    surface: Any
    slack: float = field(init=False, default=0.0)

    @cached_property
    def points(self) -> Array:
        """Dense points."""
        if isinstance(self.surface, TubeSurface):
            return sample_tube(self.surface, 320, 128)
        return sample_ribbon(self.surface, 1200, 65)

    @cached_property
    def tree(self) -> cKDTree:
        """A search tree of the points."""
        return cKDTree(self.points)

    @cached_property
    def spacing(self) -> float:
        """The surface has no point further away from all samples, about.

        Samples are the crossings of lines; neighbours along one line may be much nearer than those
        along the other.
        """
        distances, _ = self.tree.query(self.points[::7], 9)
        return 2 * float(distances[:, -1].max())

    def measure_to_mesh(self, corners: Array) -> float:
        return Soup(corners).farthest(self.points)[1]

    def measure_from_mesh(self, corners: Array, doubt: float) -> float:
        del doubt
        return float(self.tree.query(spread_points(corners))[0].max()) - self.spacing

    def measure_points(self, points: Array) -> Array:
        distances: Array = self.tree.query(points)[0]
        return distances

    def measure_place(self, point: Array, uv: Array) -> float:
        del uv
        return float(self.measure_points(point)[0])


def spread_points(corners: Array) -> Array:
    """Points (m, 3) of triangles (t, 3, 3), with the corners."""
    steps = [(i, j) for i in range(INNER + 1) for j in range(INNER + 1 - i)]
    weights = np.array([(INNER - i - j, i, j) for i, j in steps]) / INNER
    points: Array = np.einsum("wk,tki->twi", weights, corners).reshape(-1, 3)
    return points
