"""Follows every recipe of CONTRIBUTING.md with a small example, then leaves out one step at a time.

    python -m tools.recipes [NAME …]

A recipe passes if it changes at most the number of files that it states, without generated files;
if the tests pass after all steps; and if, for each step that is not itself a test, a test fails
without this step and its output names the file of the step.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType

from tools.processes import ROOT
from tools.programs import NODE_MODULES, find_program
from tools.recipes.call_toys import COMMAND, ENDPOINT
from tools.recipes.steps import Recipe, Step
from tools.recipes.toys import FORMAT, KIND, OPTION

RECIPES: Mapping[str, Recipe] = MappingProxyType(
    {"format": FORMAT, "kind": KIND, "option": OPTION, "endpoint": ENDPOINT, "command": COMMAND}
)

GENERATED = (
    "{python} -m service openapi --all > openapi.json && mv openapi.json openapi/",
    "{node} tests/web/types.js > types.d.ts && mv types.d.ts openapi/surface-service.d.ts",
    "{python} -m tools.pages",
)
"""Commands that do what `make generated` does."""

COMMON = ("tests/test_openapi.py", "tests/tools/test_pages.py", "tests/test_house.py")
"""Tests that run for every recipe, in addition to the tests of the recipe."""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(RECIPES))
    names = parser.parse_args().names or list(RECIPES)
    faults = [fault for name in names for fault in check_recipe(name, RECIPES[name])]
    sys.exit("\n".join(faults) or 0)


def check_recipe(name: str, recipe: Recipe) -> Iterable[str]:
    """The faults of a recipe. Prints a line for each run of the tests."""
    count = len({step.path for step in recipe.steps})
    print(f"{name}: {count} files of at most {recipe.max_files}", flush=True)
    if count > recipe.max_files:
        yield f"{name}: changes {count} files, allowed are {recipe.max_files}"
    output = try_steps(recipe, recipe.steps)
    print(f"  all steps: {'passes' if not output else 'FAILS'}", flush=True)
    if output:
        yield f"{name}: fails with all its steps\n{output[-3000:]}"
    for step in recipe.steps:
        if step.path.startswith("tests/"):
            continue
        output = try_steps(recipe, [other for other in recipe.steps if other is not step])
        words = {step.path, Path(step.path).stem, ".".join(Path(step.path).with_suffix("").parts)}
        is_named = any(re.search(rf"\b{re.escape(word)}\b", output) for word in words)
        verdict = "a test names it" if is_named else "NOT NAMED" if output else "PASSES"
        print(f"  without {step.path}: {verdict}", flush=True)
        if not is_named:
            yield f"{name}: without {step.path}: {verdict}\n{output[-1500:]}"


def try_steps(recipe: Recipe, steps: Iterable[Step]) -> str:
    """The output of the tests in a copy of the checkout with these steps; empty if they pass.

    If a command of `GENERATED` fails, its output.
    """
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        files = _run(ROOT, "git ls-files --cached --others --exclude-standard")
        for path in files.stdout.split():
            if (ROOT / path).is_file():
                (copy / path).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / path, copy / path)
        for step in steps:
            step.apply(copy)
        (copy / "tests/web/node_modules").symlink_to(NODE_MODULES)
        for command in GENERATED:
            result = _run(copy, command.format(python=sys.executable, node=find_program("node")))
            if result.returncode:
                return result.stdout
        all_tests = (*recipe.tests, *COMMON)
        tests = [test for test in all_tests if (copy / test.partition("::")[0]).exists()]
        pytest = f"{sys.executable} -m pytest -q --maxfail=3 --no-header -p no:cacheprovider"
        result = _run(copy, f"{pytest} {' '.join(tests)}")
        return result.stdout if result.returncode else ""


def _run(checkout: Path, command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        shell=True,
        cwd=checkout,
        env=os.environ | {"PYTHONPATH": str(checkout)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )


if __name__ == "__main__":
    main()
