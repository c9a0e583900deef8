"""Makes many files in one command, in a pool of processes or on a cluster; shows the progress."""

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from service.cli.progress import Progress, describe_seconds
from service.cli.refusals import OK, REFUSED, Refused, UsageError, issue_line, print_error
from service.errors import Issue, ServiceFailed, StoreFailed, StoreFull, count_nouns

if TYPE_CHECKING:
    from service.jobs.bake import Bake, Counts, Entry
    from service.jobs.bake_record import Failure
    from service.jobs.batch import Task
    from service.jobs.engine import Engine

MAX_PROCESSES = 1024

_AGAIN = "the same command goes on from here"

_STOPS = {
    "disk_full": "the disk is full",
    "store_failed": "files cannot be written; the line above says why",
    "files_elsewhere": "workers write to disks of their own; needed a folder that all of them "
    "share, or a bucket",
    "job_process": "no process can be started",
    "wrong_engine": "a worker has another version of the engine",
}
"""Why a bake stops, in words."""

_CLUSTER_STOPS = {
    "no_scheduler": "the scheduler does not respond",
    "no_workers": "the cluster has no workers",
    "other_version": "all workers have another version of the service",
}
"""The reasons, in words, that are the fault of the cluster at `--cluster`."""

_FAILURES = {
    "OutOfTime": "The part took longer than SURFACE_JOB_PART_TIMEOUT.",
    "UnknownSurface": "The store SURFACE_STORE has no surface with this id.",
    "DamagedObject": "The stored surface is damaged; to repair it, store it again.",
}
"""Errors of parts that have no texts of their own, by their class."""


class Many(NamedTuple):
    """The files that a command makes.

    Attributes
    ----------
    texts : iterable
        The texts of the list: lines, or names of files.
    read : callable
        Returns the entry of a text with its number, or None if it is empty (`Bake.run`).
    total : int or None
        The number of parts; None if it is unknown before the list is read.
    output : str
        The folder or the bucket.
    processes : int
        0 means one for each processor.
    cluster : str or None
        The address of the scheduler of a cluster.
    """

    texts: Iterable[Any]
    read: "Callable[[int, Any], Entry | None]"
    total: int | None
    output: str
    processes: int = 0
    cluster: str | None = None


def make_files(many: Many, line: Callable[[Issue], str] = issue_line) -> int:
    """Makes all files, and prints those that failed as a table.

    Parameters
    ----------
    line : callable
        Returns the line of an issue.

    Returns
    -------
    int
        The exit code: `REFUSED` if a part has failed.

    Raises
    ------
    UsageError, InvalidSettings
    Refused
        The output cannot be read or written.
    ServiceFailed
        The cluster does not respond.
    """
    import asyncio

    from service.jobs.bake import Bake, BakeStopped
    from service.storage.address import open_output

    output, task = open_output(many.output), _make_task(many)
    progress = Progress(many.total)

    def show(counts: "Counts") -> None:
        progress.show(counts.ended, counts.failed)

    bakes: list[Bake] = []

    async def run() -> None:
        engine = _open_engine(many)
        bakes.append(Bake(engine, output, task, show))
        try:
            await bakes[0].run(many.texts, many.read)
        finally:
            await engine.close()

    try:
        asyncio.run(run())
    except (StoreFull, StoreFailed) as error:
        reason = "disk_full" if isinstance(error, StoreFull) else "store_failed"
        raise Refused(f"--output: {_STOPS[reason]}; {_AGAIN}") from None
    except BakeStopped as stop:
        if stop.reason in _CLUSTER_STOPS:
            raise ServiceFailed(f"--cluster: {_CLUSTER_STOPS[stop.reason]}; {_AGAIN}") from None
        raise Refused(f"{_STOPS.get(stop.reason, stop.reason)}; {_AGAIN}") from None
    except KeyboardInterrupt:
        progress.clear()
        print_error(f"stopped; {_AGAIN}")
        raise
    finally:
        progress.clear()
        for bake in bakes:
            _print_end(bake, progress.seconds, line)
    return REFUSED if bakes[0].counts.failed else OK


def _make_task(many: Many) -> "Task":
    """The task of every batch, without parts; with one of several processes, a share of memory."""
    from service.jobs.batch import Task
    from service.jobs.limits import part_limits
    from service.settings.environment import command_settings, variable
    from service.storage.address import open_store

    settings = command_settings()
    store = settings.store if variable("store") in os.environ else ""
    if store:
        open_store(store, 0, create=False)  # refuses a wrong address before parts do
    if variable("memory_bytes") in os.environ and many.cluster is None:
        share = settings.memory_bytes // _count_processes(many)
        settings = settings.model_copy(update={"memory_bytes": share})
    # A relative path means the same in every process here, but not in workers of a cluster.
    address = (
        many.output if "://" in many.output else str(Path(many.output).expanduser().absolute())
    )
    return Task((), store, part_limits(settings), settings.job_part_timeout, output=address)


def _open_engine(many: Many) -> "Engine":
    if many.cluster is not None:
        try:
            from service.jobs.dask_engine import open_dask
        except ImportError:
            extra = "pip install 'surface-service[cluster]'"
            raise UsageError(f"--cluster: needs the extra packages of {extra}") from None
        return open_dask(many.cluster, "--cluster")
    from service.jobs.pool import ProcessEngine
    from service.settings.runtime import half_of_memory

    processes = _count_processes(many)
    return ProcessEngine(processes, half_of_memory() // processes)


def _count_processes(many: Many) -> int:
    """The number of processes; no more than there are parts."""
    from service.settings.runtime import count_processors

    processes = many.processes or count_processors()
    return processes if many.total is None else max(1, min(processes, many.total))


def _print_end(bake: "Bake", seconds: float, line: Callable[[Issue], str]) -> None:
    """Prints the failures as a table, and the counts of all parts."""
    counts = bake.counts
    if counts.failed:
        failures = bake.record.failures
        places = max(len(failure.place) for failure in failures())
        names = max(len(failure.name) for failure in failures())
        for failure in failures():
            for reason in _reasons(failure, line):
                print_error(f"{failure.place:<{places}}  {failure.name:<{names}}  {reason}")
    facts = (f"{counts.made:,} made", f"{counts.found:,} were there", f"{counts.failed:,} failed")
    print_error(f"{', '.join(facts)}, in {describe_seconds(seconds)}")
    if counts.incomplete:
        files = count_nouns(counts.incomplete, "CAD files")
        print_error(f"faces of {files} could not be read; `surface convert` says which and why")


def _reasons(failure: "Failure", line: Callable[[Issue], str]) -> list[str]:
    from service.jobs.results import read_issues

    kind = failure.error["class"]
    return list(map(line, read_issues(failure.error))) or [_FAILURES.get(kind, kind)]
