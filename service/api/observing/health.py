"""Health checks: whether the process runs, and whether it is ready for requests.

The service is ready if the engine computes a tiny mesh correctly, stored surfaces can be read, and
the service is not about to stop. It is not ready before its store has answered once. If a store
fails, all instances that share it become unready: `docs/observability.md` says what operators do
then.
"""

import asyncio
import logging
import math
import time
from collections.abc import Callable

import numpy as np
from anyio import CapacityLimiter, Lock, to_thread
from starlette.datastructures import State

from service.encoders.registry import BY_NAME
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.pipeline.mesh import build_mesh
from service.surface.bezier import BezierSurface

TEST_INTERVAL = 5.0
"""Seconds for which the result of a self-test stays valid."""

DEADLINE = 2.0
"""Seconds that a caller waits for a self-test."""

STUCK_AFTER = 30.0
"""Seconds since the last passed test after which an engine that does not answer counts as stuck.
Until then it counts as busy, and the service as ready: if a proxy sent its requests to another
instance, that instance would become just as busy."""

_log = logging.getLogger(__name__)


def computes_correctly() -> bool:
    """Whether the engine meshes a known surface correctly.

    The control net is a plane square of 3 × 3 points, except that its middle point is 4 above the
    plane. At 2 × 2 divisions, the middle vertex (index 4) is 4 · ½ · ½ = 1 above the plane,
    with the normal along z; the other 8 vertices are at the other control points.
    """
    net = np.zeros((3, 3, 3))
    net[..., 0], net[..., 1] = np.mgrid[:3, :3]
    net[1, 1, 2] = 4.0
    mesh: Mesh = build_mesh(BezierSurface(net).lower(), MeshOptions((2, 2)), BY_NAME["json"])
    expected = net.reshape(9, 3)
    expected[4, 2] = 1.0
    return (
        mesh.positions.shape == (9, 3)
        and bool(np.abs(mesh.positions - expected).max() <= 1e-12)
        and len(mesh.triangles) == 8
        and mesh.normals is not None
        and bool(np.abs(mesh.normals[4] - (0.0, 0.0, 1.0)).max() <= 1e-6)
    )


class SelfTest:
    """Computes a mesh and compares it with known numbers, at most once in 5 s.

    The test runs in a thread of its own: it passes even while all other threads compute.
    """

    def __init__(self, test: Callable[[], bool] = computes_correctly) -> None:
        self._test = test
        self._lock = Lock()
        self._limiter = CapacityLimiter(1)
        self._last_run = self._last_success = -math.inf
        self.has_passed = True
        """Whether the last test passed or found the engine busy; true until a test has ended."""

    async def passes(self) -> bool:
        """Whether the engine passes; the result is from a test that is at most 5 s old."""
        async with self._lock:
            if time.monotonic() - self._last_run > TEST_INTERVAL:
                self._last_run = time.monotonic()
                self.has_passed = await self._run()
            return self.has_passed

    async def _run(self) -> bool:
        work = to_thread.run_sync(self._test, abandon_on_cancel=True, limiter=self._limiter)
        try:
            is_correct = await asyncio.wait_for(work, DEADLINE)
        except TimeoutError:
            _log.warning("the engine has not answered the self-test within %g s", DEADLINE)
            return time.monotonic() - self._last_success <= STUCK_AFTER
        except Exception as error:
            _log.error("the self-test failed with an error", exc_info=error)
            return False
        self._last_success = time.monotonic() if is_correct else -math.inf
        if not is_correct:
            _log.error("the self-test failed: the engine computes wrong numbers")
        return is_correct


def is_ready(state: State) -> bool:
    """Whether the service is ready, by the last results of its checks."""
    has_store = not state.services.store.has_failed
    return bool(state.ready and state.self_test.has_passed and has_store)
