"""TypeScript's compiler, as a judge."""

import subprocess
from pathlib import Path

from tests.programs import node_package, program


def complaints(project: Path) -> str:
    """What the compiler has against a project, told by its `tsconfig.json`; empty if nothing."""
    compiler = node_package("typescript") / "bin" / "tsc"
    command = [program("node"), str(compiler), "--project", str(project)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    told = done.stdout + done.stderr
    assert bool(told) == bool(done.returncode), "a compiler that fails says why"
    return told
