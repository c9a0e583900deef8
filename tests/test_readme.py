"""The examples of the README and of other pages run, and give the output that the pages show."""

import json
import re
import shlex
import subprocess
from contextlib import redirect_stdout
from io import StringIO
from itertools import pairwise
from pathlib import Path
from shutil import copy
from typing import NamedTuple, get_args

import numpy as np
import pytest

from service.cli.main import main
from service.schemas.request import MeshRequest
from service.schemas.surfaces import SurfaceDefinition
from tests.cad import FOLDER
from tools.programs import find_program

ROOT = Path(__file__).parents[1]
PAGES = ("README.md", "CONTRIBUTING.md", "docs/surfaces.md", "docs/questions.md")
TEXT = "".join((ROOT / name).read_text(encoding="utf-8") for name in PAGES)
"""The text of all pages."""

SERVED_AT = "http://127.0.0.1:8000"
"""URL of the service in the examples of all pages."""

# Each member of the union is `Annotated[model, Tag(kind)]`.
MODELS = {
    get_args(member)[1].tag: get_args(member)[0]
    for member in get_args(get_args(SurfaceDefinition.__value__)[0])
}
"""The model of each kind of surface."""

PART = "plate_no_pcurves_ap214.step"
"""The file of the first example."""

CHANNELS = {"colors", "uvs", "attributes"}
MEMBER_FIELDS = {"name", "color", "matrix", "parent"}
"""Fields of a member of a group."""

KNOT_NAMES = {"clamped", "uniform", "periodic"}
"""Words that a request may have in place of a knot vector."""


class Block(NamedTuple):
    """A fenced block: its language and its text."""

    language: str
    text: str


def find_blocks(text: str) -> list[Block]:
    """The fenced blocks of a page."""
    return [Block(*groups) for groups in re.findall(r"^```(\w+)\n(.*?)^```$", text, re.M | re.S)]


BLOCKS = find_blocks(TEXT)
OUTPUT_PAIRS = [pair for pair in pairwise(BLOCKS) if pair[1].language in {"json", "text"}]
"""Pairs of an example and the block after the example, which shows its output."""
COMMANDS = [
    (command, output)
    for command, output in OUTPUT_PAIRS
    if command.text.startswith("surface ") and output.language == "json"
]
"""Commands that write a result to standard output, each with the result."""
REQUESTS = [block for block in BLOCKS if block.language == "sh" and "curl" in block.text]


def read_section(title: str) -> str:
    """The text under a heading, up to the next heading."""
    return re.split(rf"^#+ {re.escape(title)}$", TEXT, flags=re.M)[1].split("\n#")[0]


