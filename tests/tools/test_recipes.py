"""The steps of the recipes can be done in this checkout; `make test-recipes` runs their results."""

import shutil
from pathlib import Path

import pytest

from tools.processes import ROOT
from tools.recipes.__main__ import RECIPES


@pytest.mark.parametrize("name", RECIPES)
def test_steps_find_their_places_and_touch_few_files(name: str, tmp_path: Path) -> None:
    recipe = RECIPES[name]
    assert len({step.path for step in recipe.steps}) <= recipe.most
    for step in recipe.steps:
        (tmp_path / step.path).parent.mkdir(parents=True, exist_ok=True)
        if step.behind:
            shutil.copy(ROOT / step.path, tmp_path / step.path)
        step.do(tmp_path)
