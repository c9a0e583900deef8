"""Named parts of a surface of patches: their order and their checks."""

from itertools import chain
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.errors import MAX_ISSUES, InvalidRequest, Issue, pointer
from service.surface.lowered import Part

PartMembers: TypeAlias = tuple[tuple[str, tuple[int, ...]], ...]
"""Names of parts, each with the numbers of its patches."""


def first_patch(part: tuple[str, tuple[int, ...]]) -> tuple[tuple[int, ...], str]:
    """The key by which parts are sorted: the first patch (if there is one), then the name.

    The order of parts in a request means nothing, because JSON objects have no order.
    """
    name, members = part
    return members[:1], name


def order_parts(
    parts: PartMembers, count: int, name: str
) -> tuple[NDArray[np.intp] | None, tuple[Part, ...]]:
    """Order the patches so that the patches of each part are consecutive.

    Patches without a part come last, as a part with the name of the surface.

    Returns
    -------
    order : ndarray of int, shape (count,), or None
        Patch numbers in the new order; None if `parts` is empty: the order does not change.
    ranges : tuple of Part
        The range of each part in the new order; a part without patches is left out.
    """
    if not parts:
        return None, (Part(name, 0, count),)
    order = np.fromiter(chain.from_iterable(members for _, members in parts), np.intp)
    if len(order) < count:
        has_part = np.zeros(count, bool)
        has_part[order] = True
        order = np.concatenate([order, np.flatnonzero(~has_part)])
    runs: list[Part] = []
    first = 0
    for title, members in parts:
        if members:
            runs.append(Part(title, first, first + len(members)))
            first += len(members)
    if first < count:
        runs.append(Part(name, first, count))
    return order, tuple(runs)


def check_parts(parts: PartMembers, count: int) -> None:
    """Refuse patch numbers that are not 0 … count − 1, and a patch that is listed twice."""
    all_members = [member for _, members in parts for member in members]
    if not all_members or (
        min(all_members) >= 0
        and max(all_members) < count
        and len(set(all_members)) == len(all_members)
    ):
        return
    issues: list[Issue] = []
    seen_members: set[int] = set()
    for title, members in parts:
        for position, member in enumerate(members):
            where = pointer(("parts", title, position))
            if not 0 <= member < count:
                issues.append(
                    Issue(
                        "index_out_of_range",
                        "Parts list the numbers of patches, which begin at 0.",
                        where,
                        str(member),
                        f"0 to {count - 1}",
                    )
                )
            elif member in seen_members:
                issues.append(
                    Issue(
                        "repeated_patch",
                        "A patch belongs to at most one part.",
                        where,
                        f"patch {member} once more",
                        "each patch once",
                    )
                )
            seen_members.add(member)
            if len(issues) == MAX_ISSUES:
                raise InvalidRequest(*issues)
    if issues:
        raise InvalidRequest(*issues)
