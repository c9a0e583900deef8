"""What has been counted so far: plain numbers, that a scrape of `/metrics` reads.

A request adds to a few of them, which takes a microsecond; prometheus_client's own counters, with
a lock each, would take several.
"""

from bisect import bisect_left
from collections import Counter
from collections.abc import Callable

from service.api.observing.exchange import Exchange
from service.engine.mesh import MeshReport
from service.measuring import Seconds

BOUNDS = (
    *(0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5),
    *(1.0, 2.5, 5.0, 10.0, 30.0, 60.0),
)
"""Seconds: upper ends of the histograms' buckets."""


class Histogram:
    """How many took how long."""

    __slots__ = ("counts", "total")

    def __init__(self) -> None:
        self.counts = [0] * (len(BOUNDS) + 1)
        self.total = 0.0

    def add(self, seconds: float) -> None:
        """One more."""
        self.counts[bisect_left(BOUNDS, seconds)] += 1
        self.total += seconds

    def buckets(self) -> list[tuple[str, float]]:
        """Upper ends, as Prometheus writes them, and how many took no longer."""
        ends, sums, so_far = [*map(repr, BOUNDS), "+Inf"], [], 0
        for count in self.counts:
            so_far += count
            sums.append(float(so_far))
        return list(zip(ends, sums, strict=True))


class Observed:
    """Everything that is counted of one application.

    Attributes
    ----------
    in_flight : int
        Requests whose answers have not been handed to the server.
    requests : dict
        How long they took, by route, method and class of status.
    bytes : Counter
        Of bodies of answers, by format.
    refusals : Counter
        Problems, by code.
    vertices, triangles : int
        Of meshes that were made.
    engine : Seconds
        Of computing, by formulation.
    dropped : callable
        Lines of the log that could not be written: whoever writes them knows.
    """

    def __init__(self) -> None:
        self.in_flight = 0
        self.requests: dict[tuple[str, str, int], Histogram] = {}
        self.bytes: Counter[str] = Counter()
        self.refusals: Counter[str] = Counter()
        self.vertices = self.triangles = 0
        self.engine = Seconds()
        self.dropped: Callable[[], int] = int

    def ended(self, exchange: Exchange, seconds: float) -> None:
        """A request is over."""
        status = exchange.status // 100
        key = (exchange.place.route, exchange.method, status)
        histogram = self.requests.get(key)
        if histogram is None:
            histogram = self.requests[key] = Histogram()
        histogram.add(seconds)
        if exchange.format and status == 2:
            self.bytes[exchange.format] += exchange.sent
        if exchange.code:
            self.refusals[exchange.code] += 1

    def refused(self, code: str) -> None:
        """Something was refused before it became a request to the application."""
        self.refusals[code] += 1

    def made(self, report: MeshReport | None) -> None:
        """A mesh was made; exact patches have no report, and are none."""
        if report is not None:
            self.vertices += report.vertices
            self.triangles += report.triangles
