"""Entities of a file, parsed when they are asked for.

A simple instance lists the attributes of all its supertypes in one record, a complex one has a
record for each type. `Entity.parameters` is the same list for both.

References
----------
ISO 10303-21, clause 11.2: internal and external mapping; ISO 10303-41 to 46: the entities.
"""

import re
from collections.abc import Iterable, Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.frames import Vector
from service.decoders.format import FileLimits
from service.decoders.step.budget import Budget
from service.decoders.step.faults import Fault
from service.decoders.step.instances import Instances
from service.decoders.step.records import MAX_NUMBER, Parameter, as_list, as_number, parse_record
from service.decoders.step.supertypes import SUPERTYPES

FEW_POINTS = 3
"""So few points are read one by one."""

_POINT = re.compile(r"\s*+CARTESIAN_POINT\s*+\(\s*+'[^']*+'\s*+,\s*+\(([^()']*+)\)\s*+\)")
_REFERENCE = re.compile(r"'[^']*+'|#([0-9]{1,18})")
_DIRECTION = re.compile(r"\s*+DIRECTION\s*+\(\s*+'[^']*+'\s*+,\s*+\(([^()']*+)\)\s*+\)")


class Entity(NamedTuple):
    """One instance: its type, its parameters, and the records of which it consists.

    Attributes
    ----------
    number : int
    keyword : str
        The type; of a complex instance the one that is read, or else all of them, joined by `+`.
    parameters : list
        Those of the type and of its supertypes, from the root on.
    parts : dict
        The parameters in each record, by keyword.
    """

    number: int
    keyword: str
    parameters: list[Parameter]
    parts: dict[str, list[Parameter]]

    def parameter(self, index: int) -> Parameter:
        """One parameter, counted from 0, or from −1 backwards."""
        try:
            return self.parameters[index]
        except IndexError:
            raise Fault("a parameter is missing") from None

    def has_parts(self, *keywords: str) -> bool:
        """Whether the instance has each of these types."""
        return all(keyword in self.parts for keyword in keywords)


