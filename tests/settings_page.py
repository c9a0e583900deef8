"""The page of the settings, `docs/settings.md`, as the code has them.

`python -m tests.settings_page` writes it anew.

What stands before and after the table is written by hand, and kept.
"""

import sys
from pathlib import Path

from pydantic.fields import FieldInfo

from service.settings.environment import values, variable
from service.settings.values import Settings

PAGE = Path(__file__).parents[1] / "docs" / "settings.md"
HEAD = "| variable | default | values | what it is |\n| --- | --- | --- | --- |\n"


def table() -> str:
    """The table of all settings, in the order of the code."""
    rows = (
        f"| `{variable(name)}` | {_default(field)} | {values(field)} | {field.description} |\n"
        for name, field in Settings.model_fields.items()
    )
    return HEAD + "".join(rows)


def page(text: str) -> str:
    """The page with the table in it anew."""
    before, _, rest = text.partition(HEAD)
    lines = rest.splitlines(keepends=True)
    end = next((i for i, line in enumerate(lines) if not line.startswith("|")), len(lines))
    return before + table() + "".join(lines[end:])


def _default(field: FieldInfo) -> str:
    value = field.default
    if isinstance(value, tuple):
        value = ",".join(value)
    if isinstance(value, bool):
        value = str(value).lower()
    return f"`{value}`" if value != "" else ""


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    sys.exit()
