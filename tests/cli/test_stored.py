"""`surface stored` lists, deletes and verifies stored surfaces."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.api.guard.keys import SCOPES, format_entry, make_key
from service.cli import stored
from service.cli.main import main
from service.settings.values import Settings
from service.storage.address import open_store
from tools.live import run_service

KEY, WEAK_KEY = make_key(), make_key()
KEYS = (format_entry("boss", KEY, frozenset(SCOPES)), format_entry("anna", WEAK_KEY))


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "store"


@pytest.fixture
def server(store: Path) -> Iterator[str]:
    with run_service(Settings(store=str(store), api_keys=KEYS, allow_delete=True)) as url:
        yield url


def store_surfaces(url: str, count: int = 3) -> list[str]:
    """The ids of new surfaces, sorted."""
    ids = []
    for number in range(count):
        net: Any = [[[0, 0, 0], [0, 1, number]], [[1, 0, 1], [1, 1, 0]]]
        body = {"surface": {"control_net": net}}
        headers = {"Authorization": f"Bearer {KEY}"}
        ids.append(httpx.post(f"{url}/v1/surfaces", json=body, headers=headers).json()["id"])
    return sorted(ids)


def test_surfaces_are_listed_and_deleted(
    server: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SURFACE_KEY", KEY)
    ids = store_surfaces(server)
    assert main(["stored", "list", "--url", server]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ids
    unknown = "0" * 64
    assert main(["stored", "delete", ids[0], unknown, ids[1], "--url", server]) == 1
    output = capsys.readouterr()
    assert output.out.splitlines() == [f"deleted {ids[0]}", f"deleted {ids[1]}"]
    assert unknown in output.err
    assert main(["stored", "list", "--url", server]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ids[2:]


def test_a_key_without_the_scope_is_refused_and_the_scope_named(
    server: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SURFACE_KEY", WEAK_KEY)
    assert main(["stored", "list", "--url", server]) == 1
    assert "a key with the scope admin" in capsys.readouterr().err


def test_a_service_without_keys_or_without_deletion_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("SURFACE_KEY", raising=False)
    with run_service() as url:
        assert main(["stored", "list", "--url", url]) == 1
        assert "SURFACE_API_KEYS" in capsys.readouterr().err
        assert main(["stored", "delete", "0" * 64, "--url", url]) == 1
        assert "SURFACE_ALLOW_DELETE" in capsys.readouterr().err


def test_verify_reports_damaged_and_foreign_objects(
    server: str, store: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SURFACE_STORE", str(store))
    ids = store_surfaces(server, 20)
    assert main(["stored", "verify"]) == 0
    assert capsys.readouterr().out.startswith("20 surfaces, ")
    damaged = store / "surfaces" / ids[7][:2] / ids[7]
    content = damaged.read_bytes()
    damaged.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    (store / "surfaces" / "notes.txt").write_text("x", encoding="utf-8")
    assert main(["stored", "verify"]) == 1
    *lines, summary = capsys.readouterr().out.splitlines()
    assert [line.partition(": ")[0] for line in lines] == sorted(
        [f"surfaces/{ids[7][:2]}/{ids[7]}", "surfaces/notes.txt"]
    )
    assert "of another hash" in "".join(lines)
    assert summary.startswith("21 surfaces, ")
    assert summary.endswith("2 of them faulty")


def test_verify_reports_its_progress(
    server: str, store: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SURFACE_STORE", str(store))
    monkeypatch.setattr(stored, "OTHER_SECONDS", 0.0)
    store_surfaces(server, 10)
    assert main(["stored", "verify"]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert [line.split()[0] for line in lines] == ["8", "10"]
    assert lines[-1].endswith(" MB/s, 0 faulty")


@pytest.mark.skipif(sys.platform != "linux", reason="names of other systems are Unicode")
def test_verify_names_foreign_files_with_any_name(
    store: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    open_store(str(store), 0)
    for name in (b"\xff", b"\x1b[31m"):
        Path(os.fsdecode(os.fsencode(store / "surfaces") + b"/" + name)).touch()
    monkeypatch.setenv("SURFACE_STORE", str(store))
    assert main(["stored", "verify"]) == 1
    lines = capsys.readouterr().out.splitlines()
    names = [line.partition(": ")[0] for line in lines[:-1]]
    assert names == ["surfaces/\\x1b[31m", "surfaces/\\udcff"]


def test_verify_makes_no_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SURFACE_STORE", str(tmp_path / "nothing"))
    assert main(["stored", "verify"]) == 2
    assert "there is no store in" in capsys.readouterr().err
    assert not (tmp_path / "nothing").exists()
