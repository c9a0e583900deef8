"""Sends damaged and hostile CAD files to the application.

    python -m tools.fuzz.cad_files COUNT FOLDER [FIRST]

FOLDER has files that are right, of any format that the service reads; each of the COUNT files is
one of these, damaged. Hostile files come first. File number k is the same in each run. A finding is
a response with a status of 500 or more, more than 2 s of processor time, or more than 300 MB of
memory, in the service or in the process that reads. The program prints each finding and writes its
file to build/fuzz/cad/. The exit status is 1 if there are findings.
"""

import resource
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

from service.api.app import create_app
from service.decoders.registry import BY_SUFFIX
from service.settings.values import Settings
from tools.client import Client, start_client
from tools.fuzz.cad_mutations import build_hostile, damage
from tools.fuzz.judge import measure_peak
from tools.processes import ROOT

FOLDER = ROOT / "build" / "fuzz" / "cad"
SEED = 20261130
MAX_SECONDS, MAX_MEMORY = 2.0, 300 << 20
MESHED = 0.2
"""The share of files that are not only read, but meshed; a mesh may take longer."""
MESH_SECONDS = 60.0

SETTINGS = Settings(max_vertices=50_000, request_timeout=120, log_level="error")


def measure_seconds() -> float:
    """Processor time of this process and of those that have read files."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def measure_child_peak() -> int:
    """The most bytes that a process which has read a file had."""
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss << 10


def send(client: Client, suffix: str, content: bytes, meshed: bool) -> tuple[str, str]:
    """Sends a file; returns the kind of the response, and its fault or ""."""
    path = "/v1/convert"
    if meshed:
        path = "/v1/mesh?format=glb&relative_tolerance=0.02"
    start, peak, child_peak = measure_seconds(), measure_peak(), measure_child_peak()
    headers = {"Content-Type": BY_SUFFIX[suffix].media_type}
    response = client.request("POST", path, content, headers)
    seconds, growth = measure_seconds() - start, measure_peak() - peak
    # The peak of all processes that have read files: only if it grows, this one has it.
    if measure_child_peak() > child_peak:
        growth = max(growth, measure_child_peak())
    fault = ""
    if response.status_code >= 500:
        fault = f"status {response.status_code}"
    elif seconds > (MESH_SECONDS if meshed else MAX_SECONDS):
        fault = f"{seconds:.1f} s"
    elif growth > MAX_MEMORY:
        fault = f"{growth >> 20} MiB"
    if response.status_code < 300:
        return f"{suffix} {path.partition('?')[0]}", fault
    codes = [error["code"] for error in response.json().get("errors", [])]
    return f"{suffix} {response.status_code} {codes[0] if codes else ''}", fault


def main(count: int, folder: str, first: int = 0) -> bool:
    """Sends all files; returns whether there are no findings."""
    seeds = [
        (path.suffix.lower().removeprefix("."), path.read_bytes())
        for path in sorted(Path(folder).iterdir())
        if path.suffix.lower().removeprefix(".") in BY_SUFFIX
    ]
    kinds: Counter[str] = Counter()
    findings = 0
    FOLDER.mkdir(parents=True, exist_ok=True)

    with start_client(create_app(SETTINGS)) as client:

        def judge(name: str, suffix: str, content: bytes, meshed: bool) -> None:
            nonlocal findings
            kind, fault = send(client, suffix, content, meshed)
            kinds[kind] += 1
            if fault:
                findings += 1
                print(f"FINDING: {name}: {fault}", flush=True)
                (FOLDER / f"{name.replace(' ', '_')}.{suffix}").write_bytes(content)

        for name, content in build_hostile():
            judge(name, "step", content, False)
            judge(name, "igs", content, False)
        for number in range(first, first + count):
            rng = np.random.default_rng([SEED, number])
            suffix, seed = seeds[int(rng.integers(len(seeds)))]
            judge(str(number), suffix, damage(seed, rng), bool(rng.random() < MESHED))
            if (number + 1) % 500 == 0:
                print(f"{number + 1} files", flush=True)
    for kind, number in kinds.most_common():
        print(f"{number:7}  {kind}")
    print(f"{sum(kinds.values())} files, {findings} findings")
    return not findings


if __name__ == "__main__":
    count, folder, *first = sys.argv[1:]
    sys.exit(0 if main(int(count), folder, *map(int, first)) else 1)
