"""Many clients at once, and the count of what they got."""

import asyncio
import time
from collections import Counter, defaultdict
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

from tools.deploy.client import Answer, Broken, Connection
from tools.deploy.traffic import Request, Traffic

TOO_LATE = 90.0
"""Seconds after which an answer is counted as none."""


@dataclass
class Tally:
    """Requests by kind, and whatever failed."""

    seconds: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    statuses: Counter[tuple[str, int]] = field(default_factory=Counter)
    broken: list[str] = field(default_factory=list)
    """Requests that got no whole answer."""
    wrong: list[str] = field(default_factory=list)
    """Requests that got a whole answer, but not theirs."""

    @property
    def count(self) -> int:
        """Requests that have ended."""
        return sum(map(len, self.seconds.values())) + len(self.broken)

    def lines(self) -> list[str]:
        """A table: kind, number, median, 99th percentile and longest time."""
        yes = f"{self.count} requests, {len(self.broken)} broken, {len(self.wrong)} wrong"
        return [yes] + [
            f"  {kind:<11} {len(times):>6}   p50 {_at(times, 0.5):>8.1f} ms"
            f"   p99 {_at(times, 0.99):>8.1f} ms   longest {max(times) * 1e3:>8.1f} ms"
            for kind, times in sorted(self.seconds.items())
        ]


@dataclass(frozen=True)
class Clients:
    """So many clients that ask for such things, one after the other."""

    number: int
    kinds: dict[str, int]
    keep: bool = True
    """Whether they keep their connection, or take a new one for each request."""
    pause: float = 0.0
    """Seconds between an answer and the next request."""


async def under_load(
    port: int,
    traffic: Traffic,
    groups: tuple[Clients, ...],
    during: Callable[[Tally], Awaitable[None]],
) -> Tally:
    """Has clients ask at a port of this machine for as long as `during` takes.

    A request that is under way at the end is waited for.
    """
    tally = Tally()
    over = asyncio.Event()

    async def client(group: Clients) -> None:
        connection = Connection("127.0.0.1", port)
        for request in traffic.requests(group.kinds):
            if over.is_set():
                break
            await _one(connection, request, traffic, tally)
            if not group.keep:
                await connection.close()
            await asyncio.sleep(group.pause)
        await connection.close()

    async with asyncio.TaskGroup() as tasks:
        for group in groups:
            for _ in range(group.number):
                tasks.create_task(client(group))
        try:
            await during(tally)
        finally:
            over.set()
    return tally


async def _one(connection: Connection, request: Request, traffic: Traffic, tally: Tally) -> None:
    start = time.perf_counter()
    try:
        async with asyncio.timeout(TOO_LATE):
            answer: Answer = await connection.ask(
                request.method, request.target, request.headers, request.body
            )
    except (Broken, TimeoutError) as error:
        await connection.close()
        tally.broken.append(f"{time.strftime('%X')} {_name(request)}: {error!r}")
        return
    tally.seconds[request.kind].append(time.perf_counter() - start)
    tally.statuses[request.kind, answer.status] += 1
    if problem := traffic.wrong_with(request, answer):
        tally.wrong.append(f"{time.strftime('%X')} {_name(request)}: {problem}")


def _name(request: Request) -> str:
    return f"{request.kind}, {request.method} {request.target}"


def _at(times: list[float], share: float) -> float:
    return sorted(times)[min(int(len(times) * share), len(times) - 1)] * 1e3
