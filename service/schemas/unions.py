"""Fields that hold one of several kinds, told by their `type`."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from service.errors import Issue
from service.schemas.refusals import refusal, wrong_type


def kind_of(kinds: Sequence[str]) -> Callable[[object], str | None]:
    """What tells the member of the union that a checked value wants to be.

    The first kind is meant where none is said.
    """

    def tell(value: object) -> str | None:
        return str(value.get("type", kinds[0])) if isinstance(value, dict) else None

    return tell


def of_known_kind(kinds: Sequence[str], what: str) -> Callable[[object], object]:
    """What refuses a value that names no kind of `what`, before the union is asked."""

    def check(value: object) -> object:
        if not isinstance(value, dict):
            raise refusal([((), wrong_type(value, "an object"))])
        wanted = value.get("type", kinds[0])
        needed = "one of " + ", ".join(kinds)
        if not isinstance(wanted, str):
            raise refusal([((), replace(wrong_type(wanted, needed), pointer="/type"))])
        if wanted not in kinds:
            got = "an unknown name"
            message = f"There is no such kind of {what}."
            raise refusal([((), Issue("unknown_type", message, "/type", got, needed))])
        return value

    return check
