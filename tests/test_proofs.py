"""docs/proofs.md and the docstrings that rest on it name the same theorems."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "proofs.md").read_text(encoding="utf-8")
THEOREM = re.compile(r"^### (.+)\n\n\*Rests on it:\* (.+)$", re.MULTILINE)
SENTENCE = re.compile(r"docs/proofs\.md: ((?:(?:, | and )?\"[^\"]+\")+)\.")
"""The form in which a docstring names theorems: `Proof in docs/proofs.md: "A", "B" and "C".`"""


def test_a_theorem_names_the_modules_that_name_it() -> None:
    on_the_page = {
        (name, module)
        for name, modules in THEOREM.findall(PAGE)
        for module in re.findall(r"`([^`]+)`", modules)
    }
    in_the_code = set()
    for path in (ROOT / "service").rglob("*.py"):
        text = " ".join(path.read_text(encoding="utf-8").split())
        sentences = SENTENCE.findall(text)
        assert len(sentences) == text.count("docs/proofs.md"), path
        for name in re.findall(r'"([^"]+)"', " ".join(sentences)):
            in_the_code.add((name, path.relative_to(ROOT).as_posix()))
    assert on_the_page == in_the_code


def test_every_theorem_has_a_statement_and_a_proof() -> None:
    for theorem in re.split(r"^### ", PAGE, flags=re.MULTILINE)[1:]:
        assert THEOREM.match(f"### {theorem}"), theorem
        assert "\n**Statement.**" in theorem, theorem
        assert "\n**Proof.**" in theorem, theorem


def test_links_lead_to_headings_of_the_page() -> None:
    headings = re.findall(r"^#+ (.+)$", PAGE, re.MULTILINE)
    anchors = {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}
    assert set(re.findall(r"\]\(#([^)]+)\)", PAGE)) <= anchors
