"""Parts for the judge of questions: the solids of the tests, generated parts, closed forms, groups.

A case is made again from its name: `solid gear`, `gaps 5003` (a family of `make certify` and a
seed), `form hollow ball`, `group 3`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain
from types import MappingProxyType
from typing import Any

import numpy as np

from oracles.brep_documents import Array
from oracles.forms import Ball, Box, Form, Hollow, Moved, Plate, Ring, Several, Turned
from oracles.solids import VALID, read_solid
from tools.certify.more_parts import join_void
from tools.certify.part_curves import Loop, Random, draw_arc, draw_segments, reverse_loop
from tools.certify.part_documents import (
    Document,
    build_prism,
    draw_move,
    move_document,
)
from tools.certify.parts import build_part

FIRST_SEED = 9000
"""The first seed of generated parts; `make certify` uses others."""

FAMILIES = (
    *("plates", "sheets", "cut cylinders", "thin parts", "trimmed tori", "bands around", "caps"),
    *("trimmed freeform", "gaps", "wrong curves", "moved parts", "many holes", "voids"),
    *("edges of 1e-9", "close knots", "no loops", "across the seam"),
)
"""Families of `tools.certify.parts`."""


@dataclass(frozen=True, eq=False)
class Case:
    """A part to judge.

    `truth` is a document with the right parameter curves, if those of `document` are not; `form` is
    the closed form of the solid, if there is one.
    """

    name: str
    document: Document
    truth: Document | None = None
    form: Form | None = None
    is_closed: bool = False


def list_names(seeds: int) -> list[str]:
    """The names of all cases, with this number of seeds of each family."""
    numbers = range(FIRST_SEED, FIRST_SEED + seeds)
    return [
        *(f"solid {name}" for name in VALID),
        *(f"form {name}" for name in FORMS),
        *chain.from_iterable((f"{family} {seed}" for family in FAMILIES) for seed in numbers),
        *(f"group {seed}" for seed in numbers),
    ]


def build_case(name: str) -> Case:
    """The case of a name."""
    kind, _, rest = name.partition(" ")
    if kind == "solid":
        return Case(name, read_solid(rest), None, SOLID_FORMS.get(rest), is_closed=True)
    if kind == "form":
        document, form = FORMS[rest]()
        return Case(name, document, None, form, is_closed=True)
    if kind == "group":
        return build_group(name, np.random.default_rng([int(rest), 37]))
    family, _, seed = name.rpartition(" ")
    part = build_part(family, int(seed))
    return Case(name, part.document, part.truth, None, part.is_closed)


def read_plain(name: str) -> Document:
    """A solid of the tests without uncertainties, so that it can be scaled and joined."""
    document = read_solid(name)
    document.pop("vertex_uncertainties", None)
    for edge in document["edges"]:
        edge.pop("uncertainty", None)
    return document | {"up": "y"}


def _turn(*points: tuple[float, float]) -> Turned:
    return Turned(np.array(points, dtype=np.float64))


SOLID_FORMS: MappingProxyType[str, Form] = MappingProxyType(
    {
        "box": Box(np.zeros(3), np.array([10.0, 20, 30])),
        "cylinder": _turn((0, 0), (5, 0), (5, 12), (0, 12)),
        "cone": _turn((0, 0), (6, 0), (0, 10)),
        "frustum": _turn((0, 0), (6, 0), (2.5, 10), (0, 10)),
        "sphere": Ball(np.array([1.0, 2, 3]), 7.0),
        "torus": Ring(10.0, 3.0),
    }
)
"""Solids of the tests whose distances are known."""


def _draw_circle(middle: tuple[float, float], radius: float) -> Loop:
    """A hole."""
    both = np.array([radius, radius])
    return reverse_loop([draw_arc(np.array(middle), both, 0.0, 2 * np.pi)])


def _draw_rectangle(low: tuple[float, float], high: tuple[float, float]) -> Loop:
    (a, b), (c, d) = low, high
    return draw_segments(np.array([[a, b], [c, b], [c, d], [a, d]]))


def _shift(document: Document, move: Array, scale: float = 1.0) -> Document:
    return move_document(document, lambda points: scale * points + move, mirrored=False)


def _build_plate() -> tuple[Document, Form]:
    """A box with a hole 1e-6 from a side, a hole in the middle, and two holes 1e-3 apart."""
    holes = np.array([[1.5, 1.0, 1 - 1e-6], [4.0, 1.5, 0.7], [5.5, 1.5, 0.799], [7.5, 2.2, 0.5]])
    rim = _draw_rectangle((0, 0), (9, 3))
    loops = [rim, *(_draw_circle((x, y), r) for x, y, r in holes.tolist())]
    return build_prism(loops, 2.0, np.zeros(2)), Plate(np.array([9.0, 3, 2]), holes)


def _build_tube() -> tuple[Document, Form]:
    """A tube whose wall is 1e-3 thick."""
    both = np.ones(2)
    loops = [[draw_arc(np.zeros(2), both, 0.0, 2 * np.pi)], _draw_circle((0, 0), 0.999)]
    profile = (0.999, 0), (1, 0), (1, 3), (0.999, 3)
    return build_prism(loops, 3.0, np.zeros(2)), _turn(*profile)


def _build_thin_plate() -> tuple[Document, Form]:
    """A box whose height is 1e-6."""
    document = build_prism([_draw_rectangle((0, 0), (2, 1))], 1e-6, np.zeros(2))
    return document, Box(np.zeros(3), np.array([2, 1, 1e-6]))


def _build_hollow_box() -> tuple[Document, Form]:
    """A box with the void of a box, 1e-4 from a side, and that of a ball."""
    solid = build_prism([_draw_rectangle((0, 0), (4, 3))], 2.0, np.zeros(2))
    void = build_prism([_draw_rectangle((0, 0), (1, 1))], 1.0, np.zeros(2))
    corner, middle = np.array([1e-4, 1, 0.5]), np.array([2.7, 1.5, 1.1])
    document = join_void(solid, _shift(void, corner))
    ball = read_plain("sphere")
    document = join_void(document, _shift(ball, middle - np.array([1, 2, 3]) / 10, 0.1))
    voids: list[Form] = [Box(corner, corner + 1), Ball(middle, 0.7)]
    return document, Hollow(Box(np.zeros(3), np.array([4.0, 3, 2])), voids)


def _build_hollow_ball() -> tuple[Document, Form]:
    """A ball with the void of a ball beside its middle."""
    ball = read_plain("sphere")
    middle = np.array([2.0, 2, 4])
    void = _shift(ball, middle - 0.5 * np.array([1, 2, 3]), 0.5)
    return join_void(ball, void), Hollow(SOLID_FORMS["sphere"], [Ball(middle, 3.5)])


def _move_solid(name: str, seed: int, *, far: bool, mirrored: bool) -> tuple[Document, Form]:
    move = draw_move(np.random.default_rng(seed), far=far, mirrored=mirrored)
    matrix = np.eye(4)
    matrix[:3, 3] = move(np.zeros((1, 3)))[0]
    matrix[:3, :3] = (move(np.eye(3)) - matrix[:3, 3]).T
    document = move_document(read_plain(name), move, mirrored=mirrored)
    return document, Moved(SOLID_FORMS[name], matrix)


FORMS: MappingProxyType[str, Callable[[], tuple[Document, Form]]] = MappingProxyType(
    {
        "plate": _build_plate,
        "tube": _build_tube,
        "thin plate": _build_thin_plate,
        "hollow box": _build_hollow_box,
        "hollow ball": _build_hollow_ball,
        "mirrored cone": lambda: _move_solid("cone", 1, far=False, mirrored=True),
        "turned torus": lambda: _move_solid("torus", 2, far=False, mirrored=False),
        "far cylinder": lambda: _move_solid("cylinder", 3, far=True, mirrored=True),
        "turned frustum": lambda: _move_solid("frustum", 4, far=False, mirrored=False),
    }
)
"""Generated solids of closed form: functions that make the document and the form."""


PATCH: Document = {
    "control_net": [[[0, 0, 1], [0, 3, 0], [0, 5, 2]], [[4, 0, 0], [4, 2, 3], [5, 5, 1]]]
}


def build_group(name: str, rng: Random) -> Case:
    """Placed solids: apart from each other, turned, mirrored and scaled; some with a patch.

    In one of three groups all placements keep angles, and the closed form is known. In the others
    each axis is scaled, and members have parents.
    """
    has_form = int(rng.integers(3)) == 0
    names = rng.choice(list(SOLID_FORMS if has_form else VALID_SMALL), 3).tolist()
    members: list[dict[str, Any]] = []
    forms: list[Form] = []
    for k, each in enumerate([*names, names[0]]):
        matrix = _draw_placement(rng, np.array([100.0 * k, 0, 0]), keeps_angles=has_form)
        members.append({"definition": names.index(each), "matrix": matrix.tolist()})
        if has_form:
            forms.append(Moved(SOLID_FORMS[each], matrix))
    definitions = [read_plain(each) | {"up": "z"} for each in names]
    if not has_form:
        turn = _draw_placement(rng, np.zeros(3), keeps_angles=True)
        members = [{"matrix": turn.tolist()}, *({**each, "parent": 0} for each in members)]
        definitions.append(PATCH | {"up": "z"})
        members.insert(2, {"definition": len(definitions) - 1, "name": "patch"})
    group = {"type": "group", "up": "z", "definitions": definitions, "members": members}
    form = Several(forms) if has_form else None
    return Case(name, group, None, form, is_closed=has_form)


VALID_SMALL = ("box", "cone", "cylinder", "plate", "sphere", "torus_cut", "viviani", "steinmetz")
"""Solids of groups without a closed form."""


def _draw_placement(rng: Random, shift: Array, *, keeps_angles: bool) -> Array:
    matrix = np.eye(4)
    scales = 10 ** (
        np.full(3, rng.uniform(-0.3, 0.2)) if keeps_angles else rng.uniform(-0.5, 0.2, 3)
    )
    turns = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
    matrix[:3, :3] = next(turns) @ np.diag(scales) @ next(turns)
    matrix[:3, 3] = shift + rng.uniform(-5, 5, 3)
    return matrix
