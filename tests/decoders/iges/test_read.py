"""Whole files: those of Open CASCADE, limits, and damage."""

import json
import random
from pathlib import Path

import numpy as np
import pytest

from service.decoders.cad.document import write_document
from service.decoders.format import FileLimits
from service.decoders.iges.read import read
from service.errors import SurfaceError
from tests.decoders.cad.part_meshes import measure_part
from tests.decoders.iges.reading import list_parts, read_all
from tests.decoders.iges.writing import Writer, add_box, add_quad

FOLDER = Path(__file__).parents[2] / "cad_files"
EXPECTED = json.loads((FOLDER / "iges.json").read_text())
SMALL = [name for name in EXPECTED if (FOLDER / name).stat().st_size < 25_000]


@pytest.mark.slow
@pytest.mark.parametrize("name", EXPECTED)
def test_files_are_read_as_they_were_written(name: str) -> None:
    content = read((FOLDER / name).read_bytes(), FileLimits())
    expected = EXPECTED[name]
    parts = list_parts(content)
    reading = content.reading
    assert sum(len(part.faces) for part in parts) == expected["faces"] == reading.faces
    assert not reading.skipped_faces
    assert not reading.skipped_entities
    assert reading.system.startswith("Open CASCADE")
    assert reading.schema == "IGES 5.3"
    assert content.metres_per_unit == pytest.approx(expected["metres_per_unit"])
    assert all(shell.is_closed for part in parts for shell in part.shells)
    measured = [measure_part(part, 1e-3) for part in parts]
    assert all(not cracks for _, cracks in measured)
    assert content.metres_per_unit is not None
    unit = (1e3 * content.metres_per_unit) ** 3
    volume = sum(each for each, _ in measured) * unit
    assert volume == pytest.approx(expected["volume_mm3"], rel=0.01)


def test_entities_and_faces_are_limited() -> None:
    writer = Writer()
    add_box(writer, (1, 1, 1))
    entities = len(writer.file().directory)
    read_all(writer, max_entities=entities, max_faces=6)
    for limits, code in (
        ({"max_entities": entities - 1}, "too_many_entities"),
        ({"max_faces": 5}, "too_many_faces"),
        ({"max_control_points": 20}, "too_many_control_points"),
    ):
        with pytest.raises(SurfaceError) as info:
            read_all(writer, **limits)
        assert info.value.issues[0].code == code


def test_files_without_faces_are_read_and_have_no_document() -> None:
    writer = Writer()
    writer.add(110, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
    content = read_all(writer)
    assert content.reading.skipped_entities == {"type 110": 1}
    with pytest.raises(SurfaceError) as info:
        write_document(content)
    assert info.value.issues[0].code == "no_geometry"


def test_the_report_is_complete() -> None:
    writer = Writer(unit=1, name="4HINCH", resolution="2.D-5")
    add_quad(writer, [(0, 0, 0), (9, 0, 0), (9, 9, 0), (0, 9, 0)])
    reading = read_all(writer).reading
    assert reading.format == "iges"
    assert (reading.schema, reading.system) == ("IGES 5.3", "made")
    assert reading.units == ("inch",)
    assert (reading.metres_per_unit, reading.uncertainty) == (0.0254, 2e-5)
    assert (reading.products, reading.solids, reading.faces) == (1, 0, 1)
    assert (reading.closed_shells, reading.open_shells, reading.open_edges) == (0, 1, 4)


def damage(content: bytes, generator: random.Random) -> bytes:
    """A file with one to five faults."""
    data = bytearray(content)
    for _ in range(generator.randint(1, 5)):
        kind = generator.randrange(6)
        start = generator.randrange(len(data))
        if kind == 0:
            del data[start:]
        elif kind == 1:
            del data[start : start + generator.randint(1, 200)]
        elif kind == 2:
            data[start] ^= 1 << generator.randrange(8)
        elif kind == 3:
            word = generator.choice([b"1.E308", b"NAN", b"-1", b"999999999", b"0", b"5H", b";;"])
            data[start : start + len(word)] = word
        elif kind == 4:
            line = start - start % 81
            data[line:line] = data[line : line + 81 * generator.randint(1, 5)]
        else:
            other = generator.randrange(len(data))
            data[start : start + 8] = data[other : other + 8]
        if not data:
            return b"x"
    return bytes(data)


@pytest.mark.parametrize("name", SMALL)
def test_damaged_files_give_errors_of_the_service_only(name: str) -> None:
    generator = random.Random(name)
    content = (FOLDER / name).read_bytes()
    for _ in range(15):
        try:
            read(damage(content, generator), FileLimits())
        except SurfaceError:
            continue


def test_pointers_that_are_exchanged_give_errors_of_the_service_only() -> None:
    generator = random.Random(1)
    writer = Writer()
    add_box(writer, (1, 2, 3))
    content = writer.content()
    numbers = [str(number).encode() for number in range(1, 2 * len(writer.file().directory), 2)]
    start = content.index(b"128,1,1,1,1")
    for _ in range(60):
        changed = content[:start] + b",".join(
            generator.choice(numbers).rjust(len(word)) if word in numbers else word
            for word in content[start:].split(b",")
        )
        assert len(changed) >= len(content)
        try:
            read(changed, FileLimits())
        except SurfaceError:
            continue


def test_memory_follows_the_file_and_not_its_counts() -> None:
    writer = Writer()
    add_quad(writer, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    writer.add(128, 99_999, 99_999, 3, 3, 0, 0, 1, 0, 0, 0.0)
    writer.add(144, 2 * len(writer.file().directory) - 1, 0, 0, 0)
    content = read_all(writer)
    assert [face.reason for face in content.reading.skipped_faces] == [
        "it has fewer parameters than it says"
    ]
    assert np.isfinite(list_parts(content)[0].vertices).all()
