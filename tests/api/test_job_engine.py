"""Which engine computes the jobs of an application, and the memory that its batches reserve."""

import pytest

from service.api.caching.cache import ResponseCache
from service.api.job_engine import JobMemory, open_engine
from service.api.threads import Threads
from service.jobs.dask_engine import DaskEngine
from service.jobs.pool import ProcessEngine
from service.settings.values import Settings

pytestmark = pytest.mark.anyio


@pytest.mark.parametrize(
    ("address", "engine_type", "reserved"),
    [("", ProcessEngine, 1000), ("tcp://127.0.0.1:8786", DaskEngine, 0)],
)
async def test_batches_on_a_cluster_reserve_no_memory_of_this_machine(
    address: str, engine_type: type, reserved: int
) -> None:
    settings = Settings(dask=address, store="/surfaces")
    threads = Threads(settings, ResponseCache(0))
    engine, reserve = open_engine(settings, JobMemory(threads))
    assert type(engine) is engine_type
    async with reserve(1000):
        assert threads.used_bytes == reserved
    assert threads.used_bytes == 0
