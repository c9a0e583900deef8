"""`surface stored list`, `delete` and `verify`: the surfaces that a service keeps."""

import argparse
import sys
import time
from typing import TYPE_CHECKING

from service.cli.flags import Command, CommandGroup, flag
from service.cli.output import print_lines, printable
from service.cli.refusals import OK, REFUSED, Refused, issue_line
from service.errors import SurfaceError

if TYPE_CHECKING:
    from service.storage.verify import Verification

TERMINAL_SECONDS, OTHER_SECONDS = 0.2, 30.0
"""Seconds between two reports of progress: to a terminal, and to a file or a pipe."""


def _list(arguments: argparse.Namespace) -> int:
    from service.cli import remote

    for entry in remote.list_stored(arguments.url):
        print_lines([f"{entry['id']}  {entry['bytes']:>10}  {entry['time']}"])
    return OK


def _delete(arguments: argparse.Namespace) -> int:
    from service.cli import remote

    lines = []
    for id in arguments.ids:
        try:
            remote.delete(arguments.url, id)
        except SurfaceError as error:
            lines += [f"{id}: {issue_line(issue)}" for issue in error.issues]
        else:
            print_lines([f"deleted {id}"])
    if lines:
        raise Refused(*lines)
    return OK


def _verify(_: argparse.Namespace) -> int:
    import asyncio

    from service.settings.environment import read_environment
    from service.storage.address import open_store
    from service.storage.verify import Verification, verify

    async def run() -> Verification:
        progress, result = _Progress(), Verification()
        async for result in verify(store.backend):
            progress.show(result)
        progress.end()
        return result

    store = open_store(read_environment().store, quota=0, create=False)
    result = asyncio.run(run())
    print_lines(f"{printable(key)}: {fault}" for key, fault in result.faults.items())
    state = f"{len(result.faults)} of them faulty" if result.faults else "all are intact"
    print_lines([f"{result.objects} surfaces, {result.bytes / 1e6:.1f} MB: {state}"])
    return REFUSED if result.faults else OK


class _Progress:
    """Reports the progress of a verification to standard error, if it takes long."""

    def __init__(self) -> None:
        self._is_terminal = sys.stderr is not None and sys.stderr.isatty()
        self._start = self._last = time.monotonic()
        self._has_shown = False

    def show(self, result: "Verification") -> None:
        """Shows the result so far, unless it was shown a moment ago."""
        now = time.monotonic()
        interval = TERMINAL_SECONDS if self._is_terminal else OTHER_SECONDS
        if sys.stderr is None or now - self._last < interval:
            return
        self._last, self._has_shown = now, True
        rate = result.bytes / 1e6 / (now - self._start)
        line = f"{result.objects} surfaces, {result.bytes / 1e6:.1f} MB, {rate:.1f} MB/s"
        begin, end = ("\r", "\x1b[K") if self._is_terminal else ("", "\n")
        print(f"{begin}{line}, {len(result.faults)} faulty", end=end, file=sys.stderr, flush=True)

    def end(self) -> None:
        """Clears the line on a terminal."""
        if self._is_terminal and self._has_shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


_URL = flag("--url", "URL of the service", required=True)

STORED = CommandGroup(
    "stored",
    "list, delete or verify the surfaces that a service keeps",
    (
        Command(
            "list",
            "list all stored surfaces of a service: id, bytes, time",
            _list,
            (_URL,),
            description="Needs a key with the scope admin in SURFACE_KEY.",
            has_exit_codes=True,
        ),
        Command(
            "delete",
            "delete stored surfaces at a service",
            _delete,
            (flag("ids", "ids of surfaces", "ID", nargs="+"), _URL),
            description="Needs a service that allows it (SURFACE_ALLOW_DELETE), and a key with the "
            "scope delete in SURFACE_KEY if the service has keys.",
            has_exit_codes=True,
        ),
        Command(
            "verify",
            "read all surfaces in a store, and check their hashes",
            _verify,
            description="Reads the store that SURFACE_STORE names, without a service; a service "
            "may use it meanwhile. Prints a line for each faulty object, and exits with 1 if there "
            "is one. Store a damaged surface again, or copy it from a backup, to repair it.",
            has_exit_codes=True,
        ),
    ),
)
