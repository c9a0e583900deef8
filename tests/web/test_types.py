"""The types that the modules of the editor declare in their comments, checked by TypeScript."""

import subprocess
from pathlib import Path

from tests.tools import node_package, program

FOLDER = Path(__file__).parent


def compiled(project: Path) -> str:
    """What the compiler complains of."""
    compiler = node_package("typescript") / "bin" / "tsc"
    node_package("@types/three")
    command = [program("node"), str(compiler), "--project", str(project)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False).stdout


def test_the_modules_of_the_page_agree() -> None:
    assert compiled(FOLDER / "tsconfig.json") == ""


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
    complaints = compiled(project)
    assert "TS2345" in complaints  # a text is no number
    assert "TS2554" in complaints  # one is wanted
