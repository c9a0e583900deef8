"""How many more requests two workers serve than one: `surface serve --workers 2`.

`wrk` sends the same request to a service with one worker and to a service with two, alternately, on
16 connections; responses are not cached. Two workers can use two processors, but `wrk` takes a part
of them, which a client on another machine would leave to them. So the time of the client is not
counted: the rate of two workers is that of two processors' time without what `wrk` and other
programs took. One worker computes one request at a time, and `wrk` runs on the other processor:
its rate is counted as it is, and that is too high rather than too low a rate to compare with,
unless other programs took its processor. So rounds with such programs do not count.

    python -m tools.benchmarks.workers [--seconds 2] [--rounds 5] [--connections 16] [WORK …]
"""

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from typing import NamedTuple

from tools.benchmarks.requests import Work, list_works, measure_rate
from tools.processes import PATIENCE, Server, service_server

WORKS = ("teapot1e-3.glb", "one16.glb", "net17.glb")
"""The teapot at a relative tolerance of 1e-3; and two patches with 17 × 17 vertices, the second
also with 17 × 17 control points."""

MIN_RATIO = 1.8
"""The ratio of the rates below which the exit status is 1."""

MAX_OTHERS = 0.1
"""Processors that other programs may take in a round that counts."""

PROCESSORS = 2
"""Processors that the measurement may use: one for each of two workers."""

SETTINGS = {"SURFACE_CACHE_BYTES": "0", "SURFACE_ACCESS_LOG": "false"}


class Round(NamedTuple):
    """One run of `wrk`: requests a second; and the processors that the service, `wrk` and other
    programs took, on average."""

    rate: float
    service: float
    client: float
    others: float


def start_service(folder: Path, workers: int) -> Server:
    """A service with this number of workers, all of which serve."""
    settings = SETTINGS | {
        "SURFACE_WORKERS": str(workers),
        "SURFACE_STORE": str(folder / f"store-{workers}"),
    }
    server = service_server(folder, settings, probe="/health/ready")
    server.start()
    server.wait_until_ready()
    end = time.monotonic() + PATIENCE
    text = "Application startup complete"
    while server.log.read_text(encoding="utf-8").count(text) < workers:
        if time.monotonic() > end:
            raise RuntimeError(f"the workers do not start; see {server.log}")
        time.sleep(0.05)
    return server


def measure_round(server: Server, url: str, script: Path, seconds: int, connections: int) -> Round:
    """Sends requests for some seconds, and counts the processor time of all programs meanwhile."""
    pids = [server.pid, *server.worker_pids()]
    start = time.monotonic()
    services, clients, busy = read_processes(pids), read_children(), read_busy()
    rate = measure_rate(url, script, seconds, connections)
    wall = time.monotonic() - start
    service = (read_processes(pids) - services) / wall
    client = (read_children() - clients) / wall
    return Round(rate, service, client, (read_busy() - busy) / wall - service - client)


def read_processes(pids: Sequence[int]) -> float:
    """Seconds of processor time that processes have taken (proc_pid_stat(5))."""
    fields = (Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split() for pid in pids)
    return sum(int(each[11]) + int(each[12]) for each in fields) / os.sysconf("SC_CLK_TCK")


def read_children() -> float:
    """Seconds of processor time that ended children of this process took: runs of `wrk`."""
    times = os.times()
    return times.children_user + times.children_system


def read_busy() -> float:
    """Seconds for which processors of this machine have not been idle (proc_stat(5))."""
    user, nice, system, _, _, *interrupts = Path("/proc/stat").read_text().split()[1:9]
    ticks = sum(map(int, (user, nice, system, *interrupts)))
    return ticks / os.sysconf("SC_CLK_TCK")


def compare(one: Round, two: Round) -> float:
    """How many times as many requests two workers serve in their share of two processors."""
    available = PROCESSORS - two.client - two.others
    return two.rate * PROCESSORS / available / one.rate


def build_net_work() -> Work:
    """A patch of 17 × 17 control points at resolution 16."""
    net = [[[i, j, (i * j) % 5 / 4] for j in range(17)] for i in range(17)]
    document = {"surface": {"control_net": net}, "resolution": 16}
    return Work("net17.glb", "/v1/mesh?format=glb", document)


def run(arguments: Sequence[str] = ()) -> bool:
    """Prints the table; returns whether no ratio is below `MIN_RATIO`."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seconds", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--connections", type=int, default=16)
    parser.add_argument("names", nargs="*", metavar="WORK", help="as in the table (all)")
    options = parser.parse_args(arguments)
    if not shutil.which("wrk") or sys.platform != "linux":
        print("Workers: not measured; this needs Linux and wrk (Debian's package wrk)")
        return True
    print(f"Requests a second of two workers and of one, {options.connections} connections")
    print(
        f"{'work':16}{'one/s':>9}{'two/s':>9}{'as sent':>9}{'ratio':>7}{'ms/one':>8}{'ms/two':>8}"
        f"{'client':>8}{'others':>8}{'others':>8}{'rounds':>8}"
    )
    is_fast = True
    with tempfile.TemporaryDirectory() as temporary, ExitStack() as stack:
        folder = Path(temporary)
        servers = []
        for count in (1, 2):
            servers.append(start_service(folder, count))
            stack.callback(servers[-1].stop)
        works = {work.name: work for work in (*list_works(servers[0]), build_net_work())}
        for name in options.names or WORKS:
            work = works[name]
            script = work.write_script(folder)
            pairs: list[list[Round]] = []
            for number in range(options.rounds + 1):
                pair = [
                    measure_round(
                        server,
                        server.url + work.target,
                        script,
                        options.seconds,
                        options.connections,
                    )
                    for server in servers
                ]
                if number:  # the first round fills caches of bases and plans
                    pairs.append(pair)
            quiet_pairs = [pair for pair in pairs if max(r.others for r in pair) <= MAX_OTHERS]
            counted = quiet_pairs or pairs
            one, two = (
                Round(*(median(pair[side][k] for pair in counted) for k in range(4)))
                for side in (0, 1)
            )
            ratio = median(compare(*pair) for pair in counted)
            as_sent = median(pair[1].rate / pair[0].rate for pair in counted)
            costs = [1000 * each.service / each.rate for each in (one, two)]
            print(
                f"{name:16}{one.rate:9.1f}{two.rate:9.1f}{as_sent:9.2f}{ratio:7.2f}"
                f"{costs[0]:8.2f}{costs[1]:8.2f}{two.client:8.2f}"
                f"{one.others:8.2f}{two.others:8.2f}{len(quiet_pairs):6}/{len(pairs)}",
                flush=True,
            )
            if not quiet_pairs:
                print(f"{name}: other programs took processors in every round; this does not count")
            elif ratio < MIN_RATIO:
                print(f"{name}: the ratio must be {MIN_RATIO}")
                is_fast = False
    return is_fast


if __name__ == "__main__":
    sys.exit(not run(sys.argv[1:]))
