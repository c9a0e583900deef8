"""Groups of one level of a file, with their parts and instances.

References
----------
IGES 5.3, section 4.90 (402, forms 1, 7, 14 and 15).
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass, field, replace

from service.decoders.cad.content import Definition, Part, Placement
from service.decoders.iges.entities import MAX_NESTING
from service.decoders.iges.readers import Readers
from service.decoders.iges.references import GROUP, list_children

LEVEL = 0
"""The group of members without a group: the level itself."""


@dataclass(eq=False, slots=True)
class _Group:
    """A group while its content is read."""

    name: str
    parent: int
    parts: list[Part] = field(default_factory=list)
    placements: list[Placement] = field(default_factory=list)


class Groups:
    """The tree of groups.

    Attributes
    ----------
    owners : dict
        For each member its group; each is in one group only, the first one that lists it.
    hidden : list of int
        Members and groups that are not to be shown, and members of such groups.
    """

    def __init__(
        self, name: str, readers: Readers, types: Container[int], members: Sequence[int]
    ) -> None:
        """Sort members of the given types into groups, which are among the members."""
        self.owners: dict[int, int] = {}
        self.hidden: list[int] = []
        self._groups = {LEVEL: _Group(name, LEVEL)}
        file = readers.file
        nested = {
            child
            for number in members
            if file.type(number) == GROUP
            for child in list_children(file, number)
        }
        # Groups first, so that what is both in a group and a member itself is in the group.
        ordered = sorted(members, key=lambda number: (file.type(number) != GROUP, number in nested))
        pending = [(number, LEVEL, 0, False) for number in reversed(ordered)]
        seen: set[int] = set()
        while pending:
            number, group, depth, is_hidden = pending.pop()
            kind = file.type(number)
            if number in seen or kind not in types:
                continue
            seen.add(number)
            is_hidden = is_hidden or bool(file.directory.is_blanked[file.row(number)])
            if is_hidden:
                self.hidden.append(number)
            elif kind != GROUP:
                self.owners[number] = group
            if kind == GROUP and depth < MAX_NESTING:
                self._groups[number] = _Group(readers.attributes.find_name(number), group)
                children = reversed(list_children(file, number))
                pending += [(child, number, depth + 1, is_hidden) for child in children]

    def add_part(self, members: Sequence[int], part: Part) -> None:
        """Add a part to the innermost group that has all of some members in it."""
        common = self._list_above(self.owners[members[0]])
        for group in {self.owners[member] for member in members}:
            above = set(self._list_above(group))
            common = [each for each in common if each in above]
        self._groups[common[0]].parts.append(part)

    def add_placement(self, member: int, placement: Placement) -> None:
        """Add an instance to the group of a member."""
        self._groups[self.owners[member]].placements.append(placement)

    def compose(self, definitions: list[Definition]) -> int:
        """Add the definition of the level, and those of named groups; returns its number.

        Named groups of several parts are placed once. Other groups give their name, if they have
        one, to their only part.
        """
        for number, group in reversed(self._groups.items()):
            if number == LEVEL:
                break
            parent = self._groups[group.parent]
            if not group.name:
                parent.parts[:0] = group.parts
                parent.placements[:0] = group.placements
            elif len(group.parts) == 1 and not group.placements:
                (part,) = group.parts
                parent.parts.insert(0, replace(part, name=part.name or group.name))
            elif group.parts or group.placements:
                parent.placements.insert(0, Placement(_define(group, definitions)))
        return _define(self._groups[LEVEL], definitions)

    def _list_above(self, group: int) -> list[int]:
        """A group and all groups that it is in, the level itself last."""
        found = [group]
        while group != LEVEL:
            group = self._groups[group].parent
            found.append(group)
        return found


def _define(group: _Group, definitions: list[Definition]) -> int:
    definitions.append(Definition(group.name, tuple(group.parts), tuple(group.placements)))
    return len(definitions) - 1
