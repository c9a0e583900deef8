"""Batches on a Dask cluster: results, refusals, withdrawal, lost workers and lost schedulers.

Most tests have a scheduler and a worker in this process; a worker that dies is a process.
"""

import asyncio
import pickle
import pickletools
import re
import subprocess
import sys
import threading
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import dask
import orjson
import pytest
from distributed import Scheduler, Worker
from distributed import client as dask_client
from distributed.protocol.serialize import serialize

from service.errors import InvalidSettings
from service.jobs import dask_engine, dask_worker
from service.jobs.attempts import run_task
from service.jobs.batch import DONE, WRONG_ENGINE, Task, read_result, read_task
from service.jobs.checks import check_part
from service.jobs.dask_engine import DaskEngine, open_dask
from service.jobs.engine import EngineUnavailable
from service.jobs.engines import open_cluster
from service.pipeline.calls import CallLimits
from service.settings.values import Settings
from service.storage.address import open_store
from service.surface.kinds import Surface
from tools.processes import ROOT
from tools.programs import find_program

pytestmark = pytest.mark.anyio

LIMITS = CallLimits()
PATH = "/v1/surfaces/saddle/mesh.{suffix}?resolution=2"
ROLES = ("client", "scheduler", "worker")
QUICK = {
    "distributed.scheduler.allowed-failures": 0,
    "distributed.client.scheduler-info-interval": "20ms",
}


def find_none(_: str) -> Surface:
    raise AssertionError


def make_task(store: Path, *suffixes: str, **fields: Any) -> bytes:
    """A task with a mesh of the saddle in each of these formats."""
    documents = ({"path": PATH.format(suffix=suffix)} for suffix in suffixes)
    lines = (orjson.loads(check_part(each, LIMITS, find_none).line) for each in documents)
    numbered = tuple({"part": part, **line} for part, line in enumerate(lines))
    return Task(numbered, str(store), LIMITS, 10.0, **fields).write()


@pytest.fixture
def store(tmp_path: Path) -> Path:
    open_store(str(tmp_path / "store"), 0)
    return tmp_path / "store"


@asynccontextmanager
async def run_scheduler(scheme: str = "tcp", port: int = 0) -> AsyncIterator[Scheduler]:
    with dask.config.set(QUICK):
        async with Scheduler(
            host="127.0.0.1",
            port=port,
            protocol=f"{scheme}://",
            dashboard=False,
            dashboard_address="127.0.0.1:0",
        ) as scheduler:
            yield scheduler


def make_worker(scheduler: Scheduler) -> Worker:
    return Worker(
        scheduler.address,
        nthreads=1,
        host="127.0.0.1",
        protocol=f"{urlsplit(scheduler.address).scheme}://",
        preload=["service.jobs.dask_worker"],
        dashboard_address="127.0.0.1:0",
        memory_limit=0,
    )


@asynccontextmanager
async def run_engine(scheduler: Scheduler) -> AsyncIterator[DaskEngine]:
    engine = open_dask(scheduler.address, "SURFACE_DASK")
    try:
        yield engine
    finally:
        await engine.close()


@asynccontextmanager
async def run_cluster() -> AsyncIterator[tuple[Scheduler, DaskEngine]]:
    """A scheduler and one worker in this process, and an engine."""
    async with (
        run_scheduler() as scheduler,
        make_worker(scheduler),
        run_engine(scheduler) as engine,
    ):
        yield scheduler, engine


async def test_a_batch_is_computed_and_the_scheduler_keeps_nothing(store: Path) -> None:
    async with run_cluster() as (scheduler, engine):
        assert engine.slots == 1
        result = read_result(await engine.run(make_task(store, "glb", "stl")))
        assert (len(result.records), result.end) == (2, DONE)
        assert {record["state"] for record in result.records} == {"succeeded"}
        assert len(list((store / "parts").rglob("*/*"))) == 2
        assert engine.slots == 2
        await wait_until(lambda: not scheduler.tasks)


