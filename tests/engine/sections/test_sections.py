"""Sections, checked by searches along parameter lines, by formulas, and by topology."""

from math import asin, cos, sin

import numpy as np
import pytest

from oracles.sections import find_crossings, measure_distances
from oracles.sheets import Array, build_sheets
from service.engine.connectivity.connect import connect
from service.engine.models import to_patches
from service.engine.sections.section import cut_surface
from service.engine.sections.values import Planes, Section, Sections
from service.surface.bspline import BsplineSurface
from service.surface.examples.catalogue import find
from service.surface.examples.quadrics import cone, cylinder, sphere, torus
from service.surface.lowered import PatchModel
from service.surface.sizes import SurfaceKind
from tests.strategies import build_cube, build_model
from tools.certify.surfaces import FAMILIES

RNG = np.random.default_rng
TUBE_RADIUS = 0.4
"""The radius of the tube of the torus, whose centre line has radius 1."""


class Refused(Exception):
    """A section has more pieces than the test allows."""


def cut(model: PatchModel, normals: object, offsets: object, relative: float = 1e-3) -> Sections:
    """The sections of a model by planes; `relative` is the tolerance as a share of the diagonal."""
    n = np.atleast_2d(np.array(normals, float))
    n /= np.linalg.norm(n, axis=1)[:, np.newaxis]
    planes = Planes(n, np.atleast_1d(np.array(offsets, float)))

    def allow(count: int) -> None:
        assert count < 200_000

    return cut_surface(model, connect(model), planes, relative * model.diagonal, allow)


def lower_patches(surface: SurfaceKind) -> PatchModel:
    """The surface as patches in model coordinates."""
    return to_patches(surface.lower())


def count_lines(section: Section) -> tuple[int, int, int]:
    """The numbers of closed polylines, of open polylines, and of touching points."""
    closed_count = sum(line.closed for line in section.polylines)
    return closed_count, len(section.polylines) - closed_count, len(section.touching)


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_sections_include_all_crossings_of_parameter_lines(name: str) -> None:
    surface = FAMILIES[name].surface(seed=5)
    model = lower_patches(surface)
    (low, high), rng = model.bounds, RNG(11)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    offset = float(normal @ (low + (high - low) * rng.uniform(0.3, 0.7, 3)))
    sections = cut(model, normal, offset)
    (section,), sheets = sections.sections, build_sheets(surface)
    line_count = max(8, int(60 / len(sheets) ** 0.5))  # parameter lines of each sheet
    crossings = find_crossings(sheets, normal, offset, line_count)
    bound = sections.deviation_bound + 1e-9 * model.diagonal
    assert bound <= 1.001e-3 * model.diagonal
    assert (
        np.minimum(
            measure_distances(section, crossings), _measure_to_points(section.touching, crossings)
        ).max()
        <= bound
    )
    line_points = np.concatenate([line.points for line in section.polylines] or [crossings[:0]])
    assert np.abs(line_points @ normal - offset).max(initial=0) <= 1e-10 * model.diagonal


def _measure_to_points(points: Array, crossings: Array) -> Array:
    """For each crossing, the distance of the nearest of `points`; infinite without points."""
    distances = np.linalg.norm(points[:, None] - crossings, axis=2)
    return np.asarray(distances.min(axis=0, initial=np.inf))


TILT = asin(TUBE_RADIUS)
"""The angle at which a plane through the centre of the torus touches it twice."""
DIRECTION = cos(0.3), sin(0.3)
"""A horizontal direction, as (x, y), that is not a border of patches."""


