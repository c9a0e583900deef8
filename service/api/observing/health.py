"""Whether the service is well: it lives, and it is ready for requests.

Ready means that the engine answers a tiny canary rightly, that the store answers, and that the
service is not about to stop. A store may fail for some seconds before that counts. Where several
share one, none of them is ready then: that is meant, for a surface that can neither be kept nor
given out is a failed request, and whatever stands in front can say so at once.
`docs/observability.md` tells what follows from it.
"""

import asyncio
import logging
import math
import time
from collections.abc import Callable

import numpy as np
from anyio import CapacityLimiter, Lock, to_thread
from starlette.datastructures import State
from starlette.requests import Request
from starlette.responses import Response

from service import __version__
from service.api.answers import HEADERS, json_response
from service.encoders.registry import BY_NAME
from service.engine.mesh import ENGINE, Mesh
from service.engine.options import MeshOptions
from service.pipeline.mesh import mesh
from service.storage.store import SurfaceStore
from service.surface.bezier import BezierSurface

REMEMBERED = 5.0
"""Seconds for which it is known how the engine is: whoever asks, it computes no oftener."""

PATIENCE = 5.0
"""Seconds for which a store may fail: it is asked twice, so one slow answer stops nobody."""

DEADLINE = 2.0
"""Seconds for which whoever asks waits for the engine."""

SILENCE = 30.0
"""Seconds after which an engine that does not answer counts as stuck. One that answered before has
much to do: were it taken out, its requests would go to the next one, and stop that too."""

_HEADERS = {**HEADERS, "Cache-Control": "no-store"}

_log = logging.getLogger(__name__)


def is_right() -> bool:
    """Makes the canary's mesh, and looks whether it is the one that it must be.

    A square of nine control points, the one in the middle four above the others: at 2 × 2 divisions
    every number is a binary fraction, and the vertex in the middle lies 4 · ½ · ½ = 1 above.
    """
    net = np.zeros((3, 3, 3))
    net[..., 0], net[..., 1] = np.mgrid[:3, :3]
    net[1, 1, 2] = 4.0
    surface = BezierSurface(net)
    made: Mesh = mesh(surface.lower(), MeshOptions((2, 2)), BY_NAME["json"])
    expected = net.reshape(9, 3)
    expected[4, 2] = 1.0
    return (
        made.positions.shape == (9, 3)
        and bool(np.abs(made.positions - expected).max() <= 1e-12)
        and len(made.triangles) == 8
        and made.normals is not None
        and bool(np.abs(made.normals[4] - (0.0, 0.0, 1.0)).max() <= 1e-6)
    )


class Canary:
    """A tiny mesh with known numbers, made again and again to see whether the engine works.

    It has a thread of its own: where all others are busy the service is busy, and well.
    """

    def __init__(self, work: Callable[[], bool] = is_right) -> None:
        self._work = work
        self._asking = Lock()
        self._limiter = CapacityLimiter(1)
        self._asked: tuple[float, bool] | None = None
        self._heard = -math.inf

    @property
    def last(self) -> bool:
        """Whether it was right when somebody asked last; as long as nobody did, it is taken so."""
        return self._asked is None or self._asked[1]

    async def sings(self) -> bool:
        """Whether the mesh was right, a few seconds ago at most."""
        async with self._asking:
            if self._asked is None or time.monotonic() - self._asked[0] > REMEMBERED:
                self._asked = (time.monotonic(), await self._sang())
            return self._asked[1]

    async def _sang(self) -> bool:
        work = to_thread.run_sync(self._work, abandon_on_cancel=True, limiter=self._limiter)
        try:
            right = await asyncio.wait_for(work, DEADLINE)
        except TimeoutError:
            _log.warning("the engine has not answered within %g s", DEADLINE)
            return time.monotonic() - self._heard <= SILENCE
        except Exception as error:
            _log.error("the engine does not answer", exc_info=error)
            return False
        self._heard = time.monotonic() if right else -math.inf
        if not right:
            _log.error("the engine computes wrong numbers")
        return right


def is_ready(state: State) -> bool:
    """Whether new requests are welcome, as far as is known without asking."""
    canary: Canary = state.canary
    store: SurfaceStore = state.store
    return bool(state.ready) and canary.last and store.failing <= PATIENCE


async def health(request: Request) -> Response:
    """GET /health: version and state, for people."""
    state = "ready" if request.app.state.ready else "draining"
    return json_response({"status": state, "version": __version__, "engine": ENGINE})


async def live(_: Request) -> Response:
    """GET /health/live: the event loop turns."""
    return json_response({"status": "live"}, headers=_HEADERS)


async def ready(request: Request) -> Response:
    """GET /health/ready: 503 while no new requests should come here, and why."""
    canary: Canary = request.app.state.canary
    store: SurfaceStore = request.app.state.store
    if not request.app.state.ready:
        return json_response({"status": "draining"}, 503, _HEADERS)
    sings, answers = await asyncio.gather(canary.sings(), store.answers())
    well = is_ready(request.app.state)
    found = {
        "status": "ready" if well else "unready",
        "computing": "ready" if sings else "unavailable",
        "store": "ready" if answers else "unavailable",
    }
    return json_response(found, 200 if well else 503, _HEADERS)
