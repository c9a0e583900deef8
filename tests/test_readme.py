"""Whatever the README shows is run, and gives what it shows."""

import json
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np
import pytest

from service.encoders.registry import FORMATS
from service.schemas.convert import OPERATIONS
from service.schemas.options import MeshOptionFields
from service.schemas.surfaces import KINDS, SurfaceDefinition
from service.surface.examples import EXAMPLES
from tests.programs import program, run_python

ROOT = Path(__file__).parents[1]
README = "".join(
    (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "CONTRIBUTING.md")
)
SERVED_AT = "http://127.0.0.1:8000"

MODELS = {
    get_args(member)[1].tag: get_args(member)[0]
    for member in get_args(get_args(SurfaceDefinition.__value__)[0])
}
"""The model of each kind of surface."""

CARRIED = {"colors", "uvs", "attributes"}
CHANNELS = {"colors": "colours", "uvs": "uvs", "attribute": "attributes"}
"""What formats call channels here."""

MEMBER = {"name", "color", "matrix"}
"""Fields of a member of a group."""

BY_NAME = {"clamped", "uniform", "periodic"}
"""What knots may be called."""


class Block(NamedTuple):
    """A fenced block: its language and its text."""

    language: str
    text: str


BLOCKS = [Block(*found) for found in re.findall(r"^```(\w+)\n(.*?)^```$", README, re.M | re.S)]
SHOWN = [pair for pair in pairwise(BLOCKS) if pair[1].language in {"json", "text"}]
REQUESTS = [block for block in BLOCKS if block.language == "sh" and "curl" in block.text]


def section(title: str) -> str:
    """The text under a heading, up to the next one."""
    return re.split(rf"^#+ {re.escape(title)}$", README, flags=re.M)[1].split("\n#")[0]


def run_shell(command: str, folder: Path) -> str:
    done = subprocess.run(
        [program("bash"), "-euc", command], cwd=folder, capture_output=True, text=True, check=True
    )
    return done.stdout


def test_there_are_three_requests_to_begin_with() -> None:
    assert section("Three requests").count("curl") == 3


@pytest.mark.parametrize("request_", REQUESTS, ids=[f"{n}" for n in range(len(REQUESTS))])
def test_requests_are_answered_as_shown(request_: Block, server: str, tmp_path: Path) -> None:
    program("curl")
    np.save(tmp_path / "net.npy", np.arange(30_000.0).reshape(100, 100, 3))
    answer = run_shell(request_.text.replace(SERVED_AT, server), tmp_path)
    shown = [after.text for before, after in SHOWN if before is request_]
    if shown:
        assert json.loads(answer) == json.loads(shown[0])
        return
    (file,) = set(tmp_path.iterdir()) - {tmp_path / "net.npy"}
    if file.suffix == ".json":
        assert json.loads(file.read_bytes()).keys() == {"id", "links"}
    else:
        assert file.read_bytes()[:4] == b"glTF"


def test_programs_print_what_is_shown() -> None:
    programs = [pair for pair in SHOWN if pair[0].language == "python"]
    assert len(programs) == 2
    for source, shown in programs:
        done = run_python("-W", "error", "-c", source.text, cwd=ROOT)
        assert done.stdout.strip() == shown.text.strip()


def test_commands_without_a_server_work(tmp_path: Path) -> None:
    """Those that stand in the running text."""
    (tmp_path / "net.json").write_text('{"control_net": [[[0,0,0],[0,1,1]],[[1,0,1],[1,1,0]]]}')
    commands = re.findall(r"`(surface (?:mesh|points|convert) [^`]+)`", README)
    assert len(commands) == 4
    for command in commands:
        from_here = command.replace("surface", f"{sys.executable} -m service", 1)
        run_shell(f"PYTHONPATH={ROOT} {from_here}", tmp_path)
    assert (tmp_path / "teapot.glb").read_bytes()[:4] == b"glTF"


def test_formats_are_those_of_the_registry() -> None:
    rows = re.findall(r"^\| (.*?) \| `\.(\w+)` \| `(.*?)` \| (.*?) \|$", README, re.M)
    expected = [
        (
            fmt.title,
            fmt.suffix,
            fmt.media_type,
            ", ".join(
                [
                    "triangles",
                    *["quads"] * fmt.quads,
                    *["lines"] * fmt.overlays,
                    *[word for kind, word in CHANNELS.items() if kind in fmt.carries],
                ]
            ),
        )
        for fmt in FORMATS
    ]
    assert rows == expected


def test_the_table_of_surfaces_is_that_of_the_schemas() -> None:
    """A row for every kind, in order; in it every field that not all kinds share, and no other."""
    table = section("What goes in").strip().partition("\n\n")[0].partition("| --- | --- |")[2]
    rows = re.findall(r"^\| `(\w+)`(?: \(.*?\))? \| (.*) \|$", table, re.M)
    assert [kind for kind, _ in rows] == list(KINDS)
    for kind, text in rows:
        fields = set(MODELS[kind].model_fields) - {"type", "up", "name", *CARRIED}
        named = set(re.findall(r"`(\w+)`", text))
        assert fields <= named, kind
        assert named <= fields | {"group": MEMBER, "bspline": BY_NAME}.get(kind, set()), kind


def test_what_surfaces_carry_is_said_of_those_that_do() -> None:
    carry = {kind for kind, model in MODELS.items() if set(model.model_fields) >= CARRIED}
    assert carry == {"bezier", "bspline", "triangle", "patches"}
    paragraph = section("What goes in").partition("Surfaces of patches")[2].partition("\n\n")[0]
    assert set(re.findall(r"`(\w+)`", paragraph)) >= carry - {"bezier", "triangle"} | CARRIED


def test_every_option_and_operation_is_named() -> None:
    for title, names in (
        ("What goes in", MeshOptionFields.model_fields),
        ("Questions to a surface", OPERATIONS),
    ):
        text = section(title)
        assert [name for name in names if f"`{name}`" not in text] == []


def test_examples_are_those_that_are_built_in() -> None:
    listed = section("What goes in").partition("Built in: ")[2].partition(";")[0]
    assert re.findall(r"`([\w-]+)`", listed) == list(EXAMPLES)


def test_the_map_of_the_house_shows_every_room() -> None:
    rooms = re.findall(r"^\| `([\w/.]+)` \|", section("The house"), re.M)
    for room in rooms:
        assert (ROOT / room).exists(), room
    served = {
        path.relative_to(ROOT).as_posix() + ("/" if path.is_dir() else "")
        for path in (ROOT / "service").iterdir()
        if not path.name.startswith("__")
    }
    assert served == {room for room in rooms if room.startswith("service/")}


def test_files_that_are_linked_exist() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / target).is_file(), target
    for target in re.findall(r"(?:--file|--kustomize) (\S+)", README):
        assert (ROOT / target).exists(), target
