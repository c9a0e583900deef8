"""The examples of docs/judge.md run, and give the answers that the page shows."""

import json
import shlex
from contextlib import redirect_stdout
from io import StringIO
from itertools import pairwise
from pathlib import Path
from shutil import copy
from typing import Any, get_args

import pytest

from service.api.models.checks import MeshCheck
from service.cli.main import main
from service.decoders.mesh_registry import MESH_DECODERS
from service.engine.mesh_checks.values import Limit
from tests.cad import FOLDER
from tests.test_readme import PART, SERVED_AT, Block, find_blocks, run_shell
from tools.programs import find_program

PAGE = (Path(__file__).parents[1] / "docs" / "judge.md").read_text(encoding="utf-8")
PAIRS = list(pairwise([*find_blocks(PAGE), Block("", "")]))
REQUESTS = [pair for pair in PAIRS if pair[0].language == "sh" and "curl" in pair[0].text]
COMMANDS = [pair for pair in PAIRS if pair[0].text.startswith("surface ")]
PROGRAMS = [pair for pair in PAIRS if pair[0].language == "python"]


def compare(value: Any, expected: Any) -> None:
    """Refuses values that differ by more than the digits of the page."""
    if isinstance(expected, dict):
        assert list(value) == list(expected)
        for name, item in expected.items():
            compare(value[name], item)
    else:
        assert value == pytest.approx(expected, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("number", range(len(REQUESTS)))
def test_requests_get_the_answers_that_the_page_shows(
    server: str, tmp_path: Path, number: int
) -> None:
    find_program("curl")
    request, shown = REQUESTS[number]
    answer = json.loads(run_shell(request.text.replace(SERVED_AT, server), tmp_path))
    assert shown.language == "json"
    compare(answer, json.loads(shown.text))
    MeshCheck.model_validate(answer)


def test_commands_print_what_the_page_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    monkeypatch.chdir(tmp_path)
    copy(FOLDER / PART, "part.step")
    assert main(["mesh", "part.step", "-o", "part.stl", "--tolerance", "0.04"]) == 0
    for command, shown in COMMANDS:
        capsysbinary.readouterr()
        for line in command.text.splitlines():
            program, *arguments = shlex.split(line)
            assert (program, main(arguments)) == ("surface", 0)
        if shown.language == "text":
            assert capsysbinary.readouterr().out.decode() == shown.text


def test_programs_print_what_the_page_shows(server: str) -> None:
    for program, shown in PROGRAMS:
        names: dict[str, Any] = {}
        with redirect_stdout(StringIO()) as output:
            exec(compile(program.text.replace(SERVED_AT, server), "docs/judge.md", "exec"), names)
        names["client"].close()
        assert (shown.language, output.getvalue()) == ("text", shown.text)


def test_the_page_names_all_types_of_files_and_all_limits() -> None:
    assert all(f"`{decoder.media_type}`" in PAGE for decoder in MESH_DECODERS)
    assert all(f"| `{name}` |" in PAGE for name in get_args(Limit))
