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
    """The sort key of parts, since JSON objects have no order."""
    name, members = part
    return members[:1], name


def order_parts(
    parts: PartMembers, count: int, name: str
) -> tuple[NDArray[np.intp] | None, tuple[Part, ...]]:
    """An order of the patches in which each part is one range, and these ranges.

    The order is None if there are no parts: then one range covers all patches. Patches without a
    part come last, in a range with the name of the surface.
    """
    if not parts:
        return None, (Part(name, 0, count),)
    order = np.fromiter(chain.from_iterable(members for _, members in parts), np.intp)
    if len(order) < count:
        is_left = np.ones(count, bool)
        is_left[order] = False
        order = np.concatenate([order, is_left.nonzero()[0]])
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
    """Refuse parts with a patch that does not exist, or with one patch twice."""
    named = [member for _, members in parts for member in members]
    if not named or (min(named) >= 0 and max(named) < count and len(set(named)) == len(named)):
        return
    issues: list[Issue] = []
    owner: set[int] = set()
    for title, members in parts:
        for position, member in enumerate(members):
            where = pointer(("parts", title, position))
            if not 0 <= member < count:
                issues.append(
                    Issue(
                        "index_out_of_range",
                        "Parts list patches by number from 0.",
                        where,
                        str(member),
                        f"0 to {count - 1}",
                    )
                )
            elif member in owner:
                issues.append(
                    Issue(
                        "repeated_patch",
                        "A patch belongs to at most one part.",
                        where,
                        f"patch {member} once more",
                        "each patch once",
                    )
                )
            owner.add(member)
            if len(issues) == MAX_ISSUES:
                raise InvalidRequest(*issues)
    if issues:
        raise InvalidRequest(*issues)
