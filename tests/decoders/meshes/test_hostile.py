"""Hostile files of meshes are refused with a code, or read: nothing else, and not for long."""

import sys
import time
from pathlib import Path

import pytest

from service.decoders.child import read_file
from service.decoders.child_processes import PROCESSES
from service.decoders.format import FileLimits
from service.decoders.mesh_registry import MESH_BY_NAME
from service.errors import SurfaceError
from service.schemas.meshes import MeshDefinition
from service.schemas.validation import validate_document
from tools.hostile.meshes import ANY, MESHES, READ, HostileMesh

SHORT = 100_000
"""Files of at most this many bytes are read in this process."""

MEBIBYTE = 1 << 20


def check(case: HostileMesh, content: bytes, *, in_child: bool) -> None:
    """Checks the code of a case; if it is read, its mesh is valid."""
    decoder, limits = MESH_BY_NAME[case.format], FileLimits()
    try:
        if in_child:
            tree = read_file(decoder, content, None, limits).tree
        else:
            tree = decoder.decode(content, None, limits).tree
        mesh = validate_document(MeshDefinition, tree).to_mesh("02")
        assert len(mesh.triangles), case.name
        code = READ
    except SurfaceError as error:
        code = error.issues[0].code
        assert code, case.name
    assert case.code in (ANY, code), (case.name, code)


def test_there_are_at_least_two_hundred_cases_and_their_names_differ() -> None:
    assert len(MESHES) >= 200
    assert len({case.name for case in MESHES}) == len(MESHES)
    assert sum(case.code != ANY for case in MESHES) > 150


def test_some_hostile_files_in_this_process() -> None:
    for case in MESHES[::9]:
        content = case.build() if not case.name.startswith(("300,000", "many", "a face")) else b""
        if 0 < len(content) <= SHORT:
            check(case, content, in_child=False)


@pytest.mark.slow
def test_all_hostile_files_in_this_process() -> None:
    for case in MESHES:
        if len(content := case.build()) <= SHORT:
            check(case, content, in_child=False)


def _reset_peak() -> int:
    """Bytes of memory that this process has now, from where its peak is measured."""
    Path("/proc/self/clear_refs").write_text("5")
    return _read_peak()


def _read_peak() -> int:
    (line,) = (
        text for text in Path("/proc/self/status").read_text().splitlines() if "VmHWM" in text
    )
    return int(line.split()[1]) * 1024


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux shows the peak of memory")
def test_hostile_files_take_no_memory_of_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PROCESSES, "starts_ahead", True)
    for number, case in enumerate(MESHES):
        content = case.build()
        if len(content) <= SHORT and number % 30:  # each takes a process
            continue
        decoder, before, start = MESH_BY_NAME[case.format], _reset_peak(), time.monotonic()
        check(case, content, in_child=True)
        # The answer may take a quarter of the memory of the file, and here it is checked.
        assert _read_peak() - before < decoder.memory(len(content)) / 2 + 16 * MEBIBYTE, case.name
        # The child has a lower priority, and other tests run beside it.
        assert time.monotonic() - start < 10 * decoder.seconds(len(content)), case.name
    PROCESSES.close()
