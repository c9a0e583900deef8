"""Stores of several processes: some are killed while they store, others store equal contents."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from service.storage.folder import ABANDONED_AFTER, STAGING
from tests.storage.backends import compute_id, compute_path, list_files, open_test_store
from tests.storage.storing import CONTENT_COUNT, generate_contents

pytestmark = pytest.mark.anyio
ROOT = Path(__file__).parents[2]


def start_storing(folder: Path) -> subprocess.Popen[str]:
    """A process that runs `tests/storage/storing.py`."""
    command = [sys.executable, "-m", "tests.storage.storing", str(folder)]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        command,
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        # The pipe is short, so the process waits for its reader, and cannot end before it is
        # killed.
        pipesize=4096,
    )


def read_stored_ids(folder: Path) -> set[str]:
    """The ids of all objects in a folder, each of which must be complete."""
    objects = list_files(folder / "surfaces")
    for path in objects:
        assert path == compute_path(folder, path.read_bytes()), "the name is not the hash"
    return {path.name for path in objects}


@pytest.mark.slow
def test_a_killed_process_leaves_only_complete_objects_and_all_that_it_reported(
    tmp_path: Path,
) -> None:
    """Two processes, one after the other, are killed when they have stored 1 and 120 contents.

    A third process then stores the rest in the same folder.
    """
    for count in (1, 120):
        with start_storing(tmp_path) as process:
            assert process.stdout is not None
            reported_ids = {process.stdout.readline().strip() for _ in range(count)}
            process.kill()
            # More ids that the process printed before it was killed; the last line may be cut off.
            reported_ids |= {line.strip() for line in process.stdout if line.endswith("\n")}
        assert process.returncode == -signal.SIGKILL
        assert count <= len(reported_ids) < CONTENT_COUNT
        assert reported_ids <= read_stored_ids(tmp_path)
    with start_storing(tmp_path) as process:
        process.communicate()
    assert read_stored_ids(tmp_path) == {compute_id(content) for content in generate_contents()}


@pytest.mark.slow
def test_two_processes_may_store_equal_contents_at_the_same_time(tmp_path: Path) -> None:
    with start_storing(tmp_path) as first, start_storing(tmp_path) as second:
        ids = [process.communicate()[0].split() for process in (first, second)]
    assert [first.returncode, second.returncode] == [0, 0]
    assert set(ids[0]) == set(ids[1]) == read_stored_ids(tmp_path)
    assert list_files(tmp_path / STAGING) == []


# obstore first writes a file with `#1` after its name, and then renames it.
@pytest.mark.parametrize("name", ["0123456789abcdef", "0123456789abcdef#1"])
async def test_files_of_killed_processes_are_not_objects_and_are_removed_after_an_hour(
    name: str, tmp_path: Path
) -> None:
    store = open_test_store("folder", tmp_path)
    staged_file = tmp_path / STAGING / name
    staged_file.write_bytes(b"half of a conte")

    await store.backend.sweep()
    assert staged_file.exists(), "another process may be writing it"
    old_time = time.time() - ABANDONED_AFTER - 1
    os.utime(staged_file, (old_time, old_time))
    assert read_stored_ids(tmp_path) == set()
    await store.backend.sweep()
    assert not staged_file.exists()
