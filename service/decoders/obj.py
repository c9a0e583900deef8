r"""Reads the free-form surfaces of Wavefront OBJ files: `surf`, with trimming curves.

    v 0 0 0                  x y z, and a weight if the curve or surface is rational
    vp 0.2 0.2               u v, and a weight: points of trimming curves
    cstype rat bspline       or bezier
    deg 3 3
    surf 0 1 0 1 1 2 3 …     ranges of u and v, then the control points, u fastest
    parm u 0 0 0 0 1 1 1 1
    parm v 0 0 0 0 1 1 1 1
    trim 0 1 1               or hole: ranges of curves and their numbers among all `curv2`
    end

Points are not multiplied by their weights. Texture coordinates, normals, materials, curves of
space, lines and connectivity are skipped. A file with polygons is refused, also beside surfaces:
nothing with an area is left out in silence. Other files that a file names are never opened.

References
----------
Wavefront Technologies, "Object Files (.obj)", version 3.0: "Free-form geometry".
"""

import re
from array import array
from collections.abc import Callable

import numpy as np

from service.decoders.format import (
    Decoded,
    FileLimits,
    Tree,
    build_too_many_error,
    check_kind,
    check_parts,
)
from service.decoders.obj_surfaces import (
    Form,
    Loop,
    build_curve,
    build_surface,
    is_same_range,
)
from service.decoders.obj_text import ObjText
from service.errors import InvalidRequest, Issue, count_nouns

KINDS = ()
"""No kind can be requested: the file decides."""

MAX_NAME = 100
"""The most characters of a name; a surface in a group with a longer name is read without it."""

_COUNT = re.compile(rb"[1-9][0-9]{0,8}")

_SKIPPED = frozenset(
    b"vn vt s mg usemtl mtllib usemap maplib bevel c_interp d_interp lod shadow_obj trace_obj "
    b"ctech stech scrv sp con curv l p".split()
)
"""Statements that are not read: they are not about surfaces, or not about their form."""

_BASES = ("bezier", "bspline")


def decode(content: bytes, kind: str | None, limits: FileLimits) -> Decoded:
    """Decode the surfaces of a file: a `bezier` or `bspline`, or a `group` of several.

    All trimmed surfaces together are one `brep`, which is the last member of a group.

    Raises
    ------
    MalformedBody
        The text does not have the form of a file with surfaces.
    InvalidRequest
        The file has polygons, or surfaces of other bases; a number is not finite, an index names
        nothing; or there are too many control points.
    TooLarge
        There are too many surfaces or curves.
    """
    check_kind(kind, KINDS)
    named = [
        (tree, {"name": name} if name else {}) for name, tree in _Reader(content, limits).read()
    ]
    surfaces = [(tree, name) for tree, name in named if "loops" not in tree]
    if faces := [tree | name for tree, name in named if "loops" in tree]:
        surfaces.append(({"type": "brep", "faces": faces}, {}))
    if len(surfaces) == 1:
        return Decoded(surfaces[0][0])
    members = [{"surface": tree} | name for tree, name in surfaces]
    return Decoded({"type": "group", "members": members})


