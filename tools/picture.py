"""Draws the pictures of the documentation, and writes the page of examples, which shows them.

`python -m tools.picture docs` writes `editor.png`, `part.png`, `curvature.png`, `wires.png`,
`adaptive.png`, `examples/<id>.png`, `curves/<name>.png` and `examples.md` in the folder `docs`.
Further arguments are the names of the only pictures to draw: `python -m tools.picture docs gear`.
"""

import json
import sys
from base64 import b64encode
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, TypeAlias

from playwright.sync_api import Browser

from service.api.openapi.parameters import REQUESTS
from service.encoders.polylines.registry import CURVES_BY_NAME
from service.engine.options import OverlayName
from service.engine.pictures.options import PictureOptions, Viewpoint
from service.pipeline.picture import plan_picture
from service.pipeline.polylines import plan_curve
from service.schemas.curves import CurveRequest
from service.schemas.validation import validate_document
from service.surface.examples.catalogue import EXAMPLES, Example, find
from tools.browser import (
    FOLDER,
    open_browser,
    open_page,
    open_viewer,
    record_page,
    serve_folder,
)
from tools.editor import select_point, show
from tools.examples import PARTS
from tools.live import run_service
from tools.programs import find_chromium

WIRES = (
    "/v1/surfaces/utah-teapot/mesh.glb?resolution=12&faces=none&isocurves=4&wires=tubes"
    "&wire_width=0.03"
)
ADAPTIVE = "/v1/surfaces/utah-teapot/mesh.glb?relative_tolerance=0.001"
EDITOR = "/?surface=utah-teapot"
SPOUT_TIP = 200
"""The number of a control point at the tip of the spout of the teapot."""
PART = "/?surface=impeller"
ON_HUB = (430, 420)
"""The pixel at which the picture of a part shows a click."""
CURVATURE = "/?surface=nurbs-goblet&relative_tolerance=0.001&look=gaussian"

Scheme: TypeAlias = Literal["light", "dark"]

# Widths and heights of pictures, in pixels.
LARGE = (1200, 800)
MEDIUM = (900, 600)
SMALL = (400, 300)

HEAD = """\
# The built-in surfaces

Each of these surfaces has its meshes at `/v1/surfaces/{id}/mesh.{suffix}`, and its
[picture](pictures.md) at `/v1/surfaces/{id}/image.png`, with any option in the query.
`/v1/surfaces/{id}` returns its definition, from which you can start. The service has drawn the
pictures of surfaces on this page itself; `make picture` draws them again.
"""


CURVES = """\
# Examples of curves

Curves have no URLs. Send these bodies to `POST /v1/curve`, or save them as files for
`surface curve`. The OpenAPI document has the same examples under the same names.
"""


CURVE_EXAMPLES = {
    name: example
    for name, example in REQUESTS["createCurve"].items()
    if "parameters" not in example["value"]
}
"""The examples of curves that are lines; those with parameters have no picture."""


def write_examples_page() -> str:
    """The text of docs/examples.md."""
    curves = [_write_curve(name, example) for name, example in CURVE_EXAMPLES.items()]
    return "\n".join([HEAD, *map(_write_entry, EXAMPLES.values()), CURVES, *curves])


def _write_entry(example: Example) -> str:
    return (
        f"## {example.title}: `{example.id}`\n\n"
        f"![{example.title}](examples/{example.id}.png)\n\n{example.description}\n"
    )


def _write_curve(name: str, example: dict[str, Any]) -> str:
    title = example["summary"]
    return (
        f"## {title}: `{name}`\n\n![{title}](curves/{name}.png)\n\n"
        f"```json\n{json.dumps(example['value'])}\n```\n"
    )


def _build_curve_url(document: dict[str, Any]) -> str:
    """A `data:` URL with the glTF file of a curve."""
    request = validate_document(CurveRequest, document)
    glb = CURVES_BY_NAME["glb"]
    content = plan_curve(request.to_curve(), request.curve_options(), glb).run()
    return f"data:{glb.media_type};base64,{b64encode(content).decode()}"


def draw_example(name: str) -> bytes:
    """The picture of a built-in surface, by the service; of a part with its edges."""
    edges: tuple[OverlayName, ...] = ("boundary",) if name in PARTS else ()
    options = PictureOptions(Viewpoint(*SMALL), overlays=edges)
    return plan_picture(find(name).surface(), options).run()


def draw_editor(
    browser: Browser,
    url: str,
    scheme: Scheme,
    target: Path,
    *,
    point: int = 0,
    click: tuple[int, int] | None = None,
) -> None:
    """Writes a screenshot of the editor at a URL, in a light or dark colour scheme.

    Control point `point` is selected; if `point` is 0, no control point is selected. `click` is the
    pixel of a click on the surface. Errors in the console of the page end the program.
    """
    context = browser.new_context(
        viewport={"width": 1280, "height": 800}, device_scale_factor=1.25, color_scheme=scheme
    )
    stage = record_page(context.new_page())
    show(stage.page, url)
    if point:
        select_point(stage.page, point)
    if click is not None:
        stage.page.mouse.click(*click)
        stage.page.wait_for_selector("#probe-row:visible", timeout=120_000)
        stage.page.mouse.move(0, 0)
    stage.page.evaluate("document.activeElement.blur()")
    stage.page.screenshot(path=target)
    context.close()
    if stage.messages:
        sys.exit("\n".join(stage.messages))


def main(folder: Path, chosen: Sequence[str] = ()) -> None:
    """Writes the pictures and the page `examples.md`; messages of the browser end the program.

    `chosen` are the names of pictures, without their suffixes; without names, all are drawn.
    """
    for name in ("examples", "curves"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    pictures = {folder / "wires.png": (WIRES, MEDIUM), folder / "adaptive.png": (ADAPTIVE, LARGE)}
    pictures_with_edges = {folder / "adaptive.png"}
    for example in EXAMPLES:
        if not chosen or example in chosen:
            (folder / "examples" / f"{example}.png").write_bytes(draw_example(example))
    for name, request in CURVE_EXAMPLES.items():
        url = _build_curve_url({"curve": request["value"]["curve"], "resolution": 32})
        pictures[folder / "curves" / f"{name}.png"] = (url, SMALL)
    with (
        run_service() as service,
        serve_folder(FOLDER) as viewer_url,  # tests/web, with the page of the viewer
        open_browser(find_chromium()) as browser,
    ):
        if not chosen or "editor" in chosen:
            draw_editor(browser, service + EDITOR, "light", folder / "editor.png", point=SPOUT_TIP)
        if not chosen or "part" in chosen:
            draw_editor(browser, service + PART, "light", folder / "part.png", click=ON_HUB)
        if not chosen or "curvature" in chosen:
            draw_editor(browser, service + CURVATURE, "dark", folder / "curvature.png")
        stage = open_page(browser)
        open_viewer(stage, viewer_url)
        for target, (url, size) in pictures.items():
            if chosen and target.stem not in chosen:
                continue
            stage.show(url if url.startswith("data:") else service + url, *size)
            if stage.messages:
                sys.exit("\n".join([url, *stage.messages]))
            if target in pictures_with_edges:
                stage.draw_edges()
            stage.page.screenshot(path=target)
    (folder / "examples.md").write_text(write_examples_page(), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
