"""Whether the service is well: it lives, and it is ready for requests.

Ready means that the engine answers a tiny canary rightly, that the store answers, and that the
service is not about to stop. Where several share a store that fails, none of them is ready: that
is meant, for a surface that cannot be kept or given out is a failed request, and whatever stands in
front can say so at once. `docs/observability.md` tells what follows from it.
"""

import asyncio
import logging
import time
from typing import Any

import numpy as np
from anyio import CapacityLimiter, Lock, to_thread
from starlette.requests import Request
from starlette.responses import Response
from starlette.datastructures import State

from service import __version__
from service.api.answers import HEADERS, json_response
from service.encoders.registry import BY_NAME
from service.engine.mesh import ENGINE, Mesh
from service.engine.options import MeshOptions
from service.pipeline.mesh import mesh
from service.surface.bezier import BezierSurface

REMEMBERED = 5.0
"""Seconds for which it is known how the engine is: whoever asks, it computes no oftener."""

DEADLINE = 2.0
"""Seconds within which an engine answers that is well, however much is computed beside it."""

_HEADERS = {**HEADERS, "Cache-Control": "no-store"}

_log = logging.getLogger(__name__)


class Canary:
    """A tiny mesh with known numbers, made again and again to see whether the engine works.

    It has a thread of its own: where all others are busy the service is busy, and well.
    """

    def __init__(self) -> None:
        self._asking = Lock()
        self._limiter = CapacityLimiter(1)
        self._asked: tuple[float, bool] | None = None

    async def sings(self) -> bool:
        """Whether the mesh was right a few seconds ago at most."""
        async with self._asking:
            if self._asked is None or time.monotonic() - self._asked[0] > REMEMBERED:
                self._asked = (time.monotonic(), await self._sang())
            return self._asked[1]

    async def _sang(self) -> bool:
        work = to_thread.run_sync(is_right, abandon_on_cancel=True, limiter=self._limiter)
        try:
            right = await asyncio.wait_for(work, DEADLINE)
        except Exception as error:
            _log.error("the engine does not answer", exc_info=error)
            return False
        if not right:
            _log.error("the engine computes wrong numbers")
        return right
