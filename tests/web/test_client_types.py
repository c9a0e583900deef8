"""The TypeScript types of the service: made from the OpenAPI document, and of use to a client."""

import json
import subprocess
from pathlib import Path

from tests.programs import node_package, program
from tests.web.browser import FOLDER
from tests.web.compiler import complaints

TYPES = FOLDER.parents[1] / "openapi" / "surface-service.d.ts"
STRICT = {
    "strict": True,
    "noEmit": True,
    "noUncheckedIndexedAccess": True,
    "target": "es2022",
    "module": "es2022",
    "moduleResolution": "bundler",
    "lib": ["es2023", "dom", "dom.iterable"],
    "types": [],
}


def project_of(source: Path, folder: Path, **settings: object) -> Path:
    """A project of this one source, strict, described by a file in `folder`."""
    project = folder / "tsconfig.json"
    described = {"compilerOptions": STRICT | settings, "files": [str(source)]}
    project.write_text(json.dumps(described), encoding="utf-8")
    return project


def test_committed_types_are_those_of_the_document() -> None:
    node_package("openapi-typescript")
    command = [program("node"), str(FOLDER / "types.js")]
    made = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert made.stdout == TYPES.read_text(encoding="utf-8"), "run `make types`"


def test_right_uses_compile_and_wrong_ones_do_not(tmp_path: Path) -> None:
    node_package("openapi-fetch")
    assert complaints(project_of(FOLDER / "uses.ts", tmp_path)) == ""
