"""Polygons on three faces, triangulated, for tests: a bump, a quarter of a cylinder and a plane."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Ints
from service.engine.brep.borders.border import Polygons
from service.engine.brep.borders.border_vertices import BorderVertices
from service.engine.brep.borders.predicates import orient
from service.engine.brep.filling.corners import FaceCorners
from service.engine.brep.filling.triangulation import FaceTriangulations
from service.engine.trims.places import SIZE, Places
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import SurfaceTable
from tests.engine.brep.polygons import Loop, build_polygons

BUMP, CYLINDER, PLANE = range(3)
UNIT = SIZE // 16
SQUARE = [(0, 0), (16, 0), (16, 16), (0, 16)]
HOLE = [(6, 6), (6, 10), (9, 11), (10, 6)]
"""Loops in units of `UNIT`."""


def build_table() -> SurfaceTable:
    """Degree (2, 3) with 3 × 2 spans; a rational quadratic; a plane."""
    u, v = np.meshgrid(np.linspace(0, 4, 5), np.linspace(0, 3, 5), indexing="ij")
    bump = np.stack([u, v, np.sin(u) * np.cos(v)], axis=-1).reshape(-1, 3)
    quarter = np.array([[x, y, z] for x, y in ((1, 0), (1, 1), (0, 1)) for z in (0, 2)], float)
    plane = np.array([[0, 0, 0], [0, 2, 1], [3, 0, 1], [3, 2, 2]], float)
    weights = np.ones(len(bump) + 10)
    weights[len(bump) + 2 : len(bump) + 4] = 0.5**0.5
    knots = [
        *(0, 0, 0, 0.25, 0.5, 1, 1, 1, 0, 0, 0, 0, 0.5, 1, 1, 1, 1),
        *(0, 0, 0, 1, 1, 1, 0, 0, 1, 1),
        *(0, 0, 1, 1, 0, 0, 1, 1),
    ]
    return SurfaceTable(
        np.array([[2, 3], [2, 1], [1, 1]]),
        np.array([[5, 5], [3, 2], [2, 2]]),
        np.concatenate([bump, quarter, plane]),
        weights,
        np.array([False, True, False]),
        np.array(knots, float),
    )


def build_surfaces() -> Places:
    """Places over the whole domains of these surfaces."""
    surfaces = FaceSurfaces.of(build_table())
    return Places.of(surfaces, surfaces.low, surfaces.high)


@dataclass
class FilledFaces:
    """Polygons of faces, the corners on them, and their triangulations."""

    polygons: Polygons
    corners: FaceCorners
    triangulations: FaceTriangulations

    def read(self) -> Ints:
        """The triangles (3, T) of all faces."""
        return self.triangulations.read(self.triangulations.faces)[0]

    def insert(self, faces: Ints, places: Ints) -> None:
        """Add corners inside faces."""
        self.triangulations.insert(faces, places)
        self.corners.add(faces, places)

    def measure_areas(self, triangles: Ints) -> Ints:
        """Twice the areas of triangles of places in all faces together."""
        places = self.corners.places[triangles]
        areas = orient(places[0], places[1], places[2])
        assert (areas > 0).all()
        faces = self.corners.faces[triangles[0]]
        assert (faces == self.corners.faces[triangles]).all()
        total = np.zeros(3, np.intp)
        np.add.at(total, faces, areas)
        return total


def fill(*loops_of_faces: list[Loop]) -> FilledFaces:
    """Loops, in units of `UNIT`, of up to three faces; by default a square with a hole in each."""
    loops = loops_of_faces or ([SQUARE, HOLE],) * 3
    scaled = [[[(x * UNIT, y * UNIT) for x, y in loop] for loop in face] for face in loops]
    count = 0
    vertices: list[list[int]] = []
    for face in scaled:
        for loop in face:
            vertices.append(list(range(count, count + len(loop))))
            count += len(loop)
    polygons = build_polygons(*scaled, vertices=vertices)
    surface = build_surfaces()
    positions = surface.evaluate(polygons.faces, polygons.begins)
    border, scales = BorderVertices.of(polygons, 3), np.array([1.0, 0.25, 2.0])
    corners = FaceCorners.of(surface, border, positions, scales)
    return FilledFaces(polygons, corners, FaceTriangulations(border, scales))


def draw_inner_places(
    filled: FilledFaces, rng: np.random.Generator, count: int
) -> tuple[Ints, Ints]:
    """Random places beside the hole of the default polygons: faces, ascending, and places."""
    faces = np.sort(rng.integers(0, len(filled.triangulations.faces), count))
    places = rng.integers(1, SIZE, (count, 2))
    left = rng.random(count) < 0.5
    places[left, 0] %= 6 * UNIT - 1
    places[left, 0] += 1
    places[~left, 1] = 11 * UNIT + 1 + places[~left, 1] % (5 * UNIT - 1)
    return faces, places
