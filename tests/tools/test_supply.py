"""Packages of other projects: licences, bill of materials, versions; and faults of a changelog."""

import json
import re
from email.message import Message
from importlib.metadata import PackageNotFoundError, distribution
from types import SimpleNamespace
from typing import Any, cast

import orjson
import pytest
import yaml

from service import __version__
from tests.deploy.files import run_command
from tools.page_build import BUILD, MANIFEST
from tools.programs import find_program
from tools.supply.licences import (
    PAGE,
    READ_LICENCES,
    UnknownLicence,
    check_licence,
    find_licence,
    read_statement,
    write_page,
)
from tools.supply.packages import BUNDLED, ROOT, list_packages, list_scripts
from tools.supply.release import find_changelog_fault
from tools.supply.sbom import add_scripts

DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
DEPENDABOT = ROOT / ".github" / "dependabot.yml"


def find_licence_of(name: str, **fields: str) -> str:
    """The licence that is found for a package with these fields of metadata."""
    metadata = Message()
    for field, text in fields.items():
        metadata[field] = text
    return find_licence(cast(Any, SimpleNamespace(name=name, metadata=metadata)))


def test_the_page_of_licences_lists_the_installed_packages() -> None:
    try:
        result = write_page()
    except PackageNotFoundError as error:
        pytest.skip(f"not installed: {error.name}, which the image's Python needs")
    assert PAGE.read_text(encoding="utf-8") == result


def test_needed_packages_exclude_development_tools() -> None:
    result = list_packages()
    assert {"fastapi", "starlette", "numpy", "meshopt"} <= result.keys()
    assert not result.keys() & {"pytest", "ruff", "scipy", "playwright"}


def test_a_licence_that_is_no_spdx_expression_is_refused_until_a_person_read_it() -> None:
    with pytest.raises(UnknownLicence, match="'BSD License'"):
        find_licence_of("x", Classifier="License :: OSI Approved :: BSD License")
    with pytest.raises(UnknownLicence, match="says ''"):
        find_licence_of("x")


def test_a_package_that_changes_its_statement_is_refused_until_a_person_read_it() -> None:
    name, (statement, licence) = next(iter(READ_LICENCES.items()))
    assert read_statement(distribution(name)) == statement
    # An SPDX expression needs no person to read it; whether it is allowed, `check_licence` decides.
    assert find_licence_of(name, License="GPL-3.0-only") == "GPL-3.0-only"
    with pytest.raises(UnknownLicence, match=name):
        find_licence_of(name, License="Our own licence")
    assert check_licence(name, licence) == licence


# A licence that is not allowed is refused even as an alternative to an allowed one.
@pytest.mark.parametrize(
    "expression",
    [
        *("GPL-3.0-only", "MIT OR AGPL-3.0-only", "(MIT)AND(X)", ""),
        *("GPL-2.0-only WITH Classpath-exception-2.0", "MIT WITH LLVM-exception"),
    ],
)
def test_licences_that_are_not_allowed_are_refused(expression: str) -> None:
    with pytest.raises(UnknownLicence, match="not allowed"):
        check_licence("x", expression)


def test_a_licence_with_an_exception_is_one_licence() -> None:
    expression = "MPL-2.0 AND (Apache-2.0 WITH LLVM-exception OR MIT)"
    assert check_licence("x", expression) == expression


def test_the_image_copies_the_bundled_npm_packages() -> None:
    """The image copies the files of one package, and the build bundles the other."""
    copied_packages = re.findall(r"/web/node_modules/([\w./-]+)/", DOCKERFILE)
    licences = re.findall(r"'node_modules/([\w-]+)/LICENSE'", BUILD.read_text(encoding="utf-8"))
    assert {*copied_packages, *licences} == set(BUNDLED)
    if MANIFEST.is_file():
        packages = orjson.loads(MANIFEST.read_bytes())["packages"]
        assert packages == licences


def test_the_bill_of_materials_has_the_npm_packages() -> None:
    library = {"bom-ref": "numpy==2", "name": "numpy", "version": "2", "type": "library"}
    bill: dict[str, Any] = {
        "metadata": {"component": {"bom-ref": "root-component", "name": "surface-service"}},
        "components": [library],
        "dependencies": [{"ref": "root-component", "dependsOn": ["numpy==2"]}, {"ref": "numpy==2"}],
    }
    complete_bill = add_scripts(bill)
    assert complete_bill["metadata"]["component"]["version"] == __version__
    assert [each["name"] for each in complete_bill["components"]] == ["numpy", *BUNDLED]
    (checksum,) = complete_bill["components"][-1]["hashes"]
    assert checksum["alg"] == "SHA-512"
    assert re.fullmatch("[0-9a-f]{128}", checksum["content"])
    needs = {each["ref"]: each.get("dependsOn") for each in complete_bill["dependencies"]}
    npm_refs = [f"pkg:npm/{script.name}@{script.version}" for script in list_scripts()]
    assert needs["root-component"] == ["numpy==2", *npm_refs]
    assert needs["numpy==2"] is None
    # The first call did not change `bill`, so a second call gives the same bytes.
    assert json.dumps(add_scripts(bill)) == json.dumps(complete_bill)


def test_base_images_have_exact_versions() -> None:
    base_images = re.findall(r"^ARG \w+_IMAGE=(\S+)$", DOCKERFILE, re.MULTILINE)
    assert len(base_images) == 2
    for base_image in base_images:
        assert re.fullmatch(r"\w+:\d+\.\d+\.\d+-slim-\w+|\w+:\d+\.\d+\.\d+-\w+-slim", base_image)


def test_dependabot_watches_the_files_that_pin_versions() -> None:
    run_command(
        find_program("check-jsonschema"), "--builtin-schema", "vendor.dependabot", DEPENDABOT
    )
    updates = yaml.safe_load(DEPENDABOT.read_text(encoding="utf-8"))["updates"]
    watched_folders = {(each["package-ecosystem"], each["directory"]) for each in updates}
    npm_folders = ("web", "tests/web", "tests/generators")
    assert watched_folders == {
        *(("npm", f"/{folder}") for folder in npm_folders),
        *(("pip", "/"), ("docker", "/"), ("docker-compose", "/deploy")),
    }
    assert all((ROOT / folder / "package-lock.json").is_file() for folder in npm_folders)


@pytest.mark.parametrize(
    ("changelog", "fault"),
    [
        ("# Log\n\n## [Unreleased]\n\n## [1.1.0]\n\nNews.\n\n## [1.0.0]\n", ""),
        ("# Log\n\n## [1.1.0] - 2026-01-01\n\nNews.\n", ""),
        ("# Log\n\n## [Unreleased]\n\nNews.\n\n## [1.1.0]\n", "Unreleased"),
        ("# Log\n\n## [1.0.0]\n", "is not 1.1.0"),
        ("# Log\n", "is not 1.1.0"),
    ],
)
def test_faults_of_a_changelog(changelog: str, fault: str) -> None:
    result = find_changelog_fault(changelog, "1.1.0")
    assert fault in result
    assert bool(fault) == bool(result)
