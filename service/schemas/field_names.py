"""Suggests what an unknown name was probably meant to be: a documented field, a kind of surface."""

from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel

MAX_LETTERS = 40
"""Longer names get no suggestion: comparing them takes long, and all names are shorter."""


NEAR = 0.7
"""Least similarity of a field that is suggested, from 0 to 1: `format` and `normals` have 0.62."""


def sort_nearest_first(name: str, names: Sequence[str]) -> list[str]:
    """The names in their order, but the one nearest to `name` first, if one is near."""
    near = get_close_matches(name.lower(), names, 1) if len(name) <= MAX_LETTERS else []
    return [*near, *(other for other in names if other not in near)]


def nearest_field(model: type[BaseModel], path: Sequence[str | int]) -> str:
    """The field nearest to the unknown one at the end of pydantic's `path`; empty if none is near.

    Parameters
    ----------
    model : type
        The model of the whole document.
    """
    name = str(path[-1])
    if len(name) > MAX_LETTERS:
        return ""
    models = {model}
    for part in path[:-1]:
        if isinstance(part, str):
            fields = [each.model_fields[part] for each in models if part in each.model_fields]
            inner = {each for field in fields for each in _models_in(field.annotation)}
            # A part that is not a field is pydantic's name for one model of a union.
            models = inner or {each for each in models if _has_tag(each, part)} or models
    names = sorted({field for each in models for field in each.model_fields})
    return next(iter(get_close_matches(name, names, 1, NEAR)), "")


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    value = getattr(annotation, "__value__", annotation)  # of `type Name = …`
    for part in get_args(value):
        yield from _models_in(part)


def _has_tag(model: type[BaseModel], tag: str) -> bool:
    literals = [field.annotation for field in model.model_fields.values()]
    return any(get_origin(each) is Literal and tag in get_args(each) for each in literals)