# `expected` has the numbers of closed polylines, of open polylines, and of touching points.
@pytest.mark.parametrize(
    ("normal", "offset", "expected"),
    [
        ((0, 0, 1), 0.1, (2, 0, 0)),  # two circles
        ((1, 0.3, 0), 0, (2, 0, 0)),
        # The two Villarceau circles, which cross twice.
        ((sin(TILT), 0, cos(TILT)), 0, (2, 0, 0)),
        ((sin(TILT) * DIRECTION[0], sin(TILT) * DIRECTION[1], cos(TILT)), 0, (2, 0, 0)),
        ((1, 0, 0), 1 - TUBE_RADIUS, (1, 0, 0)),  # a figure of eight
        ((1, 0.3, 0), 1 - TUBE_RADIUS, (1, 0, 0)),
        ((1, 0.3, 0), 1 - TUBE_RADIUS - 1e-9, (2, 0, 0)),
        ((1, 0.3, 0), 1 - TUBE_RADIUS + 1e-9, (1, 0, 0)),
        # The plane touches the torus along a circle, on sides of patches.
        ((0, 0, 1), TUBE_RADIUS, (1, 0, 0)),
        ((0, 0, -1), -TUBE_RADIUS, (1, 0, 0)),
        ((1, 0, 0), 1 + TUBE_RADIUS, (0, 0, 1)),
        ((1, 0.3, 0), 1 + TUBE_RADIUS, (0, 0, 1)),
        ((1, 0.3, 0), 1 + TUBE_RADIUS + 1e-9, (0, 0, 0)),
    ],
)
def test_sections_of_a_torus_have_the_right_topology(
    normal: tuple[float, ...], offset: float, expected: tuple[int, int, int]
) -> None:
    sections = cut(lower_patches(torus(1.0, TUBE_RADIUS)), normal, offset)
    (section,) = sections.sections
    assert count_lines(section) == expected
    # Every point is on the torus, and the polyline is within the bound between the points.
    for line in section.polylines:
        middles = (line.points[1:] + line.points[:-1]) / 2
        for points, limit in ((line.points, 1e-11), (middles, sections.deviation_bound)):
            x, y, z = points.T
            assert np.abs(np.hypot(np.hypot(x, y) - 1, z) - TUBE_RADIUS).max() <= limit


def test_villarceau_circles_have_radius_1() -> None:
    (section,) = cut(
        lower_patches(torus(1.0, TUBE_RADIUS)), (sin(TILT), 0, cos(TILT)), 0, 1e-5
    ).sections
    for line in section.polylines:
        # The centres of the two circles are (0, r, 0) and (0, −r, 0), r the radius of the tube.
        center = np.array([0, TUBE_RADIUS, 0]) * np.sign(line.points[:-1, 1].mean())
        assert np.abs(np.linalg.norm(line.points - center, axis=1) - 1).max() < 1e-6


@pytest.mark.parametrize(
    ("surface", "normal", "offset", "expected"),
    [
        (sphere(), (1, 2, 3), 0.1, (1, 0, 0)),
        (sphere(), (1, 0.3, 0), 0, (1, 0, 0)),  # through both poles
        (sphere(), (1, 0, 0), 0, (1, 0, 0)),  # along borders of patches
        (sphere(), (0, 0, 1), 0, (1, 0, 0)),
        (sphere(), (0, 0, 1), 1, (0, 0, 1)),  # at a pole
        (sphere(), (1, 2, 3), 1, (0, 0, 1)),
        (sphere(), (1, 2, 3), 1 + 1e-9, (0, 0, 0)),
        (cylinder(), (1, 2, 3), 0.1, (1, 0, 0)),
        (cone(), (1, 0, 0.2), 0.1, (1, 0, 0)),
        (find("monkey-saddle").surface(), (0, 0, 1), 0, (0, 3, 0)),  # touches the plane and crosses
    ],
)
def test_sections_of_other_surfaces_have_the_right_topology(
    surface: SurfaceKind, normal: tuple[float, ...], offset: float, expected: tuple[int, int, int]
) -> None:
    model = lower_patches(surface)
    for sign in (1, -1):
        sections = cut(model, np.multiply(sign, normal), sign * offset)
        assert count_lines(sections.sections[0]) == expected
        assert sections.deviation_bound <= 1e-3 * model.diagonal


def test_patches_in_the_plane_are_listed_and_their_borders_drawn() -> None:
    model = build_model(build_cube())
    for offset, coplanar_count in ((1.0, 1), (0.5, 0), (0.0, 1)):
        for sign in (1, -1):
            (section,) = cut(model, (0, 0, sign), sign * offset).sections
            assert len(section.coplanar) == coplanar_count
            (line,) = section.polylines
            assert line.closed
            corners = {tuple(p) for p in line.points.tolist() if set(p[:2]) <= {0.0, 1.0}}
            assert corners == {(x, y, offset) for x in (0.0, 1.0) for y in (0.0, 1.0)}


