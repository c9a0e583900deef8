"""`surface convert`: its flags, the files that it reads and writes, and its errors."""

import json
from pathlib import Path
from typing import Any

import pytest

from service.cli.convert import operations_from_text
from service.cli.main import main
from service.pipeline.documents import plan_conversion
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import Elevate, Reverse, Split, Transpose
from service.surface.examples.catalogue import find
from tools.hostile.files import build_net, save_array

SURFACE = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]], "name": "sail"}


@pytest.fixture
def net(tmp_path: Path) -> Path:
    """The path of a file with a surface alone, without a request around it."""
    file = tmp_path / "net.json"
    file.write_text(json.dumps(SURFACE), encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("elevate", "3", {"degree": 3}),
        ("elevate", "3,4", {"degree": [3, 4]}),
        ("elevate", "3,x", {"degree": [3, "x"]}),
        ("untrim", "3", {"face": 3}),
        ("untrim", "0:3", {"face": 3, "member": 0}),
        ("untrim", "3,4", {"face": [3, 4]}),
        ("select", "3", {"faces": [3]}),
        ("select", "2:3,x", {"faces": [3, "x"], "member": 2}),
        ("split", "u=0.5", {"u": 0.5}),
        ("split", "u=0.5,v=1e-3", {"u": 0.5, "v": 1e-3}),
        ("split", "0.25,0.25,0.5", {"at": [0.25, 0.25, 0.5]}),
        ("split", "u=1e999", {"u": "1e999"}),
        ("insert", "u=0.5,v=1", {"u": 0.5, "v": 1}),
        ("insert", "u=x", {"u": "x"}),
        ("restrict", "u=-1:2.5", {"u": [-1, 2.5]}),
        ("restrict", "u=0:1,v=nan:2", {"u": [0, 1], "v": ["nan", 2]}),
        ("transpose", "", {}),
        ("reverse", "u", {"direction": "u"}),
        ("bezier", "", {}),
        ("triangle", "lower", {"half": "lower"}),
    ],
)
def test_flags_become_operations(name: str, text: str, expected: dict[str, Any]) -> None:
    """Words that are not finite numbers stay texts, which the request's schema refuses."""
    assert operations_from_text([(name, text)]) == ([name], [{"op": name, **expected}])


def test_a_patch_belongs_to_the_operation_before_it() -> None:
    words = [("elevate", "3"), ("patch", "1"), ("transpose", ""), ("patch", "x")]
    elevate, transpose = {"op": "elevate", "degree": 3}, {"op": "transpose"}
    expected = [elevate | {"patch": 1}, transpose | {"patch": "x"}]
    assert operations_from_text(words) == (["elevate", "transpose"], expected)


def test_operations_are_applied_in_the_order_of_the_flags(tmp_path: Path, net: Path) -> None:
    output = tmp_path / "out.json"
    flags = ["--elevate", "2,3", "--reverse", "u", "--split", "v=0.5", "--transpose"]
    for source in ("saddle", str(net)):
        assert main(["convert", source, "-o", str(output), *flags]) == 0
        surface = json.loads(output.read_bytes())["surface"]
        assert surface["type"] == "patches"
        # The split makes two patches; 3 × 4 control points each become 4 × 3.
        assert [len(surface["patches"]), len(surface["patches"][0])] == [2, 4]
    expected = plan_conversion(
        find("saddle").surface(),
        (Elevate((2, 3)), Reverse("u"), Split(v=0.5), Transpose()),
        SizeLimits(),
    ).run()
    assert main(["convert", "saddle", "-o", str(output), *flags]) == 0
    assert output.read_bytes() == expected
    assert main(["mesh", str(output), "-o", str(tmp_path / "out.glb")]) == 0


def test_a_file_may_contain_operations_and_flags_replace_them(tmp_path: Path) -> None:
    file, output = tmp_path / "request.json", tmp_path / "out.json"
    request = {"surface": SURFACE, "operations": [{"op": "elevate", "degree": 5}]}
    file.write_text(json.dumps(request), "utf-8")
    assert main(["convert", str(file), "-o", str(output)]) == 0
    assert len(json.loads(output.read_bytes())["surface"]["control_net"]) == 6
    assert main(["convert", str(file), "-o", str(output), "--elevate", "3"]) == 0
    assert len(json.loads(output.read_bytes())["surface"]["control_net"]) == 4


def test_without_operations_the_surface_stays_as_it_is(
    server: str, net: Path, tmp_path: Path
) -> None:
    output = tmp_path / "same.json"
    for url_flags in ([], ["--url", server]):
        assert main(["convert", str(net), "-o", str(output), *url_flags]) == 0
        same = json.loads(output.read_bytes())["surface"]
        source = json.loads(net.read_bytes())
        assert {name: same[name] for name in source} == source
        output.unlink()


