"""Colours of solids, shells, faces and instances.

A style is a short tree of entities; the first colour of a surface in it counts. Styles of curves
and points, layers and invisibility do not count.

References
----------
ISO 10303-46: styled_item, over_riding_styled_item, surface_style_usage, colour_rgb,
draughting_pre_defined_colour, surface_style_transparent.
"""

from service.decoders.step.entities import Entities, Entity
from service.decoders.step.faults import Fault
from service.decoders.step.instances import COMPLEX
from service.decoders.step.records import as_number, as_reference, as_text, find_references

MAX_VISITS = 32
"""The most entities of one style that are looked at."""

NAMED_COLORS = {
    "red": (1.0, 0.0, 0.0),
    "green": (0.0, 1.0, 0.0),
    "blue": (0.0, 0.0, 1.0),
    "yellow": (1.0, 1.0, 0.0),
    "magenta": (1.0, 0.0, 1.0),
    "cyan": (0.0, 1.0, 1.0),
    "black": (0.0, 0.0, 0.0),
    "white": (1.0, 1.0, 1.0),
}

Color = tuple[float, ...]

_CONTEXT_DEPENDENT = "CONTEXT_DEPENDENT_OVER_RIDING_STYLED_ITEM"
_STYLED = ("STYLED_ITEM", "OVER_RIDING_STYLED_ITEM", _CONTEXT_DEPENDENT)
_PREDEFINED = ("DRAUGHTING_PRE_DEFINED_COLOUR", "PRE_DEFINED_COLOUR")
_COLORS = ("COLOUR_RGB", *_PREDEFINED)
_TRANSPARENT = "SURFACE_STYLE_TRANSPARENT"
_OF_SURFACES = ("SURFACE_", "FILL_AREA_", "PRESENTATION_STYLE_", *_COLORS, COMPLEX)
"""How the types in a style of a surface begin; those of styles of curves and points do not."""


class Styles:
    """Colours by the number of the entity that has them."""

    def __init__(self, entities: Entities) -> None:
        self._entities = entities
        self._colors_of_styles: dict[int, Color | None] = {}
        self._colors: dict[int, Color] = {}
        for keyword in _STYLED:  # those that over-ride others come later
            for entity in entities.read_all(keyword):
                if isinstance(entity, Entity):
                    self._read_styled(entity)

    def find(self, *numbers: int) -> Color | None:
        """The colour of the first of these entities that has one."""
        for number in numbers:
            if number in self._colors:
                return self._colors[number]
        return None

    def _read_styled(self, item: Entity) -> None:
        try:
            styles = find_references([item.parameter(1)])
            styled = as_reference(item.parameter(2))
            color = next(filter(None, map(self._find_color, styles[:MAX_VISITS])), None)
            if color is None:
                return
            if item.keyword == _CONTEXT_DEPENDENT:
                # The style of an item where one instance of it is.
                for number in find_references([item.parameter(-1)])[-1:]:
                    self._colors[number] = color
            else:
                self._colors[styled] = color
        except Fault:
            return

    def _find_color(self, style: int) -> Color | None:
        if style not in self._colors_of_styles:
            self._colors_of_styles[style] = self._search(style)
        return self._colors_of_styles[style]

    def _search(self, style: int) -> Color | None:
        """Look for a colour, and for a transparency, in the order of the file."""
        pending, seen = [style], {style}
        color: Color | None = None
        transparency = 0.0
        while pending and len(seen) <= MAX_VISITS:
            number = pending.pop()
            keyword = self._entities.find_keyword(number)
            if not keyword.startswith(_OF_SURFACES):
                continue
            try:
                if keyword in _COLORS or keyword == COMPLEX:
                    color = color or _read_color(self._entities.read(number))
                elif keyword == _TRANSPARENT:
                    transparency = as_number(self._entities.read(number).parameter(0))
                found = self._entities.find_references(number, MAX_VISITS)
            except Fault:
                continue
            found = [each for each in found if each not in seen]
            seen.update(found)
            pending.extend(reversed(found))
        if color is not None and 0.0 < transparency <= 1.0:
            return (*color, 1.0 - transparency)
        return color


def _read_color(entity: Entity) -> Color | None:
    if "COLOUR_RGB" in entity.parts:
        values = [as_number(each) for each in entity.parts["COLOUR_RGB"][-3:]]
        if len(values) == 3:
            return tuple(min(max(value, 0.0), 1.0) for value in values)
    for keyword in _PREDEFINED:
        name = entity.parts.get(keyword) or entity.parts.get("PRE_DEFINED_ITEM")
        if keyword in entity.parts and name:
            return NAMED_COLORS.get(as_text(name[0]).strip().lower())
    return None
