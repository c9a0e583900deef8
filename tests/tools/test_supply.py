"""Packages of other projects in the image are listed, and have allowed licences."""

import json
import re
from email.message import Message
from importlib.metadata import PackageNotFoundError, distribution
from types import SimpleNamespace
from typing import Any, cast

import pytest
import yaml

from service import __version__
from tests.deploy.files import run_command
from tests.programs import find_program
from tools.supply.licences import PAGE, READ, Unread, check, licence, page, statement
from tools.supply.packages import BUNDLED, ROOT, needed, scripts
from tools.supply.release import unreleased
from tools.supply.sbom import add_scripts

DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
DEPENDABOT = ROOT / ".github" / "dependabot.yml"


def read_licence(name: str, **fields: str) -> str:
    """The licence of a distribution with these fields."""
    metadata = Message()
    for field, text in fields.items():
        metadata[field] = text
    return licence(cast(Any, SimpleNamespace(name=name, metadata=metadata)))


def test_the_page_of_licences_lists_the_installed_packages() -> None:
    try:
        result = page()
    except PackageNotFoundError as error:
        pytest.skip(f"not installed: {error.name}, which the image's Python needs")
    assert PAGE.read_text(encoding="utf-8") == result


def test_needed_packages_exclude_development_tools() -> None:
    result = needed()
    assert {"fastapi", "starlette", "numpy", "meshopt"} <= result.keys()
    assert not result.keys() & {"pytest", "ruff", "scipy", "playwright"}


def test_an_unclear_licence_must_be_read_first() -> None:
    with pytest.raises(Unread, match="'BSD License'"):
        read_licence("x", Classifier="License :: OSI Approved :: BSD License")
    with pytest.raises(Unread, match="says ''"):
        read_licence("x")


def test_a_changed_licence_text_must_be_read_again() -> None:
    name, (declared, expected) = next(iter(READ.items()))
    assert statement(distribution(name)) == declared
    assert read_licence(name, License="GPL-3.0-only") == "GPL-3.0-only"
    with pytest.raises(Unread, match=name):
        read_licence(name, License="Our own licence")
    assert check(name, expected) == expected


@pytest.mark.parametrize("expression", ["GPL-3.0-only", "MIT OR AGPL-3.0-only", "(MIT)AND(X)", ""])
def test_strange_licence_is_refused(expression: str) -> None:
    with pytest.raises(Unread, match="not allowed"):
        check("x", expression)


def test_scripts_are_those_that_the_image_copies() -> None:
    copied = re.findall(r"/web/node_modules/([\w./-]+)/", DOCKERFILE)
    assert set(copied) == set(BUNDLED)


def test_bill_of_materials_has_the_scripts_too() -> None:
    library = {"bom-ref": "numpy==2", "name": "numpy", "version": "2", "type": "library"}
    bill: dict[str, Any] = {
        "metadata": {"component": {"bom-ref": "root-component", "name": "surface-service"}},
        "components": [library],
        "dependencies": [{"ref": "root-component", "dependsOn": ["numpy==2"]}, {"ref": "numpy==2"}],
    }
    whole = add_scripts(bill)
    assert whole["metadata"]["component"]["version"] == __version__
    assert [each["name"] for each in whole["components"]] == ["numpy", *BUNDLED]
    (hashed,) = whole["components"][-1]["hashes"]
    assert hashed["alg"] == "SHA-512"
    assert re.fullmatch("[0-9a-f]{128}", hashed["content"])
    needs = {each["ref"]: each.get("dependsOn") for each in whole["dependencies"]}
    added = [f"pkg:npm/{script.name}@{script.version}" for script in scripts()]
    assert needs["root-component"] == ["numpy==2", *added]
    assert needs["numpy==2"] is None
    assert json.dumps(add_scripts(bill)) == json.dumps(whole)


def test_bases_of_the_image_are_exact() -> None:
    bases = re.findall(r"^ARG \w+_IMAGE=(\S+)$", DOCKERFILE, re.MULTILINE)
    assert len(bases) == 2
    for base in bases:
        assert re.fullmatch(r"\w+:\d+\.\d+\.\d+-slim-\w+|\w+:\d+\.\d+\.\d+-\w+-slim", base)


def test_updates_are_looked_for_wherever_something_is_pinned() -> None:
    run_command(
        find_program("check-jsonschema"), "--builtin-schema", "vendor.dependabot", DEPENDABOT
    )
    updates = yaml.safe_load(DEPENDABOT.read_text(encoding="utf-8"))["updates"]
    watched = {(each["package-ecosystem"], each["directory"]) for each in updates}
    locks = {("npm", f"/{folder}") for folder in ("web", "tests/web")}
    assert watched == locks | {("pip", "/"), ("docker", "/"), ("docker-compose", "/deploy")}
    assert all((ROOT / f"./{folder}/package-lock.json").is_file() for _, folder in locks)


@pytest.mark.parametrize(
    ("changelog", "problem"),
    [
        ("# Log\n\n## [Unreleased]\n\n## [1.1.0]\n\nNews.\n\n## [1.0.0]\n", ""),
        ("# Log\n\n## [1.1.0] - 2026-01-01\n\nNews.\n", ""),
        ("# Log\n\n## [Unreleased]\n\nNews.\n\n## [1.1.0]\n", "Unreleased"),
        ("# Log\n\n## [1.0.0]\n", "is not 1.1.0"),
        ("# Log\n", "is not 1.1.0"),
    ],
)
def test_changelog_of_a_release(changelog: str, problem: str) -> None:
    result = unreleased(changelog, "1.1.0")
    assert problem in result
    assert bool(problem) == bool(result)
