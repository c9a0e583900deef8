"""Checks whether this checkout may be tagged, beyond the tests: `make release-check`.

`docs/release.md` has the steps before and after it.
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
from service.engine.mesh.report import ENGINE
from tools.supply.packages import ROOT

TAG = f"v{__version__}"
GOLDEN = "tests/golden"
ENGINE_FILE = "service/engine/mesh/report.py"


def git(*arguments: str) -> str:
    """The output of git; empty if it fails."""
    done = subprocess.run(
        ["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False
    )
    return done.stdout.strip() if done.returncode == 0 else ""


def nothing_uncommitted() -> str:
    """Fails for changes that are not committed."""
    return git("status", "--porcelain")


def tag_is_new() -> str:
    """Fails for a version that has a tag already."""
    return git("tag", "--list", TAG) and f"{TAG} exists: raise service/__init__.py"


def changelog_is_closed() -> str:
    """Fails if CHANGELOG.md has entries that are not under this version."""
    return unreleased((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), __version__)


def unreleased(changelog: str, version: str) -> str:
    """The faults of a changelog whose newest version must be this one."""
    sections = re.split(r"^## ", changelog, flags=re.MULTILINE)[1:]
    titles = [section.partition("\n")[0] for section in sections]
    news = [s for s in sections if s.startswith("[Unreleased]") and s.partition("\n")[2].strip()]
    if news:
        return "CHANGELOG.md has news under [Unreleased]: move them under the version"
    rest = [title for title in titles if not title.startswith("[Unreleased]")]
    if not rest or not rest[0].startswith(f"[{version}]"):
        return f"the newest version in CHANGELOG.md is not {version}"
    return ""


def engine_is_raised() -> str:
    """Fails if golden files changed but ENGINE did not: caches keep URLs with `engine=N` for
    ever."""
    before = git("describe", "--tags", "--abbrev=0", "--match", "v*")
    if not before or not git("diff", "--name-only", before, "--", GOLDEN):
        return ""
    match = re.search(r"^ENGINE = (\d+)$", git("show", f"{before}:{ENGINE_FILE}"), re.MULTILINE)
    if match and int(match[1]) == ENGINE:
        return f"{GOLDEN} is not as in {before}, and ENGINE is still {ENGINE}: read what changed"
    return ""


def wheel_is_reproducible() -> str:
    """Fails if two builds of the wheel have different bytes."""
    checksums = set()
    for _ in range(2):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps"]
            time = git("log", "-1", "--format=%ct") or "0"
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
    """Prints the result of each check; returns 0 if all pass."""
    wrong = 0
    for check in CHECKS:
        problem = check()
        wrong += bool(problem)
        print(f"  {check.__name__.replace('_', ' '):<24} {problem or 'yes'}")
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