async def test_of_this_service_only_the_name_of_a_function_is_pickled(
    store: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frames: list[bytes] = []

    def record(*arguments: Any, **options: Any) -> Any:
        header, parts = serialize(*arguments, **options)
        frames.extend(map(bytes, parts))
        return header, parts

    monkeypatch.setattr(dask_client, "serialize", record)
    async with run_cluster() as (_, engine):
        await engine.run(make_task(store, "glb"))
    texts = [
        argument
        for frame in frames
        if frame.startswith(pickle.PROTO)
        for _, argument, _ in pickletools.genops(frame)
        if isinstance(argument, str) and argument.startswith("service")
    ]
    assert texts == ["service.jobs.dask_worker"]
    task = b"\n".join((dask_worker.VERSION.encode(), make_task(store, "glb")))
    assert type(await asyncio.to_thread(dask_worker.run_task, task)) is bytes


async def test_a_worker_of_another_version_refuses_and_is_named(
    store: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(dask_engine, "VERSION", "version 9 and engine 7")
    pauses: list[float] = []
    monkeypatch.setattr(time, "sleep", pauses.append)
    async with run_cluster() as (scheduler, engine):
        with pytest.raises(EngineUnavailable, match="other_version"):
            await engine.run(make_task(store, "glb"))
        (address,) = scheduler.workers
    (text,) = find_warnings(caplog, "refused")
    assert f"{address} has {dask_worker.VERSION}, the job needs version 9 and engine 7" in text
    # A worker that refused at once would always be idle, and get all tasks.
    assert set(pauses) == {dask_worker.REFUSAL_SECONDS}


async def test_a_job_of_another_engine_is_not_computed(store: Path) -> None:
    async with run_cluster() as (_, engine):
        result = read_result(await engine.run(make_task(store, "glb", engine=3)))
    assert (result.records, result.end) == ((), WRONG_ENGINE)


async def test_a_worker_that_does_not_reach_the_store_is_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with run_cluster() as (scheduler, engine):
        with pytest.raises(EngineUnavailable, match="worker_failed"):
            await engine.run(make_task(tmp_path / "elsewhere", "glb"))
        (address,) = scheduler.workers
    (text,) = find_warnings(caplog, "failed")
    assert address in text
    assert "elsewhere" in text


async def test_a_part_that_fails_fails_alone(store: Path) -> None:
    task = orjson.loads(make_task(store, "glb", "stl", "json"))
    task["lines"][1]["path"] = "/v1/surfaces/none/mesh.stl"
    async with run_cluster() as (_, engine):
        result = read_result(await engine.run(orjson.dumps(task)))
    states = [record["state"] for record in result.records]
    assert states == ["succeeded", "failed", "succeeded"]


async def test_a_batch_whose_job_is_withdrawn_is_forgotten(
    store: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    began, may_end = threading.Event(), threading.Event()

    def wait(_: bytes) -> bytes:
        began.set()
        may_end.wait(10)
        return b""

    monkeypatch.setattr(dask_worker, "run_batch", wait)
    async with run_cluster() as (scheduler, engine):
        batches = [asyncio.create_task(engine.run(b"")) for _ in range(2)]
        await wait_until(lambda: began.is_set() and len(scheduler.tasks) == 2)
        for batch in batches:
            batch.cancel()
        assert [type(each) for each in await asyncio.gather(*batches, return_exceptions=True)] == [
            asyncio.CancelledError
        ] * 2
        await wait_until(lambda: not scheduler.tasks)
        may_end.set()
        monkeypatch.undo()
        assert read_result(await engine.run(make_task(store, "glb"))).end == DONE


async def test_without_workers_a_batch_is_given_back(store: Path) -> None:
    async with run_scheduler() as scheduler, run_engine(scheduler) as engine:
        with pytest.raises(EngineUnavailable, match="no_workers"):
            await engine.run(make_task(store, "glb"))
        async with make_worker(scheduler):
            await wait_until(lambda: engine.slots == 2)
            assert read_result(await engine.run(make_task(store, "glb"))).end == DONE


async def test_a_batch_waits_for_workers_that_start_again(
    store: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask_engine, "LOOK_SECONDS", 0.01)
    async with run_scheduler() as scheduler, run_engine(scheduler) as engine:
        async with make_worker(scheduler):
            await engine.run(make_task(store, "glb"))
        batch = asyncio.create_task(engine.run(make_task(store, "stl")))
        await wait_until(lambda: engine.slots == 1)
        await asyncio.sleep(0.05)
        assert not batch.done()
        async with make_worker(scheduler):
            assert read_result(await batch).end == DONE


async def test_after_the_loss_of_the_scheduler_the_engine_connects_again(
    store: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(dask_engine, "CONNECT_SECONDS", 0.2)
    async with run_cluster() as (scheduler, engine):
        port = scheduler.port
        await engine.run(make_task(store, "glb"))
        await scheduler.close()
        for _ in range(2):
            with pytest.raises(EngineUnavailable, match="no_scheduler"):
                await engine.run(make_task(store, "stl"))
        assert len(find_warnings(caplog, f"{scheduler.address} does not respond")) == 1
        async with run_scheduler(port=port) as again, make_worker(again):
            result = read_result(await engine.run(make_task(store, "glb", "stl")))
    assert [record["state"] for record in result.records] == ["succeeded"] * 2


DEADLY = """
import asyncio, os, signal, sys
from distributed import Worker
from service.jobs import batch, dask_worker

def run_batch(task):
    if b"mesh.stl" in task:
        os.kill(os.getpid(), signal.SIGKILL)
    return batch.run_batch(task)

async def work():
    async with Worker(sys.argv[1], nthreads=1, dashboard_address="127.0.0.1:0") as worker:
        await worker.finished()

dask_worker.run_batch = run_batch
while True:
    if not os.fork():
        asyncio.run(work())
        os._exit(0)
    os.wait()
"""
"""A worker that dies by meshes as STL, and is started again each time."""


@pytest.mark.slow
async def test_a_part_that_kills_its_workers_is_named_and_fails_alone(store: Path) -> None:
    async with run_scheduler() as scheduler, run_engine(scheduler) as engine:
        command = (sys.executable, "-c", DEADLY, scheduler.address)
        with subprocess.Popen(command, stderr=subprocess.DEVNULL) as workers:
            try:
                await wait_until(lambda: len(scheduler.workers) == 1)
                batches = make_task(store, "glb", "stl", "json"), make_task(store, "obj")
                results = await asyncio.gather(
                    *(run_task(engine, read_task(each)) for each in batches)
                )
            finally:
                workers.kill()
    records, others = (result.records for result in results)
    assert [record["state"] for record in records] == ["succeeded", "failed", "succeeded"]
    assert records[1]["error"]["class"] == "PartCrashed"
    assert [record["state"] for record in others] == ["succeeded"]


async def test_certificates_by_the_command_of_the_page(store: Path, tmp_path: Path) -> None:
    page = (ROOT / "docs" / "cluster.md").read_text(encoding="utf-8")
    (command,) = re.findall(r"^(openssl .*\\\n.*)$", page, re.MULTILINE)
    find_program("openssl")
    subprocess.run(["sh", "-c", command], cwd=tmp_path, capture_output=True, check=True)
    names = "ca-file", *(f"{role}.cert" for role in ROLES), *(f"{role}.key" for role in ROLES)
    files = {name: tmp_path / ("tls.key" if name.endswith("key") else "tls.crt") for name in names}
    settings = {f"distributed.comm.tls.{name}": str(file) for name, file in files.items()}
    with dask.config.set(settings | {"distributed.comm.require-encryption": True}):
        async with run_scheduler("tls") as scheduler, make_worker(scheduler):
            assert scheduler.address.startswith("tls://")
            async with run_engine(scheduler) as engine:
                assert read_result(await engine.run(make_task(store, "glb"))).end == DONE
            with pytest.raises(InvalidSettings, match="REQUIRE_ENCRYPTION"):
                open_dask(scheduler.address.replace("tls", "tcp"), "SURFACE_DASK")


@pytest.mark.parametrize(
    "address",
    ["10.0.0.1:8786", "https://10.0.0.1:8786", "tls://scheduler", "tls://[::1", "tls://a:x"],
)
def test_an_address_without_scheme_or_port_is_refused(address: str) -> None:
    with pytest.raises(InvalidSettings, match=r"SURFACE_DASK: got .*, needed tls://host:port"):
        open_dask(address, "SURFACE_DASK")


SETTINGS = Settings(dask="tls://127.0.0.1:8786", store="s3://surfaces")


def test_tls_needs_certificates() -> None:
    with pytest.raises(InvalidSettings, match="needs certificates: set the variables DASK_"):
        open_cluster(SETTINGS)


def test_the_store_must_not_be_in_the_memory_of_one_process() -> None:
    with pytest.raises(InvalidSettings, match="set SURFACE_STORE to a folder or a bucket"):
        open_cluster(SETTINGS.model_copy(update={"store": "memory://"}))


def test_certificates_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    names = ("ca-file", "client.cert", "client.key")
    settings = {f"distributed.comm.tls.{name}": str(tmp_path / "none") for name in names}
    error = pytest.raises(InvalidSettings, match=r"--cluster: .* cannot be read: .*No such file")
    with dask.config.set(settings), error:
        open_dask("tls://127.0.0.1:8786", "--cluster")


def test_without_the_extra_the_error_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, "service.jobs.dask_engine")
    with pytest.raises(InvalidSettings, match="the extra `cluster` to be installed"):
        open_cluster(SETTINGS)


def find_warnings(caplog: pytest.LogCaptureFixture, word: str) -> list[str]:
    """The warnings of the engine that have this word."""
    return [
        record.getMessage()
        for record in caplog.records
        if record.name == dask_engine.__name__ and word in record.getMessage()
    ]


async def wait_until(condition: Callable[[], bool]) -> None:
    """Returns once the condition is true; the test fails after 30 s."""
    async with asyncio.timeout(30):
        while not condition():
            await asyncio.sleep(0.01)
