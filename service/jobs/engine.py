"""Engines compute the batches of jobs: they run tasks, in processes here or on other machines.

A task is bytes, and so is its result (`service.jobs.batch`): no
object of ours is pickled, so an engine may run another version of the service.
"""

from typing import Protocol


class EngineLost(Exception):
    """The process that ran a task has ended: perhaps because of the task, perhaps not."""


class EngineUnavailable(Exception):
    """No process can be had at the moment, whatever the task is.

    Parameters
    ----------
    reason : str
        A code that the state of a job shows (`JobState.waiting_for`).
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class Engine(Protocol):
    """Runs tasks."""

    @property
    def slots(self) -> int:
        """The number of tasks that run at one time."""

    async def run(self, task: bytes) -> bytes:
        """Runs a task, and returns its records.

        If this is cancelled, the engine ends the task, with its process if need be.

        Raises
        ------
        EngineLost
            Running the task again may succeed.
        EngineUnavailable
            Running the task again later may succeed; the task is not to blame.
        """

    async def close(self) -> None:
        """Ends all tasks and processes."""
