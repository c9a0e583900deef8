"""The file of keys: read again when it changes; a broken file is ignored."""

import logging
import os
from collections.abc import Sequence
from pathlib import Path

import pytest

from service.api.guard.keys import (
    MAX_BYTES,
    InvalidKeys,
    KeyEntry,
    KnownKeys,
    entry_line,
    parse_entries,
)

ALICE, BOB, CAROL = (entry_line(name, name) for name in ("alice", "bob", "carol"))


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def list_names(entries: Sequence[KeyEntry]) -> list[str]:
    return [entry.name for entry in entries]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "keys"
    path.write_text(f"# ours\n\n  {ALICE}\r\n", encoding="utf-8")
    return path


def write(file: Path, text: str) -> None:
    """Writes the file with a later time, because the clock of the disk may be coarse."""
    later = os.stat(file).st_mtime_ns + 10**9 if file.exists() else None
    file.write_text(text, encoding="utf-8")
    if later is not None:
        os.utime(file, ns=(later, later))


def test_it_is_read_beside_the_settings(file: Path) -> None:
    assert list_names(KnownKeys(parse_entries([BOB]), str(file))()) == ["bob", "alice"]


def test_it_is_read_again_when_it_changed_a_second_later(
    file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    clock = Clock()
    keys = KnownKeys((), str(file), clock)
    write(file, BOB)
    clock.now = 0.9
    assert list_names(keys()) == ["alice"]
    clock.now = 1.0
    with caplog.at_level(logging.INFO):
        assert list_names(keys()) == ["bob"]
    assert "read again" in caplog.text


def test_the_file_is_checked_once_a_second(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    keys = KnownKeys((), str(file), clock)
    looked: list[Path] = []
    stat = os.stat

    def look(path: Path) -> os.stat_result:
        looked.append(path)
        return stat(path)

    monkeypatch.setattr(os, "stat", look)
    for tenth in range(50):
        clock.now = tenth / 10
        keys()
    assert len(looked) == 4


@pytest.mark.parametrize("text", ["alice:", BOB + "\n" + BOB, "x" * (MAX_BYTES + 1)])
def test_a_broken_file_keeps_the_known_keys_and_is_logged_once(
    text: str, file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    clock = Clock()
    keys = KnownKeys((), str(file), clock)
    write(file, text)
    for clock.now in (2, 4, 6):
        assert list_names(keys()) == ["alice"]
    assert [record.levelname for record in caplog.records] == ["ERROR"]
    write(file, CAROL)
    clock.now = 8
    assert list_names(keys()) == ["carol"]


def test_a_file_that_is_removed_and_written_again(
    file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    clock = Clock()
    keys = KnownKeys((), str(file), clock)
    file.unlink()
    clock.now = 2
    assert list_names(keys()) == ["alice"]
    assert "cannot be read" in caplog.text
    write(file, BOB)
    clock.now = 4
    assert list_names(keys()) == ["bob"]


def test_an_empty_file_lets_no_client_in(file: Path) -> None:
    write(file, "")
    assert KnownKeys((), str(file))() == ()


@pytest.mark.parametrize("content", [b"\xff\xfe", b"alice", None])
def test_at_the_start_a_broken_file_is_an_error(file: Path, content: bytes | None) -> None:
    if content is None:
        file.unlink()
    else:
        file.write_bytes(content)
    with pytest.raises(InvalidKeys):
        KnownKeys((), str(file))
