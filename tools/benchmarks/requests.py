"""Requests per second of the service, compared with an echo of the same bytes and a plain service.

Each server is one process of uvicorn with BLAS on one thread. The echo reads the body, and sends
the response of the service from a file. So the ratio of both rates is the share of the time that
FastAPI and uvicorn need; it is above 1 for cached responses, which do not pass FastAPI. `plain` is
a plain service (`tools/benchmarks/plain.py`), which has no meshes by tolerance. The program `wrk`
sends requests to the servers alternately, on four connections of one thread; ratios are medians
over the rounds.

    python -m tools.benchmarks.requests [--against DIRECTORY] [--keep] [--seconds 2] [--rounds 5]
        [WORK …]

DIRECTORY is another checkout of the service with a `.venv` of its own. The table then also has its
requests per second, and the ratio of the rate of this checkout to that rate. The columns `kept`
have the ratios in `requests.json`; with `--keep` the program writes the new ratios to this file.
"""

import argparse
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from math import nan
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import httpx
from fastapi import FastAPI, Request, Response

from tools.processes import ROOT, Server, free_port, service_environment

CONNECTIONS = 4
FOLDER_VARIABLE = "ECHO_FOLDER"
"""The environment variable that names the folder of the responses of the echo."""

MIN_RATIOS = {"hit.glb": 1.5, "unchanged.glb": 2.0}
"""For responses from the cache, the ratio to the echo below which the exit status is 1."""

BASELINE = Path(__file__).with_name("requests.json")
UNCOMPRESSED = {"Accept-Encoding": "identity"}
SERVICE, ECHO = "service.api.app:create_app", "tools.benchmarks.requests:create_echo"
PLAIN = "tools.benchmarks.plain:create"


class Work(NamedTuple):
    """A request: a POST of a document, or a GET, with the entity tag `tag` if it is not empty."""

    name: str
    target: str
    document: Mapping[str, Any] | None = None
    tag: str = ""

    def send(self, server: Server) -> httpx.Response:
        """Sends the request once; returns the response."""
        method, url = "GET" if self.document is None else "POST", server.url + self.target
        response = httpx.request(method, url, json=self.document, headers=UNCOMPRESSED, timeout=60)
        return response.raise_for_status()

    def write_script(self, folder: Path) -> Path:
        """Writes the Lua script with which `wrk` sends the request; returns its path."""
        headers = UNCOMPRESSED | ({"If-None-Match": self.tag} if self.tag else {})
        lines = [f"wrk.headers[{name!r}] = {value!r}" for name, value in headers.items()]
        if self.document is not None:
            lines += ['wrk.method = "POST"', 'wrk.headers["Content-Type"] = "application/json"']
            lines += [f"wrk.body = [=[{json.dumps(self.document)}]=]"]
        file = folder / f"{self.name}.lua"
        file.write_text("\n".join(lines))
        return file


def list_works(service: Server) -> list[Work]:
    """The measured requests; the heights of the nets are the same in every run.

    A name has the number of patches, and the resolution or the relative tolerance: `one16.glb` is 1
    patch at resolution 16, `bspline27x8.glb` 27 × 27 patches at resolution 8.
    """
    random_heights = random.Random(3)

    def build_net(side: int) -> list[list[list[float]]]:
        return [[[i, j, random_heights.random()] for j in range(side)] for i in range(side)]

    def build_work(name: str, surface: Mapping[str, Any], **options: float) -> Work:
        target = f"/v1/mesh?format={name.rpartition('.')[2]}"
        return Work(name, target, {"surface": surface, **options})

    patch = {"control_net": build_net(4)}
    spline = {"type": "bspline", "degree": 3, "knots": "clamped", "control_net": build_net(30)}
    teapot = httpx.get(f"{service.url}/v1/surfaces/utah-teapot").json()["surface"]
    hit = Work("hit.glb", "/v1/surfaces/saddle/mesh.glb?resolution=16")
    tag = hit.send(service).headers["etag"]
    return [
        build_work("one16.glb", patch, resolution=16),
        build_work("one16.json", patch, resolution=16),
        build_work("teapot16.glb", teapot, resolution=16),
        build_work("teapot16.json", teapot, resolution=16),
        build_work("teapot1e-3.glb", teapot, relative_tolerance=1e-3),
        build_work("one1e-2.glb", patch, relative_tolerance=1e-2),
        build_work("bspline27x8.glb", spline, resolution=8),
        build_work("one512.glb", patch, resolution=512),
        hit,
        Work("unchanged.glb", hit.target, tag=tag),
    ]


def create_echo() -> FastAPI:
    """An application that reads the body and responds with the bytes of a file."""
    responses = {
        file.name: file.read_bytes() for file in Path(os.environ[FOLDER_VARIABLE]).iterdir()
    }
    app = FastAPI(openapi_url=None)

    @app.api_route("/{name}", methods=["GET", "POST"])
    async def echo(name: str, request: Request) -> Response:
        await request.body()
        return Response(responses[name], media_type="model/gltf-binary")

    return app


