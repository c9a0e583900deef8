"""Draws the picture of the README: `python -m tests.web.picture docs/teapot.png`."""

import sys
from pathlib import Path

from tests.live import running_service
from tests.tools import chromium
from tests.web.browser import viewer

MODEL = "/v1/surfaces/utah-teapot/mesh.glb?resolution=32"


def main(target: Path) -> None:
    """Write what the browser shows of the teapot to `target`, a PNG file."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with running_service() as url, viewer(chromium(), url + MODEL) as (page, complaints):
        if complaints:
            sys.exit("\n".join(complaints))
        page.screenshot(path=target)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
