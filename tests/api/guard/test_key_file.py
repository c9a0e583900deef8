"""The file of keys: a changed file is read again; an invalid new file is ignored."""

import logging
import os
from collections.abc import Sequence
from pathlib import Path

import pytest

from service.api.guard.key_file import MAX_BYTES, KnownKeys
from service.api.guard.keys import KeyEntry, format_entry, parse_entries
from service.errors import InvalidSettings
from tests.clock import Clock

ALICE, BOB, CAROL = (format_entry(name, name) for name in ("alice", "bob", "carol"))


def list_names(entries: Sequence[KeyEntry]) -> list[str]:
    return [entry.name for entry in entries]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "keys"
    path.write_text(f"# ours\n\n  {ALICE}\r\n", encoding="utf-8")
    return path


def write(file: Path, text: str) -> None:
    """Writes the file; sets its modification time one second later than before.

    Otherwise two writes may have equal times, because the clock of a disk may be coarse.
    """
    new_time = os.stat(file).st_mtime_ns + 10**9 if file.exists() else None
    file.write_text(text, encoding="utf-8")
    if new_time is not None:
        os.utime(file, ns=(new_time, new_time))


def test_keys_of_the_settings_and_of_the_file_are_known(file: Path) -> None:
    assert list_names(KnownKeys(parse_entries([BOB]), str(file))()) == ["bob", "alice"]


def test_a_changed_file_is_read_again_after_a_second(
    file: Path, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    keys = KnownKeys((), str(file))
    write(file, BOB)
    clock.now += 0.9
    assert list_names(keys()) == ["alice"]
    clock.now += 0.2
    with caplog.at_level(logging.INFO):
        assert list_names(keys()) == ["bob"]
    assert "read again" in caplog.text


def test_the_file_is_checked_once_a_second(
    file: Path, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys = KnownKeys((), str(file))
    checked_paths: list[Path] = []
    stat = os.stat

    def stat_and_record(path: Path) -> os.stat_result:
        checked_paths.append(path)
        return stat(path)

    monkeypatch.setattr(os, "stat", stat_and_record)
    for _ in range(50):  # 4.9 s
        keys()
        clock.now += 0.1
    assert len(checked_paths) == 4


@pytest.mark.parametrize("text", ["alice:", BOB + "\n" + BOB, "x" * (MAX_BYTES + 1)])
def test_an_invalid_new_file_is_logged_once_and_the_old_keys_stay(
    text: str, file: Path, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    keys = KnownKeys((), str(file))
    write(file, text)
    for _ in range(3):
        clock.now += 2
        assert list_names(keys()) == ["alice"]
    assert [record.levelname for record in caplog.records] == ["ERROR"]
    write(file, CAROL)
    clock.now += 2
    assert list_names(keys()) == ["carol"]


def test_a_removed_file_keeps_its_keys_until_it_is_written_again(
    file: Path, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    keys = KnownKeys((), str(file))
    file.unlink()
    clock.now += 2
    assert list_names(keys()) == ["alice"]
    assert "cannot be read" in caplog.text
    write(file, BOB)
    clock.now += 2
    assert list_names(keys()) == ["bob"]


def test_an_empty_file_has_no_keys(file: Path) -> None:
    write(file, "")
    assert KnownKeys((), str(file))() == ()


@pytest.mark.parametrize("content", [b"\xff\xfe", b"alice", None])
def test_an_invalid_file_is_an_error_at_the_start(file: Path, content: bytes | None) -> None:
    if content is None:
        file.unlink()
    else:
        file.write_bytes(content)
    with pytest.raises(InvalidSettings):
        KnownKeys((), str(file))
