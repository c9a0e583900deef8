"""How the command line refuses: its errors, their lines and exit codes."""

import sys
from collections.abc import Mapping
from types import MappingProxyType

from service.errors import Issue, first_part

OK, REFUSED, USAGE, UNREACHABLE = range(4)

EXIT_CODES = """\
exit codes:
  0  done
  1  refused: the surface or an option says nothing that can be computed, a file cannot
     be read or written, the port is taken, or standard output was closed (silently, if
     that was by the program it is piped into)
  2  the command line itself, or a variable SURFACE_*, is wrong
  3  the service given by --url does not answer, or fails
  130  interrupted; a service ends with 0 the first time
"""


class UsageError(Exception):
    """The command line cannot be understood."""


class Refused(Exception):
    """Nothing can be done, and the lines say why."""


def issue_line(issue: Issue, chosen: Mapping[str, str] = MappingProxyType({})) -> str:
    """One issue as a line; it names the flag where the value is one that the command line chose."""
    name = first_part(issue.pointer)
    place = f"--{name.replace('_', '-')}" if name in chosen else issue.pointer
    facts = ", ".join(
        f"{name} {text}" for name, text in (("got", issue.got), ("needed", issue.needed)) if text
    )
    return (f"{place}: " if place else "") + issue.message + (f" ({facts})" if facts else "")


def complain(line: str) -> None:
    """Writes a line to standard error."""
    if sys.stderr is not None:  # else `print` would take standard output
        print(f"surface: {line}", file=sys.stderr)
