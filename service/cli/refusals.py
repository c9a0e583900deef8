"""Errors of the command line: the lines that it prints for them, and its exit codes."""

import sys
from collections.abc import Container

from service.errors import Issue, first_part

OK, REFUSED, USAGE, UNREACHABLE = range(4)
"""Exit codes, described in `EXIT_CODES`."""

EXIT_CODES = """\
exit codes:
  0  done
  1  refused: the surface or an option is invalid, one of several parts failed, a mesh
     deviates by more than --max, a file cannot be read or written, the port is taken,
     or standard output is closed (silently, if the program that reads the pipe closed it)
  2  the command line or a variable SURFACE_* is invalid
  3  the service given by --url, or the cluster given by --cluster, does not answer, or
     fails
  130  interrupted; a service exits with 0 at the first signal
"""


class UsageError(Exception):
    """The command line is invalid."""


class Refused(Exception):
    """The command failed; the arguments are lines that say why."""


def issue_line(issue: Issue, flags: Container[str] = ()) -> str:
    """An issue as a line; if one of `flags` set the wrong value, the line names that flag."""
    name = first_part(issue.pointer)
    location = f"--{name.replace('_', '-')}" if name in flags else issue.pointer
    texts = {"got": issue.got, "needed": issue.needed}
    facts = ", ".join(f"{key} {text}" for key, text in texts.items() if text)
    return (f"{location}: " if location else "") + issue.message + (f" ({facts})" if facts else "")


def print_error(line: str) -> None:
    """Writes a line to standard error."""
    if sys.stderr is not None:  # if it is None, `print` would write to standard output
        print(f"surface: {line}", file=sys.stderr)
