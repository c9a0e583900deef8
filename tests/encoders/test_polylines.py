"""Sections in every format; other programs read the files: an XML parser, the glTF validator."""

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from oracles.gltf import read_glb
from service.encoders.polylines.format import count_sections
from service.encoders.polylines.registry import SECTION_FORMATS, SECTIONS_BY_NAME
from service.engine.sections.values import Planes, Sections, SectionTolerance
from service.pipeline.polylines import plan_sections
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.member import Member
from tests.clients.gltf_validator import list_issues
from tests.engine.sections.test_sections import cut, lower_patches

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def teapot() -> Sections:
    """Sections of the teapot: closed polylines, open polylines, and a plane that misses it."""
    normals, offsets = [(0, 0, 1), (0, 1, 0.1), (0, 0, 1)], [1, 0.1, 9]
    return cut(lower_patches(find("utah-teapot").surface()), normals, offsets)


@pytest.fixture(scope="module")
def empty() -> Sections:
    """The section of a sphere of radius 1 by the plane z = 5, which misses it."""
    return cut(lower_patches(find("sphere").surface()), normals=(0, 0, 1), offsets=5)


def measure_lengths(sections: Sections) -> list[float]:
    """The length of each polyline."""
    lines = [line.points for section in sections.sections for line in section.polylines]
    return [float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) for points in lines]


def encode_sections(sections: Sections, name: str) -> bytes:
    return SECTIONS_BY_NAME[name].encode(sections)


def test_files_are_not_longer_than_their_bounds(teapot: Sections, empty: Sections) -> None:
    # A plane at the distance 1 from the centre of the sphere touches it.
    tangent = cut(lower_patches(find("sphere").surface()), normals=(1, 2, 3), offsets=1)
    for sections in (teapot, empty, tangent):
        for fmt in SECTION_FORMATS:
            assert len(fmt.encode(sections)) <= fmt.byte_bound(count_sections(sections))


def test_json_has_the_exact_points_and_repeats_the_first_of_closed_polylines(
    teapot: Sections,
) -> None:
    document = json.loads(encode_sections(teapot, "json"))
    for json_section, section in zip(document["sections"], teapot.sections, strict=True):
        for line, polyline in zip(json_section["polylines"], section.polylines, strict=True):
            assert line["closed"] == polyline.closed
            assert np.array_equal(line["points"], polyline.points)
            assert (line["points"][0] == line["points"][-1]) == polyline.closed
    assert document["report"]["points"] == teapot.point_count


def test_svg_has_a_path_for_each_polyline_in_the_plane(teapot: Sections) -> None:
    root = ET.fromstring(encode_sections(teapot, "svg"))
    x, y, width, height = map(float, root.attrib["viewBox"].split())
    groups = root.findall(f"{SVG}g")
    assert len(groups) == 3
    lengths = []
    for group, section in zip(groups, teapot.sections, strict=True):
        paths = group.findall(f"{SVG}path")
        for path, line in zip(paths, section.polylines, strict=True):
            commands = path.attrib["d"]
            assert commands.endswith("Z") == line.closed
            points = np.array(commands.strip("MZ").split(), float).reshape(-1, 2)
            assert (points >= (x, y)).all()
            assert (points <= (x + width, y + height)).all()
            if line.closed:
                points = np.append(points, points[:1], axis=0)
            lengths.append(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    assert lengths == pytest.approx(measure_lengths(teapot), rel=1e-12)
    # The axes of the plane z = 1 are x and y of space; y of SVG points downwards.
    commands = groups[0].findall(f"{SVG}path")[0].attrib["d"]
    first_point = np.array(commands.strip("MZ").split()[:2], float)
    assert (first_point == teapot.sections[0].polylines[0].points[0, :2] * (1, -1)).all()


def test_svg_does_not_contain_the_name_of_the_surface(teapot: Sections) -> None:
    content = encode_sections(teapot, "svg")
    assert b"teapot" not in content
    assert content.isascii()


def test_glb_has_a_strip_for_each_polyline(teapot: Sections) -> None:
    content = read_glb(encode_sections(teapot, "glb"))
    strips = [strip for mesh in content.document["meshes"] for strip in mesh["primitives"]]
    points = [content.array(strip["attributes"]["POSITION"]).astype(float) for strip in strips]
    lengths = [np.linalg.norm(np.diff(each, axis=0), axis=1).sum() for each in points]
    assert lengths == pytest.approx(measure_lengths(teapot), rel=1e-6)
    # 3 is LINE_STRIP.
    assert {strip["mode"] for strip in strips} == {3}
    # The root, and a node for each plane.
    assert len(content.document["nodes"]) == 1 + 3


def test_the_root_of_gltf_scales_to_metres() -> None:
    """The local origin, too; other formats stay in model units."""
    far = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]) + 1e5
    group = GroupSurface((Member(BezierSurface(far)),), "z", metres_per_unit=0.001)
    planes = Planes(np.array([[1.0, 0, 0]]), np.array([1e5 + 0.5]))
    query = planes, SectionTolerance(None)
    roots, texts = [], []
    for each in (group, replace(group, metres_per_unit=None)):
        content = plan_sections(each, query, SECTIONS_BY_NAME["glb"]).run()
        roots.append(read_glb(content).document["nodes"][0])
        texts.append(plan_sections(each, query, SECTIONS_BY_NAME["json"]).run())
    scaled, plain = roots
    assert scaled["scale"] == [0.001] * 3
    assert scaled["rotation"] == plain["rotation"]
    np.testing.assert_allclose(scaled["translation"], np.array(plain["translation"]) / 1000)
    assert texts[0] == texts[1]


def test_obj_has_a_line_element_of_equal_length_for_each_polyline(teapot: Sections) -> None:
    records = [line.split() for line in encode_sections(teapot, "obj").decode().splitlines()]
    names = [words[0] for keyword, *words in records if keyword == "o"]
    assert names == [f"utah-teapot-{k}" for k in range(3)]
    points = np.array([words for keyword, *words in records if keyword == "v"], float)
    lines = [np.array(words, int) - 1 for keyword, *words in records if keyword == "l"]
    lengths = [np.linalg.norm(np.diff(points[line], axis=0), axis=1).sum() for line in lines]
    assert lengths == pytest.approx(measure_lengths(teapot), rel=1e-12)


@pytest.mark.parametrize("name", ["glb", "gltf"])
def test_the_validator_finds_no_issue(
    teapot: Sections, empty: Sections, name: str, tmp_path: Path
) -> None:
    assert list_issues(encode_sections(teapot, name), tmp_path / f"a.{name}") == []
    assert list_issues(encode_sections(empty, name), tmp_path / f"b.{name}") == []


def test_oogl_has_the_numbers_of_points_negative_for_closed_polylines(teapot: Sections) -> None:
    lines = encode_sections(teapot, "oogl").decode().split("\n")
    polylines, points, colors = map(int, lines[1].split())
    # The head is followed by a number of points and a number of colours for each polyline, then by
    # the points; the last lines are the colour and an empty line.
    counts, rows = list(map(int, lines[2 : 2 + polylines])), lines[2 + 2 * polylines : -2]
    assert lines[0] == "VECT"
    assert colors == 1
    assert sum(map(abs, counts)) == points == len(rows)
    is_closed = [line.closed for section in teapot.sections for line in section.polylines]
    assert [count < 0 for count in counts] == is_closed
