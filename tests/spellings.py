"""Random JSON texts that all define the same surface.

The texts differ in the order of keys, in blanks, in the spelling of numbers and strings, and in
which defaults are written. A seeded generator makes the choices, so tests can repeat them.
"""

from collections.abc import Mapping
from decimal import Decimal
from functools import lru_cache
from random import Random
from typing import Any

from tests.forms import Json

WHOLE_NUMBERS = frozenset({"patches", "triangles", "parts", "degree", "sides"})
"""Fields of whole numbers: each number has only one spelling, because the service refuses 1.0."""

NAMES: Mapping[str, str] = {"tube": "tube", "ribbon": "ribbon", "group": "group"}
"""Default names of surfaces by kind; for all other kinds the default is `surface`."""

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
"""Default values of fields by kind of surface, except `name` and `up`."""

IDENTITY = [[float(i == j) for j in range(4)] for i in range(4)]


def spell_surface(surface: Json, random: Random) -> str:
    """A random JSON text that defines this surface."""
    return _spell_value(_spell_definition(surface, random), random, whole=False)


def _spell_definition(content: Json, random: Random) -> Json:
    """An equal definition: each default is written or left out; `[x, x]` or `[x]` may be `x`."""
    kind = content.get("type", "bezier")
    defaults = {"up": "y", "name": NAMES.get(kind, "surface")} | DEFAULTS[kind]
    if "camera" in content:
        del defaults["facing"]
    spelling = _spell_defaults(content, defaults, random)
    for key in {"degree", "knots"} & spelling.keys():
        spelling[key] = _spell_directions(spelling[key], random)
    for key in {"radius", "width"} & spelling.keys():
        if not isinstance(spelling[key], list) and random.random() < 0.5:
            spelling[key] = [spelling[key]]
    if "curve" in spelling:
        spelling["curve"] = _spell_curve(spelling["curve"], random)
    if "surfaces" in spelling:
        spelling["surfaces"] = [
            _spell_definition(single, random) for single in spelling["surfaces"]
        ]
    if "members" in spelling:
        surfaces = spelling.get("definitions", [])
        spelling["members"] = [
            _spell_member(member, surfaces, random) for member in spelling["members"]
        ]
    if "definitions" in spelling:
        spelling["definitions"] = [
            _spell_definition(single, random) for single in spelling["definitions"]
        ]
    return spelling


def _spell_directions(value: Any, random: Random) -> Any:
    """A value for u and one for v, as a list of two, or as one value if they are equal."""
    for_u, for_v = value if isinstance(value, list) else (value, value)
    return for_u if for_u == for_v and random.random() < 0.5 else [for_u, for_v]


def _spell_curve(content: Json, random: Random) -> Json:
    defaults: Json = {"type": "bezier"}
    if content.get("type") == "bspline":
        defaults = {"degree": 3, "knots": "clamped"}
    spelling = _spell_defaults(content, defaults, random)
    # The service ignores the name and the up axis of a curve that is swept.
    ignored = {"name": random.choice(["curve", "a curve", "é"]), "up": random.choice("yz")}
    return spelling | {key: value for key, value in ignored.items() if random.random() < 0.3}


def _spell_member(content: Json, surfaces: list[Json], random: Random) -> Json:
    """An equal member: the surface may be its own, or one of the definitions `surfaces`."""
    if "definition" in content:
        if random.random() < 0.5:
            return _spell_defaults(content, {"matrix": IDENTITY}, random)
        content = {key: value for key, value in content.items() if key != "definition"} | {
            "surface": surfaces[content["definition"]]
        }
    elif "surface" not in content:
        return _spell_defaults(content, {"name": "assembly", "matrix": IDENTITY}, random)
    kind = content["surface"].get("type", "bezier")
    default_name = content["surface"].get("name", NAMES.get(kind, "surface"))
    spelling = _spell_defaults(content, {"name": default_name, "matrix": IDENTITY}, random)
    if len(spelling.get("color", ())) == 3 and random.random() < 0.5:
        spelling["color"] = [*spelling["color"], 1]
    return spelling | {"surface": _spell_definition(spelling["surface"], random)}


def _spell_defaults(content: Json, defaults: Json, random: Random) -> Json:
    """An equal definition: each field that has its default value is written or left out."""
    others = {key: value for key, value in content.items() if value != defaults.get(key)}
    optional = {key: value for key, value in defaults.items() if content.get(key, value) == value}
    return others | {key: value for key, value in optional.items() if random.random() < 0.5}


def _spell_value(value: Any, random: Random, *, whole: bool) -> str:
    """A random JSON text of a value; with `whole`, its numbers are integers."""
    blank = random.choice(("", "", "", " ", "\n\t ")) if random.random() < 0.2 else ""
    if isinstance(value, dict):
        keys = random.sample(list(value), len(value))
        # Only a definition has a `type`; attributes may have the same names as `WHOLE_NUMBERS`.
        items = (
            f"{_spell_string(key, random)}{blank}:"
            + _spell_value(
                value[key],
                random,
                whole=whole
                or (key in WHOLE_NUMBERS and "type" in value)
                or (key in ("definition", "parent") and type(value[key]) is int),
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
    """Numerals of JSON for exactly this number."""
    if number == 0:
        return ("0", "-0", "0.0", "-0.0", "0e0", "-0e5", "0.000E-3")
    sign, digits, exponent = Decimal(repr(number)).as_tuple()
    assert isinstance(exponent, int)
    text = ("-" if sign else "") + "".join(map(str, digits))
    plain = f"{Decimal(repr(number)):f}"
    numerals = [
        repr(number),
        plain,
        f"{text}e{exponent}",
        f"{text}0E{exponent - 1:+d}",
        f"{text}.0e{exponent}",
        f"{plain}{'00' if '.' in plain else '.00'}",
        f"{Decimal(repr(number)):e}",
    ]
    if number == int(number):
        numerals += [str(int(number)), str(int(number)) + "e0", str(int(number)) + "0e-1"]
    assert all(float(numeral) == number for numeral in numerals)
    return tuple(numerals)


def _spell_string(text: str, random: Random) -> str:
    """A JSON text of a string; in one of ten, about half of the characters are escaped.

    The string must have no characters that JSON requires to escape.
    """
    if random.random() < 0.9:
        return f'"{text}"'
    characters = (_escape_character(each) if random.random() < 0.5 else each for each in text)
    return f'"{"".join(characters)}"'


def _escape_character(character: str) -> str:
    """The character as escapes of JSON whose digits are lower case, then upper case."""
    units = character.encode("utf-16-be")
    return "".join(f"\\u{units[k]:02x}{units[k + 1]:02X}" for k in range(0, len(units), 2))
