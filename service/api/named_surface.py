"""Surfaces that a query names by their id, beside a body that is a file of something else."""

from collections.abc import Mapping
from dataclasses import replace

from service.api.computation import Computation
from service.api.errors import InvalidQuery
from service.api.services import Services
from service.api.stored import surface_of
from service.errors import InvalidRequest, Issue, UnknownSurface
from service.surface.kinds import Surface


def check_named(values: Mapping[str, object], field: str, noun: str) -> None:
    """Refuse a query that names no surface, or that has the field which the body is.

    `noun` is what a body of this kind has, such as "numbers".

    Raises
    ------
    InvalidRequest
        `unknown_field` or `missing_field`; the pointer is `/` and the name.
    """
    if field in values:
        message, got = f"The body has {noun}.", "a parameter"
        raise InvalidRequest(Issue("unknown_field", message, f"/{field}", got, "a body"))
    if not isinstance(values.get("surface"), str):
        message, needed = "The query must name the surface.", "the id of a surface"
        raise InvalidRequest(Issue("missing_field", message, "/surface", "no id", needed))


async def load_named(services: Services, computation: Computation, id: str) -> Surface:
    """The surface with the id in the query.

    Raises
    ------
    UnknownSurface, InvalidQuery, DamagedObject, StoreFailed
        The errors of `surface_of`, with pointers to the parameter `surface`.
    """
    try:
        return await surface_of(services, computation, id)
    except (UnknownSurface, InvalidRequest) as error:
        issue = replace(error.issues[0], pointer="/surface")
        error_class = UnknownSurface if isinstance(error, UnknownSurface) else InvalidQuery
        raise error_class(issue) from None
