"""All steps of the recipes can be done in this checkout.

`make test-recipes` also runs the tests of the recipes.
"""

import ast
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tools.processes import ROOT
from tools.recipes.__main__ import RECIPES


@pytest.mark.parametrize("name", RECIPES)
def test_steps_can_be_done_and_change_few_files_without_missing_names(
    name: str, tmp_path: Path
) -> None:
    recipe = RECIPES[name]
    assert len({step.path for step in recipe.steps}) <= recipe.max_files
    for step in recipe.steps:
        (tmp_path / step.path).parent.mkdir(parents=True, exist_ok=True)
        if step.insertions:
            shutil.copy(ROOT / step.path, tmp_path / step.path)
        step.apply(tmp_path)
    # F821 is the rule that finds undefined names.
    command = [sys.executable, "-m", "ruff", "check", "--isolated", "--select=F821", str(tmp_path)]
    result = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    assert result.returncode == 0, result.stdout
    assert not list(find_missing_imports(tmp_path))


def find_missing_imports(copy: Path) -> Iterator[str]:
    """Names that files of `copy` import from modules whose text does not contain the name."""
    for path in copy.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ImportFrom):
                continue
            module = (node.module or "").replace(".", "/")
            text = read_text(copy, f"{module}.py") or read_text(copy, f"{module}/__init__.py")
            for name in [each.name for each in node.names] if text else ():
                is_defined = re.search(rf"\b{name}\b", text) or read_text(
                    copy, f"{module}/{name}.py"
                )
                if not is_defined:
                    yield f"{path.relative_to(copy)}: {node.module}.{name}"


def read_text(copy: Path, path: str) -> str:
    """The text of a file of `copy`, or else of this checkout; empty if neither has the file."""
    files = (root / path for root in (copy, ROOT) if (root / path).is_file())
    return next((file.read_text(encoding="utf-8") for file in files), "")
