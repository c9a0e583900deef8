"""The types that the modules of the editor declare in their comments, checked by TypeScript."""

from pathlib import Path

from tests.programs import node_package
from tests.web.compiler import complaints

FOLDER = Path(__file__).parent


def test_the_modules_of_the_page_agree() -> None:
    node_package("@types/three")
    assert complaints(FOLDER / "tsconfig.json") == ""


def test_the_compiler_sees_a_mistake(tmp_path: Path) -> None:
    """The same settings, and a module that calls others as they do not want to be called."""
    page = FOLDER.parents[1] / "service" / "api" / "page"
    (tmp_path / "wrong.js").write_text(
        f"import {{ diverging }} from '{page}/colors.js';\ndiverging('a half');\ndiverging();\n",
        encoding="utf-8",
    )
    project = tmp_path / "tsconfig.json"
    project.write_text(
        f'{{"extends": "{FOLDER}/tsconfig.json", "include": ["wrong.js"]}}', encoding="utf-8"
    )
    found = complaints(project)
    assert "TS2345" in found  # a text is no number
    assert "TS2554" in found  # one is wanted