def start_uvicorn(app: str, responses: Path, checkout: Path = ROOT) -> Server:
    """Starts uvicorn with an application of a checkout; `responses` is the folder of the echo."""
    python = sys.executable if checkout == ROOT else checkout / ".venv" / "bin" / "python"
    port = free_port()
    options = ("--factory", "--port", str(port), "--no-access-log", "--log-level", "warning")
    environment = service_environment(
        {"OPENBLAS_NUM_THREADS": "1", FOLDER_VARIABLE: str(responses)}
    )
    command = (python, "-m", "uvicorn", app, *options)
    return Server(responses.parent / f"{port}.log", command, port, environment, folder=checkout)


def measure_rate(url: str, script: Path, seconds: int, connections: int = CONNECTIONS) -> float:
    """Requests per second that `wrk` measures.

    Raises
    ------
    RuntimeError
        A response is an error, or a connection failed.
    """
    options = ("-t1", f"-c{connections}", f"-d{seconds}s", "--timeout=30s", "-s", str(script))
    output = subprocess.run(
        ("wrk", *options, url), capture_output=True, text=True, check=True
    ).stdout
    if match := re.search(r"(Non-2xx|Socket errors).*", output):
        raise RuntimeError(f"{url}: {match[0]}")
    return float(re.findall(r"Requests/sec:\s+([\d.]+)", output)[0])


def run(arguments: Sequence[str] = ()) -> bool:
    """Prints the table; returns whether no ratio is below `MIN_RATIOS`."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--against", type=Path, metavar="DIRECTORY")
    parser.add_argument("--keep", action="store_true", help="keep the ratios as the baseline")
    parser.add_argument("--seconds", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("names", nargs="*", metavar="WORK", help="as in the table (all)")
    options = parser.parse_args(arguments)
    if not shutil.which("wrk"):
        print("Requests a second: not measured, wrk is not installed (Debian's package wrk)")
        return True
    print(f"Requests a second, {CONNECTIONS} connections; medians of alternating rounds")
    header = f"{'work':18}{'bytes':>10}{'service/s':>11}{'echo/s':>10}{'ratio':>8}{'kept':>8}"
    header += f"{'plain/s':>10}{'ratio':>8}{'kept':>8}"
    print(header + (f"{'old/s':>10}{'new/old':>9}" if options.against else ""))
    too_slow, baseline, ratios = [], json.loads(BASELINE.read_text()), {}
    with tempfile.TemporaryDirectory() as temporary, ExitStack() as stack:
        responses = Path(temporary) / "answers"
        responses.mkdir()
        service = stack.enter_context(start_uvicorn(SERVICE, responses))
        works = [
            work for work in list_works(service) if not options.names or work.name in options.names
        ]
        for work in works:
            (responses / work.name).write_bytes(work.send(service).content)
        echo, plain = (stack.enter_context(start_uvicorn(app, responses)) for app in (ECHO, PLAIN))
        old_service = None
        if options.against:
            old_service = stack.enter_context(
                start_uvicorn(SERVICE, responses, options.against.absolute())
            )
        for work in works:
            script = work.write_script(Path(temporary))
            urls = {"service": service.url + work.target, "echo": f"{echo.url}/{work.name}"}
            if "resolution" in (work.document or {}):
                urls["plain"] = f"{plain.url}/mesh.{work.name.rpartition('.')[2]}"
            if old_service is not None:
                urls["old"] = old_service.url + work.target
            rates = [
                {name: measure_rate(url, script, options.seconds) for name, url in urls.items()}
                for _ in range(options.rounds)
            ]
            median_rates = {name: median(row[name] for row in rates) for name in urls}
            ratio_of = {
                name: median(row["service"] / (row[name] or nan) for row in rates) for name in urls
            }
            if ratio_of["echo"] < MIN_RATIOS.get(work.name, 0):
                too_slow.append(f"{work.name}: the ratio must be {MIN_RATIOS[work.name]}")
            size = (responses / work.name).stat().st_size
            line = f"{work.name:18}{size:10}{median_rates['service']:11.1f}"
            for name, key in (("echo", work.name), ("plain", f"{work.name} / plain")):
                if name in urls:
                    ratios[key] = round(ratio_of[name], 3)
                    line += f"{median_rates[name]:10.1f}{ratio_of[name]:8.3f}"
                    line += f"{baseline.get(key, 0):8.3f}"
                else:
                    line += " " * 26
            print(
                line
                + (f"{median_rates['old']:10.1f}{ratio_of['old']:9.2f}" if old_service else ""),
                flush=True,
            )
    if options.keep:
        BASELINE.write_text(json.dumps(baseline | ratios, indent=1) + "\n")
    for line in too_slow:
        print(line)
    return not too_slow


if __name__ == "__main__":
    sys.exit(not run(sys.argv[1:]))
