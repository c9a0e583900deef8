"""Builds the image, runs it, and prints a line for each check: `make image-test`.

Base images of Debian replace the official base images, so no registry of images is needed.
PYTHON_IMAGE and NODE_IMAGE in the environment name other base images, which podman must have on
this machine. The container runs as in production: as uid 10001, with a read-only file system,
without capabilities, with 512 MB. It listens at 127.0.0.1 on the network of this machine.
"""

import json
import os
import re
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

import httpx

from service import __version__
from tools.deploy.containers import CheckFailed, Engine, find_missing
from tools.processes import ROOT, peak_memory, resident_memory

IMAGE = "localhost/surface-service:test"
PORT = int(os.environ.get("IMAGE_TEST_PORT", "8150"))
URL = f"http://127.0.0.1:{PORT}"
USER = 10001
MAX_ADDED_BYTES = 180e6
"""The largest size of the image without its base image; Dask with its packages takes 29e6."""
MAX_START = 2.0
"""The largest CPU time, in seconds, until the first response."""
MEMORY = 512 << 20
"""The memory limit of the container."""
MEMORY_BYTES = "250MB"
"""SURFACE_MEMORY_BYTES of the container: a little less than the default, half of the limit."""

SURFACE = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}

INSIDE_PROGRAM = """
import json, os
def find_error(path):
    try:
        open(path, "w").close()
    except OSError as error:
        return error.strerror
    os.remove(path)
status = dict(line.split(":\\t", 1) for line in open("/proc/self/status").read().splitlines())
print(json.dumps({
    "uid": os.getuid(), "gid": os.getgid(), "groups": os.getgroups(),
    "CapEff": status["CapEff"], "CapBnd": status["CapBnd"],
    "NoNewPrivs": status["NoNewPrivs"], "Seccomp": status["Seccomp"],
    "errors": {path: find_error(path + "/x") for path in ("/", "/app", "/tmp", "/var/tmp", "/run")},
    "data": find_error("/data/x"),
}))
"""


FAULTS: list[str] = []
"""The names of the checks that failed."""


def report_check(name: str, fact: object = "", *, passes: bool = True) -> None:
    """Prints a line about a check, and adds its name to `FAULTS` if it does not pass."""
    print(f"{' ' if passes else '✗'} {name:<44} {fact}", flush=True)
    if not passes:
        FAULTS.append(name)


def check_build(engine: Engine) -> None:
    """Checks that two builds have the same layers, and that the image is small and labelled."""
    bases = {
        f"{kind.upper()}_IMAGE": os.environ.get(f"{kind.upper()}_IMAGE") or engine.build_base(kind)
        for kind in ("python", "node")
    }
    arguments = {**bases, "REVISION": "0" * 40, "SOURCE_DATE_EPOCH": "0"}
    layers = []
    for _ in range(2):
        begin = time.monotonic()
        engine.build(ROOT, IMAGE, arguments)
        report_check("built", f"in {time.monotonic() - begin:.0f} s")
        layers.append(engine.inspect(IMAGE)["RootFS"]["Layers"])
    report_check(
        "two builds have the same layers", layers[0][-1][:19], passes=layers[0] == layers[1]
    )
    image, base = engine.inspect(IMAGE), engine.inspect(bases["PYTHON_IMAGE"])
    added_bytes = image["Size"] - base["Size"]
    fact = f"{added_bytes / 1e6:.0f} MB"
    report_check("added to its base", fact, passes=added_bytes <= MAX_ADDED_BYTES)
    config = image["Config"]
    labels = config["Labels"]
    name = "org.opencontainers.image."
    has_version = (labels[name + "version"], labels[name + "revision"]) == (__version__, "0" * 40)
    report_check(
        "labels", ", ".join(key.removeprefix(name) for key in sorted(labels)), passes=has_version
    )
    report_check("user", config["User"], passes=config["User"] == f"{USER}:{USER}")
    programs = [config["Entrypoint"][0], image["Healthcheck"]["Test"][1]]
    report_check(
        "runs",
        " ".join(config["Entrypoint"] + config["Cmd"]),
        passes=programs == ["/app/bin/surface"] * 2,
    )


