"""What the query of a request says: a format, and nothing unknown."""

from collections.abc import Iterable, Sequence

from service.api.negotiation import AnyFormat, by_name
from service.api.problems import InvalidQuery
from service.errors import InvalidRequest, Issue, pointer
from service.schemas.query import values_from_text
from service.schemas.scan import shortened


def only_format(query: Iterable[tuple[str, str]], formats: Sequence[AnyFormat]) -> AnyFormat | None:
    """The format that the query of a POST names, if it does; it has no other parameter.

    Raises
    ------
    InvalidQuery
        For any other parameter, a repeated one, and an unknown format.
    """
    try:
        values = values_from_text(query)
    except InvalidRequest as error:
        raise InvalidQuery(*error.issues) from None
    _refuse_unknown(values.keys() - {"format"}, "only `format`; options go into the body")
    return by_name(str(values["format"]), formats) if values else None


def no_parameters(names: Iterable[str]) -> None:
    """Refuses every query parameter, where there is nothing to choose."""
    _refuse_unknown(names, "no parameters")


def _refuse_unknown(names: Iterable[str], needed: str) -> None:
    issues = [
        Issue(
            "unknown_field",
            "There is no parameter of this name.",
            pointer([shortened(name)]),
            "an unknown parameter",
            needed,
        )
        for name in sorted(names)
    ]
    if issues:
        raise InvalidQuery(*issues)
