"""Surfaces that a query names by their id, beside a body that is a file of something else."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from service.api.body import PostedFile
from service.api.computation import Computation
from service.api.errors import InvalidQuery
from service.api.services import Services
from service.api.stored import surface_of
from service.errors import InvalidRequest, Issue, UnknownSurface
from service.schemas.fields import RequestModel
from service.schemas.surfaces import definition
from service.schemas.validation import validate_document
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


async def parse_named(
    model: type[RequestModel],
    file: PostedFile,
    services: Services,
    computation: Computation,
    read_fields: Callable[[], Mapping[str, Any]],
    *,
    is_long: bool,
) -> RequestModel:
    """The model of a document with the surface of the query, and the fields of a file.

    `read_fields` reads the file; it and the validation run as `is_long` says.

    Raises
    ------
    UnknownSurface, InvalidQuery, DamagedObject, StoreFailed
        As `load_named`; and the errors of `read_fields` and of the document.
    """
    surface = await load_named(services, computation, file.beside["surface"])

    def parse() -> RequestModel:
        # `flat`: nets as arrays, also those of triangles; the model accepts both forms.
        document = {**file.beside, "surface": definition(surface, flat=True), **read_fields()}
        parsed = validate_document(model, document, services.document_limits)
        parsed.build()
        return parsed

    return await computation.parse(parse, is_long=is_long)