REFUSALS = [
    (["--elevate", "0"], "--elevate: The number is out of range."),
    (["--transpose", "--elevate", "2,x"], "--elevate: This must be a whole number."),
    (["--split", "u=2"], "--split: A surface is split inside its domain."),
    (["--split", "u=0.5,u=0.25"], "--split: A name is repeated."),
    (["--restrict", "v=0:1,v=0:0.5"], "--restrict: A name is repeated."),
    (["--restrict", "u=1:0"], "--restrict: An interval begins before it ends."),
    (["--restrict", "w=0:1"], "--restrict: No field has this name."),
    (["--reverse", "w"], "--reverse: The value is not one of those allowed."),
    (["--split", "u=0.5", "--split", "v=0.5"], "--split: The patches of this surface"),
    (["--patch", "0"], "--patch: A patch belongs to an operation."),
    (["--split", "u=0.5", "--patch", "0"], "--split: The surface is one patch"),
    (["--split", "u=0.5", "--transpose", "--patch", "2"], "--transpose: Patches are numbered"),
    (["--operations", '[{"op": "paint"}]'], "--operations: No operation has this name."),
    (
        ["--operations", '[{"op": "split", "u": 0.5, "u": 0.25}]'],
        "--operations/0/u: An object has this key more than once.",
    ),
    (["--operations", "[]"], "/operations: The list has another length."),
]


@pytest.mark.parametrize(("flags", "text"), REFUSALS)
def test_errors_of_an_operation_name_its_flag(
    server: str, net: Path, capsys: pytest.CaptureFixture[str], flags: list[str], text: str
) -> None:
    """The error is the same, whether this process or a service computes the result."""
    command = ["convert", str(net), "-o", "x.json", *flags]
    assert main(command) == 1
    local_error = capsys.readouterr().err
    assert local_error.startswith(f"surface: {text}")
    assert main([*command, "--url", server]) == 1
    assert capsys.readouterr().err == local_error
    assert not Path("x.json").exists()


@pytest.mark.parametrize(
    ("output", "flags", "begin"),
    [
        ("part.step", [], b"ISO-10303-21;"),
        ("part.STP", [], b"ISO-10303-21;"),
        ("part.p21", [], b"ISO-10303-21;"),
        ("part.igs", [], b" " * 72),
        ("part.iges", [], b" " * 72),
        ("part.vtu", [], b"<?xml"),
        ("part", ["--format", "step"], b"ISO-10303-21;"),
        ("part.json", [], b"{"),
        ("part", [], b"{"),
        ("part.step", ["--format", "json"], b"{"),
    ],
)
def test_the_suffix_or_a_flag_chooses_the_format(
    tmp_path: Path, net: Path, output: str, flags: list[str], begin: bytes
) -> None:
    """Without either the output is JSON."""
    file = tmp_path / output
    assert main(["convert", str(net), *flags, "-o", str(file)]) == 0
    assert file.read_bytes().startswith(begin)


def test_operations_come_before_the_file(tmp_path: Path, net: Path) -> None:
    file = tmp_path / "part.vtu"
    assert main(["convert", str(net), "--split", "u=0.5", "-o", str(file)]) == 0
    assert b'NumberOfCells="2"' in file.read_bytes()


@pytest.mark.parametrize(
    ("output", "unit", "is_named"),
    [("part.step", None, True), ("part.igs", None, True), ("part.step", 0.0254, False),
     ("part.vtu", None, False), ("part.json", None, False)],
)  # fmt: skip
def test_the_command_names_an_assumed_unit(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    output: str,
    unit: float | None,
    is_named: bool,
) -> None:
    group: dict[str, Any] = {"type": "group", "members": [{"surface": SURFACE}]}
    group |= {} if unit is None else {"metres_per_unit": unit}
    file = tmp_path / "group.json"
    file.write_text(json.dumps(group), encoding="utf-8")
    assert main(["convert", str(file), "-o", str(tmp_path / output)]) == 0
    assert ("one unit is written as 1 mm" in capsys.readouterr().err) == is_named


@pytest.mark.parametrize(("output", "notes"), [("part.step", 1), ("part.vtu", 0), ("part.json", 0)])
def test_a_unit_that_a_service_assumes_is_named_too(
    server: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], output: str, notes: int
) -> None:
    """Neither the JSON nor the file has a unit."""
    (tmp_path / "net.json").write_text(json.dumps({"surface": SURFACE}), encoding="utf-8")
    (tmp_path / "net.npy").write_bytes(save_array(build_net()))
    for source in ("net.json", "net.npy"):
        command = ["convert", str(tmp_path / source), "--url", server]
        assert main([*command, "-o", str(tmp_path / output)]) == 0
        assert capsys.readouterr().err.count("one unit is written as 1 mm") == notes
