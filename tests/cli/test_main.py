"""The program `surface`: its arguments, the files that it reads and writes, and its exit codes."""

import inspect
import io
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler
from importlib import import_module
from pathlib import Path

import httpx
import pytest

from service import __version__
from service.cli.documents import Query
from service.cli.flags import Command, CommandGroup
from service.cli.main import COMMANDS, main
from service.encoders.format import Format
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.schemas.options import MeshOptionFields
from service.surface.examples.catalogue import EXAMPLES, find
from tools.live import serve
from tools.processes import service_server
from tools.programs import run_python

SURFACE = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]], "name": "sail"}


@pytest.fixture
def net(tmp_path: Path) -> Path:
    """The path of a file with a surface alone, without a request around it."""
    file = tmp_path / "net.json"
    file.write_text(json.dumps(SURFACE), encoding="utf-8")
    return file


@pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)
def test_the_suffix_of_the_output_selects_the_format(tmp_path: Path, fmt: Format) -> None:
    output = tmp_path / f"saddle.{fmt.suffix}"
    assert main(["mesh", "saddle", "-o", str(output), "--resolution", "3,4"]) == 0
    expected = render(find("saddle").surface(), MeshOptions((3, 4)), fmt)
    assert output.read_bytes() == expected
    # No temporary file is left beside the output.
    assert list(tmp_path.iterdir()) == [output]


def test_flags_override_options_in_the_file(tmp_path: Path) -> None:
    file, output = tmp_path / "request.json", tmp_path / "mesh.json"
    file.write_text(json.dumps({"surface": SURFACE, "resolution": 9, "uvs": True}), "utf-8")
    assert main(["mesh", str(file), "-o", str(output), "--resolution", "2", "--no-normals"]) == 0
    mesh = json.loads(output.read_bytes())
    assert len(mesh["vertices"]) == len(mesh["uvs"]) == 9
    assert "normals" not in mesh


