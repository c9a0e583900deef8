"""TypeScript's compiler, as a judge."""

import subprocess
from pathlib import Path

from tests.tools import node_package, program


def complaints(project: Path) -> str:
    """What the compiler has against a project, told by its `tsconfig.json`."""
    compiler = node_package("typescript") / "bin" / "tsc"
    command = [program("node"), str(compiler), "--project", str(project)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False).stdout
