"""The lines of a file, by section.

A line has 80 columns: column 73 has the letter of its section, and columns 74 to 80 its number
there. The lines of parameters have their data in columns 1 to 64.

References
----------
IGES 5.3, section 2.2: the fixed line length ASCII format; sections 2.4 and 2.5, the compressed
ASCII and the binary form, which are refused.
"""

import re
from dataclasses import dataclass

from service.errors import Issue, MalformedBody

COLUMNS = 80
LETTER = 72
"""Index of the column with the letter of the section."""

DATA = 64
"""Number of columns with data in a line of parameters."""

_TAIL = re.compile(r"[SGDPT] *\d{1,7}$")
"""The last eight columns of a line that has more than 80, as lines with UTF-8 may have."""


@dataclass(frozen=True, slots=True)
class Sections:
    """The lines of a file that are read.

    Attributes
    ----------
    global_text : str
        The global section without line ends; each character is one byte (Latin-1).
    directory : list of str
        The lines of the directory section, two for each entity; each has 72 columns.
    parameters : list of str
        The lines of the parameter section; each has 64 columns.
    """

    global_text: str
    directory: list[str]
    parameters: list[str]


def find_sections(content: bytes) -> Sections:
    """Sort the lines of a file.

    Lines may end with a line feed, a carriage return, both, or not at all, and may have lost or
    gained blanks at their ends. A line without a section is left out.

    Raises
    ------
    MalformedBody
        `malformed_file`: the file is not in the fixed format, or has no directory.
    """
    lines = _split_lines(content)
    _refuse_other_forms(content, lines)
    global_lines: list[str] = []
    directory: list[str] = []
    parameters: list[str] = []
    for line in lines:
        letter, data = line[LETTER : LETTER + 1], line[:LETTER]
        if len(line) > COLUMNS and len(line := line.rstrip()) > COLUMNS:
            # Characters of several bytes make a line longer; its last columns are as usual.
            letter, data = line[-8] if _TAIL.match(line, len(line) - 8) else "", line[:-8]
        if letter == "P":
            parameters.append(data[: DATA - LETTER])
        elif letter == "D":
            directory.append(data)
        elif letter == "G":
            global_lines.append(data)
    if not directory:
        raise malformed(
            "The file has no entities.", "no line of a directory", "lines with a D in column 73"
        )
    return Sections("".join(global_lines), directory, parameters)


def malformed(message: str, got: str, needed: str) -> MalformedBody:
    """The error for a file that is not an IGES file in the fixed format."""
    return MalformedBody(Issue("malformed_file", message, "", got, needed))


def _split_lines(content: bytes) -> list[str]:
    text = content.decode("latin-1")
    head = text[: 4 * COLUMNS]
    if "\n" in head:
        return text.replace("\r", "").split("\n")
    if "\r" in head:
        return text.split("\r")
    return [text[start : start + COLUMNS] for start in range(0, len(text), COLUMNS)]


def _refuse_other_forms(content: bytes, lines: list[str]) -> None:
    """Refuse the binary and the compressed form, whose first line has a flag in column 73."""
    needed = "the fixed line length ASCII format, which all systems can write"
    first = next((line for line in lines[:10] if line.strip()), "")
    flag = first[LETTER : LETTER + 1]
    if flag == "B" or b"\0" in content[: 64 * COLUMNS]:
        raise malformed("The service reads IGES as text.", "the binary form of IGES", needed)
    if flag == "C":
        raise malformed(
            "The service reads IGES with lines of 80 columns.",
            "the compressed ASCII form of IGES",
            needed,
        )
