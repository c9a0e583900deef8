"""Removals by other processes: a cached response of a stored surface ends with the surface.

The process that removes a surface forgets its responses at once. All others that share the store,
workers and instances, ask the store again about a cached surface, when a response is requested that
was computed, or last checked, more than `CHECK_INTERVAL` seconds ago.
"""

import asyncio
import time

from service.api.caching.cache import ResponseCache
from service.api.caching.cached_response import CHECK_INTERVAL, CachedResponse
from service.errors import StoreFailed
from service.storage.store import SurfaceStore

PATIENCE = 1.0
"""Seconds to wait for the store. If it does not answer, or fails, the cached response is sent: the
surface may still be there."""


async def is_removed(store: SurfaceStore, cache: ResponseCache, entry: CachedResponse) -> bool:
    """Whether the surface of a cached response is gone; the cache then forgets its responses.

    Asks the store only if the entry is due for a check (`CachedResponse.check_time`), and only for
    one of several requests at the same time.
    """
    now = time.monotonic()
    if now < entry.check_time:
        return False
    entry.check_time = now + CHECK_INTERVAL
    try:
        async with asyncio.timeout(PATIENCE):
            is_gone = not await store.has(entry.subject.surface)
    except (StoreFailed, TimeoutError):
        return False
    if is_gone:
        cache.forget(entry.subject.surface)
    return is_gone
