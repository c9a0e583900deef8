"""Checks of the values and names of channels.

Values must be finite and within float32; formats must be able to store the colours and names.
All functions raise `InvalidRequest` with pointers relative to the surface.
"""

import re

import numpy as np

from service.bases.arrays import FloatArray
from service.errors import MAX_ISSUES, InvalidRequest, Issue, count_nouns, format_number, pointer
from service.surface.checks import check_stored

MAX_ATTRIBUTES, MAX_ATTRIBUTE_NAME = 16, 32
"""The most attributes of a surface, and the most characters of the name of an attribute."""

ATTRIBUTE_NAME = re.compile(rf"[A-Za-z][A-Za-z0-9_]{{0,{MAX_ATTRIBUTE_NAME - 1}}}", re.ASCII)


def validate_values(
    values: FloatArray, path: tuple[str, ...], min_dimension: int, max_dimension: int, needed: str
) -> FloatArray:
    """The values of a channel as a read-only array (…, d) of finite numbers within float32.

    Parameters
    ----------
    values : array_like
    path : tuple of str
        The field of the surface, for pointers.
    min_dimension, max_dimension : int
        The least and the greatest allowed length d of one value.
    needed : str
        Text for the client: the value that is expected.
    """
    where = pointer(path)
    net = np.array(values, dtype=np.float64, order="C")
    if net.ndim < 2 or net.size == 0 or not min_dimension <= net.shape[-1] <= max_dimension:
        raise InvalidRequest(
            Issue(
                "wrong_dimension",
                "The values of a channel are lists of numbers, all of one length.",
                where,
                "no values"
                if net.size == 0
                else count_nouns(net.shape[-1], "numbers")
                if net.ndim > 1
                else "no lists of numbers",
                needed,
            )
        )
    check_stored(net, where)
    net += 0.0  # −0 becomes 0, so that equal nets have equal bytes
    net.flags.writeable = False
    return net


def check_colors(colors: FloatArray) -> None:
    """Refuse colours with numbers outside [0, 1], for example 255 for white."""
    is_outside = (colors < 0) | (colors > 1)
    if is_outside.any():
        positions = np.argwhere(is_outside)[:MAX_ISSUES]
        raise InvalidRequest(
            *(
                Issue(
                    "out_of_range",
                    "Colours are sRGB, each number from 0 to 1.",
                    "/colors" + pointer(position),
                    format_number(colors[tuple(position)]),
                    "0 to 1",
                )
                for position in positions.tolist()
            )
        )


def check_names(names: list[str]) -> None:
    """Refuse too many attributes, and names that a format cannot write or cannot distinguish."""
    if len(names) > MAX_ATTRIBUTES:
        raise InvalidRequest(
            Issue(
                "wrong_length",
                "The surface has more attributes than formats have room for.",
                "/attributes",
                f"{len(names)} attributes",
                f"at most {MAX_ATTRIBUTES}",
            )
        )
    known_names: set[str] = set()
    for name in names:
        if not ATTRIBUTE_NAME.fullmatch(name):
            raise InvalidRequest(
                Issue(
                    "wrong_value",
                    "The name of an attribute becomes a word in files.",
                    pointer(("attributes", shorten_name(name))),
                    "another name",
                    f"a letter, then letters, digits and _; at most {MAX_ATTRIBUTE_NAME} in all",
                )
            )
        if name.upper() in known_names:
            raise InvalidRequest(_name_clash(name, "a name that differs from another in case only"))
        known_names.add(name.upper())
    # glTF splits an attribute `name` of more than four numbers into `_NAME_0`, `_NAME_1`, ….
    for name in names:
        base = re.sub(r"_[0-9]+\Z", "", name)
        if base != name and base.upper() in known_names:
            raise InvalidRequest(_name_clash(name, "the name of another attribute and a number"))


def shorten_name(name: str) -> str:
    """A name, shortened for a pointer of an issue."""
    return name if len(name) <= MAX_ATTRIBUTE_NAME else name[:MAX_ATTRIBUTE_NAME] + "…"


def _name_clash(name: str, got: str) -> Issue:
    """The issue for an attribute whose name is equal to another in glTF."""
    return Issue(
        "name_clash",
        "glTF writes the names of attributes in upper case, and splits an attribute of more than "
        "four numbers into pieces, each with its number after the name.",
        pointer(("attributes", name)),
        got,
        "another name",
    )
