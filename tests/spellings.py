"""Random spellings of one surface.

A seeded generator changes the order of keys, the blanks and the spelling of numbers and strings,
and writes or leaves out defaults.
"""

from collections.abc import Mapping
from decimal import Decimal
from functools import lru_cache
from random import Random
from typing import Any

from tests.forms import Json

WHOLE_NUMBERS = frozenset({"patches", "triangles", "parts", "degree", "sides"})
"""Fields of whole numbers, which have one spelling: 1.0 is not an index."""

NAMES: Mapping[str, str] = {"tube": "tube", "ribbon": "ribbon", "group": "group"}
"""Default names of surfaces; other kinds are called `surface`."""

DEFAULTS: Mapping[str, Json] = {
    "bezier": {"type": "bezier", "attributes": {}},
    "bspline": {"degree": [3, 3], "knots": ["clamped", "clamped"], "attributes": {}},
    "triangle": {"attributes": {}},
    "patches": {"attributes": {}, "parts": {}},
    "multipatch": {},
    "tube": {"sides": 16, "caps": True},
    "ribbon": {"facing": [0, 0, 1]},
    "group": {},
}
"""Defaults of each kind of surface, without its name and its axis."""

EYE = [[float(i == j) for j in range(4)] for i in range(4)]


def spell_surface(surface: Json, random: Random) -> str:
    """One of the JSON texts of this surface."""
    return _spell_value(_spell_definition(surface, random), random, whole=False)


def _spell_definition(content: Json, random: Random) -> Json:
    """The definition, with or without each of its defaults."""
    kind = content.get("type", "bezier")
    defaults = {"up": "y", "name": NAMES.get(kind, "surface")} | DEFAULTS[kind]
    if "camera" in content:
        del defaults["facing"]
    spelled = _spell_defaults(content, defaults, random)
    for key in {"degree", "knots"} & spelled.keys():
        spelled[key] = _spell_directions(spelled[key], random)
    for key in {"radius", "width"} & spelled.keys():
        if not isinstance(spelled[key], list) and random.random() < 0.5:
            spelled[key] = [spelled[key]]
    if "curve" in spelled:
        spelled["curve"] = _spell_curve(spelled["curve"], random)
    if "surfaces" in spelled:
        spelled["surfaces"] = [_spell_definition(single, random) for single in spelled["surfaces"]]
    if "members" in spelled:
        spelled["members"] = [_spell_member(member, random) for member in spelled["members"]]
    return spelled


def _spell_directions(value: Any, random: Random) -> Any:
    """A value for u and one for v, as a list of two, or as one value if they are equal."""
    one, other = value if isinstance(value, list) else (value, value)
    return one if one == other and random.random() < 0.5 else [one, other]


def _spell_curve(content: Json, random: Random) -> Json:
    defaults: Json = {"type": "bezier"}
    if content.get("type") == "bspline":
        defaults = {"degree": 3, "knots": "clamped"}
    spelled = _spell_defaults(content, defaults, random)
    # Its own name and axis are not read.
    others = {"name": random.choice(["curve", "a curve", "é"]), "up": random.choice("yz")}
    return spelled | {key: value for key, value in others.items() if random.random() < 0.3}


def _spell_member(content: Json, random: Random) -> Json:
    kind = content["surface"].get("type", "bezier")
    named = content["surface"].get("name", NAMES.get(kind, "surface"))
    spelled = _spell_defaults(content, {"name": named, "matrix": EYE}, random)
    if len(spelled.get("color", ())) == 3 and random.random() < 0.5:
        spelled["color"] = [*spelled["color"], 1]
    return spelled | {"surface": _spell_definition(spelled["surface"], random)}


def _spell_defaults(content: Json, defaults: Json, random: Random) -> Json:
    """Each field with its default is written or left out."""
    text = {key: value for key, value in content.items() if value != defaults.get(key)}
    unsaid = {key: value for key, value in defaults.items() if content.get(key, value) == value}
    return text | {key: value for key, value in unsaid.items() if random.random() < 0.5}


def _spell_value(value: Any, random: Random, *, whole: bool) -> str:
    """A random JSON text of a value."""
    blank = random.choice(("", "", "", " ", "\n\t ")) if random.random() < 0.2 else ""
    if isinstance(value, dict):
        keys = random.sample(list(value), len(value))
        items = (
            f"{_spell_string(key, random)}{blank}:"
            + _spell_value(
                value[key], random, whole=whole or (key in WHOLE_NUMBERS and "type" in value)
            )
            for key in keys
        )
        return "{" + blank + ("," + blank).join(items) + blank + "}"
    if isinstance(value, list):
        items = (_spell_value(item, random, whole=whole) for item in value)
        return "[" + blank + ("," + blank).join(items) + blank + "]"
    if isinstance(value, str):
        return _spell_string(value, random)
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value) if whole else random.choice(spell_number(float(value)))


@lru_cache(maxsize=4096)
def spell_number(number: float) -> tuple[str, ...]:
    """Ways to write a number, all of exactly this value."""
    if number == 0:
        return ("0", "-0", "0.0", "-0.0", "0e0", "-0e5", "0.000E-3")
    sign, digits, exponent = Decimal(repr(number)).as_tuple()
    assert isinstance(exponent, int)
    text = ("-" if sign else "") + "".join(map(str, digits))
    plain = f"{Decimal(repr(number)):f}"
    result = [
        repr(number),
        plain,
        f"{text}e{exponent}",
        f"{text}0E{exponent - 1:+d}",
        f"{text}.0e{exponent}",
        f"{plain}{'00' if '.' in plain else '.00'}",
        f"{Decimal(repr(number)):e}",
    ]
    if number == int(number):
        result += [str(int(number)), str(int(number)) + "e0", str(int(number)) + "0e-1"]
    assert all(float(numeral) == number for numeral in result)
    return tuple(result)


def _spell_string(text: str, random: Random) -> str:
    """A string with some of its characters escaped; it has no characters that must be escaped."""
    if random.random() < 0.9:
        return f'"{text}"'
    return '"' + "".join(_escape_character(c) if random.random() < 0.5 else c for c in text) + '"'


def _escape_character(character: str) -> str:
    units = character.encode("utf-16-be")
    return "".join(f"\\u{units[k]:02x}{units[k + 1]:02X}" for k in range(0, len(units), 2))
