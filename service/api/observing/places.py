"""What a path stands for: a route, a surface, a format; never more of it than that.

Whatever is counted or logged by path is so by these: there are few routes, and nothing that a
client made up gets into a label or a line.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from starlette.routing import BaseRoute, Route

from service.encoders.registry import FORMATS
from service.storage.keys import is_id
from service.surface.examples import EXAMPLES

UNMATCHED = "unmatched"
"""The route of all paths that lead nowhere."""

QUIET = frozenset({"/health/live", "/health/ready", "/metrics"})
"""Routes that machines ask every few seconds: logged for debugging only."""

REMEMBERED, LETTERS = 4096, 200
"""Paths with something variable that are remembered, and how long they may be."""


@dataclass(frozen=True, slots=True)
class Place:
    """What is known from a path.

    Attributes
    ----------
    route : str
        The template, such as `/v1/surfaces/{id}`.
    shown : str
        The template with what is known filled in: the id of a surface, the suffix of a format.
    surface : str
        The id of a surface: of an example, or a hash.
    format : str
        Name of the format that the suffix stands for.
    """

    route: str
    shown: str
    surface: str = ""
    format: str = ""

    @property
    def quiet(self) -> bool:
        """Whether its requests are of no interest."""
        return self.route in QUIET


NOWHERE = Place(UNMATCHED, "(no such path)")

_FORMATS = {fmt.suffix: fmt.name for fmt in FORMATS}


class Places:
    """The places of an application, by path."""

    def __init__(self, routes: Iterable[BaseRoute]) -> None:
        found = [route for route in routes if isinstance(route, Route)]
        self._fixed = {
            route.path: Place(route.path, route.path)
            for route in found
            if not route.param_convertors
        }
        self._variable = [
            (route.path, route.path_regex) for route in found if route.param_convertors
        ]
        self._remembered: dict[str, Place] = {}

    def at(self, path: str) -> Place:
        """What a path stands for."""
        place = self._fixed.get(path) or self._remembered.get(path)
        if place is None:
            place = self._looked_up(path)
            if place is not NOWHERE and len(path) <= LETTERS:
                if len(self._remembered) >= REMEMBERED:
                    self._remembered.clear()
                self._remembered[path] = place
        return place

    def _looked_up(self, path: str) -> Place:
        for template, pattern in self._variable:
            found = pattern.match(path)
            if found is not None:
                return _place(template, found)
        return NOWHERE


def _place(template: str, found: re.Match[str]) -> Place:
    parts = found.groupdict()
    id, suffix = parts.get("id", ""), parts.get("suffix", "")
    shown, surface = template, ""
    if id in EXAMPLES or is_id(id):
        surface, shown = id, shown.replace("{id}", id)
    if suffix in _FORMATS:
        shown = shown.replace("{suffix}", suffix)
    return Place(template, shown, surface, _FORMATS.get(suffix, ""))
