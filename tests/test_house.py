"""Rules of the project that no linter checks."""

import json
import re
import tomllib
from importlib.metadata import distribution
from itertools import chain
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from service import __version__

ROOT = Path(__file__).parents[1]
MODULES = sorted((ROOT / "service").rglob("*.py"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CONSTRAINTS = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
LOCKS = [ROOT / each / "package-lock.json" for each in ("web", "tests/web", "tests/generators")]
MAX_LINES = 500


def to_relative(path: Path) -> str:
    return str(path.relative_to(ROOT))


def test_modules_are_short_and_have_a_docstring() -> None:
    for module in MODULES:
        text = module.read_text(encoding="utf-8")
        assert len(text.splitlines()) <= MAX_LINES, f"{to_relative(module)} is too long"
        has_docstring = re.match(r'\s*r?"""\S', text)
        assert has_docstring or not text.strip(), f"{to_relative(module)} has no docstring"


def test_modules_that_docstrings_name_exist() -> None:
    """A name in backticks names a module, a package, or a member of a module."""
    for module in MODULES:
        for name in re.findall(r"`(service(?:\.\w+)+)`", module.read_text(encoding="utf-8")):
            path = ROOT / name.replace(".", "/")
            candidates = [path.with_suffix(".py"), path, path.parent.with_suffix(".py")]
            assert any(candidate.exists() for candidate in candidates), (
                f"{to_relative(module)}: {name}"
            )


def test_a_folder_of_code_has_more_than_one_file() -> None:
    for package in {module.parent for module in MODULES}:
        assert len(list(package.glob("*.py"))) > 1, to_relative(package)


def test_constraints_pin_exact_versions_and_name_no_host() -> None:
    pin = re.compile(r"[A-Za-z0-9._-]+==[A-Za-z0-9.!+]+")
    assert [line for line in CONSTRAINTS if not pin.fullmatch(line)] == []


def test_every_dependency_is_pinned_and_installed_as_pinned() -> None:
    """Visits all packages that the service and its tests need, directly or through others."""
    pins = (line.partition("==") for line in CONSTRAINTS)
    pinned_versions = {str(canonicalize_name(name)): version for name, _, version in pins}
    extras = PROJECT["optional-dependencies"].values()
    requirements = [Requirement(text) for text in chain(PROJECT["dependencies"], *extras)]
    installed_versions: dict[str, str] = {}
    visited: set[str] = set()
    while requirements:
        requirement = requirements.pop()
        package = distribution(requirement.name)
        installed_versions[canonicalize_name(package.name)] = package.version
        for extra in requirement.extras | {""}:
            if (key := f"{package.name}[{extra}]") not in visited:
                visited.add(key)
                requirements += [
                    needed
                    for needed in map(Requirement, package.requires or [])
                    if not needed.marker or needed.marker.evaluate({"extra": extra})
                ]
    assert installed_versions == {name: pinned_versions.get(name) for name in installed_versions}


@pytest.mark.parametrize("lock", LOCKS, ids=to_relative)
def test_lock_files_pin_checksums_and_name_no_host(lock: Path) -> None:
    text = lock.read_text(encoding="utf-8")
    assert "://" not in text
    packages = json.loads(text)["packages"]
    expected = json.loads((lock.parent / "package.json").read_text(encoding="utf-8"))[
        "dependencies"
    ]
    for name, version in expected.items():
        # A package that is installed under another name has the version `npm:NAME@VERSION`.
        assert packages[f"node_modules/{name}"]["version"] == version.rpartition("@")[2]
    # The package without a name is the project itself.
    assert all("integrity" in package for name, package in packages.items() if name)


def test_targets_of_make_that_pages_name_exist() -> None:
    pages = "".join(
        (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "CONTRIBUTING.md")
    )
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"(?:^|`)make ([a-z]+)", pages, re.MULTILINE))
    assert {"serve", "test"} <= targets
    assert targets <= set(re.findall(r"^([a-z]+):.*## ", makefile, re.MULTILINE))


def test_changelog_has_this_version() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [{__version__}]" in changelog
