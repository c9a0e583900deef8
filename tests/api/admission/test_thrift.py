"""Memory is handed back once after large requests, and not after small ones."""

import asyncio
import gc
import time
import weakref
from traceback import extract_tb

import pytest

from service.api.admission.admission import Admission
from service.api.admission.thrift import LARGE, PAUSE, Thrift
from service.api.admission.visits import Visit
from service.settings.process import give_back
from service.settings.values import Settings


def test_once_for_all_that_end_together() -> None:
    async def scenario() -> list[int]:
        done: list[int] = []
        thrift = Thrift(lambda: done.append(1))
        counts = []
        for sizes in ((LARGE - 1,), (LARGE, LARGE, 0), (LARGE,)):
            for size in sizes:
                thrift.ended(size)
            await asyncio.sleep(PAUSE + 0.1)
            counts.append(len(done))
        return counts

    assert asyncio.run(scenario()) == [0, 1, 2]


def test_a_request_counts_with_the_most_that_it_had() -> None:
    async def scenario() -> list[int]:
        seen: list[int] = []

        class Noting(Thrift):
            def ended(self, most: int) -> None:
                seen.append(most)

        admission = Admission(Settings())
        admission.thrift = Noting()
        visit = Visit(admission)
        visit.arrival.claim(3000)
        await visit.room(admission.large, 5000)
        visit.worked(answer=100)
        visit.close()
        return seen

    assert asyncio.run(scenario()) == [8000]


def test_handing_back_may_be_asked_for_anywhere() -> None:
    give_back()


class _Large:
    """Something that work has in its hands."""


def test_work_that_fails_leaves_nothing_but_where_it_failed() -> None:
    had: list[weakref.ref[_Large]] = []

    def first() -> None:
        large = _Large()
        had.append(weakref.ref(large))
        raise KeyError

    def work() -> None:
        large = _Large()
        had.append(weakref.ref(large))
        try:
            first()
        except KeyError:
            raise ArithmeticError from None  # it still has the other, and all of its frames

    async def scenario() -> None:
        visit = Visit(Admission(Settings()))
        with pytest.raises(ArithmeticError) as failed:
            await visit.in_thread(work)
        assert extract_tb(failed.value.__traceback__)[-1].name == "work"
        del failed
        visit.close()

    gc.collect()
    gc.disable()
    try:
        asyncio.run(scenario())
        end = time.monotonic() + 10
        while any(large() for large in had) and time.monotonic() < end:
            time.sleep(0.001)  # the thread itself lets go of it a moment later
        assert [large() for large in had] == [None, None]
    finally:
        gc.enable()