def run_shell(command: str, folder: Path) -> str:
    """Runs a command with Bash in a folder; returns its output. A command that fails raises."""
    process = subprocess.run(
        [find_program("bash"), "-euc", command],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    return process.stdout


def round_numbers(text: str) -> object:
    """The value of a JSON text; numbers have 9 decimals, as further decimals depend on the BLAS."""
    return json.loads(text, parse_float=lambda digits: round(float(digits), 9))


def test_the_first_example_is_a_cad_file_and_prints_the_lines_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command, output = BLOCKS[:2]
    copy(FOLDER / PART, tmp_path / "part.step")
    monkeypatch.chdir(tmp_path)
    program, *arguments = shlex.split(command.text)
    assert program == "surface"
    assert main(arguments) == 0
    assert capsys.readouterr().err == output.text
    assert (tmp_path / "part.glb").read_bytes()[:4] == b"glTF"


@pytest.mark.parametrize("number", range(len(COMMANDS)))
def test_commands_write_the_results_that_the_page_shows(
    number: int, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    command, output = COMMANDS[number]
    assert main(shlex.split(command.text)[1:]) == 0
    written = capsysbinary.readouterr().out.decode()
    assert round_numbers(written) == round_numbers(output.text)


def test_there_are_three_requests_to_begin_with() -> None:
    assert read_section("Three requests").count("curl") == 3


@pytest.mark.parametrize("request_", REQUESTS, ids=[f"{n}" for n in range(len(REQUESTS))])
def test_requests_get_the_responses_that_the_page_shows(
    request_: Block, server: str, tmp_path: Path
) -> None:
    find_program("curl")
    np.save(tmp_path / "net.npy", np.arange(1200.0).reshape(20, 20, 3))
    np.save(tmp_path / "measured.npy", np.arange(30.0).reshape(10, 3))
    copy(FOLDER / PART, tmp_path / "part.step")
    input_files = set(tmp_path.iterdir())
    response = run_shell(request_.text.replace(SERVED_AT, server), tmp_path)
    outputs_on_page = [output.text for example, output in OUTPUT_PAIRS if example is request_]
    if outputs_on_page:
        assert round_numbers(response) == round_numbers(outputs_on_page[0])
        return
    output_files = set(tmp_path.iterdir()) - input_files
    assert len(output_files) == 1, "the response must follow on the page, or be written to one file"
    (file,) = output_files
    if file.name == "closest.json":
        assert len(json.loads(file.read_bytes())["distances"]) == 10
    elif file.suffix == ".json":
        assert json.loads(file.read_bytes()).keys() == {"id", "links"}
    else:
        assert file.read_bytes()[:4] == b"glTF"


def test_programs_print_the_output_that_the_page_shows() -> None:
    programs = [pair for pair in OUTPUT_PAIRS if pair[0].language == "python"]
    assert len(programs) == 2
    for source, output_on_page in programs:
        with redirect_stdout(StringIO()) as output:
            exec(compile(source.text, "README.md", "exec"), {"__name__": "__main__"})
        assert output.getvalue().strip() == output_on_page.text.strip()


def test_commands_in_sentences_work_without_a_server(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    """Runs the commands that stand in sentences of the pages rather than in blocks."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "net.json").write_text('{"control_net": [[[0,0,0],[0,1,1]],[[1,0,1],[1,1,0]]]}')
    copy(FOLDER / PART, tmp_path / "part.step")
    commands = re.findall(r"`(surface (?:mesh|points|convert) [^`]+)`", TEXT)
    assert len(commands) == 8
    for command in commands:
        assert main(shlex.split(command)[1:]) == 0, command
    assert b"positions" in capsysbinary.readouterr().out
    assert (tmp_path / "teapot.glb").read_bytes()[:4] == b"glTF"


def test_names_in_tables_exist() -> None:
    """The tables name only fields that exist. (The generated reference must name all fields.)"""
    surfaces = re.findall(
        r"^\| `(\w+)`(?: \(.*?\))? \| (.*) \|$", read_section("What goes in"), re.M
    )
    kinds = [row for row in surfaces if row[0] in MODELS]
    assert len(kinds) >= 7
    for kind, text in kinds:
        other_names = {"group": MEMBER_FIELDS, "bspline": KNOT_NAMES}.get(kind, set())
        assert set(re.findall(r"`(\w+)`", text)) <= {*MODELS[kind].model_fields} | other_names, kind
    for title in ("What goes in", "Options of a mesh"):
        cells = re.findall(r"^\| (`.*?) \|", read_section(title).partition("| option |")[2], re.M)
        options = set(re.findall(r"`(\w+)`", " ".join(cells)))
        assert len(options) >= 10
        assert options <= {*MeshRequest.model_fields}


def test_channels_are_listed_for_the_kinds_that_have_them() -> None:
    kinds = {kind for kind, model in MODELS.items() if set(model.model_fields) >= CHANNELS}
    paragraph = (
        read_section("Kinds of surfaces").partition("Surfaces of patches")[2].partition("\n\n")[0]
    )
    assert set(re.findall(r"`(\w+)`", paragraph)) >= kinds | CHANNELS


def test_the_map_of_the_house_shows_every_room() -> None:
    """One table has the rooms of the checkout, another those of the engine."""
    tables = read_section("The house").split("| room of the engine |")
    for table, folder in zip(tables, (ROOT, ROOT / "service" / "engine"), strict=True):
        cells = " ".join(re.findall(r"^\| (`.*?) \|", table, re.MULTILINE))
        rooms = {folder / name for name in re.findall(r"`([\w/.]+)`", cells)}
        assert {room for room in rooms if not room.exists()} == set()
        inner = ROOT / "service" if folder == ROOT else folder
        existing = {path for path in inner.iterdir() if not path.name.startswith("__")}
        if folder != ROOT:
            existing = {path for path in existing if (path / "__init__.py").exists()}
        assert existing <= rooms


def test_files_that_pages_name_exist() -> None:
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")):
        # Formulas are in blocks of code, which have no links.
        text = re.sub(r"^    .*$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text):
            assert (page.parent / target).is_file(), (page.name, target)
    for target in re.findall(r"(?:--file|--kustomize) (\S+)", TEXT):
        assert (ROOT / target).exists(), target
