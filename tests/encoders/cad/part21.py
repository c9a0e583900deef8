"""A small reader of exchange structures (ISO 10303-21) for tests; it shares no code with ours."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

_TOKEN = re.compile(
    r"\s*(?:(?P<string>'(?:[^']|'')*')|(?P<reference>#\d+)|(?P<enumeration>\.[A-Z0-9_]+\.)"
    r"|(?P<real>[-+]?\d+\.\d*(?:E[-+]?\d+)?)|(?P<integer>[-+]?\d+)|(?P<mark>[(),$*])"
    r"|(?P<keyword>[A-Z][A-Z0-9_]*))"
)


@dataclass(frozen=True)
class Reference:
    number: int


@dataclass(frozen=True)
class Record:
    """An instance: its types, each with its parameters."""

    parts: dict[str, list[Any]]

    @property
    def kind(self) -> str:
        return next(iter(self.parts))

    @property
    def values(self) -> list[Any]:
        return self.parts[self.kind]


def read(content: bytes) -> dict[int, Record]:
    """All instances of a file by number; asserts that the text is an exchange structure."""
    text = content.decode("ascii")
    assert text.startswith("ISO-10303-21;\nHEADER;\n")
    assert text.endswith("ENDSEC;\nEND-ISO-10303-21;\n")
    head, data = text.split("DATA;\n")
    for keyword in ("FILE_DESCRIPTION(", "FILE_NAME(", "FILE_SCHEMA("):
        assert keyword in head
    records: dict[int, Record] = {}
    for line in re.findall(r"#(\d+)=((?:'(?:[^']|'')*'|[^;'])*);\n", data):
        number = int(line[0])
        assert number == len(records) + 1
        records[number] = _read_record(line[1])
    return records


def find(records: dict[int, Record], kind: str) -> list[Record]:
    """All instances that have this type."""
    return [record for record in records.values() if kind in record.parts]


def read_string(text: str) -> str:
    """The characters of a string without its quotes."""
    text = text.replace("''", "'")
    pattern = re.compile(r"\\X2\\((?:[0-9A-F]{4})+)\\X0\\|\\X4\\((?:[0-9A-F]{8})+)\\X0\\|(\\\\)")

    def decode(match: re.Match[str]) -> str:
        if match[3]:
            return "\\"
        return bytes.fromhex(match[1] or match[2]).decode("utf-16-be" if match[1] else "utf-32-be")

    return pattern.sub(decode, text)


def _read_record(text: str) -> Record:
    tokens: list[tuple[str, str]] = []
    place = 0
    while place < len(text):
        match = _TOKEN.match(text, place)
        assert match is not None, text[place : place + 40]
        assert match.lastgroup is not None
        tokens.append((match.lastgroup, match[match.lastgroup]))
        place = match.end()
    tokens.reverse()
    parts: dict[str, list[Any]] = {}
    is_complex = tokens[-1] == ("mark", "(")
    if is_complex:
        tokens.pop()
    while tokens and tokens[-1][0] == "keyword":
        _, keyword = tokens.pop()
        assert tokens.pop() == ("mark", "(")
        parts[keyword] = _read_list(tokens)
    if is_complex:
        assert tokens.pop() == ("mark", ")")
        assert list(parts) == sorted(parts)
    assert not tokens
    return Record(parts)


def _read_list(tokens: list[tuple[str, str]]) -> list[Any]:
    """The values up to the closing bracket."""
    values: list[Any] = []
    while True:
        kind, text = tokens.pop()
        if text == ")" and kind == "mark":
            assert not values
            return values
        values.append(_read_value(kind, text, tokens))
        kind, text = tokens.pop()
        if text == ")":
            return values
        assert text == ","


def _read_value(kind: str, text: str, tokens: list[tuple[str, str]]) -> Any:
    if kind == "keyword":
        assert tokens.pop() == ("mark", "(")
        return text, _read_list(tokens)
    if text == "(":
        return _read_list(tokens)
    convert: dict[str, Callable[[], Any]] = {
        "string": lambda: read_string(text[1:-1]),
        "reference": lambda: Reference(int(text[1:])),
        "real": lambda: float(text),
        "integer": lambda: int(text),
    }
    return convert.get(kind, lambda: text)()
