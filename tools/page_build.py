"""The scripts of the page as `make web` builds them: whether they are old, and single modules."""

import subprocess
from hashlib import sha256
from pathlib import Path

import orjson
import pytest

from service.api.page_files import STATIC
from tools.programs import find_program

ROOT = Path(__file__).parents[1]
BUILD = ROOT / "web" / "build.mjs"
MANIFEST = STATIC / "page" / "manifest.json"


def need_bundles() -> None:
    """Skips the test if the scripts of the page are not built, and fails it if they are old."""
    if not MANIFEST.is_file():
        pytest.skip("the scripts of the page are not built ('make web')")
    changed = find_changed_sources()
    if changed:
        pytest.fail(
            "The scripts of the page are older than their sources. Run 'make web' or 'node "
            f"web/build.mjs', then the test again. Changed: {', '.join(changed)}."
        )


def find_changed_sources() -> list[str]:
    """The sources that differ from those of which the scripts of the page were made."""
    sources: dict[str, str] = orjson.loads(MANIFEST.read_bytes())["sources"]
    return [name for name, value in sources.items() if hash_source(ROOT / name) != value]


def hash_source(path: Path) -> str:
    """The hash of a file in hexadecimal; empty if the file is missing."""
    return sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


def build_modules(folder: Path) -> Path:
    """Builds every module of the page by its own name, and returns the folder with them."""
    if not (BUILD.parent / "node_modules" / "esbuild").is_dir():
        pytest.skip("esbuild is not installed ('make web')")
    command = [find_program("node"), str(BUILD), "--modules", str(folder)]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return folder
