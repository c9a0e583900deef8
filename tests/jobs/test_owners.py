"""Which instance counts as gone, and when."""

import asyncio
import os
import subprocess
import sys

import orjson
from obstore.store import MemoryStore

from service.jobs.files import JobFiles
from service.jobs.keys import instance_key, owner_key
from service.jobs.owners import GONE_AFTER, Owners
from service.storage.backends import Bucket
from tests.clock import stop_clock

JOB = "a" * 64


def test_an_instance_without_a_new_sign_of_life_for_60_s_is_gone() -> None:
    async def run() -> None:
        with stop_clock() as clock:
            files = JobFiles(Bucket(MemoryStore()))
            owner, observer = Owners(files), Owners(files)
            await owner.take(JOB)
            assert await observer.look() == {JOB: owner.instance}
            assert not observer.is_gone(owner.instance)
            clock.now += GONE_AFTER
            await observer.look()
            assert not observer.is_gone(owner.instance)
            await owner.beat()
            await observer.look()
            clock.now += GONE_AFTER
            await observer.look()
            assert not observer.is_gone(owner.instance)
            clock.now += 1
            assert observer.is_gone(owner.instance)
            assert not owner.is_gone(owner.instance)
            await observer.take(JOB)
            await owner.look()
            assert await owner.look() == {JOB: observer.instance}
            assert await owner.owner_of(JOB) == observer.instance

    asyncio.run(run())


def test_an_instance_that_has_stopped_in_order_is_gone_at_once() -> None:
    async def run() -> None:
        files = JobFiles(Bucket(MemoryStore()))
        owner, observer = Owners(files), Owners(files)
        await owner.take(JOB)
        await owner.leave()
        assert await observer.look() == {JOB: owner.instance}
        assert observer.is_gone(owner.instance)

    asyncio.run(run())


def test_a_process_of_this_host_that_is_gone_is_gone_at_once() -> None:
    async def run() -> None:
        files = JobFiles(Bucket(MemoryStore()))
        owner, observer = Owners(files), Owners(files)
        await owner.take(JOB)
        sign = orjson.loads(await files.read(instance_key(owner.instance)) or b"")
        assert sign["pid"] == os.getpid()
        dead = subprocess.Popen([sys.executable, "-c", ""])
        dead.wait()
        for change, is_gone in (
            ({}, False),
            ({"pid": dead.pid}, True),
            ({"pid": dead.pid, "host": "another"}, False),
            ({"started": "1"}, True),  # another process with the same number
        ):
            await files.write(instance_key(owner.instance), orjson.dumps(sign | change))
            await observer.look()
            assert observer.is_gone(owner.instance) == is_gone, change
        await files.write(instance_key(owner.instance), orjson.dumps(sign | {"started": "1"}))
        await observer.look()
        await observer.forget_gone()
        assert await files.names("instances") == []

    asyncio.run(run())


def test_only_the_owner_releases_a_job() -> None:
    async def run() -> None:
        files = JobFiles(Bucket(MemoryStore()))
        first, second = Owners(files), Owners(files)
        await first.take(JOB)
        await second.take(JOB)
        await first.release(JOB)
        assert await files.has(owner_key(JOB))
        await second.release(JOB)
        assert await first.owner_of(JOB) is None
        assert first.is_gone(None)

    asyncio.run(run())
