"""The global section of a file: delimiters, unit, resolution, and the system that wrote it.

References
----------
IGES 5.3, section 2.2.4.3: the parameters of the global section, with their defaults.
"""

import re
from dataclasses import dataclass

from service.decoders.iges.faults import Fault
from service.decoders.iges.records import Parameters, split_words

_INCH, _NAMED = 1, 3
_UNITS = {
    1: ("inch", 0.0254),
    2: ("millimetre", 0.001),
    4: ("foot", 0.3048),
    5: ("mile", 1609.344),
    6: ("metre", 1.0),
    7: ("kilometre", 1000.0),
    8: ("mil", 0.0254e-3),
    9: ("micron", 1e-6),
    10: ("centimetre", 0.01),
    11: ("microinch", 0.0254e-6),
}
_NAMES = {
    "IN": 1, "INCH": 1, "INCHES": 1, "MM": 2, "MILLIMETER": 2, "MILLIMETRE": 2, "MILLIMETERS": 2,
    "FT": 4, "FOOT": 4, "FEET": 4, "MI": 5, "MILE": 5, "M": 6, "METER": 6, "METRE": 6,
    "METERS": 6, "KM": 7, "MIL": 8, "UM": 9, "MICRON": 9, "CM": 10, "CENTIMETER": 10,
    "CENTIMETRE": 10, "UIN": 11, "MICROINCH": 11,
}  # fmt: skip
_VERSIONS = {
    1: "1.0", 2: "ANSI Y14.26M-1981", 3: "2.0", 4: "3.0", 5: "ANSI Y14.26M-1987", 6: "4.0",
    7: "ANSI Y14.26M-1989", 8: "5.0", 9: "5.1", 10: "5.2", 11: "5.3",
}  # fmt: skip
_DEFAULT_VERSION = 3

_DELIMITER = re.compile(r" *1H(.)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Header:
    """The global section.

    Attributes
    ----------
    delimiters : tuple of two str
        The sign between parameters, and the sign at the end of a record.
    name : str
        The product, as the sender calls it; empty if it is the name of the system.
    system : str
    schema : str
        The version of IGES.
    unit : str
        Name of the unit, as this module or, if it does not know it, as the file says.
    metres_per_unit : float or None
        None for a unit that this module does not know.
    resolution : float
        Coordinates that differ by less are equal, in units; 0 if the file does not say it.
    """

    delimiters: tuple[str, str]
    name: str
    system: str
    schema: str
    unit: str
    metres_per_unit: float | None
    resolution: float


def read_header(text: str) -> Header:
    """Read the global section; what is left out or damaged has its default."""
    delimiters = _find_delimiters(text)
    words = Parameters(split_words(text, delimiters))
    unit, metres = _read_unit(words)
    scale = _read_number(words, 12, 1.0)
    if metres is not None and scale > 0:
        # Ratio of a length in the file to the real one.
        metres /= scale
    name, systems = words.text(2), (words.text(4), words.text(5))
    return Header(
        delimiters,
        name="" if name in systems else name,
        system=systems[0] or systems[1],
        schema="IGES " + _VERSIONS.get(int(_read_number(words, 22, _DEFAULT_VERSION)), "5.3"),
        unit=unit,
        metres_per_unit=metres,
        resolution=max(0.0, _read_number(words, 18, 0.0)),
    )


def _find_delimiters(text: str) -> tuple[str, str]:
    """The first two parameters: strings of one character; if left out, they are `,` and `;`."""
    first = _DELIMITER.match(text)
    between = first[1] if first else ","
    second = _DELIMITER.match(text, first.end() + 1 if first else text.find(between) + 1)
    return between, second[1] if second else ";"


def _read_unit(words: Parameters) -> tuple[str, float | None]:
    flag = int(_read_number(words, 13, 0.0))
    name = words.text(14).strip()
    if flag not in _UNITS:
        # The flag 3 says that the name counts; so does it if the flag is damaged or left out.
        if flag != _NAMED and not name:
            flag = _INCH
        flag = _NAMES.get(name.upper(), flag)
    return _UNITS.get(flag, (name, None))


def _read_number(words: Parameters, position: int, default: float) -> float:
    try:
        return words.number(position, default)
    except Fault:
        return default