class Entities:
    """The entities of a file, by number."""

    def __init__(self, content: bytes, limits: FileLimits) -> None:
        """Find the instances of a file; the errors are those of `Instances`."""
        self.instances = Instances(content, limits)
        self.budget = Budget(limits, len(content))
        self._text = self.instances.text

    def read(self, number: int) -> Entity:
        """The entity with a number.

        Raises
        ------
        Fault
            The file has no entity with this number, or its record is malformed.
        InvalidRequest
            `too_costly`: records of the file have been parsed far more often than files need.
        """
        start, end = self._span(number)
        parts = parse_record(self._text[start:end])
        if len(parts) == 1:
            for keyword, parameters in parts.items():
                return Entity(number, keyword, parameters, parts)
        for keyword, supertypes in SUPERTYPES.items():
            if keyword in parts:
                types = (*supertypes, keyword)
                flat = [each for type_ in types for each in parts.get(type_, ())]
                return Entity(number, keyword, flat, parts)
        return Entity(number, "+".join(sorted(parts)), [], parts)

    def read_as(self, number: int, *keywords: str) -> Entity:
        """The entity with a number, which has one of these types."""
        entity = self.read(number)
        if entity.keyword not in keywords:
            raise Fault(f"#{number} is not {_join_words(keywords)}")
        return entity

    def read_all(self, *keywords: str) -> Iterable[Entity | Fault]:
        """All entities of these types, or a fault in place of one that is malformed."""
        for row in self.instances.rows_of(*keywords):
            number = int(self.instances.numbers[row])
            try:
                entity = self.read(number)
            except Fault as fault:
                yield fault
            else:
                # The keywords of complex instances were found without parsing.
                is_one = any(keyword in entity.parts for keyword in keywords)
                yield entity if is_one else Fault("it is not a record")

    def has(self, number: int) -> bool:
        """Whether the file has an entity with this number."""
        return self.instances.find(number) >= 0

    def point(self, number: int) -> Vector:
        """Coordinates of a CARTESIAN_POINT; those that it lacks are 0."""
        start, end = self._span(number)
        match = _POINT.match(self._text, start, end)
        if match is None:
            entity = self.read_as(number, "CARTESIAN_POINT")
            return _to_triple([as_number(item) for item in as_list(entity.parameter(1))])
        try:
            return _to_triple(list(map(float, match[1].split(","))))
        except ValueError:
            raise Fault("a coordinate is not a number") from None

    def points(self, numbers: Sequence[int]) -> FloatArray:
        """Coordinates of points, (n, 3)."""
        rows = self.instances.find_all(numbers)
        if len(numbers) >= FEW_POINTS and rows.min() >= 0:
            starts, ends = self.instances.starts[rows], self.instances.ends[rows]
            self.budget.charge_characters(int((ends - starts).sum()))
            match, text = _POINT.match, self._text
            pairs = zip(starts.tolist(), ends.tolist(), strict=True)
            found = [each[1] for each in (match(text, *pair) for pair in pairs) if each]
            try:
                values = np.array(list(map(float, ",".join(found).split(","))))
            except ValueError:
                values = np.empty(0)
            if len(found) == len(numbers) and len(values) == 3 * len(numbers):
                if not np.abs(values).max() <= MAX_NUMBER:
                    raise Fault("a coordinate is too large")
                return values.reshape(-1, 3)
        return np.array([self.point(number) for number in numbers], np.float64).reshape(-1, 3)

    def direction(self, number: int) -> Vector:
        """Ratios of a DIRECTION, as they stand in the file; those that it lacks are 0."""
        start, end = self._span(number)
        match = _DIRECTION.match(self._text, start, end)
        if match is None:
            entity = self.read_as(number, "DIRECTION")
            return _to_triple([as_number(item) for item in as_list(entity.parameter(1))])
        try:
            return _to_triple(list(map(float, match[1].split(","))))
        except ValueError:
            raise Fault("a ratio of a direction is not a number") from None

    def find_keyword(self, number: int) -> str:
        """The keyword of an entity without parsing it; empty if there is no such entity."""
        row = self.instances.find(number)
        return self.instances.keyword(row) if row >= 0 else ""

    def find_references(self, number: int, most: int) -> list[int]:
        """The first references in an entity, without parsing it."""
        start, end = self._span(number)
        matches = islice(_REFERENCE.finditer(self._text, start, end), most)
        return [int(match[1]) for match in matches if match[1]]

    def match(self, number: int, pattern: re.Pattern[str]) -> re.Match[str] | None:
        """Match a pattern with the record of an entity: for the most frequent types."""
        start, end = self._span(number)
        return pattern.match(self._text, start, end)

    def _span(self, number: int) -> tuple[int, int]:
        row = self.instances.find(number)
        if row < 0:
            raise Fault(f"the file has no entity #{number}")
        start, end = self.instances.span(row)
        self.budget.charge_characters(end - start)
        return start, end


def unsupported(entity: Entity, role: str) -> Fault:
    """The fault for an entity of a type that is not read; `role` is what it is used as."""
    return Fault(f"{role} is {_article(entity.keyword)} {entity.keyword}, which is not read")


def _article(word: str) -> str:
    return "an" if word[:1] in "AEIOU" else "a"


def _join_words(keywords: tuple[str, ...]) -> str:
    return " or ".join(f"{_article(keyword)} {keyword}" for keyword in keywords)


def _to_triple(numbers: list[float]) -> Vector:
    x, y, z = numbers if len(numbers) == 3 else (*numbers, 0.0, 0.0, 0.0)[:3]
    # A comparison with a number that is no number is false.
    if abs(x) <= MAX_NUMBER and abs(y) <= MAX_NUMBER and abs(z) <= MAX_NUMBER:
        return x, y, z
    raise Fault("a coordinate is too large")