def test_a_local_file_may_be_larger_than_a_request_body(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The service limits the size of bodies to protect itself; the limit is not for local files."""
    for name in ("SURFACE_MAX_BODY_BYTES", "SURFACE_MAX_JSON_BYTES"):
        monkeypatch.setenv(name, "1024")
    file, output = tmp_path / "net.json", tmp_path / "net.off"
    file.write_text(json.dumps(SURFACE) + " " * 2000, encoding="utf-8")
    assert main(["mesh", str(file), "-o", str(output), "--resolution", "1"]) == 0


def test_a_dash_is_standard_input_and_standard_output(
    net: Path, monkeypatch: pytest.MonkeyPatch, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(net.read_bytes())))
    assert main(["mesh", "-", "-o", "-", "--format", "off", "--resolution", "1"]) == 0
    assert capsysbinary.readouterr().out.startswith(b"OFF")


@pytest.mark.parametrize(
    ("content", "location"),
    [
        ('{"surface": {"control_net": [[[0,0,0],[0,1,0]],[[1,0,0]]]}}', "/surface/control_net/1"),
        ('{"control_net": [[[0,0,0],[0,1,true]],[[1,0,0],[1,1,0]]]}', "/surface/control_net/0/1/2"),
        ('{"surface": {"control_net": [[NaN]]}}', "/surface/control_net/0/0"),
        ('{"surface": {"type": "sponge"}}', "/surface/type"),
        ('{"surface": {}, "colour": 1}', "/colour"),
        ("[1, 2", "line 1, column"),
    ],
)
def test_errors_name_the_location_in_the_file_and_no_output_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str, location: str
) -> None:
    file, output = tmp_path / "net.json", tmp_path / "mesh.glb"
    file.write_text(content, encoding="utf-8")
    assert main(["mesh", str(file), "-o", str(output)]) == 1
    assert location in capsys.readouterr().err
    assert not output.exists()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["mesh", "teapot", "-o", "x.glb"], "utah-teapot"),
        (["mesh", "saddle", "-o", "x.fbx"], "--format"),
        (["mesh", "saddle", "-o", "-"], "--format"),
        (["mesh", "saddle", "-o", "", "--format", "glb"], "--output: empty"),
        (["mesh", "", "-o", "x.glb"], "the name is empty"),
        (["mesh", "saddle", "-o", "x.glb", "--format", "fbx"], "glb"),
        (["mesh", "saddle", "-o", "x.glb", "--url", "ftp://127.0.0.1"], "--url"),
        (
            ["serve", "--port", "70000"],
            "--port: got '70000', needed a whole number from 0 to 65535",
        ),
        (["serve", "--port", "http"], "--port: got 'http', needed a whole number"),
    ],
)
def test_wrong_arguments_give_exit_code_2(
    capsys: pytest.CaptureFixture[str], arguments: list[str], text: str
) -> None:
    assert main(arguments) == 2
    assert text in capsys.readouterr().err


def test_invalid_settings_give_exit_code_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SURFACE_MAX_VERTICES", "many")
    assert main(["mesh", "saddle", "-o", "x.glb"]) == 2
    assert "SURFACE_MAX_VERTICES" in capsys.readouterr().err


COMMAND = f"{sys.executable} -m service"


# With Python's buffer the flush fails, and without it the write.
@pytest.mark.parametrize(
    ("command", "unbuffered"),
    [("mesh utah-teapot -o - --format json | head -c 10", ""), ("examples | true", "1")],
)
def test_a_closed_pipe_has_an_exit_code_and_no_message(
    monkeypatch: pytest.MonkeyPatch, command: str, unbuffered: str
) -> None:
    monkeypatch.setenv("PYTHONUNBUFFERED", unbuffered)
    process = _run_bash(f"{COMMAND} {command}; exit ${{PIPESTATUS[0]}}")
    assert (process.returncode, process.stderr) == (1, "")


def test_closed_standard_output_gives_an_error() -> None:
    process = _run_bash(f"{COMMAND} formats >&-")
    assert (process.returncode, process.stderr) == (1, "surface: standard output is closed\n")


def test_closed_standard_input_gives_an_error() -> None:
    process = _run_bash(f"{COMMAND} mesh - -o x.glb <&-")
    assert (process.returncode, process.stderr) == (1, "surface: standard input is closed\n")


def test_with_closed_standard_error_the_exit_code_stays() -> None:
    process = _run_bash(f"{COMMAND} mesh sponge -o - --format glb 2>&-")
    assert (process.returncode, process.stdout) == (2, "")


def _run_bash(script: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=False)


def test_output_to_a_link_or_a_device_does_not_replace_it(tmp_path: Path) -> None:
    target, link = tmp_path / "target.glb", tmp_path / "link.glb"
    target.touch()
    link.symlink_to(target)
    assert main(["mesh", "saddle", "-o", str(link)]) == 0
    assert link.is_symlink()
    assert target.read_bytes().startswith(b"glTF")
    assert main(["mesh", "saddle", "-o", os.devnull, "--format", "glb"]) == 0
    assert Path(os.devnull).is_char_device()


def test_examples_and_formats_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["examples"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(EXAMPLES)
    assert main(["formats"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(BY_NAME)


def test_every_command_is_listed() -> None:
    folder = Path(inspect.getfile(main)).parent
    modules = [import_module(f"service.cli.{file.stem}") for file in folder.glob("[a-z]*.py")]
    values = {id(v): v for module in modules for v in vars(module).values()}.values()
    groups = [value for value in values if isinstance(value, CommandGroup)]
    below = {command.name for group in groups for command in group.commands}
    commands = {value.name for value in values if isinstance(value, Command | CommandGroup | Query)}
    assert commands - below == {command.name for command in COMMANDS}, (
        "list the command in COMMANDS of service/cli/main.py"
    )


def test_every_option_of_a_mesh_has_a_flag(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["mesh", "--help"])
    flags = capsys.readouterr().out.split()
    assert {f"--{name.replace('_', '-')}" for name in MeshOptionFields.model_fields} <= {
        flag.rstrip(",") for flag in flags
    }


@pytest.mark.parametrize("arguments", [["--help"], ["mesh", "--help"], ["convert", "--help"]])
def test_help_lists_the_exit_codes_and_imports_no_slow_modules(arguments: list[str]) -> None:
    program = (
        "import sys; from service.cli.main import main\n"
        "try: main(sys.argv[1:])\n"
        "except SystemExit: print(sorted({'numpy', 'fastapi', 'pydantic'} & set(sys.modules)))"
    )
    process = run_python("-c", program, *arguments)
    assert "exit codes:" in process.stdout
    assert process.stdout.endswith("[]\n")


def test_local_and_remote_meshes_are_equal(server: str, tmp_path: Path, net: Path) -> None:
    local, remote = tmp_path / "local.oogl", tmp_path / "remote.oogl"
    options = ["--resolution", "3,2", "--overlays", "control_net,boundary", "--oogl", "off"]
    for source in ("utah-teapot", str(net)):
        assert main(["mesh", source, "-o", str(local), "--uvs", *options]) == 0
        assert main(["mesh", source, "-o", str(remote), "--uvs", *options, "--url", server]) == 0
        assert local.read_bytes() == remote.read_bytes()


@pytest.mark.parametrize("source", ["saddle", "file"])
@pytest.mark.parametrize(
    "options",
    [
        ["--faces", "quads"],
        ["--resolution", "0"],
        ["--resolution", "60000"],
        ["--overlays", "boundary,edges"],
        ["--crease-angle", "wide", "--oogl", "x"],
    ],
)
def test_local_and_remote_errors_are_equal(
    server: str, net: Path, capsys: pytest.CaptureFixture[str], source: str, options: list[str]
) -> None:
    command = ["mesh", str(net) if source == "file" else source, "-o", "x.glb", *options]
    assert main(command) == 1
    local_error = capsys.readouterr().err
    assert main([*command, "--url", server]) == 1
    assert capsys.readouterr().err == local_error
    assert local_error.startswith(f"surface: {options[0]}: ")


def test_errors_name_an_option_in_a_file_by_its_pointer(
    server: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "request.json"
    file.write_text(json.dumps({"surface": SURFACE, "overlays": ["edges"]}), "utf-8")
    for url in ([], ["--url", server]):
        assert main(["mesh", str(file), "-o", "x.glb", "--resolution", "2", *url]) == 1
        assert capsys.readouterr().err.startswith("surface: /overlays/0: ")


class _OtherServer(BaseHTTPRequestHandler):
    """Responds to each request with a page: 200 below /welcome/, else 404.

    Below /broken/ it responds with a problem of this service, 500.
    """

    def do_GET(self) -> None:
        is_broken = self.path.startswith("/broken/")
        is_welcome = self.path.startswith("/welcome/")
        problem = {
            "status": 500,
            "code": "internal_error",
            "detail": "The fault is ours.",
            "errors": [],
        }
        body = json.dumps(problem).encode() if is_broken else b"<h1>Welcome</h1>"
        self.send_response(500 if is_broken else 200 if is_welcome else 404)
        self.send_header("Content-Type", "application/problem+json" if is_broken else "text/html")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Writes no log to the terminal."""


@pytest.fixture
def other_server() -> Iterator[str]:
    with serve(_OtherServer) as url:
        yield url


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("", "not a surface service"),
        ("/welcome", "not a surface service"),
        ("/broken", "The fault is ours."),
    ],
)
def test_a_server_that_fails_or_is_not_this_service_gives_exit_code_3(
    other_server: str, capsys: pytest.CaptureFixture[str], path: str, text: str
) -> None:
    assert main(["mesh", "saddle", "-o", "x.glb", "--url", other_server + path]) == 3
    assert text in capsys.readouterr().err