class _Reader:
    """Reads the statements of a text, one after another, and collects surfaces."""

    def __init__(self, content: bytes, limits: FileLimits) -> None:
        self._text = ObjText(content)
        self._limits = limits
        self._max_points = self._points_left = limits.max_control_points
        self._vertices = array("d")  # x y z w
        self._places = array("d")  # u v w
        self._polygons = 0
        self._name = ""
        self._basis = ""
        self._is_rational = False
        self._degrees: list[int] = []
        self._element = ""  # the keyword of an element up to its `end`
        self._ranges: list[float] = []
        self._indices: list[int] = []
        self._parameters: dict[bytes, list[float]] = {}
        self._loops: list[Loop] = []
        self._curves: list[tuple[Tree, tuple[float, float]]] = []
        self._surfaces: list[tuple[str, Tree]] = []
        self._handlers: dict[bytes, Callable[[list[bytes]], None]] = {
            b"v": self._read_vertex,
            b"vp": self._read_place,
            b"cstype": self._read_basis,
            b"deg": self._read_degrees,
            b"surf": self._read_surface,
            b"curv2": self._read_curve,
            b"parm": self._read_knots,
            b"trim": lambda words: self._read_loop(words, is_hole=False),
            b"hole": lambda words: self._read_loop(words, is_hole=True),
            b"end": self._end_element,
            b"g": self._read_name,
            b"o": self._read_name,
            b"f": self._count_polygon,
            b"fo": self._count_polygon,
        }

    def read(self) -> list[tuple[str, Tree]]:
        """Read all statements; returns the names and documents of the surfaces."""
        for words in self._text.read_statements():
            handler = self._handlers.get(words[0])
            if handler is not None:
                handler(words[1:])
            elif words[0] not in _SKIPPED:
                raise self._text.build_error(
                    "The service does not know this statement", "another word", "surf, v, …"
                )
        if self._element:
            raise self._text.build_error(
                "A surface or curve has no end", "the end of the text", "end"
            )
        if self._polygons:
            beside = f" beside {count_nouns(len(self._surfaces), 'surfaces')}"
            raise InvalidRequest(
                Issue(
                    "wrong_value",
                    "The file has polygons; the service reads free-form surfaces, and leaves "
                    "nothing out.",
                    "",
                    count_nouns(self._polygons, "polygons") + beside * bool(self._surfaces),
                    "only free-form surfaces (cstype, deg, surf, parm, end); Rhino and Maya write "
                    "them if surfaces are exported as NURBS, not as meshes",
                )
            )
        if not self._surfaces:
            raise self._text.build_error("The file has no surface", "the end of the text", "surf")
        return self._surfaces

    def _read_vertex(self, words: list[bytes]) -> None:
        values = self._text.parse_numbers(words)
        if len(values) not in (3, 4, 6):  # 6: a colour
            got = count_nouns(len(values), "numbers")
            raise self._text.build_error("A vertex is x y z, or x y z w", got, "3 or 4 numbers")
        self._vertices.extend(values[:4] if len(values) == 4 else (*values[:3], 1.0))
        if len(self._vertices) > 4 * self._max_points:
            raise build_too_many_error("more vertices", self._max_points)

    def _read_place(self, words: list[bytes]) -> None:
        values = self._text.parse_numbers(words)
        if len(values) not in (1, 2, 3):
            got = count_nouns(len(values), "numbers")
            raise self._text.build_error("A point of the parameters is u v", got, "2 or 3 numbers")
        self._places.extend((*values, 0.0, 1.0)[:3] if len(values) == 1 else (*values, 1.0)[:3])
        if len(self._places) > 3 * self._max_points:
            raise build_too_many_error("more points of the parameters", self._max_points)

    def _read_basis(self, words: list[bytes]) -> None:
        self._is_rational = words[:1] == [b"rat"]
        basis = b" ".join(words[self._is_rational :]).decode("latin-1")
        if basis not in _BASES:
            known = basis if basis in ("bmatrix", "cardinal", "taylor") else "another word"
            raise self._text.build_error(
                "The service reads Bézier and B-spline surfaces", known, " or ".join(_BASES)
            )
        self._basis = basis

    def _read_degrees(self, words: list[bytes]) -> None:
        self._degrees = [int(word) for word in words if _COUNT.fullmatch(word)]
        if len(self._degrees) != len(words) or len(words) not in (1, 2):
            got = count_nouns(len(words), "words")
            raise self._text.build_error("Degrees are whole numbers above zero", got, "one or two")

    def _read_surface(self, words: list[bytes]) -> None:
        self._begin("surf", words, range_count=4)

    def _read_curve(self, words: list[bytes]) -> None:
        self._begin("curv2", words, range_count=0)

    def _begin(self, element: str, words: list[bytes], *, range_count: int) -> None:
        """Begin a surface or a curve: ranges of parameters, then indices of points."""
        if self._element:
            raise self._text.build_error("A surface or curve has no end", "another one", "end")
        if not self._basis or not self._degrees:
            needed = "cstype and deg, before it"
            raise self._text.build_error("The basis or the degree is missing", "nothing", needed)
        self._take_points(len(words) - range_count)
        check_parts(len(self._surfaces) + 1, "surfaces", self._limits.max_definitions)
        check_parts(len(self._curves) + 1, "curves", self._limits.max_members)
        self._element, self._parameters, self._loops = element, {}, []
        self._ranges = self._text.parse_numbers(words[:range_count])
        count = len(self._vertices) // 4 if range_count else len(self._places) // 3
        self._indices = self._text.parse_indices(
            [word.partition(b"/")[0] for word in words[range_count:]], count
        )

    def _take_points(self, count: int) -> None:
        """Count control points, also of curves that several loops have."""
        self._points_left -= count
        if self._points_left < 0:
            raise build_too_many_error("more control points", self._max_points)

    def _read_knots(self, words: list[bytes]) -> None:
        if not self._element:
            return  # of a curve of space, which is skipped
        if words[:1] not in ([b"u"], [b"v"]):
            raise self._text.build_error(
                "Parameters are those of u or of v", "another word", "u or v"
            )
        self._parameters[words[0]] = self._text.parse_numbers(words[1:])

    def _read_loop(self, words: list[bytes], *, is_hole: bool) -> None:
        if self._element != "surf" or not words or len(words) % 3:
            got = count_nouns(len(words), "words")
            raise self._text.build_error(
                "A loop has three numbers for each curve", got, "u0 u1 curv2"
            )
        numbers = self._text.parse_numbers([w for n, w in enumerate(words) if n % 3 < 2])
        indices = self._text.parse_indices(words[2::3], len(self._curves))
        curves = []
        for first, last, index in zip(numbers[::2], numbers[1::2], indices, strict=True):
            curve, domain = self._curves[index]
            if not is_same_range((first, last), domain):
                raise self._text.build_error(
                    "A loop has whole curves", "a part of a curve", "the first and last parameter"
                )
            curves.append(curve)
            self._take_points(len(curve["control_points"]))
        self._loops.append(Loop(tuple(curves), is_hole))

    def _end_element(self, words: list[bytes]) -> None:
        """Build the surface or the curve that ends; a curve of space was skipped."""
        del words
        element, self._element = self._element, ""
        if not element:
            return
        is_surface = element == "surf"
        directions = (b"u", b"v") if is_surface else (b"u",)
        form = Form(
            self._basis,
            tuple((self._degrees * 2)[: len(directions)]),
            tuple(self._parameters.get(direction, []) for direction in directions),
        )
        count = len(self._indices)
        if not count or form.count_points() != count:
            message = "The number of control points is not that of the degrees and parameters"
            got = count_nouns(count, "control points")
            raise self._text.build_error(message, got, form.describe_needed())
        numbers = np.frombuffer(self._vertices if is_surface else self._places)
        points = numbers.reshape(-1, 4 if is_surface else 3)[self._indices]
        weights = points[:, -1] if self._is_rational else None
        if is_surface:
            tree = build_surface(form, points[:, :3], weights, self._ranges, self._loops)
            self._surfaces.append((self._name, tree))
        else:
            self._curves.append((build_curve(form, points[:, :2], weights), form.domain(0)))

    def _read_name(self, words: list[bytes]) -> None:
        name = b" ".join(words).decode("utf-8", "replace")
        self._name = name if name.isprintable() and len(name) <= MAX_NAME else ""

    def _count_polygon(self, words: list[bytes]) -> None:
        del words
        self._polygons += 1
