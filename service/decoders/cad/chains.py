"""The directions in which the edges of a loop follow each other."""

from collections.abc import Sequence


def find_turned(ends: Sequence[tuple[int, int]], can_turn: Sequence[bool]) -> list[int]:
    """The edges of a loop that must be turned around, so that each begins where the last one ends.

    Some files have edges whose vertices are swapped.

    Parameters
    ----------
    ends : sequence of pairs of ints
        The vertices from which and to which each edge of the loop runs.
    can_turn : sequence of bool
        Whether an edge has the same points in the other direction. An arc of a circle does not: it
        would be the rest of the circle.

    Returns
    -------
    list of int
        Less than half of the edges: they would say as well that the loop runs the other way. Empty
        if no edge is to be turned, or if that does not close the loop.
    """
    for is_first_turned in (False, True):
        turned = _follow(ends, can_turn, is_first_turned)
        if turned is not None and 2 * len(turned) < len(ends):
            return turned
    return []


def _follow(
    ends: Sequence[tuple[int, int]], can_turn: Sequence[bool], is_first_turned: bool
) -> list[int] | None:
    """The turned edges of a closed chain; None if the chain breaks or stays open."""
    begin, vertex = ends[0][::-1] if is_first_turned else ends[0]
    if is_first_turned and not can_turn[0]:
        return None
    turned = [0] if is_first_turned else []
    for number, (first, last) in enumerate(ends[1:], start=1):
        if first == vertex:
            vertex = last
        elif last == vertex and can_turn[number]:
            vertex = first
            turned.append(number)
        else:
            return None
    return turned if vertex == begin else None
