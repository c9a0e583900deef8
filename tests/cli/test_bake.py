"""`surface bake`, and `surface mesh` into a folder: lists, flags, failures, exit codes."""

import asyncio
import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from service.cli import baking
from service.cli.bake import read_entry
from service.cli.main import main
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.jobs.batch import run_batch
from service.pipeline.mesh import render
from service.storage.address import open_store
from service.storage.backends import Bucket
from service.storage.canonical import plan_content
from service.surface.examples.catalogue import find
from tests.cad import OPEN_TETRAHEDRON, TETRAHEDRON

NET = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]}
SADDLE = {"name": "saddle", "path": "/v1/surfaces/saddle/mesh.stl?resolution=2"}


class ThreadEngine:
    """Runs tasks in a thread, which starts sooner than a process."""

    slots = 1

    async def run(self, task: bytes) -> bytes:
        return await asyncio.to_thread(run_batch, task)

    async def close(self) -> None:
        """Has nothing to end."""


@pytest.fixture(autouse=True)
def _without_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(baking, "_open_engine", lambda _: ThreadEngine())


def write_list(path: Path, *parts: object) -> str:
    lines = (part if isinstance(part, str) else json.dumps(part) for part in parts)
    path.write_text("\n".join(lines), encoding="utf-8")
    return str(path)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.is_file())


def test_parts_are_meshes_in_the_format_or_what_their_path_says(tmp_path: Path) -> None:
    points = {"name": "points", "path": "/v1/points", "body": {"surface": NET, "uv": [[0, 0]]}}
    net = {"name": "net", "body": {"surface": NET, "resolution": 2}}
    parts = write_list(tmp_path / "list.ndjson", net, "", points, SADDLE)
    out = tmp_path / "out"
    assert main(["bake", parts, "-o", str(out), "--format", "off"]) == 0
    assert names(out) == ["net.off", "points.json", "saddle.stl"]
    expected = render(find("saddle").surface(), MeshOptions((2, 2)), BY_NAME["stl"])
    assert (out / "saddle.stl").read_bytes() == expected
    assert (out / "net.off").read_bytes().startswith(b"OFF\n9 8")


