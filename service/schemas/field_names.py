"""Suggests the most similar known name for a misspelt name of a field or of a kind of surface."""

from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel

MAX_LETTERS = 40
"""Names with more characters get no suggestion: comparing them takes long, and no field has such a
long name."""


MIN_SIMILARITY = 0.7
"""The least similarity, from 0 to 1, of a field that is suggested. `format` and `normals` have the
similarity 0.62: neither must be suggested for the other."""


def sort_nearest_first(name: str, names: Sequence[str]) -> list[str]:
    """The names in their order; but if any name is similar to `name`, the most similar is first."""
    similar_names = get_close_matches(name.lower(), names, 1) if len(name) <= MAX_LETTERS else []
    return [*similar_names, *(other for other in names if other not in similar_names)]


def nearest_field(model: type[BaseModel], path: Sequence[str | int]) -> str:
    """The field whose name is most similar to an unknown field; "" if no name is similar.

    Parameters
    ----------
    model : type
        The model of the whole document.
    path : sequence of str and int
        Pydantic's path of the unknown field.
    """
    name = str(path[-1])
    if len(name) > MAX_LETTERS:
        return ""
    models = {model}
    for part in path[:-1]:
        if isinstance(part, str):
            fields = [
                candidate.model_fields[part]
                for candidate in models
                if part in candidate.model_fields
            ]
            inner_models = {
                candidate for field in fields for candidate in _models_in(field.annotation)
            }
            # If the part is not a field, it is the tag of one model of a union.
            models = (
                inner_models
                or {candidate for candidate in models if _has_tag(candidate, part)}
                or models
            )
    names = sorted({field for candidate in models for field in candidate.model_fields})
    return next(iter(get_close_matches(name, names, 1, MIN_SIMILARITY)), "")


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """All models that an annotation contains, also inside unions, lists and type aliases."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    value = getattr(annotation, "__value__", annotation)  # the value of a `TypeAliasType`
    for part in get_args(value):
        yield from _models_in(part)


def _has_tag(model: type[BaseModel], tag: str) -> bool:
    """Whether a field of the model, such as `type`, has the literal value `tag`."""
    literals = [field.annotation for field in model.model_fields.values()]
    return any(
        get_origin(annotation) is Literal and tag in get_args(annotation) for annotation in literals
    )
