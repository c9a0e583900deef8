"""The page of the settings, `docs/settings.md`, as the code has them.

`python -m tools.settings_page` writes it anew.

What stands before and after the table is written by hand, and kept.
"""

import sys
from bisect import bisect_left
from pathlib import Path

from pydantic.fields import FieldInfo

from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.engine.options import MeshOptions
from service.errors import TooLarge
from service.pipeline.mesh import plan_mesh
from service.settings.environment import values, variable
from service.settings.values import Settings, result_limits
from service.surface.examples import find
from service.surface.sizes import SurfaceKind

PAGE = Path(__file__).parents[1] / "docs" / "settings.md"
HEAD = "| variable | default | values | what it is |\n| --- | --- | --- | --- |\n"
LARGEST = "| format | one patch | the teapot |\n| --- | --- | --- |\n"


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
    return _with_largest(before + table() + "".join(lines[end:]))


def largest(surface: SurfaceKind, fmt: Format) -> int:
    """Vertices of the largest mesh of a surface that is answered on a machine of 8 GB."""
    limits = result_limits(Settings(memory_bytes=4_000_000_000))

    def size(resolution: int) -> int:
        try:
            options = MeshOptions(resolution=(resolution, resolution))
            return plan_mesh(surface, options, fmt, limits=limits).size.vertices
        except TooLarge:
            return 0

    finest = bisect_left(range(1, 5000), True, key=lambda r: not size(r))
    return size(finest)


def _with_largest(text: str) -> str:
    """The page with the table of the largest meshes in it anew."""
    before, _, rest = text.partition(LARGEST)
    lines = rest.splitlines(keepends=True)
    end = next(i for i, line in enumerate(lines) if not line.startswith("|"))
    surfaces = [find(name).surface() for name in ("saddle", "utah-teapot")]
    rows = (
        f"| {fmt.name} | "
        + " | ".join(f"{largest(s, fmt) / 1e6:.2f} million vertices" for s in surfaces)
        + " |\n"
        for fmt in FORMATS
    )
    return before + LARGEST + "".join(rows) + "".join(lines[end:])


def _default(field: FieldInfo) -> str:
    if field.default_factory is not None:
        return "half"
    value = field.default
    if isinstance(value, tuple):
        value = ",".join(value)
    if isinstance(value, bool):
        value = str(value).lower()
    return f"`{value}`" if value != "" else ""


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    sys.exit()
