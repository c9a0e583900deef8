"""A small reader of IGES files for tests, which shares no code with ours."""

from collections import Counter
from dataclasses import dataclass


@dataclass(frozen=True)
class Entity:
    """An entity: its type, form, parameters after the type, colour, matrix and status."""

    kind: int
    form: int
    values: list[str]
    color: int
    matrix: int
    status: str

    @property
    def numbers(self) -> list[float]:
        return [float(value.replace("D", "E")) for value in self.values]


def read(content: bytes) -> tuple[list[str], dict[int, Entity]]:
    """The global parameters and all entities by number; asserts the form of the records."""
    lines = content.decode("ascii").splitlines()
    assert all(len(line) == 80 for line in lines)
    assert content.endswith(b"\n")
    sections: dict[str, list[str]] = {}
    for line in lines:
        sections.setdefault(line[72], []).append(line)
        assert int(line[73:]) == len(sections[line[72]])
    assert list(sections) == ["S", "G", "D", "P", "T"]
    last = sections["T"][0]
    assert [last[8 * k : 8 * k + 8] for k in range(4)] == [
        f"{name}{len(sections[name]):7d}" for name in "SGDP"
    ]
    globals_ = split("".join(line[:72] for line in sections["G"]), 72)
    entities = {}
    taken: Counter[int] = Counter()
    directory, parameters = sections["D"], sections["P"]
    for k in range(0, len(directory), 2):
        first = [directory[k][8 * c : 8 * c + 8] for c in range(9)]
        second = [directory[k + 1][8 * c : 8 * c + 8] for c in range(9)]
        begin, count = int(first[1]) - 1, int(second[3])
        own = parameters[begin : begin + count]
        taken.update(range(begin, begin + count))
        assert all(int(line[64:72]) == k + 1 for line in own)
        kind, *values = split("".join(line[:64] for line in own), 64)
        assert kind.strip() == first[0].strip() == second[0].strip()
        entities[k + 1] = Entity(
            int(kind), int(second[4]), values, int(second[2]), int(first[6]), first[8]
        )
    assert taken == Counter(range(len(parameters)))
    return globals_, entities


def split(text: str, width: int) -> list[str]:
    """The parameters of a text that ends with a semicolon; strings without their lengths.

    Asserts that every number is on one record of this width, with the delimiter after it.
    """
    values = []
    place = 0
    while True:
        end = place
        while text[end].isdigit() or text[end] == " ":
            end += 1
        if text[end] == "H":
            count = int(text[place:end])
            values.append(text[end + 1 : end + 1 + count])
            end += 1 + count
        else:
            while text[end] not in ",;":
                end += 1
            values.append(text[place:end].strip())
            assert (end - len(text[place:end].lstrip())) // width == end // width
        if text[end] == ";":
            assert not text[end + 1 :].strip()
            return values
        assert text[end] == ","
        place = end + 1
