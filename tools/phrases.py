"""Finds phrases that readers stumble over, and says what to write instead: `make check` runs it.

    .venv/bin/python -m tools.phrases

The phrases are regular expressions. A space in them also matches a line break, the `#` of a comment
and the underscore of a name, so that names of tests are checked, too. The program fails for a
phrase without an exemption, and for an exemption that is not needed any more.
"""

import os
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
FOLDERS = ("service", "clients", "tests", "tools", "oracles", "docs", "deploy", ".github", ".ci")
PAGES = (
    *("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md"),
    *("Makefile", "Dockerfile", "pyproject.toml"),
)
SUFFIXES = frozenset(
    {"", ".cfg", ".css", ".example", ".html", ".js", ".json", ".md", ".py", ".service", ".toml"}
    | {".ts", ".yaml", ".yml"}
)
SKIPPED = frozenset({"node_modules", "static", "__pycache__", "golden"})

_ACTOR = "name the actor: the client, the caller, the operator, another process"
_NUMBER = "say the number: N bytes, 1/12 of the memory, at most 16 requests"
_DIRECT = "say it directly, with a verb or a noun"

PHRASES: Mapping[str, str] = {
    '"""The same': "a docstring stands alone: say what this one does or is",
    "(some|any|every|no)body": _ACTOR,
    "whoever|whomever|whosoever": _ACTOR,
    "who asks": _ACTOR,
    "one of it": "say which: one of these, 1/N of it",
    "so many|so much": _NUMBER,
    "part of so many": _NUMBER,
    '"""Of': "begin with the noun: the size of …, the points of …",
    '"""What': "begin with the noun: the cost of …, the headers of …",
    "(of|for|to|by|in|from|than|with|at|on|into|and) what (is|are|was|were)": _DIRECT,
    "(is|are|was|were|be|been) told": "say who writes what to whom: the log names …",
    "tells? of": "names, contains, reports",
    "(is|are) none of": "is not one of",
    "makes? no sense": "is invalid",
    "under way": "running",
    "come again": "try again",
    "(is|are) well": "works, is ready",
    "holds? on to": "keeps",
    "as many as": _NUMBER,
    "given out": "sent, served",
    "(if|where) nothing is said|unless told": "by default",
    "name of the whole": "name of the group, of the surface",
    "(was|were|is|are) born": "was built",
    "Instead: ": "in place of …",
    "def test what(ever)?": "name the value: test_invalid_requests_are_refused",
}
"""Phrases, in upper or lower case, and what to write in their place."""


class Exemption(NamedTuple):
    """A phrase that is allowed in files whose path begins with `path`; `*` means all phrases."""

    path: str
    phrase: str
    reason: str


EXEMPTIONS = (
    Exemption("tools/phrases.py", "*", "this list"),
    Exemption("tests/tools/test_phrases.py", "*", "phrases that the check must find"),
    Exemption("tests/storage/test_address.py", "(some|any|every|no)body", "nobody is a Unix user"),
)


class Finding(NamedTuple):
    """A phrase in a file of the project."""

    path: str
    line: int
    phrase: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: /{self.phrase}/: {PHRASES[self.phrase]}"


def _pattern(phrase: str) -> re.Pattern[str]:
    words = phrase.replace(" ", r"[\s#_]+")
    return re.compile(f"(?<![A-Za-z])(?:{words})(?![A-Za-z])", re.IGNORECASE)


_PATTERNS = {phrase: _pattern(phrase) for phrase in PHRASES}


def find_phrases(path: str, text: str) -> Iterator[Finding]:
    """The phrases in the text of a file; `path` is the path of the file."""
    for phrase, pattern in _PATTERNS.items():
        for match in pattern.finditer(text):
            yield Finding(path, text.count("\n", 0, match.start()) + 1, phrase)


def read_files(root: Path) -> Iterator[tuple[str, str]]:
    """Paths and texts of the files that the check covers: code, documents, and configuration."""
    paths = [root / page for page in PAGES if (root / page).is_file()]
    for top in FOLDERS:
        for folder, names, files in os.walk(root / top):
            names[:] = sorted(set(names) - SKIPPED)
            paths += [Path(folder, name) for name in sorted(files)]
    for path in paths:
        if path.suffix in SUFFIXES:
            yield path.relative_to(root).as_posix(), path.read_text(encoding="utf-8")


def check(root: Path, exemptions: Sequence[Exemption] = EXEMPTIONS) -> list[str]:
    """A line for each phrase without an exemption, and for each exemption that is not needed."""
    lines, needed_exemptions = [], set()
    for path, text in read_files(root):
        for finding in find_phrases(path, text):
            exemptions_of_finding = {
                each
                for each in exemptions
                if path.startswith(each.path) and each.phrase in ("*", finding.phrase)
            }
            needed_exemptions |= exemptions_of_finding
            if not exemptions_of_finding:
                lines.append(str(finding))
    lines += [
        f"tools/phrases.py: nothing needs the exemption of {each.path!r} for {each.phrase!r}"
        for each in exemptions
        if each not in needed_exemptions
    ]
    return lines


if __name__ == "__main__":
    findings = check(ROOT)
    print("\n".join(findings))
    sys.exit(bool(findings))
