"""Draws the pictures of the documentation, and lists the examples beside theirs.

`python -m tests.web.picture docs` writes `teapot.png`, `wires.png`, `examples/<id>.png` and
`examples.md`.
"""

import json
import sys
from pathlib import Path
from typing import Any

from service.api.openapi.curve import REQUESTS
from service.surface.examples import EXAMPLES, Example
from tests.live import running_service
from tests.tools import chromium
from tests.web.browser import FOLDER, open_browser, open_page, open_viewer, serve_folder

TEAPOT = "/v1/surfaces/utah-teapot/mesh.glb?resolution=32"
WIRES = (
    "/v1/surfaces/utah-teapot/mesh.glb?resolution=12&faces=none&isocurves=4&wires=tubes"
    "&wire_width=0.03"
)
LARGE = (1200, 800)
MEDIUM = (900, 600)
SMALL = (400, 300)

HEAD = """\
# The built-in surfaces

They answer at `/v1/surfaces/{id}/mesh.{suffix}` without having been posted, with any option in the
query; `/v1/surfaces/{id}` is the definition to start from. Drawn by three.js from the service's
own glTF; `make picture` draws them anew.
"""


CURVES = """\
# Curves to begin with

Curves have no address of their own: these are bodies for `POST /v1/curve`, or files for
`surface curve`.
"""


def listing() -> str:
    """The page of the examples, Markdown."""
    curves = [_curve(example["summary"], example["value"]) for example in REQUESTS.values()]
    return "\n".join([HEAD, *map(_entry, EXAMPLES.values()), CURVES, *curves])


def _entry(example: Example) -> str:
    return (
        f"## {example.title}: `{example.id}`\n\n"
        f"![{example.title}](examples/{example.id}.png)\n\n{example.description}\n"
    )


def _curve(summary: str, request: dict[str, Any]) -> str:
    return f"## {summary}\n\n```json\n{json.dumps(request)}\n```\n"


def main(folder: Path) -> None:
    """All pictures, and the page that shows them."""
    (folder / "examples").mkdir(parents=True, exist_ok=True)
    pictures = {folder / "teapot.png": (TEAPOT, LARGE), folder / "wires.png": (WIRES, MEDIUM)}
    for example in EXAMPLES:
        address = f"/v1/surfaces/{example}/mesh.glb?resolution=24"
        pictures[folder / "examples" / f"{example}.png"] = (address, SMALL)
    with (
        running_service() as service,
        serve_folder(FOLDER) as pages,
        open_browser(chromium()) as browser,
    ):
        stage = open_page(browser)
        open_viewer(stage, pages)
        for target, (address, size) in pictures.items():
            stage.show(service + address, *size)
            if stage.complaints:
                sys.exit("\n".join([address, *stage.complaints]))
            stage.page.screenshot(path=target)
    (folder / "examples.md").write_text(listing(), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
