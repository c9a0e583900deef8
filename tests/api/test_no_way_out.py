"""No text of a request becomes the name of a file, or an address to connect to."""

import json
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import service
from tests.programs import run_python

ALLOWED = tuple(
    str(Path(folder).resolve())
    for folder in (Path(service.__file__).parent, sys.prefix, sys.base_prefix)
)
"""Folders of modules, which are imported at their first use, and of static files."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    result = tmp_path_factory.mktemp("audited")
    (result / "secret").write_text("the secret of the house", encoding="utf-8")
    return result


@pytest.fixture(scope="module")
def audited(folder: Path) -> Mapping[str, Any]:
    root = Path(service.__file__).parents[1]
    done = run_python("-m", "tests.api.audited", str(folder), check=False, cwd=root)
    assert done.returncode == 0, done.stderr
    result: Mapping[str, Any] = json.loads(done.stdout)
    return result


def test_the_audit_sees_forbidden_events(audited: Mapping[str, Any]) -> None:
    assert {"open", "socket.connect", "os.listdir"} <= set(audited["would"])


def test_hostile_requests_are_answered(audited: Mapping[str, Any]) -> None:
    statuses = audited["statuses"]
    assert len(statuses) > 300
    assert {s for s in statuses if s not in (200, 201)} <= {400, 403, 404, 405, 406, 415, 422, 503}


def test_nothing_is_connected_to_and_no_program_started(audited: Mapping[str, Any]) -> None:
    assert [event for event, _ in audited["seen"] if event != "open"] == []


def test_no_file_is_opened_but_our_own_and_those_of_the_store(
    audited: Mapping[str, Any], folder: Path
) -> None:
    stored = re.compile(re.escape(str(folder / "store")) + r"(/(staging|surfaces|[0-9a-f]+))*")
    for event, (path, mode, *_) in audited["seen"]:
        assert event == "open"
        if not stored.fullmatch(path):
            assert str(Path(path).resolve()).startswith(ALLOWED), path
            assert mode in ("r", "rb"), (path, mode)


def test_stored_files_have_hashes_as_names_and_lie_in_the_store(
    audited: Mapping[str, Any], folder: Path
) -> None:
    assert audited["statuses"].count(201) > 1
    files = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    assert Path("secret") in files
    for file in files:
        if file != Path("secret"):
            assert file.parts[0] == "store"
            assert set(file.name) <= set("0123456789abcdef.json")
