"""All steps of the recipes can be carried out in this checkout; `make test-recipes` runs the
tests."""

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
def test_steps_find_their_places_and_their_names_and_touch_few_files(
    name: str, tmp_path: Path
) -> None:
    recipe = RECIPES[name]
    assert len({step.path for step in recipe.steps}) <= recipe.most
    for step in recipe.steps:
        (tmp_path / step.path).parent.mkdir(parents=True, exist_ok=True)
        if step.behind:
            shutil.copy(ROOT / step.path, tmp_path / step.path)
        step.do(tmp_path)
    command = [sys.executable, "-m", "ruff", "check", "--isolated", "--select=F821", str(tmp_path)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert not list(find_missing_imports(tmp_path))


def find_missing_imports(copy: Path) -> Iterator[str]:
    """Names that files of `copy` import from files in which no such word is."""
    for path in copy.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ImportFrom):
                continue
            module = (node.module or "").replace(".", "/")
            text = read_text(copy, f"{module}.py") or read_text(copy, f"{module}/__init__.py")
            for name in [each.name for each in node.names] if text else ():
                is_there = re.search(rf"\b{name}\b", text) or read_text(copy, f"{module}/{name}.py")
                if not is_there:
                    yield f"{path.relative_to(copy)}: {node.module}.{name}"


def read_text(copy: Path, path: str) -> str:
    """A file of `copy`, or of this checkout where it has none; empty if neither has it."""
    files = (root / path for root in (copy, ROOT) if (root / path).is_file())
    return next((file.read_text(encoding="utf-8") for file in files), "")
