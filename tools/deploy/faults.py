"""Faults of the store under load, behind HAProxy: a wrong secret, a lost key, a lost folder.

`make test-rolling` runs these tests.
"""

import shutil
import time
from pathlib import Path

import pytest

from tools.deploy.bucket import Bucket, serve_bucket
from tools.deploy.load import Clients, Tally, run_under_load
from tools.deploy.rolling import check_store, print_results, start_two_behind_haproxy
from tools.deploy.traffic import Traffic
from tools.processes import Server

PROGRESS_SECONDS = 15.0
"""Seconds within which an updated instance must be ready; otherwise the update ends."""

LOST_SECONDS = 15.0
"""Seconds for which a folder is away."""

CLIENTS = (
    Clients(6, {"store": 2, "stored": 4, "small_post": 2, "unchanged": 1}),
    Clients(2, {"store": 1, "stored": 1}, keeps_connection=False),
)
"""Clients most of whose requests need the store."""


def is_ready_soon(instance: Server) -> bool:
    """Whether an instance becomes ready within `PROGRESS_SECONDS`."""
    end = time.monotonic() + PROGRESS_SECONDS
    while time.monotonic() < end:
        if instance.is_ready():
            return True
        time.sleep(0.1)
    return False


def test_a_rolling_update_with_a_wrong_secret_fails_no_request(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The update ends at the first instance, which does not become ready, and is undone.

    The update does not wait after an instance is ready, as one with `minReadySeconds` would.
    """
    bucket, traffic = Bucket({"key"}), Traffic()
    updated: list[Server] = []
    with serve_bucket(bucket) as url:
        right, wrong = (bucket.environment(url, key) for key in ("key", "wrong"))
        with start_two_behind_haproxy(tmp_path, right, right) as (proxy, instances):

            def update(_: Tally) -> None:
                time.sleep(3.0)
                for each in instances:
                    each.stop()
                    each.start(wrong)
                    if not is_ready_soon(each):
                        break
                    updated.append(each)
                    time.sleep(1.5)
                each.stop()
                each.start(right)
                each.wait_until_ready()
                time.sleep(3.0)

            tally = run_under_load(proxy.port, traffic, CLIENTS, update)
    print_results(capsys, tally, f"{len(updated)} instances updated")
    assert traffic.stored
    assert updated == []
    assert tally.incomplete_responses == tally.wrong_responses == []


def test_an_instance_whose_store_fails_gets_few_requests(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The key of one instance becomes invalid; this instance fails its requests very quickly.

    It gets few requests until it is not ready, and none after that. Of two instances that are
    chosen by their numbers of connections, the one that fails gets almost all requests.
    """
    bucket, traffic = Bucket({"first", "second"}), Traffic()
    late_failures: list[int] = []
    with (
        serve_bucket(bucket) as url,
        start_two_behind_haproxy(
            tmp_path, *(bucket.environment(url, key) for key in ("first", "second"))
        ) as (proxy, instances),
    ):

        def revoke(tally: Tally) -> None:
            time.sleep(3.0)
            bucket.valid_keys.remove("first")
            start = time.monotonic()
            while instances[0].is_ready() and time.monotonic() < start + 30:
                time.sleep(0.1)
            assert time.monotonic() - start < 12
            time.sleep(3.0)  # until HAProxy has noticed it
            late_failures.append(len(tally.wrong_responses))
            time.sleep(5.0)

        tally = run_under_load(proxy.port, traffic, CLIENTS, revoke)
    failures = len(tally.wrong_responses)
    print_results(capsys, tally, f"{failures / tally.count:.1%} of the requests failed")
    assert tally.incomplete_responses == []
    assert late_failures == [failures]
    assert failures < tally.count / 12


def test_a_folder_that_is_lost_and_comes_back_loses_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """While the folder is away, no surface is confirmed, and the folder is not made again."""
    store, away = tmp_path / "store", tmp_path / "elsewhere"
    traffic = Traffic()
    confirmed: list[int] = []
    seconds: list[float] = []
    with start_two_behind_haproxy(tmp_path) as (proxy, instances):

        def lose(_: Tally) -> None:
            time.sleep(3.0)
            store.rename(away)
            seconds.append(wait_for(instances, is_ready=False))
            # By now, requests that had opened the folder before have ended.
            confirmed.append(len(traffic.stored))
            time.sleep(max(0.0, LOST_SECONDS - seconds[0]))
            confirmed.append(len(traffic.stored))
            confirmed.append(store.exists())
            shutil.rmtree(store, ignore_errors=True)
            away.rename(store)
            seconds.append(wait_for(instances, is_ready=True))
            time.sleep(3.0)

        tally = run_under_load(proxy.port, traffic, CLIENTS, lose)
        summary = check_store(tmp_path, traffic, instances)
    print_results(
        capsys,
        tally,
        f"unready after {seconds[0]:.1f} s, ready again after {seconds[1]:.1f} s",
        f"{confirmed[1] - confirmed[0]} surfaces confirmed while no instance was ready",
        summary,
    )
    assert confirmed[0] == confirmed[1] < len(traffic.stored)
    assert not confirmed[2]
    assert seconds[0] < 12
    assert seconds[1] < 15
    assert all(" 503 " in line for line in tally.wrong_responses)


def wait_for(instances: tuple[Server, ...], *, is_ready: bool) -> float:
    """Waits until all instances are ready, or none is; returns the seconds."""
    start = time.monotonic()
    while any(each.is_ready() is not is_ready for each in instances):
        assert time.monotonic() < start + 30
        time.sleep(0.1)
    return time.monotonic() - start
