"""Runs TypeScript's compiler."""

import json
import subprocess
from pathlib import Path

from tests.programs import find_node_package, find_program

STRICT = {
    "strict": True,
    "noUncheckedIndexedAccess": True,
    "target": "es2022",
    "module": "es2022",
    "moduleResolution": "bundler",
    "lib": ["es2023", "dom", "dom.iterable"],
    "types": [],
    "skipDefaultLibCheck": True,
}


def project_of(folder: Path, *sources: Path) -> Path:
    """A strict project of these sources: a file in `folder`, into whose `js` it is compiled."""
    project = folder / "tsconfig.json"
    options = STRICT | {"outDir": "js", "rootDir": "/"}
    described = {"compilerOptions": options, "files": [str(source) for source in sources]}
    project.write_text(json.dumps(described), encoding="utf-8")
    return project


def compile_project(project: Path) -> str:
    """The compiler's errors in the project of a `tsconfig.json`; empty if there are none."""
    # Version 7 takes a sixth of the time; openapi-typescript needs the library of version 5.
    compiler = find_node_package("typescript-7") / "bin" / "tsc"
    command = [find_program("node"), str(compiler), "--project", str(project)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    reported = done.stdout + done.stderr
    assert bool(reported) == bool(done.returncode), "a compiler that fails says why"
    return reported
