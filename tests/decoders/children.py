"""The child processes of the tests that read files."""

from pathlib import Path

from tests.decoders import payloads


def list_children() -> set[int]:
    """Those that run the program of the payloads, and dead ones whose end is not read yet.

    Other tests may have started processes that still run.
    """
    tasks = [task / "children" for task in Path("/proc/self/task").iterdir()]
    numbers = {number for task in tasks for number in task.read_text().split()}
    return {int(number) for number in numbers if _is_ours(Path("/proc") / number)}


def _is_ours(process: Path) -> bool:
    try:
        command = (process / "cmdline").read_text()
    except OSError:  # it has just ended, and another thread has read that
        return False
    return not command or payloads.__name__ in command
