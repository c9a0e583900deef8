"""Sections: checked by a search along lines of parameters, by closed forms, and by topology."""

from math import asin, cos, sin

import numpy as np
import pytest

from service.engine.mesh.connect import connect
from service.engine.models import to_patches
from service.engine.sections.planes import Planes
from service.engine.sections.section import cut_surface
from service.engine.sections.values import Section, Sections
from service.surface.bspline import BsplineSurface
from service.surface.examples import find
from service.surface.lowered import PatchModel
from service.surface.quadrics import cone, cylinder, sphere, torus
from service.surface.sizes import SurfaceKind
from tests.oracles.sections import find_crossings, measure_distances
from tests.oracles.sheets import Array, build_sheets
from tests.strategies import build_cube, build_model
from tools.certify.surfaces import FAMILIES

RNG = np.random.default_rng
REACH = 0.4
"""Radius of the tube of the torus, whose centre line has radius 1."""


class Refused(Exception):
    """More pieces than a test allows."""


def cut(model: PatchModel, normals: object, offsets: object, relative: float = 1e-3) -> Sections:
    n = np.atleast_2d(np.array(normals, float))
    n /= np.linalg.norm(n, axis=1)[:, np.newaxis]
    planes = Planes(n, np.atleast_1d(np.array(offsets, float)))

    def allow(count: int) -> None:
        assert count < 200_000

    return cut_surface(model, connect(model), planes, relative * model.diagonal, allow)


def lower_patches(surface: SurfaceKind) -> PatchModel:
    return to_patches(surface.lower())


def count_lines(section: Section) -> tuple[int, int, int]:
    """The numbers of closed polylines, of open polylines, and of touching points."""
    closed = sum(line.closed for line in section.polylines)
    return closed, len(section.polylines) - closed, len(section.touching)


@pytest.mark.parametrize("name", FAMILIES)
def test_no_part_of_the_section_is_lost(name: str) -> None:
    surface = FAMILIES[name].surface(5)
    model = lower_patches(surface)
    (low, high), rng = model.bounds, RNG(11)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    offset = float(normal @ (low + (high - low) * rng.uniform(0.3, 0.7, 3)))
    sections = cut(model, normal, offset)
    (section,), sheets = sections.sections, build_sheets(surface)
    seen = find_crossings(sheets, normal, offset, max(8, int(60 / len(sheets) ** 0.5)))
    bound = sections.deviation_bound + 1e-9 * model.diagonal
    assert bound <= 1.001e-3 * model.diagonal
    assert (
        np.minimum(
            measure_distances(section, seen), _measure_distance(section.touching, seen)
        ).max()
        <= bound
    )
    drawn = np.concatenate([line.points for line in section.polylines] or [seen[:0]])
    assert np.abs(drawn @ normal - offset).max(initial=0) <= 1e-10 * model.diagonal


def _measure_distance(points: Array, others: Array) -> Array:
    apart = np.linalg.norm(points[:, None] - others, axis=2)
    return np.asarray(apart.min(axis=0, initial=np.inf))


A = asin(REACH)
TURN = cos(0.3), sin(0.3)


@pytest.mark.parametrize(
    ("normal", "offset", "expected"),
    [
        ((0, 0, 1), 0.1, (2, 0, 0)),  # two circles
        ((1, 0.3, 0), 0, (2, 0, 0)),
        ((sin(A), 0, cos(A)), 0, (2, 0, 0)),  # Villarceau's circles, which cross twice
        ((sin(A) * TURN[0], sin(A) * TURN[1], cos(A)), 0, (2, 0, 0)),
        ((1, 0, 0), 1 - REACH, (1, 0, 0)),  # a figure of eight
        ((1, 0.3, 0), 1 - REACH, (1, 0, 0)),
        ((1, 0.3, 0), 1 - REACH - 1e-9, (2, 0, 0)),
        ((1, 0.3, 0), 1 - REACH + 1e-9, (1, 0, 0)),
        (
            (0, 0, 1),
            REACH,
            (1, 0, 0),
        ),  # a circle along which the plane touches it, on patches' sides
        ((0, 0, -1), -REACH, (1, 0, 0)),
        ((1, 0, 0), 1 + REACH, (0, 0, 1)),
        ((1, 0.3, 0), 1 + REACH, (0, 0, 1)),
        ((1, 0.3, 0), 1 + REACH + 1e-9, (0, 0, 0)),
    ],
)
def test_torus(normal: tuple[float, ...], offset: float, expected: tuple[int, int, int]) -> None:
    sections = cut(lower_patches(torus(1.0, REACH)), normal, offset)
    (section,) = sections.sections
    assert count_lines(section) == expected
    # Every point is on the torus, and the polyline is within the bound between the points.
    for line in section.polylines:
        middles = (line.points[1:] + line.points[:-1]) / 2
        for points, away in ((line.points, 1e-11), (middles, sections.deviation_bound)):
            x, y, z = points.T
            assert np.abs(np.hypot(np.hypot(x, y) - 1, z) - REACH).max() <= 1.5 * away