@contextmanager
def run_container(engine: Engine, *options: str) -> Iterator[str]:
    """Starts a container as in production; its id, once it responds. Removes it after the block."""
    container = engine.podman(
        "run", "--detach", "--read-only", "--read-only-tmpfs=false", "--cap-drop", "ALL",
        "--security-opt", "no-new-privileges", "--memory", str(MEMORY),
        "--memory-swap", str(MEMORY), "--pids-limit", "64",
        # Podman's default limits are higher than this process may grant.
        "--ulimit", "nofile=1024:1024", "--ulimit", "nproc=1024:1024",
        "--network", "host", "--env", "SURFACE_HOST=127.0.0.1", "--env", f"SURFACE_PORT={PORT}",
        "--env", f"SURFACE_MEMORY_BYTES={MEMORY_BYTES}", "--volume", "surfaces:/data",
        *options, IMAGE,
    ).strip()  # fmt: skip
    try:
        _wait_until_ready(engine, container)
        yield container
    finally:
        engine.podman("stop", "--time", "60", container)
        engine.podman("rm", "--force", container)


def _wait_until_ready(engine: Engine, container: str) -> None:
    """Waits until the service is ready; raises `CheckFailed` after about 30 s."""
    for _ in range(1500):
        with suppress(httpx.TransportError):
            if httpx.get(f"{URL}/health/ready", trust_env=False).status_code == 200:
                return
        time.sleep(0.02)
    raise CheckFailed(f"no response\n{engine.logs(container)}")


def check_start(engine: Engine) -> None:
    """Checks the time from the start to the first response, with a cold disk and five times warm.

    The limit applies to the CPU time, because it does not depend on other programs of the machine.
    """
    times, cpu_times = [], []
    for number in range(6):
        if number == 0:
            os.sync()
            Path("/proc/sys/vm/drop_caches").write_text("3", encoding="ascii")
        with run_container(engine) as container:
            now = time.time()
            state = engine.state(container)
            times.append(now - datetime.fromisoformat(state["StartedAt"]).timestamp())
            ticks = Path(f"/proc/{state['Pid']}/stat").read_text("ascii").rpartition(")")[2].split()
            # The times in user mode and in kernel mode: fields 14 and 15 of proc_pid_stat(5).
            cpu_times.append((int(ticks[11]) + int(ticks[12])) / os.sysconf("SC_CLK_TCK"))
    report_check("first response, from a cold disk", f"after {times[0]:.2f} s")
    min_time, min_cpu_time = min(times[1:]), min(cpu_times[1:])
    fact = f"after {min_time:.2f} s, {min_cpu_time:.2f} s of CPU time"
    report_check("first response, later", fact, passes=min_cpu_time < MAX_START)


def check_confinement(engine: Engine, container: str) -> None:
    """Checks the user and the privileges of the container, its health check and its log."""
    facts = json.loads(engine.podman("exec", container, "/app/bin/python", "-c", INSIDE_PROGRAM))
    report_check(
        "uid, gid", (facts["uid"], facts["gid"]), passes=facts["uid"] == facts["gid"] == USER
    )
    has_no_capabilities = int(facts["CapEff"], 16) == int(facts["CapBnd"], 16) == 0
    report_check("capabilities", facts["CapBnd"], passes=has_no_capabilities)
    is_restricted = (facts["NoNewPrivs"], facts["Seccomp"]) == ("1", "2")
    report_check("no new privileges, system calls filtered", is_restricted, passes=is_restricted)
    errors = facts["errors"]
    report_check("cannot write", ", ".join(errors), passes=all(errors.values()))
    report_check("can write", "/data", passes=facts["data"] is None)
    begin = time.monotonic()
    for flags in ([], ["--live"]):
        engine.podman("exec", container, "/app/bin/surface", "health", *flags)
    report_check("surface health, twice, through podman", f"{time.monotonic() - begin:.2f} s")
    engine.podman("healthcheck", "run", container)
    report_check("health check of the image", "healthy")
    lines = engine.logs(container).splitlines()
    invalid_lines = [line for line in lines if not (line.startswith("{") and line.endswith("}"))]
    report_check(
        "log lines, each is JSON",
        invalid_lines or len(lines),
        passes=bool(lines) and not invalid_lines,
    )


def check_responses(client: httpx.Client) -> str:
    """Checks pages, scripts, a mesh and a measure; stores a surface, and returns its URL."""
    for path in ("/", "/docs", "/openapi.json", "/v1/surfaces", "/metrics"):
        status = client.get(path).status_code
        report_check(f"GET {path}", status, passes=status == 200)
    pages = client.get("/").text + client.get("/docs").text
    files = set(re.findall(r'"(?:\./)?((?:page|docs)/[\w./-]+)"', pages))
    sizes = {path: len(client.get(f"/{path}").raise_for_status().content) for path in files}
    large_files = sum(size > 500_000 for size in sizes.values())
    fact = f"{len(sizes)}, {sum(sizes.values()) / 1e6:.1f} MB, three.js and Swagger UI among them"
    report_check("files of the pages", fact, passes=large_files == 2 and all(sizes.values()))
    mesh = client.get("/v1/surfaces/utah-teapot/mesh.glb?resolution=16").content
    report_check("the teapot", f"{len(mesh)} bytes", passes=mesh[:4] == b"glTF")
    status = client.post("/v1/measure", json={"surface": SURFACE}).status_code
    report_check("a surface is measured", status, passes=status == 200)
    response = client.post("/v1/surfaces", json={"surface": SURFACE})
    status = response.status_code
    report_check("a surface is stored", status, passes=status in (200, 201))
    return str(response.headers["location"])


