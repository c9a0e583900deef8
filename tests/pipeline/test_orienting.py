"""Surfaces whose patches are turned: neighbours agree, volumes are positive, the rest is said."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases.arrays import Bools, FloatArray
from service.engine.measures.orientation import Turns, find_turns
from service.engine.measures.values import MeasureQuery
from service.pipeline.measure import plan_measure
from service.pipeline.orienting import orient
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.convert.operations import Elevate, Reverse, Split, ToTriangle
from service.surface.convert.table import apply, convert
from service.surface.convert.units import turn_patches_of
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.group import GroupSurface
from service.surface.member import Member
from service.surface.multipatch import MultipatchSurface
from service.surface.sizes import SurfaceKind
from tests.breps import PLATE
from tests.surface.convert.test_members import parse

WELD = 1e-12
SEVERAL = [
    name
    for name, example in EXAMPLES.items()
    if example.surface().size().patches > 1 and not example.surface().size().faces
]
"""The built-in surfaces of several patches."""


def find_side(origin: Any, along_u: Any, along_v: Any) -> FloatArray:
    """The net of a parallelogram."""
    corner, u, v = (np.array(vector, float) for vector in (origin, along_u, along_v))
    return np.array([[corner, corner + v], [corner + u, corner + u + v]])


X, Y, Z = np.eye(3)
BOX = [
    find_side([0, 0, 0], Y, X),
    find_side([0, 0, 1], X, Y),
    find_side([0, 0, 0], X, Z),
    find_side([0, 1, 0], Z, X),
    find_side([0, 0, 0], Z, Y),
    find_side([1, 0, 0], Y, Z),
]
"""The sides of the unit cube; normals point outwards."""


def measure(surface: Any) -> Any:
    """The measures of a surface."""
    return json.loads(plan_measure(surface, MeasureQuery(1e-3)).run())


def build_multipatch(nets: Any) -> MultipatchSurface:
    """A multipatch of patches."""
    return MultipatchSurface(tuple(BezierSurface(np.array(net)) for net in nets))


def turn(surface: SurfaceKind, turns: Turns, is_turned: Bools) -> SurfaceKind:
    """The surface with these units turned."""
    return turn_patches_of(surface, turns.member[is_turned], turns.number[is_turned], apply)


@pytest.mark.slow
@pytest.mark.parametrize("name", SEVERAL)
def test_built_in_surfaces_are_oriented_from_every_turning(name: str) -> None:
    surface: Any = find(name).surface()
    oriented, first = orient(surface, WELD)
    assert first.not_orientable == ()
    start = find_turns(oriented.lower(), WELD)
    assert not start.is_turned.any()
    before = measure(oriented)
    assert before["inconsistent_edges"] == 0
    rng = np.random.default_rng(7)
    for share in (0.1, 0.5, 1.0):
        is_turned = rng.random(len(start.number)) < share
        turned = turn(oriented, start, is_turned)
        again, report = orient(turned, WELD)
        after = measure(again)
        assert after["inconsistent_edges"] == 0
        assert after["closed"] == before["closed"]
        if after["closed"]:
            assert after["volume"]["value"] > 0
            assert after["volume"]["value"] == pytest.approx(before["volume"]["value"])
            assert len(report.turned) == is_turned.sum()
        # Orienting twice changes nothing.
        assert orient(again, WELD)[1].turned == ()
        assert len(report.turned) <= len(start.number)


@given(st.lists(st.booleans(), min_size=6, max_size=6))
def test_a_cube_turns_exactly_its_wrong_sides(flags: list[bool]) -> None:
    nets = [net.swapaxes(0, 1) if flag else net for net, flag in zip(BOX, flags, strict=True)]
    oriented, report = orient(build_multipatch(nets), WELD)
    assert report.turned == tuple(np.flatnonzero(flags).tolist())
    measures = measure(oriented)
    assert measures["closed"]
    assert measures["volume"]["value"] == pytest.approx(1)


def test_members_of_a_group_are_turned_in_their_places() -> None:
    """One square, placed six times, also mirrored: its copies become two surfaces."""
    square = BezierSurface(find_side([0, 0, 0], X, Y))
    members = []
    rng = np.random.default_rng(3)
    for number, net in enumerate(BOX):
        corner, u, v = net[0, 0], net[1, 0] - net[0, 0], net[0, 1] - net[0, 0]
        if rng.random() < 0.5:
            u, v = v, u  # the normal points inwards
        third = np.cross(u, v) * (-1) ** number  # every second placement mirrors
        matrix = np.eye(4)
        matrix[:3] = np.stack([u, v, third, corner], axis=1)
        members.append(Member(square, f"side {number}", (1.0, 0.5, 0.0), matrix))
    group = GroupSurface(tuple(members), metres_per_unit=0.5)
    oriented, report = orient(group, WELD)
    assert isinstance(oriented, GroupSurface)
    assert 0 < len(report.turned) < 6
    measures = measure(oriented)
    assert measures["closed"]
    assert measures["volume"]["value"] == pytest.approx(1)
    assert oriented.stored_size().surfaces == 2
    assert oriented.metres_per_unit == 0.5
    for old, new in zip(group.members, oriented.members, strict=True):
        assert (old.full_name, old.color) == (new.full_name, new.color)
        assert np.array_equal(old.matrix, new.matrix)  # type: ignore[arg-type]
    assert orient(oriented, WELD)[1].turned == ()


def test_numbers_in_a_group_are_those_of_points() -> None:
    """The first number of a B-spline; members of other kinds count, too, and stay as they are."""
    x, y = np.meshgrid(np.arange(5.0), np.arange(4.0), indexing="ij")
    net = np.stack([x, y, 0 * x], axis=2).swapaxes(0, 1)
    spline = BsplineSurface(net, (1, 1), ("clamped", "clamped"))
    flat = BezierSurface(find_side([4, 0, 0], X, 3 * Y))
    brep = parse(PLATE)
    tube: Any = find("trefoil-tube").surface()
    for surfaces in ([brep, tube, flat, spline], [flat, brep, spline, tube]):
        group = GroupSurface(tuple(Member(each, f"m{k}") for k, each in enumerate(surfaces)))
        oriented, report = orient(group, WELD)
        # Both are of one size, so the first stays.
        assert report.turned == (brep.size().faces + 1,)
        assert isinstance(oriented, GroupSurface)
        changed = [
            number
            for number, (old, new) in enumerate(zip(group.members, oriented.members, strict=True))
            if old.surface is not new.surface
        ]
        assert changed == [surfaces.index(spline)]


def build_strip(count: int, *, is_twisted: bool) -> MultipatchSurface:
    """A closed strip of patches, with half a twist or without."""
    angles = 2 * np.pi * np.arange(count + 1) / count
    points = np.empty((count + 1, 2, 3))
    for side, offset in enumerate((-0.3, 0.3)):
        half = angles / 2 * is_twisted
        radius = 1 + offset * np.cos(half) * is_twisted
        height = offset * (np.sin(half) if is_twisted else 1.0)
        points[:, side] = np.stack(
            [radius * np.cos(angles), radius * np.sin(angles), height + 0 * angles], axis=1
        )
    points[-1] = points[0, ::-1] if is_twisted else points[0]
    return build_multipatch([points[k : k + 2] for k in range(count)])


@pytest.mark.parametrize("count", [1, 2, 5, 40])
def test_a_strip_with_half_a_twist_is_not_turned(count: int) -> None:
    strip = build_strip(max(count, 3), is_twisted=True)
    surface: Any = strip
    if count == 1:  # as one spline
        nets = np.stack([single.control_net for single in strip.surfaces])
        rows = np.concatenate([nets[:, 0], nets[-1:, 1]])
        surface = BsplineSurface(rows, (1, 1), ("clamped", "clamped"))
    oriented, report = orient(surface, WELD)
    assert report.turned == ()
    assert report.not_orientable == tuple(range(1 if count == 1 else max(count, 3)))
    assert oriented is surface
    plain = build_strip(max(count, 3), is_twisted=False)
    assert orient(plain, WELD)[1].not_orientable == ()


def test_a_strip_does_not_hinder_its_neighbours() -> None:
    strip = build_strip(5, is_twisted=True)
    nets = [net + 9 for net in BOX]
    nets[2] = nets[2].swapaxes(0, 1)
    both = MultipatchSurface((*strip.surfaces, *build_multipatch(nets).surfaces))
    oriented, report = orient(both, WELD)
    assert report.not_orientable == (0, 1, 2, 3, 4)
    assert report.turned == (7,)
    assert isinstance(oriented, MultipatchSurface)
    assert oriented.surfaces[:5] == both.surfaces[:5]


def test_the_majority_of_an_open_surface_stays_and_then_the_first() -> None:
    nets = BOX[:1] + BOX[2:]  # without its lid
    for flags, expected in (
        ([0, 0, 1, 0, 0], (2,)),
        ([1, 0, 1, 1, 1], (1,)),
        ([1, 1, 1, 1, 1], ()),
    ):
        turned = [
            net.swapaxes(0, 1) if flag else net for net, flag in zip(nets, flags, strict=True)
        ]
        assert orient(build_multipatch(turned), WELD)[1].turned == expected
    pair = [BOX[0], BOX[2].swapaxes(0, 1)]
    assert orient(build_multipatch(pair), WELD)[1].turned == (1,)
    assert orient(build_multipatch(pair[::-1]), WELD)[1].turned == (1,)


def test_borders_in_pieces_of_other_degrees_and_nearly_equal_ones_are_neighbours() -> None:
    nets = [np.array(net) for net in BOX]
    nets[3] = nets[3].swapaxes(0, 1)
    surfaces: list[Any] = list(build_multipatch(nets).surfaces)
    surfaces[1] = convert(surfaces[1], [Elevate((4, 3)), Reverse("u"), Reverse("v")])
    rng = np.random.default_rng(4)
    noisy = surfaces[5].control_net + rng.uniform(-1, 1, (2, 2, 3)) * 1e-10
    surfaces[5] = replace(surfaces[5], control_net=noisy)
    multipatch = MultipatchSurface(tuple(surfaces))
    cut: Any = convert(multipatch, [Split(u=0.375, patch=2)])
    oriented, report = orient(cut, 1e-9)
    assert report.turned == (4,)
    # The sides that measures name are those of this patch, too.
    faulty = json.loads(plan_measure(cut, MeasureQuery(1e-3, 1e-9)).run())["faulty_edges"]
    patches = [edge["patch"] for edge in faulty]
    assert max(set(patches), key=patches.count) == 4
    measures = json.loads(plan_measure(oriented, MeasureQuery(1e-3, 1e-9)).run())
    assert measures["closed"]
    assert measures["volume"]["value"] == pytest.approx(1, abs=1e-6)


def test_triangles_are_turned_too() -> None:
    ball: Any = find("octahedral-sphere").surface()
    turns = find_turns(ball.lower(), WELD)
    is_turned = np.arange(len(turns.number)) % 3 == 0
    turned = turn(ball, turns, is_turned)
    oriented, report = orient(turned, WELD)
    assert report.turned == tuple(np.flatnonzero(is_turned).tolist())
    assert measure(oriented)["volume"]["value"] == pytest.approx(4 / 3 * np.pi, rel=1e-3)
    half: Any = convert(build_multipatch(BOX), [ToTriangle("lower", 0)])
    assert orient(half, WELD)[1].not_orientable == ()


def test_a_surface_inside_another_points_outwards_too() -> None:
    inner = [0.5 + 0.25 * (net.swapaxes(0, 1) - 0.5) for net in BOX]
    _, report = orient(build_multipatch([*BOX, *inner]), WELD)
    assert report.turned == (6, 7, 8, 9, 10, 11)


def test_breps_and_sweeps_stay_as_they_are() -> None:
    for surface in (parse(PLATE), find("trefoil-tube").surface()):
        oriented, report = orient(surface, WELD)
        assert oriented is surface
        assert (report.turned, report.not_orientable) == ((), ())
