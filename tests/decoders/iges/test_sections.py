"""Lines and sections: line ends, columns, and forms that are refused."""

import pytest

from service.decoders.iges.sections import find_sections
from service.errors import MalformedBody
from tests.decoders.iges.writing import Writer, add_box


def write_lines() -> list[str]:
    writer = Writer()
    add_box(writer, (1, 2, 3))
    return writer.lines()


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", ""])
def test_lines_may_end_in_any_way(end: str) -> None:
    lines = write_lines()
    sections = find_sections("".join(line + end for line in lines).encode())
    assert sections == find_sections("\n".join(lines).encode())
    assert len(sections.directory) == sum(line[72] == "D" for line in lines)
    assert sections.parameters == [line[:64] for line in lines if line[72] == "P"]


def test_blanks_behind_lines_and_empty_lines_do_not_matter() -> None:
    lines = write_lines()
    content = "\n".join(f"{line}   \n" for line in lines).encode()
    assert find_sections(content) == find_sections("\n".join(lines).encode())


def test_characters_of_several_bytes_move_no_column() -> None:
    writer = Writer()
    writer.add(406, 1, "4Hname", form=15)
    lines = writer.lines()
    position = next(n for n, line in enumerate(lines) if line[72] == "P")
    lines[position] = lines[position].replace("name", "Naß\u00e9")
    sections = find_sections("\n".join(lines).encode())
    (parameters,) = sections.parameters
    assert parameters.encode("latin-1").decode().startswith("406,1,4HNaß\u00e9;")
    assert len(sections.directory) == 2


def test_lines_without_a_section_are_left_out() -> None:
    lines = write_lines()
    with_others = [*lines[:3], "", "short", "x" * 90, "y" * 72 + "Q      1", *lines[3:]]
    assert find_sections("\n".join(with_others).encode()) == find_sections(
        "\n".join(lines).encode()
    )


@pytest.mark.parametrize(
    ("content", "got"),
    [
        (" " * 72 + "C0000001\n1:2_3_;D1\n", "the compressed ASCII form of IGES"),
        (" " * 72 + "B0000001\n", "the binary form of IGES"),
        ("B" + "\0" * 200, "the binary form of IGES"),
        ("", "no line of a directory"),
        ("ISO-10303-21;\nHEADER;\n" * 9, "no line of a directory"),
    ],
)
def test_other_forms_are_refused_by_name(content: str, got: str) -> None:
    with pytest.raises(MalformedBody) as info:
        find_sections(content.encode())
    (issue,) = info.value.issues
    assert issue.code == "malformed_file"
    assert issue.got == got