def find_largest(client: httpx.Client, suffix: str) -> int:
    """The largest resolution of one patch that the service accepts."""
    low, high = 1, 1 << 13
    while high - low > 1:
        middle = (low + high) // 2
        body = {"surface": SURFACE, "resolution": middle}
        response = client.post(f"/v1/estimate?format={suffix}", json=body).json()
        low, high = (middle, high) if response["accepted"] else (low, middle)
    return low


def check_large(engine: Engine, container: str) -> None:
    """Checks that the service stays within the memory with many of the largest requests at once."""
    pid = engine.state(container)["Pid"]
    report_check("resident before", f"{resident_memory(pid) >> 20} MiB")
    with httpx.Client(base_url=URL, trust_env=False, timeout=120) as client:
        sizes = {suffix: find_largest(client, suffix) for suffix in ("glb", "json", "stl", "obj")}
    report_check("largest resolutions of one patch", sizes)
    net = [[[i, j, i * j % 7] for j in range(100)] for i in range(100)]
    spline = {"type": "bspline", "control_net": net, "degree": [3, 3], "knots": "clamped"}
    large_body = json.dumps({"surface": spline, "resolution": 1}).encode()

    def send_request(number: int) -> int | str:
        """Requests a large mesh that no other request is for, or sends many control points."""
        suffix = list(sizes)[number % len(sizes)]
        large_mesh = json.dumps({"surface": SURFACE, "resolution": sizes[suffix] - number}).encode()
        url = f"{URL}/v1/mesh?format={suffix}"
        headers = {"Content-Type": "application/json"}
        content = large_body if number % 5 == 4 else large_mesh
        try:
            response = httpx.post(
                url, content=content, headers=headers, timeout=120, trust_env=False
            )
            return response.status_code
        except httpx.TransportError as error:
            return type(error).__name__

    with ThreadPoolExecutor(12) as pool:
        statuses = Counter(pool.map(send_request, range(40)))
    is_expected = statuses.keys() <= {200, 429, 503} and statuses[200] > 0
    report_check("40 large requests, 12 at a time", dict(statuses), passes=is_expected)
    peak = peak_memory(pid)
    fact = f"{peak >> 20} of {MEMORY >> 20} MiB, SURFACE_MEMORY_BYTES={MEMORY_BYTES}"
    report_check("resident at most", fact, passes=peak < 0.9 * MEMORY)
    engine.podman("exec", container, "/app/bin/surface", "health")
    report_check("still ready")


def check_stop(engine: Engine, container: str) -> None:
    """Checks that SIGTERM ends the container with exit code 0."""
    begin = time.monotonic()
    engine.podman("stop", "--time", "60", container)
    state = engine.state(container)
    fact = f"exit code {state['ExitCode']} after {time.monotonic() - begin:.1f} s"
    report_check("SIGTERM", fact, passes=state["ExitCode"] == 0 and not state["OOMKilled"])


def run_checks(engine: Engine) -> None:
    """Runs all checks."""
    check_build(engine)
    engine.podman("volume", "rm", "--force", "surfaces")
    check_start(engine)
    with (
        run_container(engine) as container,
        httpx.Client(base_url=URL, trust_env=False, timeout=30) as client,
    ):
        check_confinement(engine, container)
        url = check_responses(client)
        check_large(engine, container)
        check_stop(engine, container)
    with run_container(engine) as container:
        status = httpx.get(URL + url, trust_env=False).status_code
        report_check("the stored surface, in a new container", status, passes=status == 200)
        check_stop(engine, container)


def main() -> int:
    """Runs all checks; returns 0 if they pass, 1 if not, 2 if this machine cannot build images."""
    if missing := find_missing():
        print(f"The image cannot be built here: {missing}.", file=sys.stderr)
        return 2
    try:
        run_checks(Engine(ROOT / "build" / "image"))
    except CheckFailed as error:
        print(error, file=sys.stderr)
        return 1
    return 1 if FAULTS else 0


if __name__ == "__main__":
    sys.exit(main())
