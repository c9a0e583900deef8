"""Sections in every format, read by others: an XML parser, the glTF validator."""

import json
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from service.encoders.sections.format import SectionSize
from service.encoders.sections.registry import SECTION_FORMATS, SECTIONS_BY_NAME
from service.engine.sections.values import Sections
from service.surface.examples import find
from tests.clients.gltf_validator import list_issues
from tests.encoders.gltf.reader import read_glb
from tests.engine.sections.test_sections import cut, lower_patches

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def teapot() -> Sections:
    """Closed and open lines, and a plane that cuts nothing."""
    normals = [(0, 0, 1), (0, 1, 0.1), (0, 0, 1)]
    return cut(lower_patches(find("utah-teapot").surface()), normals, [1, 0.1, 9])


def measure_lengths(sections: Sections) -> list[float]:
    lines = [line.points for section in sections.sections for line in section.polylines]
    return [float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) for points in lines]


def encode_sections(sections: Sections, name: str) -> bytes:
    return SECTIONS_BY_NAME[name].encode(sections)


def test_byte_bounds(teapot: Sections) -> None:
    empty = cut(lower_patches(find("sphere").surface()), (0, 0, 1), 5)
    touched = cut(lower_patches(find("sphere").surface()), (1, 2, 3), 1)
    for sections in (teapot, empty, touched):
        for fmt in SECTION_FORMATS:
            assert len(fmt.encode(sections)) <= fmt.byte_bound(SectionSize.of(sections))


def test_json(teapot: Sections) -> None:
    document = json.loads(encode_sections(teapot, "json"))
    for result, section in zip(document["sections"], teapot.sections, strict=True):
        assert [line["closed"] for line in result["polylines"]] == [
            line.closed for line in section.polylines
        ]
        for line, polyline in zip(result["polylines"], section.polylines, strict=True):
            assert np.array_equal(line["points"], polyline.points)
            assert (line["points"][0] == line["points"][-1]) == polyline.closed
    assert document["report"]["points"] == teapot.point_count


def test_svg_has_a_path_for_each_polyline_in_the_plane(teapot: Sections) -> None:
    root = ET.fromstring(encode_sections(teapot, "svg"))
    x, y, width, height = map(float, root.attrib["viewBox"].split())
    groups = root.findall(f"{SVG}g")
    assert len(groups) == 3
    total = []
    for group, section in zip(groups, teapot.sections, strict=True):
        paths = group.findall(f"{SVG}path")
        for path, line in zip(paths, section.polylines, strict=True):
            d = path.attrib["d"]
            assert d.endswith("Z") == line.closed
            points = np.array(d.strip("MZ").split(), float).reshape(-1, 2)
            assert (points >= (x, y)).all()
            assert (points <= (x + width, y + height)).all()
            if line.closed:
                points = np.append(points, points[:1], axis=0)
            total.append(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    assert total == pytest.approx(measure_lengths(teapot), rel=1e-12)
    # At z = 1 the axes of the plane are those of space; y counts downwards.
    first = np.array(groups[0].findall(f"{SVG}path")[0].attrib["d"].strip("MZ").split()[:2], float)
    assert (first == teapot.sections[0].polylines[0].points[0, :2] * (1, -1)).all()


def test_svg_holds_no_text_of_a_client(teapot: Sections) -> None:
    content = encode_sections(teapot, "svg")
    assert b"teapot" not in content
    assert content.isascii()


def test_glb_has_a_strip_for_each_polyline(teapot: Sections) -> None:
    content = read_glb(encode_sections(teapot, "glb"))
    strips = [p for mesh in content.document["meshes"] for p in mesh["primitives"]]
    points = [content.array(p["attributes"]["POSITION"]).astype(float) for p in strips]
    result = [np.linalg.norm(np.diff(each, axis=0), axis=1).sum() for each in points]
    assert result == pytest.approx(measure_lengths(teapot), rel=1e-6)
    assert {p["mode"] for p in strips} == {3}
    assert len(content.document["nodes"]) == 4


def test_obj_lines_return_to_their_beginning(teapot: Sections) -> None:
    words = [line.split() for line in encode_sections(teapot, "obj").decode().splitlines()]
    assert [word[1] for word in words if word[0] == "o"] == [f"utah-teapot-{k}" for k in range(3)]
    points = np.array([word[1:] for word in words if word[0] == "v"], float)
    lines = [np.array(word[1:], int) - 1 for word in words if word[0] == "l"]
    result = [np.linalg.norm(np.diff(points[line], axis=0), axis=1).sum() for line in lines]
    assert result == pytest.approx(measure_lengths(teapot), rel=1e-12)


@pytest.mark.parametrize("name", ["glb", "gltf"])
def test_the_validator_reports_nothing(teapot: Sections, name: str, tmp_path: Path) -> None:
    assert list_issues(encode_sections(teapot, name), tmp_path / f"a.{name}") == []
    empty = cut(lower_patches(find("sphere").surface()), (0, 0, 1), 5)
    assert list_issues(encode_sections(empty, name), tmp_path / f"b.{name}") == []


def test_oogl_counts(teapot: Sections) -> None:
    lines = encode_sections(teapot, "oogl").decode().split("\n")
    count, points, colors = map(int, lines[1].split())
    counts, rows = list(map(int, lines[2 : 2 + count])), lines[2 + 2 * count : -2]
    assert lines[0] == "VECT"
    assert colors == 1
    assert sum(map(abs, counts)) == points == len(rows)
    closed = [line.closed for section in teapot.sections for line in section.polylines]
    assert [number < 0 for number in counts] == closed
