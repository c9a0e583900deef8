"""The packages of other projects that the service needs.

They are Python packages, and the npm packages of its pages `/` and `/docs`.
"""

import json
import tomllib
from dataclasses import dataclass
from importlib.metadata import Distribution, distribution
from pathlib import Path
from typing import cast

from packaging.markers import default_environment
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
LOCK = ROOT / "web" / "package-lock.json"

BUNDLED = ("swagger-ui-dist", "three")
"""The npm packages whose files the service serves; others are needed only to build these files."""

PLATFORM = {
    "python_version": "3.11",
    "python_full_version": "3.11.0",
    "implementation_name": "cpython",
    "platform_python_implementation": "CPython",
    "os_name": "posix",
    "sys_platform": "linux",
    "platform_system": "Linux",
}
"""The Python of the image. The conditions of dependencies are evaluated for it, on any machine."""


@dataclass(frozen=True)
class Script:
    """An npm package that a page loads; `integrity` is its checksum in the lock file."""

    name: str
    version: str
    licence: str
    integrity: str


def list_packages() -> dict[str, Distribution]:
    """The packages that the service needs directly or indirectly, with all its extras, by name.

    Raises
    ------
    PackageNotFoundError
        A package is not installed, for example because this is not the Python of the image.
    """
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    optional = project["optional-dependencies"]
    texts = [text for extra, texts in optional.items() if extra != "dev" for text in texts]
    requirements = [(Requirement(text), "") for text in [*project["dependencies"], *texts]]
    distributions: dict[str, Distribution] = {}
    visited: set[tuple[str, str]] = set()
    while requirements:
        requirement, parent_extra = requirements.pop()
        if requirement.marker and not requirement.marker.evaluate(_environment(parent_extra)):
            continue
        name = canonicalize_name(requirement.name)
        each = distributions[name] = distribution(requirement.name)
        for extra in {"", *requirement.extras} - {
            extra for package, extra in visited if package == name
        }:
            visited.add((name, extra))
            requirements += [(Requirement(text), extra) for text in each.requires or []]
    return dict(sorted(distributions.items()))


def list_scripts() -> list[Script]:
    """The npm packages that pages load, with the versions of the lock file."""
    packages = json.loads(LOCK.read_text(encoding="utf-8"))["packages"]
    lock_entries = {name: packages[f"node_modules/{name}"] for name in BUNDLED}
    return [
        Script(name, each["version"], each["license"], each["integrity"])
        for name, each in lock_entries.items()
    ]


def _environment(extra: str) -> dict[str, str]:
    """The variables of conditions of dependencies, for the Python of the image and this extra."""
    return {**cast(dict[str, str], default_environment()), **PLATFORM, "extra": extra}
