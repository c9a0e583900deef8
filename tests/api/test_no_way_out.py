"""The service never uses a text of a request as a file name or as an address to connect to."""

import json
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import service
from tools.programs import run_python

ALLOWED = tuple(
    str(Path(folder).resolve())
    for folder in (Path(service.__file__).parent, sys.prefix, sys.base_prefix)
)
"""Folders whose files the service may read: Python modules and static files."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a file that the service must not read; the store is in it."""
    folder = tmp_path_factory.mktemp("audited")
    (folder / "secret").write_text("the secret of the house", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def audit(folder: Path) -> Mapping[str, Any]:
    """The output of `tests/api/audited.py`.

    `statuses` of hostile requests; `events` that the audit hook recorded meanwhile; and names of
    `forbidden` events: the program itself causes them at its end, to show that the hook works.
    """
    root = Path(service.__file__).parents[1]
    process = run_python("-m", "tests.api.audited", str(folder), check=False, cwd=root)
    assert process.returncode == 0, process.stderr
    document: Mapping[str, Any] = json.loads(process.stdout)
    return document


def test_the_audit_hook_reports_forbidden_operations(audit: Mapping[str, Any]) -> None:
    assert {"open", "socket.connect", "os.listdir"} <= set(audit["forbidden"])


def test_hostile_requests_get_statuses_of_success_or_refusal(audit: Mapping[str, Any]) -> None:
    statuses = audit["statuses"]
    assert len(statuses) > 300
    assert set(statuses) <= {200, 201, 400, 403, 404, 405, 406, 415, 422, 503}


def test_the_service_opens_no_connections_and_starts_no_programs(audit: Mapping[str, Any]) -> None:
    events = {event for event, _ in audit["events"]}
    assert events <= {"open", "os.rename", "os.mkdir"}


def test_the_service_opens_only_its_own_files_and_those_of_the_store(
    audit: Mapping[str, Any], folder: Path
) -> None:
    for event, arguments in audit["events"]:
        # The store names most of its files relative to its open folder.
        paths = [argument.removeprefix(f"{folder}/store/") for argument in arguments[:2]]
        if event == "os.rename":
            assert re.fullmatch("staging/[0-9a-f]{32}", paths[0])
            assert re.fullmatch("surfaces/[0-9a-f]{2}/[0-9a-f]{64}", paths[1])
        elif not (
            paths[0] == str(folder / "store")
            or re.fullmatch(r"\.surface-store|(staging|surfaces)(/[0-9a-f]+)*", paths[0])
        ):
            assert str(Path(paths[0]).resolve()).startswith(ALLOWED), paths
            assert (event, arguments[1]) in (("open", "r"), ("open", "rb")), paths


def test_files_in_the_store_have_hashes_as_names(audit: Mapping[str, Any], folder: Path) -> None:
    assert audit["statuses"].count(201) > 1
    files = {path.relative_to(folder) for path in folder.rglob("*") if path.is_file()}
    own_files = {Path("secret"), Path("store/.surface-store")}
    assert own_files <= files
    for file in files - own_files:
        assert file.parts[0] == "store"
        assert re.fullmatch("[0-9a-f]{64}", file.name)