def test_bodies_are_on_the_left_of_their_sections() -> None:
    """Then the signed area of a section is positive, seen from the tip of the plane's normal."""
    for name in ("sphere", "torus"):
        sections = cut(lower_patches(find(name).surface()), [(0, 0, 1), (1, 2, -3)], [0.1, 0.05])
        for k, section in enumerate(sections.sections):
            x, y = (axis[k] for axis in sections.planes.axes)
            total = 0.0
            for line in section.polylines:
                a, b = line.points @ x, line.points @ y
                total += float((a[:-1] * b[1:] - a[1:] * b[:-1]).sum())
            assert total > 0


def test_sections_of_closed_surfaces_are_closed() -> None:
    """Patches on both sides of an edge have equal points there."""
    net = RNG(3).normal(size=(7, 8, 3)) * 0.2
    angles = 2 * np.pi * np.arange(8) / 8
    for i in range(7):
        tube = 2 * np.pi * i / 7
        ring = (3 + np.cos(tube)) * np.stack([np.cos(angles), np.sin(angles)])
        net[i] += np.stack([*ring, np.full(8, np.sin(tube))], axis=1)
    model = lower_patches(BsplineSurface(net, (3, 2), ("periodic", "periodic")))
    normals = RNG(4).normal(size=(30, 3))
    sections = cut(model, normals, RNG(5).uniform(-2, 2, 30))
    assert all(line.closed for s in sections.sections for line in s.polylines)
    assert sections.point_count > 500
    # The plane z = 2.4 contains borders of the rim, the body, the lid and the spout (twice).
    teapot = cut(lower_patches(find("utah-teapot").surface()), [(0, 0, 1)] * 3, [0.3, 2.4, 3.0])
    assert [count_lines(s) for s in teapot.sections] == [(1, 0, 0), (5, 0, 0), (1, 0, 0)]


def test_a_section_does_not_depend_on_other_planes() -> None:
    model = lower_patches(find("utah-teapot").surface())
    heights = np.linspace(0.1, 3, 9)
    all_sections = cut(model, [(0, 0, 1)] * 9, heights).sections
    for k in (0, 4, 8):
        (section,) = cut(model, (0, 0, 1), heights[k]).sections
        for line, expected in zip(all_sections[k].polylines, section.polylines, strict=True):
            assert np.array_equal(line.points, expected.points)


def test_a_surface_that_is_one_point_is_coplanar_with_a_plane_through_it() -> None:
    sections = cut(build_model([np.ones((2, 2, 3))]), [[0, 0, 1]] * 3, np.arange(3.0)).sections
    assert [(count_lines(s), s.coplanar.tolist()) for s in sections] == [
        ((0, 0, 0), []),
        ((0, 0, 0), [0]),
        ((0, 0, 0), []),
    ]


def test_too_many_pieces_are_refused_before_they_are_computed() -> None:
    """40 planes; with the tolerance 1e-9 they are refused, with 1e-4 they are accepted.

    Cells are divided level by level, and the number of pieces is checked before each level. The
    refusal comes after few levels, when the work so far has less than half of the allowed pieces.
    """
    model = to_patches(find("utah-teapot").surface().lower())
    low, high = model.bounds
    offsets = np.linspace(low[2], high[2], 42)[1:-1]
    planes = Planes(np.tile([0.0, 0.0, 1.0], (40, 1)), offsets)
    seams, counts = connect(model), []

    def allow(count: int) -> None:
        counts.append(count)
        if count > max_pieces:
            raise Refused

    max_pieces = 20_000
    with pytest.raises(Refused):
        cut_surface(model, seams, planes, 1e-9 * model.diagonal, allow)
    assert max(counts[:-1]) < max_pieces / 2
    assert len(counts) < 8
    counts.clear()
    sections = cut_surface(model, seams, planes, 1e-4 * model.diagonal, allow)
    assert 5_000 < sections.point_count < max_pieces
