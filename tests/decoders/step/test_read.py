"""Whole STEP files: what is read of those of Open CASCADE, the report, and the limits."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.decoders.cad.content import CadContent, Placement
from service.decoders.format import FileLimits
from service.decoders.step.read import read
from service.errors import InvalidRequest, SurfaceError, TooLarge
from tests.decoders.cad.part_meshes import measure_part
from tests.decoders.step.written import HEADER, Writer, wrap

FILES = Path("tests/cad_files")
EXPECTED: dict[str, Any] = json.loads((FILES / "step.json").read_text())
METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 0.0254}


def read_file(name: str) -> CadContent:
    return read((FILES / name).read_bytes(), FileLimits())


def count_placed(content: CadContent) -> tuple[int, int]:
    """Placed parts and placed faces."""
    parts = faces = 0
    pending: list[Placement] = list(content.roots)
    while pending:
        definition = content.definitions[pending.pop().definition]
        parts += len(definition.parts)
        faces += sum(len(part.faces) for part in definition.parts)
        pending += definition.placements
    return parts, faces


def measure(content: CadContent) -> float:
    """The volume of all placed solids, in cubic units; each is closed."""
    volumes = []
    for definition in content.definitions:
        volumes.append(0.0)
        for part in definition.parts:
            volume, cracks = measure_part(part)
            assert not cracks
            volumes[-1] += volume
    total, pending = 0.0, [(root, 1.0) for root in content.roots]
    while pending:
        placement, scale = pending.pop()
        if placement.matrix is not None:
            scale *= float(np.linalg.det(placement.matrix[:3, :3]))
        total += abs(scale) * volumes[placement.definition]
        pending += [(each, scale) for each in content.definitions[placement.definition].placements]
    return total


@pytest.mark.parametrize("name", sorted(EXPECTED))
def test_files_have_what_is_expected(name: str) -> None:
    expected, content = EXPECTED[name], read_file(name)
    reading = content.reading
    parts, faces = count_placed(content)
    assert faces == expected["faces"]
    assert parts == expected.get("instances_of_parts", parts)
    assert content.metres_per_unit == METRES[expected["unit_of_file"]]
    names = {each.name for each in content.definitions}
    assert names >= {*expected.get("names", ()), expected.get("name", content.definitions[0].name)}
    assert not reading.skipped_faces
    assert reading.skipped_entities == {}
    assert reading.unfollowed_references == reading.changed_names == 0
    assert reading.vertex_gap < 1e-6
    assert reading.open_shells == (name == "open_face_ap214.step")


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(EXPECTED.keys() - {"open_face_ap214.step"}))
def test_solids_have_the_volume_that_is_expected(name: str) -> None:
    content = read_file(name)
    assert content.metres_per_unit is not None
    volume = measure(content) * (1e3 * content.metres_per_unit) ** 3
    assert volume == pytest.approx(EXPECTED[name]["volume_mm3"], rel=5e-3)


def test_colours_and_instances_of_an_assembly() -> None:
    content = read_file("assembly_inch_ap203.step")
    (bolt,) = [each for each in content.definitions if each.name == "bolt Größe 5"]
    (plate,) = [each for each in content.definitions if each.name == "plate"]
    assert bolt.parts[0].color == pytest.approx((0.9, 0.1, 0.1), abs=1e-6)
    assert plate.parts[0].color == pytest.approx((0.2, 0.4, 0.8), abs=1e-6)
    assert [each.color for each in plate.parts[0].faces].count((1, 1, 0)) == 1
    top = content.definitions[content.roots[0].definition]
    assert [each.name for each in top.placements] == ["lower", "turned"]


def test_latin_1_and_degrees() -> None:
    content = read_file("degrees_latin1.step")
    assert "K\xf6rper" in (FILES / "degrees_latin1.step").read_text("latin-1")
    assert content.reading.schema == "AUTOMOTIVE_DESIGN"
    assert content.reading.system == "Open CASCADE 8.0"
    assert content.reading.uncertainty == pytest.approx(1e-7)


def test_the_report() -> None:
    writer = Writer()
    hollow = writer.tetrahedron()
    face = writer.face("#1", writer.bound(writer("EDGE_LOOP('',(#1))")))
    model = writer(f"SHELL_BASED_SURFACE_MODEL('sheet',({writer.shell(writer.square(), face)}))")
    points = writer(f"GEOMETRIC_SET('',({writer.point(0, 0, 0)}))")
    writer("TESSELLATED_SOLID('',(),$)")
    writer("DOCUMENT_FILE('../../etc/passwd','',$,$,'',$)")
    writer("<other.stp#7>")
    tolerance = writer(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.5),{writer.unit()},'','')")
    context = writer.context(writer.unit(), uncertainty=tolerance)
    items = [hollow, model, points, writer.frame(), hollow, "#9999"]
    writer.product("part", writer.representation(items, context))
    content = writer.read()
    reading = content.reading
    assert (reading.format, reading.schema, reading.system) == (
        "step",
        "AUTOMOTIVE_DESIGN",
        "system 2.0",
    )
    assert (reading.units, reading.metres_per_unit) == (("millimetre",), 1e-3)
    assert reading.uncertainty == pytest.approx(0.5)
    assert content.definitions[0].parts[0].uncertainty == pytest.approx(0.5)
    assert (reading.products, reading.solids, reading.faces) == (1, 1, 5)
    assert (reading.closed_shells, reading.open_shells) == (1, 1)
    assert reading.skipped_entities == {
        "GEOMETRIC_SET": 1,
        "TESSELLATED_SOLID": 1,
        "missing entities": 1,
    }
    assert [each.entity for each in reading.skipped_faces] == [face]
    assert reading.unfollowed_references == 2
    assert [each.name for each in content.definitions[0].parts] == ["solid", "sheet"]


def test_voids_and_oriented_shells() -> None:
    writer = Writer()
    outer, inner = writer.tetrahedron(8.0), writer.tetrahedron(1.0)
    shells = [f"#{int(name[1:]) - 1}" for name in (outer, inner)]
    turned = writer(f"ORIENTED_CLOSED_SHELL('',*,{shells[1]},.F.)")
    solid = writer(f"BREP_WITH_VOIDS('hollow',{shells[0]},({turned}))")
    content = writer.read(solid)
    (part,) = content.definitions[0].parts
    assert [shell.is_closed for shell in part.shells] == [True, True]
    assert [part.faces[shell.faces[0]].is_reversed for shell in part.shells] == [False, True]
    volume, cracks = measure_part(part)
    assert not cracks
    assert volume == pytest.approx((8**3 - 1) / 6)


def test_a_face_that_a_shell_lists_again_is_read_once() -> None:
    writer = Writer()
    face = writer.square()
    shells = [writer(f"OPEN_SHELL('',({','.join([face] * 1000)}))"), writer.shell(face)]
    content = writer.read(writer(f"SHELL_BASED_SURFACE_MODEL('',({','.join(shells)}))"))
    assert content.reading.faces == 1
    assert content.reading.skipped_entities == {"repeated faces of shells": 1000}


def test_loose_faces_of_a_representation_are_one_part() -> None:
    writer = Writer()
    content = writer.read(writer.square(), writer.square())
    (part,) = content.definitions[0].parts
    assert len(part.faces) == 2
    assert [shell.is_closed for shell in part.shells] == [False]


def test_a_shell_that_lacks_a_face_is_open() -> None:
    writer = Writer()
    solid = writer.tetrahedron()
    face = f"#{int(solid[1:]) - 2}"
    writer.lines[int(face[1:]) - 1] = f"{face}=FACE('',(#9999));"
    content = writer.read(solid)
    assert [each.entity for each in content.reading.skipped_faces] == [face]
    assert (content.reading.closed_shells, content.reading.open_shells) == (0, 1)


def test_limits() -> None:
    writer = Writer()
    face = writer.square()
    data = [f"#{k}=ADVANCED_FACE('',(),#1,.T.);" for k in range(1000, 1010)]
    content = wrap("\n".join([*writer.lines, *data]))
    with pytest.raises(TooLarge) as error:
        read(content, FileLimits(max_faces=9))
    assert error.value.issues[0].needed == "at most 9 (SURFACE_MAX_FACES)"
    solids = [writer.tetrahedron() for _ in range(3)]
    writer.product("part", writer.representation([face, *solids]))
    with pytest.raises(TooLarge):
        read(wrap(writer.data), FileLimits(max_faces=12))
    read(wrap(writer.data), FileLimits(max_faces=13))
    with pytest.raises(InvalidRequest) as refused:
        read(wrap(writer.data), FileLimits(max_control_points=50))
    assert refused.value.issues[0].code == "too_many_control_points"


def test_long_entities_to_which_many_refer_are_too_costly() -> None:
    writer = Writer()
    points = ",".join(writer.point(k, k * k, 0) for k in range(5000))
    loop = writer(f"POLY_LOOP('',({points}))")
    faces = [writer(f"FACE('',({writer.bound(loop)}))") for _ in range(1000)]
    with pytest.raises(SurfaceError) as error:
        writer.read(writer.shell(*faces))
    assert error.value.issues[0].code in ("too_costly", "too_many_control_points")


@pytest.mark.parametrize("header", ["", HEADER + "FILE_POPULATION('x','y',$);\n"])
def test_headers_do_not_matter(header: str) -> None:
    writer = Writer()
    writer.product("part", writer.representation([writer.tetrahedron()]))
    assert read(wrap(writer.data, header), FileLimits()).reading.faces == 4


def test_gaps_are_in_the_report_in_the_root_s_unit() -> None:
    writer = Writer()
    loop, _ = writer.polygon((0, 0, 0), (1, 0, 0), (1, 1, 0.125), (0, 1, 0))
    face = writer.face(writer(f"PLANE('',{writer.frame()})"), writer.bound(loop))
    metres = writer.context(writer.unit("$"))
    near = writer.vertex(0, 0, 0.5), writer.vertex(1, 0, 0)
    line = writer.edge(*near, writer.line((0, 0, 0), (1, 0, 0)))
    back = writer.edge(near[1], near[0], writer.line((1, 0, 0), (-1, 0, 0.5)))
    third = writer.face(
        writer(f"PLANE('',{writer.frame()})"), writer.bound(writer.loop(line, back))
    )
    writer.product("first", writer.representation([writer.square()]))
    writer.product("second", writer.representation([face, third], metres))
    reading = writer.read().reading
    assert reading.edge_gap == pytest.approx(500)
    assert reading.vertex_gap == pytest.approx(500)


IMPORTS_NOTHING = """
import sys
from pathlib import Path

