"""Types that TypeScript checks: those in the comments of the editor's modules."""

import json
from pathlib import Path

from tests.programs import find_node_package
from tests.web.compiler import compile_project

FOLDER = Path(__file__).parent
PAGE = FOLDER.parents[1] / "service" / "api" / "page"


def test_the_modules_of_the_page_agree_and_the_compiler_sees_a_mistake(tmp_path: Path) -> None:
    """Adds a module with an invalid call of one of them."""
    find_node_package("@types/three")
    (tmp_path / "wrong.js").write_text(
        f"import {{ diverging }} from '{PAGE}/colors.js';\ndiverging('a half');\ndiverging();\n",
        encoding="utf-8",
    )
    project = tmp_path / "tsconfig.json"
    described = {"extends": str(FOLDER / "tsconfig.json"), "files": ["wrong.js"]}
    project.write_text(json.dumps(described), encoding="utf-8")
    # The only error is that of the invalid call: a text in place of a number.
    result = [line.rsplit("/", 1)[-1] for line in compile_project(project).splitlines()]
    assert [line.split(": ")[:2] for line in result] == [
        ["wrong.js(2,11)", "error TS2345"],
        ["wrong.js(3,1)", "error TS2554"],
    ], result
