"""Fields that hold one of several kinds, told by one of their own, `type` or `op`."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from service.errors import Issue
from service.schemas.validation import refusal, wrong_type


def kind_of(kinds: Sequence[str], key: str = "type") -> Callable[[object], str | None]:
    """What tells the member of the union that a checked value wants to be.

    The first kind is meant where none is said.
    """

    def tell(value: object) -> str | None:
        return str(value.get(key, kinds[0])) if isinstance(value, dict) else None

    return tell


def of_known_kind(
    kinds: Sequence[str], unknown: Issue, key: str = "type", *, required: bool = False
) -> Callable[[object], object]:
    """What refuses a value that names no known kind, before the union is asked.

    `unknown` is the issue of another name; unless the key is `required`, it may be left out.
    """
    needed, where = "one of " + ", ".join(kinds), f"/{key}"

    def check(value: object) -> object:
        if not isinstance(value, dict):
            raise refusal([((), wrong_type(value, "an object"))])
        if required and key not in value:
            message = "A required field is missing."
            raise refusal([((), Issue("missing_field", message, where, "nothing", needed))])
        wanted = value.get(key, kinds[0])
        if not isinstance(wanted, str):
            raise refusal([((), replace(wrong_type(wanted, needed), pointer=where))])
        if wanted not in kinds:
            issue = replace(unknown, pointer=where, got="an unknown name", needed=needed)
            raise refusal([((), issue)])
        return value

    return check
