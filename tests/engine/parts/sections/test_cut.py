"""Sections of parts: closed loops with the areas of closed forms; faces and edges in planes."""

from dataclasses import replace
from functools import cache
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles.sheets import Array
from oracles.solids import VALID, read_solid
from service.engine.parts.build import build_part
from service.engine.parts.part import Part
from service.engine.parts.sections.cut import cut_part
from service.engine.sections.values import Planes, Section, Sections
from tests.breps import build_box
from tests.engine.brep.solid_documents import lower
from tests.engine.parts.shapes import Bracket, build_cracked, build_hollow_box
from tests.engine.parts.test_part import SADDLE, lower_group
from tools.certify.part_curves import draw_segments
from tools.certify.part_documents import build_prism

Document = dict[str, Any]

X, Y, Z = np.eye(3)


@cache
def build_solid(name: str) -> Part:
    return build_part(lower(read_solid(name)))


def cut(part: Part, normals: Any, offsets: Any, relative: float = 1e-3) -> Sections:
    n = np.atleast_2d(np.array(normals, float))
    n /= np.linalg.norm(n, axis=1)[:, np.newaxis]
    tolerance = relative * part.nets.diagonal

    def allow(count: int) -> None:
        assert count < 200_000

    return cut_part(part, Planes(n, np.atleast_1d(np.array(offsets, float))), tolerance, allow)


def cut_one(part: Part, normal: Any, offset: float, relative: float = 1e-3) -> Section:
    sections = cut(part, normal, offset, relative)
    assert sections.deviation_bound <= relative * part.nets.diagonal
    return sections.sections[0]


def measure_areas(sections: Sections) -> Array:
    """The areas of sections by Green's theorem; counter-clockwise lines count positive."""
    x, y = sections.planes.axes
    areas = np.zeros(len(sections.sections))
    for k, section in enumerate(sections.sections):
        for line in section.polylines:
            a, b = (line.points - line.points[0]) @ x[k], (line.points - line.points[0]) @ y[k]
            areas[k] += float((a[:-1] * b[1:] - a[1:] * b[:-1]).sum()) / 2
    return areas


def are_closed(sections: Sections) -> bool:
    return all(line.closed for line in sections.polylines)


def area(part: Part, normal: Any, offset: float, relative: float = 1e-5) -> float:
    sections = cut(part, normal, offset, relative)
    assert are_closed(sections)
    assert sections.deviation_bound <= 1.1 * relative * part.nets.diagonal
    return float(measure_areas(sections)[0])


@pytest.mark.parametrize(
    ("name", "normal", "offset", "expected"),
    [
        ("sphere", X, 4.0, pi * (7**2 - 3**2)),  # its centre is (1, 2, 3)
        ("sphere", Y, 2.0, pi * 7**2),  # along the seam, through both poles
        ("sphere", Z, 3.0, pi * 7**2),
        ("cylinder", Z, 4.0, pi * 5**2),
        ("cylinder", X, 0.0, 10 * 12),
        ("cylinder", Y, 0.0, 10 * 12),  # along the seam
        ("cylinder", X, 3.0, 8 * 12),
        ("cylinder", (0, 1, 1), 6 / sqrt(2), pi * 5**2 * sqrt(2)),
        ("cone", Y, 0.0, 6 * 10),  # through the apex, along the seam
        ("torus", Z, 0.0, pi * (13**2 - 7**2)),
        ("torus", Y, 0.0, 2 * pi * 3**2),  # along one seam, across the other
    ],
)
def test_areas_are_those_of_closed_forms(
    name: str, normal: Any, offset: float, expected: float
) -> None:
    assert area(build_solid(name), normal, offset) == pytest.approx(expected, rel=2e-4)


def test_holes_count_negative() -> None:
    part = build_part(lower(Bracket().document()))
    section = cut_one(part, Z, 1.0)
    assert len(section.polylines) == 2
    assert area(part, Z, 1.0) == pytest.approx(6 * 2 + 2 * 3 - pi * 0.6**2, rel=1e-4)
    hollow, _, _ = build_hollow_box()
    assert area(build_part(lower(hollow)), X, 2.5) == pytest.approx(5 * 4 - 2 * 1.5)


@pytest.mark.parametrize(("offset", "sign"), [(0.0, 1), (4.0, 1), (0.0, -1), (4.0, -1)])
def test_faces_in_the_plane_are_listed_and_their_borders_are_closed(
    offset: float, sign: int
) -> None:
    part = build_part(lower(build_box((2, 3, 4))))
    section = cut_one(part, sign * Z, sign * offset)
    assert len(section.coplanar) == 1
    (line,) = section.polylines
    assert line.closed
    assert area(part, sign * Z, sign * offset) == pytest.approx(6.0)


def test_of_a_stair_both_the_tread_and_the_block_above_or_below_are_closed() -> None:
    corners = np.array([[0.0, 0], [4, 0], [4, 2], [2, 2], [2, 3], [0, 3]])
    part = build_part(lower(build_prism([draw_segments(corners)], 5.0, np.zeros(2))))
    for sign in (1, -1):
        sections = cut(part, sign * Y, 2.0 * sign)
        assert len(sections.sections[0].coplanar) == 1
        assert are_closed(sections)
        assert measure_areas(sections)[0] == pytest.approx(4 * 5)
        points = np.concatenate([line.points for line in sections.polylines])
        riser = np.abs(points[:, 0] - 2.0) < 1e-9
        assert np.ptp(points[riser, 2]) == pytest.approx(5.0)


