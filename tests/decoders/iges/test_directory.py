"""Entries of the directory, and the entities to which they lead."""

import pytest

from service.decoders.iges.directory import read_directory
from service.decoders.iges.faults import Fault
from tests.decoders.iges.writing import Writer


def test_entries_have_their_fields() -> None:
    writer = Writer()
    color = writer.add(314, 10.0, 20.0, 30.0)
    matrix = writer.add(124, *[0.0] * 12)
    writer.add(
        110, 0, 0, 0, 1, 1, 1, form=2, status="01030506", color=-color, matrix=matrix,
        label="edge", subscript=12,
    )  # fmt: skip
    writer.add(402, 0, form=7, label="plain")
    directory = writer.file().directory
    assert directory.types.tolist() == [314, 124, 110, 402]
    assert directory.forms.tolist() == [0, 0, 2, 7]
    assert directory.colors.tolist() == [0, 0, -color, 0]
    assert directory.matrices.tolist() == [0, 0, matrix, 0]
    assert directory.is_blanked.tolist() == [False, False, True, False]
    assert directory.subordinate.tolist() == [0, 0, 3, 0]
    assert directory.uses.tolist() == [0, 0, 5, 0]
    assert [directory.label(row) for row in range(4)] == ["", "", "edge(12)", "plain"]


def test_damaged_entries_have_no_type() -> None:
    writer = Writer()
    writer.add(110, 0, 0, 0, 1, 1, 1)
    writer.add(110, 0, 0, 0, 1, 1, 1)
    lines = [line[:72] for line in writer.lines() if line[72] == "D"]
    lines[0] = lines[0].replace("110", "1x0")
    assert read_directory(lines).types.tolist() == [0, 110]
    assert read_directory(lines[:3]).types.tolist() == [0]
    assert len(read_directory([])) == 0


def test_numbers_may_stand_at_the_left() -> None:
    line = f"{'110':<8}{'7':<8}{'':48}{'00000000':<8}"
    other = f"{'110':<8}{'':8}{'-3':<8}{'2':<8}{'1':<8}{'':24}{'':8}"
    directory = read_directory([line, other])
    row = (directory.types, directory.first_lines, directory.colors, directory.line_counts)
    assert [int(column[0]) for column in row] == [110, 7, -3, 2]


def test_entities_are_found_by_odd_numbers() -> None:
    writer = Writer()
    number = writer.add(116, 1.0, 2.0, 3.0)
    file = writer.file()
    assert file.read(number, 116).parameters.number(2) == 3.0
    assert file.type(number) == 116
    for wrong in (0, 2, 3, -1):
        assert file.type(wrong) == 0
        with pytest.raises(Fault):
            file.read(wrong)
    with pytest.raises(Fault):
        file.read(number, 110)


def test_parameters_of_another_entity_are_refused() -> None:
    writer = Writer()
    number = writer.add(116, 1.0, 2.0, 3.0)
    writer.add(123, 1.0, 2.0, 3.0)
    file = writer.file()
    file.directory.first_lines[0] = 2
    with pytest.raises(Fault, match="another entity"):
        file.read(number)
    file.directory.first_lines[0] = 9
    with pytest.raises(Fault, match="missing"):
        file.read(number)


def test_entities_that_share_all_lines_are_read_a_few_times_only() -> None:
    writer = Writer()
    numbers = [writer.add(116, 1.0, 2.0, 3.0) for _ in range(100)]
    file = writer.file()
    file.directory.first_lines[:] = 1
    file.directory.line_counts[:] = 10**9
    for number in numbers[:4]:
        file.read(number)
    with pytest.raises(Fault, match="many entities"):
        list(map(file.read, numbers))
