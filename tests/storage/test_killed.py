"""Processes that are killed while they store, and processes that store equal contents."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from service.storage.backends import ABANDONED_AFTER, STAGING
from tests.storage.backends import compute_id, find_file, list_files, store_of
from tests.storage.storing import CONTENTS, generate_contents

pytestmark = pytest.mark.anyio
ROOT = Path(__file__).parents[2]


def start_storing(folder: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tests.storage.storing", str(folder)]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        command,
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        # The pipe is short, so the process waits for its reader, and is always writing when it is
        # killed.
        pipesize=4096,
    )


def read_stored(folder: Path) -> set[str]:
    """The visible objects of a folder, all of which must be complete."""
    visible = list_files(folder / "surfaces")
    for path in visible:
        assert path == find_file(folder, path.read_bytes()), "an object that is not its name"
    return {path.name for path in visible}


def test_kill_leaves_complete_objects_and_all_acknowledged_ones(tmp_path: Path) -> None:
    """One folder, one process after the other, each killed later than the one before."""
    for moment in (1, 120):
        with start_storing(tmp_path) as process:
            assert process.stdout is not None
            acknowledged = {process.stdout.readline().strip() for _ in range(moment)}
            process.kill()
            # The ids that it printed before the signal.
            acknowledged |= {line.strip() for line in process.stdout if line.endswith("\n")}
        assert process.returncode == -9
        assert moment <= len(acknowledged) < CONTENTS
        assert acknowledged <= read_stored(tmp_path)
    with start_storing(tmp_path) as process:
        process.communicate()
    assert read_stored(tmp_path) == {compute_id(content) for content in generate_contents()}


def test_two_processes_may_store_the_same(tmp_path: Path) -> None:
    with start_storing(tmp_path) as one, start_storing(tmp_path) as other:
        ids = [process.communicate()[0].split() for process in (one, other)]
    assert [one.returncode, other.returncode] == [0, 0]
    assert set(ids[0]) == set(ids[1]) == read_stored(tmp_path)
    assert list_files(tmp_path / STAGING) == []


@pytest.mark.parametrize("name", ["0123456789abcdef", "0123456789abcdef#1"])
async def test_files_of_killed_processes_are_not_objects_and_are_removed_after_an_hour(
    name: str, tmp_path: Path
) -> None:
    store = store_of("folder", tmp_path)
    left = tmp_path / STAGING / name
    left.write_bytes(b"half of a conte")

    await store._backend.sweep()
    assert left.exists(), "another process may be writing it"
    before = time.time() - ABANDONED_AFTER - 1
    os.utime(left, (before, before))
    assert read_stored(tmp_path) == set()
    await store._backend.sweep()
    assert not left.exists()
