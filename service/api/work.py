"""How work is done: short work on the event loop, long work in a thread, all within its memory."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import Generic, Protocol, TypeVar

from service.api.admission.admission import Lane
from service.api.admission.visits import Visit, visiting
from service.api.timing import Timing
from service.pipeline.cost import Cost

INLINE_BYTES = 1 << 18
"""Bodies up to this size are parsed in some 5 ms."""

INLINE_OBJECTS = 32
"""Objects in a body up to which that holds; each of a group's members is some of them."""

Result = TypeVar("Result")


class Pace(Enum):
    """How long something takes.

    The event loop can spare 1 to 2 ms: a thread would add as much, since Python's threads take
    turns of 5 ms. What takes up to some 100 ms need not wait behind what takes seconds.
    """

    AT_ONCE = 1
    SOON = 2
    LONG = 3


INLINE_SECONDS, QUICK_SECONDS = 0.002, 0.02
"""Work up to which it is done on the event loop, and up to which it need not wait behind others."""


class Planned(Protocol):
    """Work of which it is known what it takes at most, its answer included."""

    @property
    def cost(self) -> Cost:
        """Memory and seconds."""
        ...


def pace_of(planned: Planned) -> Pace:
    """How long something takes."""
    if planned.cost.work <= INLINE_SECONDS:
        return Pace.AT_ONCE
    return Pace.SOON if planned.cost.work <= QUICK_SECONDS else Pace.LONG


Plan = TypeVar("Plan", bound=Planned)


@dataclass(frozen=True, slots=True)
class Task(Generic[Plan]):
    """What is to be done: find out what that takes, then do it.

    Attributes
    ----------
    name : str
        What it is called where its time is shown.
    plan : Callable
    planning : int
        Bytes that this takes, before it is known what the rest takes.
    pace : Callable
        Of what was planned.
    is_long : bool
        Whether already the planning takes long.
    """

    name: str
    plan: Callable[[], Plan]
    planning: int
    pace: Callable[[Plan], Pace]
    is_long: bool


def long_to_read(body: bytes) -> bool:
    """Whether the event loop cannot spare the time to parse and check a body."""
    return len(body) > INLINE_BYTES or body.count(b"{") > INLINE_OBJECTS


async def parsed(parse: Callable[[], Result], timing: Timing, *, is_long: bool) -> Result:
    """What a body says; if it is long, found out in a thread, which what comes next may keep."""
    visit = visiting()
    if is_long:
        with timing.step("wait"):
            await visit.thread_to_parse()
    with timing.step("parse"):
        if is_long:
            result = await visit.in_thread(parse)
        else:
            result = await _in_turn(parse, visit)
    visit.arrival.parsed()
    return result


async def done(
    task: Task[Plan], run: Callable[[Plan], Result], size: Callable[[Result], int], timing: Timing
) -> tuple[Plan, Result]:
    """What was planned, and what came of it; of all memory that of the answer is kept.

    Parameters
    ----------
    size : Callable
        Bytes of the answer.

    Raises
    ------
    Busy
    """
    visit = visiting()
    admission = visit.admission
    planned, lane, pace = None, admission.small, Pace.LONG
    if not task.is_long and task.planning <= admission.small_bytes:
        planned = await _planned(task, lane, timing)
        if planned is not None:
            pace = task.pace(planned)
    if planned is None:
        lane = admission.large
        with timing.step("wait"):
            await visit.thread(lane)
        planned = await _planned(task, lane, timing)
        assert planned is not None
    work = partial(run, planned)
    if pace is Pace.AT_ONCE:
        with timing.step(task.name):
            result = await _in_turn(work, visit)
    else:
        with timing.step("wait"):
            await visit.thread(lane)
        with timing.step(task.name):
            result = await visit.in_thread(work)
    visit.worked(size(result))
    return planned, result


async def _planned(task: Task[Plan], lane: Lane, timing: Timing) -> Plan | None:
    """What was planned, once there is memory for it; None for what is not small after all."""
    visit = visiting()
    admission = visit.admission
    lane.check()
    with timing.step("wait"):
        turn = await lane.planning.lent(1)
    with turn:
        with timing.step("wait"):
            await visit.room(lane, task.planning)
        with timing.step("plan"):
            if lane is admission.large:
                planned = await visit.in_thread(task.plan)
            else:
                planned = await _in_turn(task.plan, visit)
        is_large = planned.cost.memory > admission.small_bytes or task.pace(planned) is Pace.LONG
        if is_large and lane is admission.small:
            visit.no_room()
            return None
        with timing.step("wait"):
            await visit.room(lane, planned.cost.memory)
    return planned


async def _in_turn(work: Callable[[], Result], visit: Visit) -> Result:
    """Calls `work` on the event loop.

    Short work takes turns. The event loop runs whatever is ready before it looks for anything new,
    so hundreds of short works that arrive together would keep it from all else until the last is
    done; a lock is handed on once a round. A request has one turn for all that is short in it: at
    the end of each round Python may give the processor to a thread that computes, for 5 ms.
    """
    if visit.had_turn:
        return work()
    async with visit.admission.turn:
        visit.had_turn = True
        return work()