def test_failures_are_a_table_with_the_lines_of_the_list(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    parts = write_list(
        tmp_path / "list.ndjson",
        {"name": "a", "body": {"surface": NET}},
        '{"name": "b", ',
        {"body": {"surface": NET}},
        {"name": "../c", "body": {"surface": NET}},
        {"name": "a", "body": {"surface": NET}},
        {"name": "d", "body": {"surface": NET, "resolution": 0}},
        {"name": "e", "body": {"surface": NET}, "colour": 1},
        {"name": "f"},
        {"name": "g", "path": f"/v1/surfaces/{'0' * 64}/mesh.glb"},
        "17",
    )
    assert main(["bake", parts, "-o", str(tmp_path / "out")]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert names(tmp_path / "out") == ["a.glb"]
    expected = [
        ("line 2", "not JSON"),
        ("line 3", "/name"),
        ("line 4", "../c", "/name", "name of a file"),
        ("line 5", "a", "/name", "the name of line 1"),
        ("line 6", "d", "/body/resolution"),
        ("line 7", "/colour"),
        ("line 8", "f", "/path"),
        ("line 9", "g", "/path", "No surface is stored"),
        ("line 10", "object"),
    ]
    assert len(lines) == len(expected) + 1
    for line, texts in zip(lines, expected, strict=False):
        for text in texts:
            assert text in line
    assert "1 made, 0 were there, 9 failed" in lines[-1]


def test_a_second_run_makes_what_is_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    parts = write_list(tmp_path / "list.ndjson", SADDLE, {"name": "n", "body": {"surface": NET}})
    for expected in ("2 made, 0 were there", "0 made, 2 were there"):
        assert main(["bake", parts, "-o", str(tmp_path / "out")]) == 0
        assert expected in capsys.readouterr().err


def test_stored_surfaces_are_read_from_the_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = open_store(str(tmp_path / "store"), 0)
    id, content = plan_content(find("saddle").surface()).run()
    asyncio.run(store.put(id, content))
    monkeypatch.setenv("SURFACE_STORE", str(tmp_path / "store"))
    part = {"name": "stored", "path": f"/v1/surfaces/{id}/mesh.off?resolution=1"}
    parts = write_list(tmp_path / "list.ndjson", part)
    assert main(["bake", parts, "-o", str(tmp_path / "out")]) == 0
    expected = render(find("saddle").surface(), MeshOptions((1, 1)), BY_NAME["off"])
    assert (tmp_path / "out/stored.off").read_bytes() == expected


@pytest.mark.parametrize(
    ("flags", "text"),
    [
        (["missing.ndjson", "-o", "out"], "LIST: no such file"),
        (["LIST", "-o", ""], "--output: empty"),
        (["LIST", "-o", "ftp://x/y"], "--output: got 'ftp://x/y', needed a folder"),
        (["LIST", "-o", "s3://"], "--output: got 's3://', needed the address of a bucket"),
        (["LIST", "-o", "LIST"], "--output: got"),
        (["LIST", "-o", "out", "--format", "fbx"], "--format: unknown"),
        (["LIST", "-o", "out", "--processes", "-1"], "--processes: needed a whole number"),
        (["LIST", "-o", "out", "--processes", "1", "--cluster", "tls://x:1"], "--processes: not"),
    ],
)
def test_wrong_flags_are_named(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    flags: list[str],
    text: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    write_list(tmp_path / "LIST", SADDLE)
    assert main(["bake", *flags]) == 2
    assert text in capsys.readouterr().err
    assert names(tmp_path) == ["LIST"]


def test_a_folder_that_cannot_be_written_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    (out / "saddle.stl").mkdir(parents=True)  # a folder where the file should be
    parts = write_list(tmp_path / "list.ndjson", SADDLE)
    assert main(["bake", parts, "-o", str(out)]) == 1
    assert "files cannot be written" in capsys.readouterr().err


def test_a_full_disk_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async def fail(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Bucket, "write", fail)
    parts = write_list(tmp_path / "list.ndjson", SADDLE)
    assert main(["bake", parts, "-o", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert "the disk is full; the same command goes on from here" in error
    assert "0 made, 0 were there, 0 failed" in error


def test_default_paths_name_the_format() -> None:
    lines = [b'{"name": "a", "body": {}}\n', b" \n", b'{"name": "b", "path": "/v1/mesh"}']
    entries = [read_entry("/v1/mesh?format=obj", *numbered) for numbered in enumerate(lines, 1)]
    assert [(each.place, each.name, each.line["path"]) for each in entries if each] == [
        ("line 1", "a", "/v1/mesh?format=obj"),
        ("line 3", "b", "/v1/mesh"),
    ]


def test_mesh_writes_several_inputs_into_a_folder(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(json.dumps({"surface": NET, "resolution": 9}), "utf-8")
    (tmp_path / "b.json").write_text(json.dumps(NET), "utf-8")
    np.save(tmp_path / "c.npy", np.array(NET["control_net"], dtype=float))
    sources = [str(tmp_path / name) for name in ("a.json", "b.json", "c.npy")]
    out = tmp_path / "out"
    flags = ["-o", str(out), "--format", "off", "--resolution", "2"]
    assert main(["mesh", *sources, "saddle", *flags]) == 0
    assert names(out) == ["a.off", "b.off", "c.off", "saddle.off"]
    single = tmp_path / "single.off"
    assert main(["mesh", "saddle", "-o", str(single), "--resolution", "2"]) == 0
    assert (out / "saddle.off").read_bytes() == single.read_bytes()
    assert (out / "a.off").read_bytes() == (out / "b.off").read_bytes()
    # One input, and an output that ends with a slash, is GLB by default.
    assert main(["mesh", sources[0], "-o", f"{tmp_path}/glb/"]) == 0
    assert names(tmp_path / "glb") == ["a.glb"]


def test_mesh_lists_inputs_that_fail(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.json").write_text(json.dumps(NET), "utf-8")
    (tmp_path / "b.json").write_text('{"control_net": 1}', "utf-8")
    (tmp_path / "c.json").write_text("[", "utf-8")
    sources = [str(tmp_path / f"{name}.json") for name in "abcd"]
    assert main(["mesh", *sources, "-o", f"{tmp_path}/out/"]) == 1
    lines = capsys.readouterr().err.splitlines()
    for line, name, text in zip(
        lines, "bcd", ("/surface/control_net", "not JSON", "no such file"), strict=False
    ):
        assert f"{name}.json" in line
        assert text in line
    assert names(tmp_path / "out") == ["a.glb"]
    # The name of a file may be no text.
    odd = os.fsdecode(os.fsencode(tmp_path) + b"/\xff.json")
    if sys.platform == "linux":
        Path(odd).write_text(json.dumps(NET), "utf-8")
        assert main(["mesh", odd, sources[0], "-o", f"{tmp_path}/out/"]) == 1
        assert "\\udcff.json" in capsys.readouterr().err
    # Every input gets the flag, so the flag is named for each.
    assert main(["mesh", sources[0], "-o", f"{tmp_path}/out/", "--resolution", "0"]) == 1
    assert "--resolution" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["saddle", "utah-teapot", "-o", "all.glb"], "--output: several inputs need a folder"),
        (["saddle", "utah-teapot", "-o", "-"], "--output: several inputs need a folder"),
        (["saddle", "-", "-o", "out/"], "standard input has no name"),
        (["saddle", "-o", "out/", "--url", "http://127.0.0.1:1"], "--url: writes one file"),
        (["saddle", "-o", "out/", "--format", "fbx"], "--format: unknown"),
    ],
)
def test_wrong_flags_of_many_meshes_are_named(
    arguments: list[str],
    text: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["mesh", *arguments]) == 2
    assert text in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal")
def test_ctrl_c_stops_a_command_that_waits_for_its_list(tmp_path: Path) -> None:
    """With a real pool of processes, and a pipe in which no further line comes."""
    command = [sys.executable, "-m", "service", "bake", "-", "-o", str(tmp_path / "out")]
    with subprocess.Popen(
        [*command, "--processes", "1"],
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    ) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        process.stdin.write(json.dumps(SADDLE).encode() + b"\n17\n")
        process.stdin.flush()
        with process.stdin:
            while not (tmp_path / "out/.surface-bake").exists():
                assert process.poll() is None
                time.sleep(0.05)
            os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to its children too
            error = process.stderr.read().decode()
            assert process.wait(10) == 128 + signal.SIGINT
    assert "stopped" in error
    assert "1 made, 0 were there, 1 failed" in error
    assert "Traceback" not in error
    assert names(tmp_path / "out") == ["saddle.stl"]


def test_lines_name_cad_files_beside_the_list(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "parts"
    folder.mkdir()
    (folder / "tip.step").write_bytes(TETRAHEDRON)
    (folder / "open.stp").write_bytes(OPEN_TETRAHEDRON)
    np.save(folder / "net.npy", np.array(NET["control_net"], float))
    options = "/v1/mesh?format=stl&tolerance=0.1&name=wedge"
    lines = [
        {"file": "tip.step"},
        {"name": "other", "file": "open.stp", "path": options},
        {"name": "document", "file": str(folder / "open.stp"), "path": "/v1/convert"},
        {"file": "net.npy", "path": "/v1/measure?tolerance=0.01"},
    ]
    parts = write_list(folder / "list.ndjson", *lines)
    out = tmp_path / "out"
    monkeypatch.chdir(tmp_path)
    assert main(["bake", parts, "-o", str(out)]) == 0
    assert names(out) == ["document.json", "net.json", "other.stl", "tip.glb"]
    error = capsys.readouterr().err
    assert "4 made, 0 were there" in error
    assert "faces of 2 CAD files could not be read" in error
    expected = tmp_path / "tip.glb"
    assert main(["mesh", str(folder / "tip.step"), "-o", str(expected)]) == 0
    assert (out / "tip.glb").read_bytes() == expected.read_bytes()
    assert json.loads((out / "document.json").read_bytes())["reading"]["faces"] == 3
    capsys.readouterr()
    (folder / "tip.step").write_bytes(OPEN_TETRAHEDRON)
    assert main(["bake", parts, "-o", str(out)]) == 0
    assert "1 made, 3 were there" in capsys.readouterr().err


def test_lines_with_files_that_cannot_be_read_fail(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "loft.brep").write_bytes(b"DBRep_DrawableShape")
    (tmp_path / "empty.step").write_bytes(b"")
    (tmp_path / "tip.step").write_bytes(TETRAHEDRON)
    parts = write_list(
        tmp_path / "list.ndjson",
        {"file": "missing.step"},
        {"file": "loft.brep"},
        {"file": "empty.step"},
        {"name": "number", "file": 3},
        {"name": "both", "file": "tip.step", "body": {"surface": NET}},
        {"name": "degree", "file": "tip.step", "path": "/v1/mesh?degree=3"},
        {"name": "text", "file": "list.ndjson"},
    )
    assert main(["bake", parts, "-o", str(tmp_path / "out")]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("surface: line 1  missing  /file: The file cannot be read.")
    assert "does not read files of Open CASCADE (BREP)" in lines[1]
    assert lines[2].startswith("surface: line 3  empty ")
    assert "/file: This must be a name." in lines[3]
    assert "/file: A part has a body, or a file in its place." in lines[4]
    assert "/path: This file says itself" in lines[5]
    assert "No file with this suffix is read." in lines[6]
    assert lines[7].startswith("surface: 0 made, 0 were there, 7 failed")


def test_mesh_writes_several_cad_files_into_a_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, content in (("tip.step", TETRAHEDRON), ("open.stp", OPEN_TETRAHEDRON)):
        (tmp_path / name).write_bytes(content)
    np.save(tmp_path / "net.npy", np.array(NET["control_net"], float))
    out = tmp_path / "out"
    sources = [str(tmp_path / name) for name in ("tip.step", "open.stp", "net.npy")]
    options = ["--tolerance", "0.1", "--up", "y"]
    assert main(["mesh", *sources, "-o", f"{out}/", *options, "--format", "obj"]) == 0
    assert names(out) == ["net.obj", "open.obj", "tip.obj"]
    assert "faces of 1 CAD file could not be read" in capsys.readouterr().err
    expected = tmp_path / "tip.obj"
    assert main(["mesh", sources[0], "-o", str(expected), *options]) == 0
    assert (out / "tip.obj").read_bytes() == expected.read_bytes()
    assert main(["mesh", sources[0], str(tmp_path / "loft.brep"), "-o", f"{out}/"]) == 1
    assert "does not read files of Open CASCADE (BREP)" in capsys.readouterr().err
