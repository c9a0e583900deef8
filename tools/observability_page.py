"""The table of metrics in `docs/observability.md`, as the code has them.

`python -m tools.observability_page` writes it anew; what stands before it is kept.
"""

import sys
from pathlib import Path

from service.api.app import create_app
from service.settings.values import Settings

PAGE = Path(__file__).parents[1] / "docs" / "observability.md"
HEAD = "| metric | kind | labels | what it is |\n| --- | --- | --- | --- |\n"


def table() -> str:
    """The table of all numbers of ours, in the order of the code."""
    registry = create_app(Settings()).state.observed.registry
    pairs = [
        (each, family)
        for each in vars(registry)["_collector_to_names"]
        for family in each.collect()
    ]
    rows = []
    for collector, family in pairs:
        if not family.name.startswith("surface_"):
            continue
        name = {"counter": f"{family.name}_total", "info": f"{family.name}_info"}.get(
            family.type, family.name
        )
        names = vars(collector).get("_labelnames") or vars(family).get("_labelnames", ())
        labels = ", ".join(f"`{label}`" for label in names)
        rows.append(f"| `{name}` | {family.type} | {labels} | {family.documentation} |\n")
    return HEAD + "".join(rows)


def page(text: str) -> str:
    """The page with the table in it anew."""
    before, _, _ = text.partition(HEAD)
    return before + table()


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    sys.exit()
