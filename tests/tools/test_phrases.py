"""The check of phrases reports a phrase, and an exemption that is not needed."""

from pathlib import Path

import pytest

from tools.phrases import Exemption, check


@pytest.mark.parametrize(
    ("name", "text", "line"),
    [
        ("service/a.py", 'x = 1\n"""The same, but for y."""\n', 2),
        ("service/a.py", "# Used by whoever\n# asks.\n", 1),
        ("tests/test_a.py", "def test_nobody_is_asked() -> None: ...\n", 1),
        ("docs/a.md", "It takes so\nmany bytes.\n", 1),
        ("README.md", "A request that is under\n# way.\n", 1),
    ],
)
def test_a_phrase_is_reported_with_its_file_and_line(
    tmp_path: Path, name: str, text: str, line: int
) -> None:
    """A phrase may be in a docstring, comment, name or text, and may continue on the next line."""
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_text(text, encoding="utf-8")
    (result,) = check(tmp_path, ())
    assert result.startswith(f"{name}:{line}: ")
    assert check(tmp_path, (Exemption(name, "*", "planted"),)) == []


def test_an_exemption_that_is_not_needed_is_reported(tmp_path: Path) -> None:
    (result,) = check(tmp_path, (Exemption("service/", "so many|so much", "none"),))
    assert "nothing needs the exemption of 'service/'" in result
