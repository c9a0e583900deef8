"""The editor over a slow network: requests, bytes, and the time until its first picture.

Chromium delays and limits connections as its developer tools do with "Slow 4G": 1.44 Mbit/s to the
browser, 0.675 Mbit/s from it, and 562.5 ms before each response. The first load has an empty cache,
the reload the cache of the first. A page is ready when its first mesh is drawn; WebGL fills no
pixels, as this would take most of the time without a graphics card. A drag update is a mesh while a
control point of the teapot follows the mouse. Bytes are those of the network, with heads.

    python -m tools.benchmarks.page [--against DIRECTORY] [--rounds 3]

DIRECTORY is another checkout of the service with a `.venv` of its own, and with its built scripts
(`make web`); the rounds of both alternate. The table has the least of all rounds, because other
programs of the machine delay some of them. The exit status is 1 if a number of this checkout
exceeds its limit.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from playwright.sync_api import Browser, CDPSession, Page, sync_playwright

from tools.benchmarks.requests import SERVICE, start_uvicorn
from tools.browser import CHROMIUM_FLAGS, WITHOUT_PIXELS
from tools.editor import READY, WINDOW, select_point
from tools.processes import ROOT
from tools.programs import find_chromium

SLOW_4G = {
    "offline": False,
    "downloadThroughput": 1.6e6 / 8 * 0.9,
    "uploadThroughput": 750e3 / 8 * 0.9,
    "latency": 150 * 3.75,
}
"""The preset of Chromium's developer tools: bytes a second, and milliseconds."""


class Figures(NamedTuple):
    """The figures of one round; of the reload, only what was not cached counts."""

    requests: float
    kilobytes: float
    ready_s: float
    reload_requests: float
    reload_kilobytes: float
    reload_s: float
    drag_kilobytes: float


LIMITS = Figures(12, 300, 6, 12, 300, 3, 60)
LABELS = ("requests", "kB", "ready, s", "reload: requests", "kB", "ready, s", "drag update, kB")


@dataclass
class Wire:
    """The requests of a page that reached the network, and the bytes of their responses."""

    session: CDPSession
    urls: dict[str, str] = field(default_factory=dict)
    sizes: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.session.send("Network.enable")
        self.session.on("Network.requestWillBeSent", self._begin)
        self.session.on("Network.requestServedFromCache", self._drop)
        self.session.on("Network.responseReceived", self._drop_cached)
        self.session.on("Network.loadingFinished", self._end)

    def clear(self) -> None:
        self.urls.clear()
        self.sizes.clear()

    def total(self) -> tuple[int, float]:
        """The number of requests, and the thousands of bytes of their responses."""
        return len(self.urls), sum(self.sizes.get(each, 0) for each in self.urls) / 1000

    def _begin(self, event: dict[str, Any]) -> None:
        if event["request"]["url"].startswith("http"):
            self.urls[event["requestId"]] = event["request"]["url"]

    def _drop(self, event: dict[str, Any]) -> None:
        self.urls.pop(event["requestId"], None)

    def _drop_cached(self, event: dict[str, Any]) -> None:
        if event["response"].get("fromDiskCache"):
            self._drop(event)

    def _end(self, event: dict[str, Any]) -> None:
        self.sizes[event["requestId"]] = event["encodedDataLength"]


def measure(browser: Browser, url: str) -> Figures:
    """Loads the editor with an empty cache, reloads it, and drags a control point."""
    context = browser.new_context(viewport=WINDOW, reduced_motion="reduce")
    page = context.new_page()
    page.set_default_timeout(120_000)
    page.add_init_script(WITHOUT_PIXELS)
    session = context.new_cdp_session(page)
    wire = Wire(session)
    session.send("Network.emulateNetworkConditions", SLOW_4G)
    first = _time_load(page, lambda: page.goto(url), wire)
    wire.clear()
    again = _time_load(page, page.reload, wire)
    session.send("Network.emulateNetworkConditions", {**SLOW_4G, "latency": 0} | _FAST)
    sizes = _measure_drag(page, wire)
    context.close()
    return Figures(*first, *again, sizes)


_FAST = {"downloadThroughput": -1, "uploadThroughput": -1}


def _time_load(page: Page, act: Any, wire: Wire) -> tuple[int, float, float]:
    """Requests, kilobytes and seconds until the page is ready."""
    start = time.perf_counter()
    act()
    page.wait_for_selector(READY)
    seconds = time.perf_counter() - start
    return *wire.total(), seconds


def _measure_drag(page: Page, wire: Wire) -> float:
    """The median of the kilobytes of the meshes of a drag."""
    start = select_point(page, 1)
    wire.clear()
    page.mouse.move(*start)
    page.mouse.down()
    for step in range(1, 6):
        page.mouse.move(start[0] + 3 * step, start[1] - 3 * step)
        page.wait_for_selector(READY)
    meshes = [key for key, url in wire.urls.items() if "/v1/mesh" in url]
    sizes = [wire.sizes[key] for key in meshes if key in wire.sizes]
    page.mouse.up()
    return median(sizes) / 1000


def run(against: Path | None = None, rounds: int = 3) -> bool:
    """Prints the table; whether the numbers of this checkout are within `LIMITS`."""
    checkouts = [each for each in (against, ROOT) if each is not None]
    flags = [flag for flag in CHROMIUM_FLAGS if "no-opt" not in flag]
    figures: dict[Path, list[Figures]] = {checkout: [] for checkout in checkouts}
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "empty"
        folder.mkdir()
        servers = {
            checkout: stack.enter_context(start_uvicorn(SERVICE, folder, checkout))
            for checkout in checkouts
        }
        playwright = stack.enter_context(sync_playwright())
        browser = stack.enter_context(
            playwright.chromium.launch(executable_path=find_chromium(), args=flags)
        )
        for _ in range(rounds):
            for checkout, server in servers.items():
                figures[checkout].append(measure(browser, f"{server.url}/"))
    print("| checkout |", " | ".join(LABELS), "|")
    print("| --- |", " | ".join("---:" for _ in LABELS), "|")
    for checkout in checkouts:
        name = "this one" if checkout == ROOT else checkout.name
        print(f"| {name} |", _format(_find_least(figures[checkout])))
    print("| at most |", _format(LIMITS))
    least = _find_least(figures[ROOT])
    return all(value <= limit for value, limit in zip(least, LIMITS, strict=True))


def _find_least(rounds: Sequence[Figures]) -> Figures:
    return Figures(*(min(column) for column in zip(*rounds, strict=True)))


def _format(figures: Figures) -> str:
    return " | ".join(f"{value:.3g}" for value in figures) + " |"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--against", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    against = arguments.against
    return 0 if run(against and against.resolve(), arguments.rounds) else 1


if __name__ == "__main__":
    sys.exit(main())
