"""How a service with two workers ends, replaces them, and does not start: `make test-rolling`.

These tests start many processes, and take half a minute.
"""

import os
import signal
from pathlib import Path

import httpx

from tests.server.test_draining import is_refused
from tests.server.workers import COUNT, Workers, is_running, start_workers, wait_until
from tools.processes import PATIENCE


def test_workers_end_with_their_parent(tmp_path: Path) -> None:
    with start_workers(tmp_path) as workers:
        pids = workers.server.worker_pids()
        assert len(pids) == COUNT
        workers.server.kill()
        wait_until(lambda: not any(map(is_running, pids)))
        assert is_refused(workers.server.url)


def test_ctrl_c_while_the_workers_start_prints_no_error(tmp_path: Path) -> None:
    workers = Workers(tmp_path)
    workers.server.start()
    workers.systemd.close()
    wait_until(lambda: len(workers.server.worker_pids()) == COUNT)
    pids = workers.server.worker_pids()
    # They import modules.
    wait_until(lambda: "numpy" in Path(f"/proc/{pids[0]}/maps").read_text(encoding="utf-8"))
    for pid in (workers.server.pid, *pids):
        os.kill(pid, signal.SIGINT)
    assert workers.server.process.wait(PATIENCE) == 0
    assert not any(map(is_running, pids))
    assert "Traceback" not in workers.log


def test_a_second_signal_ends_all_workers_at_once(tmp_path: Path) -> None:
    with start_workers(tmp_path, SURFACE_DRAIN_DELAY="600") as workers:
        pids = workers.server.worker_pids()
        workers.server.process.send_signal(signal.SIGTERM)
        assert workers.systemd.read() == "STOPPING=1"
        # No connection waits for a worker that is not replaced any more.
        os.kill(pids[0], signal.SIGKILL)
        wait_until(lambda: not is_running(pids[0]))
        for _ in range(16):
            assert httpx.get(f"{workers.server.url}/v1/formats", timeout=5).status_code == 200
        workers.server.process.send_signal(signal.SIGINT)
        assert workers.server.process.wait(PATIENCE) == 128 + signal.SIGINT
        wait_until(lambda: not any(map(is_running, pids)))


def test_a_service_whose_workers_do_not_start_ends(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    workers = Workers(tmp_path, SURFACE_STORE=str(file))
    workers.server.start()
    workers.systemd.close()
    assert workers.server.process.wait(PATIENCE) == 1
    lines = workers.log.splitlines()
    assert lines[-1].startswith("surface: cannot serve at 127.0.0.1")
    assert "does not start" in workers.log
    assert "Traceback" not in workers.log


def test_hangup_replaces_the_workers_one_by_one(tmp_path: Path) -> None:
    with start_workers(tmp_path) as workers:
        old_pids = workers.server.worker_pids()
        fewest = COUNT
        with httpx.Client(base_url=workers.server.url, timeout=PATIENCE) as client:
            client.get("/v1/formats")
            workers.server.process.send_signal(signal.SIGHUP)

            def are_replaced() -> bool:
                nonlocal fewest
                pids = workers.server.worker_pids()
                fewest = min(fewest, len(pids))
                # The instance is ready all the time, at new connections and at an old one.
                assert httpx.get(f"{workers.server.url}/health/ready").status_code == 200
                assert client.get("/health/ready").status_code == 200
                return len(pids) == COUNT and not set(pids) & set(old_pids)

            wait_until(are_replaced)
        assert fewest == COUNT
        wait_until(lambda: "All workers are replaced" in workers.log)
        assert not workers.systemd.has_more()