from service.decoders.format import FileLimits
from service.decoders.step.read import read

contents = [path.read_bytes() for path in sorted(Path("tests/cad_files").glob("*.step"))]
name = rb"ADVANCED_FACE('\\X2\\00DF\\X0\\ \\X4\\0001F600\\X0\\ \\PE\\\\S\\P"
contents[0] = contents[0].replace(b"ADVANCED_FACE('", name, 1)


def refuse(event, arguments):
    if event in ("import", "open", "socket.connect", "subprocess.Popen"):
        raise RuntimeError(f"{event} {arguments}")


sys.addaudithook(refuse)
for content in contents:
    faces = [
        face.name
        for definition in read(content, FileLimits()).definitions
        for part in definition.parts
        for face in part.faces
    ]
    assert content is not contents[0] or "\u00df \U0001f600 \u0430" in faces
    read(content[: len(content) // 2], FileLimits())
"""


def test_reading_opens_no_file_and_imports_nothing() -> None:
    """The process that reads files may do neither."""
    process = subprocess.run(
        [sys.executable, "-c", IMPORTS_NOTHING], check=False, capture_output=True, text=True
    )
    assert process.returncode == 0, process.stderr


@pytest.mark.parametrize("keyword", ["CONNECTED_FACE_SET", "OPEN_SHELL", "CLOSED_SHELL"])
def test_models_of_faces(keyword: str) -> None:
    writer = Writer()
    sets = [writer(f"{keyword}('',({writer.square()}))") for _ in range(2)]
    model = writer(f"FACE_BASED_SURFACE_MODEL('faces',({','.join(sets)}))")
    content = writer.read(model)
    (part,) = content.definitions[0].parts
    assert part.name == "faces"
    # Squares are open, whatever the file says; edges are counted if it says that they are closed.
    assert [shell.is_closed for shell in part.shells] == [False, False]
    assert content.reading.open_edges == (8 if keyword == "CLOSED_SHELL" else 0)
    assert content.reading.solids == 0
