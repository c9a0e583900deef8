"""TypeScript checks the modules of the editor by the types in their comments."""

import json
from pathlib import Path

from tests.web.compiler import compile_project
from tools.programs import find_node_package

FOLDER = Path(__file__).parent
PAGE = FOLDER.parents[1] / "service" / "api" / "page"


def test_the_compiler_finds_no_errors_except_those_in_an_invalid_module(tmp_path: Path) -> None:
    """The test adds a module that calls a function of the editor with invalid arguments."""
    find_node_package("@types/three")
    (tmp_path / "wrong.js").write_text(
        f"import {{ diverging }} from '{PAGE}/colors.js';\ndiverging('a half');\ndiverging();\n",
        encoding="utf-8",
    )
    project = tmp_path / "tsconfig.json"
    document = {"extends": str(FOLDER / "tsconfig.json"), "files": ["wrong.js"]}
    project.write_text(json.dumps(document), encoding="utf-8")
    # The errors are those of the two calls: a text in place of a number, and no argument.
    errors = [line.rsplit("/", 1)[-1] for line in compile_project(project).splitlines()]
    assert [line.split(": ")[:2] for line in errors] == [
        ["wrong.js(2,11)", "error TS2345"],
        ["wrong.js(3,1)", "error TS2554"],
    ], errors
