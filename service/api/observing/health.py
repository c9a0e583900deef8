"""Health checks: the process runs, and it is ready for requests.

Ready means that the engine computes a tiny mesh correctly, that the store responds, and that the
service is not about to stop. Instances that share a store are all unready when it fails:
`docs/observability.md` says what operators do then.
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
from service.engine.mesh.mesh_value import Mesh
from service.engine.options import MeshOptions
from service.pipeline.mesh import build_mesh
from service.surface.bezier import BezierSurface

INTERVAL = 5.0
"""Seconds for which the result of a self-test is used."""

PATIENCE = 5.0
"""Seconds for which a store may fail: two checks must fail, so one slow check does not count."""

DEADLINE = 2.0
"""Seconds that a caller waits for a self-test."""

SILENCE = 30.0
"""Seconds after which an engine that does not answer counts as stuck. Until then it counts as busy
and ready: if it were taken away, its requests would make the next instance just as busy."""

_log = logging.getLogger(__name__)


def computes_rightly() -> bool:
    """Whether the engine meshes a known surface correctly.

    A square of nine control points, the middle one 4 above the others: at 2 × 2 divisions all
    coordinates are binary fractions, and the vertex in the middle lies 4 · ½ · ½ = 1 above.
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
    """Makes a mesh with known numbers when a caller asks, at most once in 5 s.

    It has a thread of its own: with all other threads computing, the service is busy but healthy.
    """

    def __init__(self, test: Callable[[], bool] = computes_rightly) -> None:
        self._test = test
        self._lock = Lock()
        self._limiter = CapacityLimiter(1)
        self._last_run = self._last_success = -math.inf
        self.last = True
        """The last result; true until the first."""

    async def passes(self) -> bool:
        """The result of a test that is at most 5 s old."""
        async with self._lock:
            if time.monotonic() - self._last_run > INTERVAL:
                self._last_run = time.monotonic()
                self.last = await self._run()
            return self.last

    async def _run(self) -> bool:
        work = to_thread.run_sync(self._test, abandon_on_cancel=True, limiter=self._limiter)
        try:
            passed = await asyncio.wait_for(work, DEADLINE)
        except TimeoutError:
            _log.warning("the engine has not answered the self-test within %g s", DEADLINE)
            return time.monotonic() - self._last_success <= SILENCE
        except Exception as error:
            _log.error("the self-test failed with an error", exc_info=error)
            return False
        self._last_success = time.monotonic() if passed else -math.inf
        if not passed:
            _log.error("the self-test failed: the engine computes wrong numbers")
        return passed


def is_ready(state: State) -> bool:
    """Whether the service is ready, by the last results."""
    return bool(state.ready and state.self_test.last and state.store.seconds_failing <= PATIENCE)