def test_planes_through_edges_and_vertices_of_a_box() -> None:
    part = build_part(lower(build_box((2, 2, 2))))
    diagonal = (1, 1, 0), sqrt(2)
    assert area(part, *diagonal) == pytest.approx(4 * sqrt(2))
    # An edge alone: there and back; a vertex alone: a point.
    sections = cut(part, (1, 1, 0), 0.0)
    assert are_closed(sections)
    assert measure_areas(sections)[0] == pytest.approx(0.0, abs=1e-12)
    assert sum(len(line.points) > 1 for line in sections.polylines) == 1
    for offset, expected in ((0.0, 1), (6 / sqrt(3), 1)):
        section = cut_one(part, (1, 1, 1), offset)
        assert (len(section.polylines), len(section.touching)) == (0, expected)
    assert area(part, (1, 1, 1), 2 / sqrt(3)) == pytest.approx(2 * sqrt(3))


def test_planes_that_touch_curved_faces() -> None:
    sphere = build_solid("sphere")
    for normal, offset in ((X, 8.0), (Z, 10.0), (-Y, 5.0)):
        section = cut_one(sphere, normal, offset)
        assert (len(section.polylines), len(section.touching)) == (0, 1)
    assert not cut_one(sphere, X, 8.001).touching.size
    cylinder = cut(build_solid("cylinder"), Y, 5.0, 2e-2)  # along a line in the middle of a span
    assert are_closed(cylinder)
    assert 1 <= len(cylinder.polylines) <= 2  # there and back
    assert measure_areas(cylinder)[0] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("name", ["plate", "tee", "viviani"])
def test_coordinate_planes_through_solids_are_closed(name: str) -> None:
    part = build_solid(name)
    low, high = part.members.definitions[0].box
    sections = cut(part, np.eye(3), (low + high) / 2)
    assert are_closed(sections)
    assert sections.deviation_bound <= 1e-3 * part.nets.diagonal
    assert (measure_areas(sections) > 0).all()


@given(st.sampled_from(VALID), st.integers(0, 2**32 - 1))
def test_sections_are_closed_and_agree_with_finer_ones(name: str, seed: int) -> None:
    part = build_solid(name)
    rng = np.random.default_rng(seed)
    low, high = part.members.definitions[0].box
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    offset = float(normal @ (low + (high - low) * rng.uniform(0.1, 0.9, 3)))
    coarse, fine = (cut(part, normal, offset, relative) for relative in (1e-2, 1e-3))
    assert are_closed(coarse)
    assert are_closed(fine)
    length = sum(
        float(np.linalg.norm(np.diff(line.points, axis=0), axis=1).sum()) for line in fine.polylines
    )
    reach = coarse.deviation_bound + fine.deviation_bound
    difference = abs(measure_areas(coarse) - measure_areas(fine))[0]
    assert difference <= 2 * reach * length + 1e-9 * part.nets.diagonal**2
    points = [line.points for line in coarse.polylines]
    if points:
        heights = np.concatenate(points) @ normal - offset
        assert np.abs(heights).max() <= 1e-10 * part.nets.diagonal


def test_a_section_does_not_depend_on_other_planes() -> None:
    part = build_solid("tee")
    n = np.array([[0.2, 1, 0.4], [1, 0, 0], [0, 0, 1]])
    together, alone = cut(part, n, [1.0, 2, 0]), cut(part, n[1], 2.0)
    lines = together.sections[1].polylines, alone.sections[0].polylines
    assert len(lines[0]) == len(lines[1]) > 0
    for one, two in zip(*lines, strict=True):
        assert one.points.tobytes() == two.points.tobytes()


@pytest.mark.parametrize("gap", [1e-2, 1e-3, 1e-5])
def test_both_faces_of_an_edge_give_one_point_across_a_gap(gap: float) -> None:
    part = build_part(lower(build_cracked(gap, tilt=0.3)))
    (section,) = cut(part, Y, 2.0).sections
    (line,) = section.polylines
    assert not line.closed  # two squares are no solid: the line ends at their outer edges
    assert np.sort(line.points[[0, -1], 0]) == pytest.approx([0.0, 10.0])
    assert np.abs(line.points[:, 0] - 5.0).min() <= 1e-12
    # The edge lies in the plane, the borders of both faces are beside it.
    (section,) = cut(part, X, 5.0).sections
    points = np.concatenate([line.points for line in section.polylines])
    assert np.ptp(points[:, 1]) == pytest.approx(5.0)


def test_copies_of_groups_are_placed_and_patches_without_trims_are_cut_too() -> None:
    document = build_box((2, 3, 4))
    matrix = [[0, -2, 0, 30], [2, 0, 0, 1], [0, 0, -2, 8], [0, 0, 0, 1]]  # mirrors and doubles
    part = build_part(
        lower_group(
            {"surface": document | {"up": "z"}},
            {"surface": document | {"up": "z"}, "matrix": matrix},
            {"surface": SADDLE},
        )
    )
    sections = cut(part, Z, 0.4)
    (section,) = sections.sections
    assert [line.closed for line in section.polylines] == [True, True, False, False]
    assert measure_areas(replace(sections, sections=(
        replace(section, polylines=section.polylines[:2]),
    )))[0] == pytest.approx(6 + 4 * 6)  # fmt: skip
    # The bottom of the one box, and the top of the other, which is turned.
    coplanar = cut(part, Z, 0.0).sections[0].coplanar
    assert len(coplanar) == 2
    assert (coplanar[0] < 6) & (6 <= coplanar[1] < 12)
