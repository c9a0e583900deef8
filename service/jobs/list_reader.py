"""Reads the list of a bake in a thread, because a disk or a pipe may let its reader wait."""

import asyncio
from collections import deque
from collections.abc import Iterable
from contextlib import suppress
from threading import Condition, Thread
from typing import Generic, TypeVar

MAX_TEXTS, MAX_BYTES = 1000, 4 << 20
"""Texts of the list that may be read before they are taken, and their bytes."""

Text = TypeVar("Text", bytes, str)


class ListReader(Generic[Text]):
    """Reads the texts of a list in a thread, only a few ahead.

    The thread is a daemon: a program may end while the thread waits for a pipe. It does nothing but
    read, so that it does not slow the event loop.
    """

    def __init__(self, texts: Iterable[Text]) -> None:
        self._texts: Iterable[Text] = texts
        self._waiting: deque[Text] = deque()
        self._size = 0
        self._change = Condition()
        self._arrival = asyncio.Event()
        self._error: BaseException | None = None
        self._is_read = self._is_closed = False
        self._loop = asyncio.get_running_loop()
        Thread(target=self._read, name="list", daemon=True).start()

    async def take(self) -> list[Text]:
        """The texts that are read; waits for one if there is none. An empty list is the end.

        Raises
        ------
        Exception
            What reading the list has raised, after the texts before it.
        """
        while True:
            await self._arrival.wait()
            with self._change:
                texts = list(self._waiting)
                self._waiting.clear()
                self._size = 0
                self._change.notify()
                if texts:
                    return texts
                if self._is_read:
                    break
                self._arrival.clear()
        if self._error is not None:
            raise self._error
        return []

    def close(self) -> None:
        """Lets the thread end at the next text."""
        with self._change:
            self._is_closed = True
            self._change.notify()

    def _read(self) -> None:
        try:
            for text in self._texts:
                with self._change:
                    self._change.wait_for(lambda: self._has_room() or self._is_closed)
                    if self._is_closed:
                        return
                    self._waiting.append(text)
                    self._size += len(text)
                    if len(self._waiting) == 1:
                        self._tell()
        except Exception as error:
            self._error = error
        finally:
            with self._change:
                self._is_read = True
                self._tell()

    def _has_room(self) -> bool:
        return len(self._waiting) < MAX_TEXTS and self._size < MAX_BYTES

    def _tell(self) -> None:
        with suppress(RuntimeError):  # the event loop has been closed
            self._loop.call_soon_threadsafe(self._arrival.set)