def test_villarceau_circles_are_circles() -> None:
    (section,) = cut(lower_patches(torus(1.0, REACH)), (sin(A), 0, cos(A)), 0, 1e-5).sections
    for line in section.polylines:
        middle = np.array([0, REACH, 0]) * np.sign(line.points[:-1, 1].mean())
        assert np.abs(np.linalg.norm(line.points - middle, axis=1) - 1).max() < 1e-6


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
    ],
)
def test_quadrics(
    surface: SurfaceKind, normal: tuple[float, ...], offset: float, expected: tuple[int, int, int]
) -> None:
    (section,) = cut(lower_patches(surface), normal, offset).sections
    assert count_lines(section) == expected
    (back,) = cut(lower_patches(surface), np.negative(normal), -offset).sections
    assert count_lines(back) == expected


def test_faces_in_the_plane_are_listed_and_outlined() -> None:
    model = build_model(build_cube())
    for offset, coplanar in ((1.0, 1), (0.5, 0), (0.0, 1)):
        for sign in (1, -1):
            (section,) = cut(model, (0, 0, sign), sign * offset).sections
            assert len(section.coplanar) == coplanar
            (line,) = section.polylines
            assert line.closed
            corners = {tuple(p) for p in line.points.tolist() if set(p[:2]) <= {0.0, 1.0}}
            assert corners == {(x, y, offset) for x in (0.0, 1.0) for y in (0.0, 1.0)}


def test_bodies_lie_on_the_left_of_sections() -> None:
    """The area is positive seen from the tip of the normal: outside is to the right."""
    for name in ("sphere", "torus"):
        sections = cut(lower_patches(find(name).surface()), [(0, 0, 1), (1, 2, -3)], [0.1, 0.05])
        for k, section in enumerate(sections.sections):
            x, y = (axis[k] for axis in sections.planes.axes)
            total = 0.0
            for line in section.polylines:
                flat = np.stack([line.points @ x, line.points @ y])
                total += float((flat[0, :-1] * flat[1, 1:] - flat[0, 1:] * flat[1, :-1]).sum())
            assert total > 0


def test_patches_on_both_sides_of_an_edge_share_its_points() -> None:
    """The sections of closed surfaces are closed."""
    net = RNG(3).normal(size=(7, 8, 3)) * 0.2
    around = 2 * np.pi * np.arange(8) / 8
    for i in range(7):
        tube = 2 * np.pi * i / 7
        ring = (3 + np.cos(tube)) * np.stack([np.cos(around), np.sin(around)])
        net[i] += np.stack([*ring, np.full(8, np.sin(tube))], axis=1)
    model = lower_patches(BsplineSurface(net, (3, 2), ("periodic", "periodic")))
    normals = RNG(4).normal(size=(30, 3))
    sections = cut(model, normals, RNG(5).uniform(-2, 2, 30))
    assert all(line.closed for s in sections.sections for line in s.polylines)
    assert sections.point_count > 500
    # At height 2.4 lie the borders of rim, body, lid and, twice, spout.
    teapot = cut(lower_patches(find("utah-teapot").surface()), [(0, 0, 1)] * 3, [0.3, 2.4, 3.0])
    assert [count_lines(s) for s in teapot.sections] == [(1, 0, 0), (5, 0, 0), (1, 0, 0)]


def test_a_plane_does_not_depend_on_the_others() -> None:
    model = lower_patches(find("utah-teapot").surface())
    heights = np.linspace(0.1, 3, 9)
    together = cut(model, [(0, 0, 1)] * 9, heights).sections
    for k in (0, 4, 8):
        (alone,) = cut(model, (0, 0, 1), heights[k]).sections
        for one, other in zip(together[k].polylines, alone.polylines, strict=True):
            assert np.array_equal(one.points, other.points)


def test_a_surface_that_is_one_point_lies_in_the_plane_through_it() -> None:
    sections = cut(build_model([np.ones((2, 2, 3))]), [[0, 0, 1]] * 3, np.arange(3.0)).sections
    assert [(count_lines(each), each.coplanar.tolist()) for each in sections] == [
        ((0, 0, 0), []),
        ((0, 0, 0), [0]),
        ((0, 0, 0), []),
    ]


def test_too_many_pieces_are_refused_before_they_are_made() -> None:
    """40 planes at 1e-9 are refused after a few levels of cells; at 1e-4 they are cut."""
    model = to_patches(find("utah-teapot").surface().lower())
    low, high = model.bounds
    offsets = np.linspace(low[2], high[2], 42)[1:-1]
    planes = Planes(np.tile([0.0, 0.0, 1.0], (40, 1)), offsets)
    seams, counts = connect(model), []

    def allow(count: int) -> None:
        counts.append(count)
        if count > most:
            raise Refused

    most = 20_000
    with pytest.raises(Refused):
        cut_surface(model, seams, planes, 1e-9 * model.diagonal, allow)
    assert max(counts[:-1]) < most / 2
    assert len(counts) < 8
    counts.clear()
    sections = cut_surface(model, seams, planes, 1e-4 * model.diagonal, allow)
    assert 5_000 < sections.point_count < most
