"""The error of a call: what the service says in a problem document (RFC 9457), as a value."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Issue:
    """One error of a request.

    Attributes
    ----------
    code : str
        Stable, for programs.
    message : str
        For people.
    pointer : str
        The place: a JSON pointer into the body of the call, such as `/surface/control_net/1/0/2`;
        or `/` and the name of a parameter or a header.
    got, needed : str
        What the service got and what it needed; "" if the message says it.
    """

    code: str
    message: str
    pointer: str = ""
    got: str = ""
    needed: str = ""

    def __str__(self) -> str:
        place = f"{self.pointer}: " if self.pointer else ""
        texts = {"got": self.got, "needed": self.needed}
        details = ", ".join(f"{name} {text}" for name, text in texts.items() if text)
        return f"{place}{self.message}" + (f" ({details})" if details else "")


class ServiceError(Exception):
    """A call failed.

    Attributes
    ----------
    status : int
        The HTTP status; 0 if there was no response.
    code : str
        Stable, for programs: that of the problem, or `unreachable`, `timeout` or
        `not_a_surface_service`.
    detail : str
        The problem in words.
    errors : tuple of Issue
        What is wrong with the request, and where; empty if nothing is.
    """

    def __init__(self, status: int, code: str, detail: str, errors: tuple[Issue, ...] = ()) -> None:
        self.status, self.code, self.detail, self.errors = status, code, detail, errors
        super().__init__(status, code, detail, errors)

    def __str__(self) -> str:
        return "; ".join(map(str, self.errors)) or self.detail


def read_problem(problem: Mapping[str, Any]) -> ServiceError:
    """The error that a problem document says."""
    errors = tuple(
        Issue(
            error["code"],
            error["detail"],
            _find_place(error),
            error.get("got", ""),
            error.get("needed", ""),
        )
        for error in problem["errors"]
    )
    return ServiceError(problem["status"], problem["code"], problem["detail"], errors)


def _find_place(error: Mapping[str, Any]) -> str:
    """The pointer of an issue; that of a parameter or a header is `/` and its name."""
    if "pointer" in error:
        return str(error["pointer"])
    names = (error[kind] for kind in ("parameter", "header") if kind in error)
    return "".join("/" + name.replace("~", "~0").replace("/", "~1") for name in names)
