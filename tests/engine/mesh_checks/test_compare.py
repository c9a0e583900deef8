"""Comparisons with surfaces whose distances from a mesh are known."""

from dataclasses import dataclass, field
from math import hypot, pi

import numpy as np
import pytest

from service.bases.arrays import FloatArray
from service.engine.mesh_checks.compare import FLOOR, compare
from service.engine.mesh_checks.query import CheckQuery
from service.engine.mesh_checks.reference import OutOfReach, ReferenceMesh, SurfacePlace
from service.errors import Issue
from service.surface.brep_model import SkippedFace
from service.surface.given_mesh import GivenMesh

FACES = np.array([[0, 1, 2], [1, 3, 2]])


def square(height: float = 0.0, size: float = 1.0) -> FloatArray:
    """The corners of a square at a height."""
    return np.array([[0.0, 0, height], [size, 0, height], [0, size, height], [size, size, height]])


@dataclass
class Plate:
    """The unit square, with reference meshes that are off by their tolerance, up and down."""

    has_places: bool = True
    max_triangles: int = 10**9
    finest: float = 0.0
    is_coarse: bool = False
    skipped_until: float = 0.0
    diagonal: float = 1.4143
    tolerances: list[float] = field(default_factory=list)

    def build_reference(self, tolerance: float) -> ReferenceMesh:
        if self.tolerances and tolerance < self.finest:
            raise OutOfReach("rounding")
        self.tolerances.append(tolerance)
        # Most of the square is left out as long as a face is skipped.
        is_skipped = bool(self.skipped_until) and tolerance > self.skipped_until
        size = 0.1 if is_skipped else 1.0
        height = tolerance * (-1) ** len(self.tolerances)
        normals = np.tile([0.0, 0, 1], (4, 1))
        skipped = (SKIPPED,) if is_skipped else ()
        return ReferenceMesh(
            square(height, size), FACES, normals, tolerance, tolerance, self.is_coarse, skipped
        )

    def find_place(self, point: FloatArray) -> SurfacePlace | None:
        if not self.has_places:
            return None
        position = np.array([*np.clip(point[:2], 0, 1), 0.0])
        distance = float(np.linalg.norm(point - position))
        return SurfacePlace(position, 0.0, distance, {"uv": position[:2]})


SKIPPED = SkippedFace(0, Issue("invalid_face", "The loops cross.", "/faces/0"))


@pytest.mark.parametrize("has_places", [False, True])
@pytest.mark.parametrize("width", [0.5, 0.1, 0.01])
def test_intervals_hold_known_distances_and_are_narrow(*, has_places: bool, width: float) -> None:
    """The mesh is half of the square, at the height 1/4."""
    positions = square(0.25)
    mesh = GivenMesh(positions, FACES[:1])
    # The corner (1, 1, 0) is nearest to the middle of the diagonal.
    expected = hypot(0.25, 0.5**0.5), 0.25
    result = compare(mesh, Plate(has_places), CheckQuery(width))
    for deviation, distance in zip(
        (result.surface_to_mesh, result.mesh_to_surface), expected, strict=True
    ):
        assert deviation.low <= distance * (1 + 1e-12)
        assert distance * (1 - 1e-12) <= deviation.high
        assert deviation.high - deviation.low <= width * deviation.high
        assert bool(deviation.place) == has_places
    assert result.limit is None
    assert result.surface_to_mesh.point[:2] == pytest.approx([1, 1], abs=0.1)
    assert result.surface_to_mesh.triangle == result.mesh_to_surface.triangle == 0


def test_a_mesh_on_the_surface_is_refined_until_the_floor() -> None:
    plate = Plate()
    result = compare(GivenMesh(square(), FACES), plate, CheckQuery())
    assert result.limit is None
    assert result.surface_to_mesh.low == result.mesh_to_surface.low == 0
    assert max(result.surface_to_mesh.high, result.mesh_to_surface.high) <= 2 * FLOOR
    assert result.angle == 0


@pytest.mark.parametrize(
    ("plate", "limit"),
    [
        (Plate(finest=1e-4), "rounding"),
        (Plate(max_triangles=5), "work"),
        (Plate(finest=1e-4, is_coarse=True), "thin"),
    ],
)
def test_the_result_says_what_kept_it_from_being_narrow(plate: Plate, limit: str) -> None:
    result = compare(GivenMesh(square(1e-5), FACES), plate, CheckQuery())
    assert result.limit == limit
    for deviation in (result.surface_to_mesh, result.mesh_to_surface):
        assert deviation.low <= 1e-5 <= deviation.high


def test_faces_that_only_a_coarse_reference_skips_count() -> None:
    """The whole square is seen as soon as no face is skipped."""
    mesh = GivenMesh(square(0.01, 0.1), FACES)
    result = compare(mesh, Plate(skipped_until=5e-3), CheckQuery())
    assert result.surface_to_mesh.low > 1
    assert result.skipped_faces == ()


@pytest.mark.parametrize("normals", [None, np.tile([0.0, 0, 2], (4, 1))])
def test_a_flipped_face_has_a_large_angle(normals: FloatArray | None) -> None:
    triangles = np.array([[0, 1, 2], [1, 2, 3]])
    result = compare(GivenMesh(square(0.1), triangles, normals), Plate(), CheckQuery())
    assert result.angle == pytest.approx(pi)
    assert result.angle_triangle == 1


def test_normals_at_corners_count_as_those_of_the_mesh() -> None:
    normals = np.array([[0.0, 0, 1], [0, 0, 1], [0, 3, 3], [0, 0, 0]])
    result = compare(GivenMesh(square(0.1), FACES[:1], normals), Plate(), CheckQuery())
    assert result.angle == pytest.approx(np.arctan2(0.5**0.5, 2 + 0.5**0.5))


def test_degenerate_triangles_have_no_angle() -> None:
    result = compare(GivenMesh(square(0.1), np.array([[0, 0, 1]])), Plate(), CheckQuery())
    assert (result.angle, result.angle_triangle) == (None, None)


def test_distances_are_those_of_vertices_and_of_middles_of_triangles() -> None:
    positions = square(0.2)
    positions[3, 2] = -0.5
    result = compare(GivenMesh(positions, FACES), Plate(), CheckQuery(distances=True))
    assert result.distances == pytest.approx([0.2, 0.2, 0.2, 0.5], abs=0.02)
    middles = np.abs(positions[FACES].mean(axis=1)[:, 2])
    assert result.middle_distances == pytest.approx(middles, abs=0.02)
    without = compare(GivenMesh(positions, FACES), Plate(), CheckQuery())
    assert (without.distances, without.middle_distances) == (None, None)