def test_serve_responds_until_a_signal(tmp_path: Path) -> None:
    with service_server(tmp_path, {}, probe="/health") as server:
        assert httpx.get(f"{server.url}/health").json()["status"] == "ready"
    assert server.process.returncode == 0
    output = server.log.read_text(encoding="utf-8")
    assert f"Uvicorn running on {server.url}" in output
    assert "Finished server process" in output
    assert "Traceback" not in output


def test_an_interrupt_gives_exit_code_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("service.settings.environment.read_environment", interrupt)
    assert main(["serve"]) == 130


def test_curves_are_read_from_files(
    tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    """The file has a curve alone, or a request whose options the command line overrides."""
    curve, request = tmp_path / "curve.json", tmp_path / "request.json"
    curve.write_text('{"control_points": [[0, 0], [1, 1], [2, 0]]}')
    request.write_text(
        '{"curve": {"control_points": [[0, 0], [1, 1], [2, 0]]}, "resolution": 3,'
        ' "tangents": false}'
    )
    output = tmp_path / "curve.obj"
    assert main(["curve", str(curve), "-o", str(output), "--resolution", "2"]) == 0
    assert output.read_text().splitlines()[-1] == "l 1 2 3"
    arguments = ["curve", str(request), "-o", "-", "--format", "json", "--tolerance", "0.01"]
    assert main([*arguments, "--tangents"]) == 0
    response = json.loads(capsysbinary.readouterr().out)
    assert response["report"]["deviation_bound"] <= 0.01
    assert len(response["tangents"]) == response["report"]["points"]
    arguments = ["curve", str(request), "-o", "-", "--format", "json", "--derivatives", "2"]
    assert main([*arguments, "--at", "0.5,1", "--at", "0"]) == 0
    response = json.loads(capsysbinary.readouterr().out)
    assert response["parameters"] == [0.5, 1, 0]
    assert response["curvature"] == pytest.approx([-1, -(0.5**1.5), -(0.5**1.5)])
    assert main([*arguments, "--at", "2"]) == 1
    assert b"--parameters: The parameter lies outside" in capsysbinary.readouterr().err
    assert main(["curve", str(curve), "-o", str(tmp_path / "curve.stl")]) == 2
    assert main(["curve", str(tmp_path / "none.json"), "-o", str(output)]) == 2
    assert main(["curve", str(curve), "-o", str(output), "--tolerance", "-1"]) == 1
    assert b"--tolerance" in capsysbinary.readouterr().err


def test_the_version_of_the_package_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as error:
        main(["--version"])
    assert (error.value.code, capsys.readouterr().out) == (0, f"surface {__version__}\n")


@pytest.mark.parametrize(
    ("command", "flag"),
    [
        ("measure", "--tolerance"),
        ("project", "--relative-tolerance"),
        ("intersect", "--relative-thickness"),
        ("section", "--tolerance"),
    ],
)
def test_two_numbers_in_place_of_one_are_refused(
    command: str, flag: str, capsys: pytest.CaptureFixture[str]
) -> None:
    needed = {
        "project": ["--point", "1,2,3"],
        "intersect": ["--ray", "0,0,5,0,0,-1"],
        "section": ["--offsets", "0", "--format", "json"],
    }
    assert main([command, "sphere", *needed.get(command, []), flag, "1,2", "-o", "-"]) == 1
    assert f"{flag}: " in capsys.readouterr().err
