"""Checks, in addition to the tests, whether this checkout may be tagged: `make release-check`.

`docs/release.md` has the steps before and after this check. Each check is a function that returns
the fault, or an empty text.
"""

import hashlib
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from service import __version__
from service.engine.mesh.mesh import ENGINE
from tools.supply.packages import ROOT

TAG = f"v{__version__}"
GOLDEN = "tests/golden"
ENGINE_FILE = "service/engine/mesh/mesh.py"


def run_git(*arguments: str) -> str:
    """The output of git; empty if it fails."""
    result = subprocess.run(
        ["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False
    )
    return result.stdout.strip() if result.returncode == 0 else ""


def nothing_uncommitted() -> str:
    """The changes that are not committed."""
    return run_git("status", "--porcelain")


def tag_is_new() -> str:
    """The fault that this version has a tag already."""
    return run_git("tag", "--list", TAG) and f"{TAG} exists: raise service/__init__.py"


def changelog_is_closed() -> str:
    """The fault that CHANGELOG.md has entries that are not under this version."""
    return find_changelog_fault((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), __version__)


def find_changelog_fault(changelog: str, version: str) -> str:
    """The fault that [Unreleased] has entries, or that the newest version is not this one."""
    sections = re.split(r"^## ", changelog, flags=re.MULTILINE)[1:]
    titles = [section.partition("\n")[0] for section in sections]
    news = [s for s in sections if s.startswith("[Unreleased]") and s.partition("\n")[2].strip()]
    if news:
        return "CHANGELOG.md has news under [Unreleased]: move them under the version"
    versions = [title for title in titles if not title.startswith("[Unreleased]")]
    if not versions or not versions[0].startswith(f"[{version}]"):
        return f"the newest version in CHANGELOG.md is not {version}"
    return ""


def engine_is_raised() -> str:
    """The fault that golden files changed since the last tag, but ENGINE did not.

    Caches keep URLs with `engine=N` for ever, so other numbers need another N.
    """
    last_tag = run_git("describe", "--tags", "--abbrev=0", "--match", "v*")
    if not last_tag or not run_git("diff", "--name-only", last_tag, "--", GOLDEN):
        return ""
    match = re.search(
        r"^ENGINE = (\d+)$", run_git("show", f"{last_tag}:{ENGINE_FILE}"), re.MULTILINE
    )
    if match and int(match[1]) == ENGINE:
        return f"{GOLDEN} is not as in {last_tag}, and ENGINE is still {ENGINE}: read what changed"
    return ""


def wheel_is_reproducible() -> str:
    """The fault that two builds of the wheel have different bytes."""
    checksums = set()
    for _ in range(2):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps"]
            time = run_git("log", "-1", "--format=%ct") or "0"
            environment = {**os.environ, "SOURCE_DATE_EPOCH": time}
            subprocess.run(
                [*command, "--wheel-dir", folder, str(ROOT)], env=environment, check=True
            )
            (wheel,) = Path(folder).glob("*.whl")
            checksums.add(hashlib.sha256(wheel.read_bytes()).hexdigest())
    return "" if len(checksums) == 1 else "two wheels of the same source differ"


CHECKS: tuple[Callable[[], str], ...] = (
    nothing_uncommitted, tag_is_new, changelog_is_closed, engine_is_raised, wheel_is_reproducible,
)  # fmt: skip


def main() -> int:
    """Prints the result of each check; returns 0 if there are no faults."""
    faults = 0
    for check in CHECKS:
        fault = check()
        faults += bool(fault)
        print(f"  {check.__name__.replace('_', ' '):<24} {fault or 'yes'}")
    return min(faults, 1)


if __name__ == "__main__":
    sys.exit(main())
