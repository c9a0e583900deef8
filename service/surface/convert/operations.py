"""The operations of a conversion: frozen values, checked when they are created.

`patch` is the number of the patch to which an operation is limited
(`service.surface.convert.chosen`, and for groups `members`).
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from service.errors import InvalidRequest, Issue, format_number
from service.surface.checks import MAX_DEGREE

Direction: TypeAlias = Literal["u", "v"]
Half: TypeAlias = Literal["lower", "upper"]
Interval: TypeAlias = tuple[float, float]

MAX_OPERATIONS = 20
"""Most operations of one conversion: each may cost as much as a mesh."""

MAX_SUM_ERROR = 1e-9
"""The sum of three barycentric coordinates may differ from 1 by at most this number, because
decimal numbers in requests are rounded."""


def degree_pointer(degree: tuple[int, int], axis: int) -> str:
    """JSON pointer to the degree of axis 0 or 1.

    If both degrees are equal, the pointer leads to the whole field, as a request may give one
    number for both.
    """
    return "/degree" if degree[0] == degree[1] else f"/degree/{axis}"


@dataclass(frozen=True, slots=True)
class Elevate:
    """Raise the degree to (p, q); triangles take p, which must equal q."""

    degree: tuple[int, int]
    patch: int | None = None

    def __post_init__(self) -> None:
        for axis, degree in enumerate(self.degree):
            if not 1 <= degree <= MAX_DEGREE:
                raise InvalidRequest(
                    Issue(
                        "out_of_range",
                        "Degrees are whole numbers of a limited size.",
                        degree_pointer(self.degree, axis),
                        str(degree),
                        f"1 to {MAX_DEGREE}",
                    )
                )


@dataclass(frozen=True, slots=True)
class Split:
    """Split a patch at u, at v or at both; split a triangle at a point (r, s, t), `at`."""

    u: float | None = None
    v: float | None = None
    at: tuple[float, float, float] | None = None
    patch: int | None = None

    def __post_init__(self) -> None:
        if (self.at is None) == (self.u is None and self.v is None):
            raise InvalidRequest(
                Issue(
                    "missing_field" if self.at is None else "unknown_field",
                    "A surface is split at u, at v or at both, a triangle at [r, s, t].",
                    "",
                    "no parameter" if self.at is None else "`at` beside `u` or `v`",
                    "`u`, `v` or both; or `at` alone",
                )
            )
        if self.at is not None and not (
            min(self.at) > 0 and abs(sum(self.at) - 1) <= MAX_SUM_ERROR
        ):
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "Barycentric coordinates of a point within the triangle are positive and add "
                    "up to one.",
                    "/at",
                    f"a least of {min(self.at):.6g} and a sum of {sum(self.at):.6g}",
                    "numbers above 0, their sum 1",
                )
            )


@dataclass(frozen=True, slots=True)
class Restrict:
    """Take the piece over [u₀, u₁] × [v₀, v₁]; None keeps the whole interval of that direction."""

    u: Interval | None = None
    v: Interval | None = None
    patch: int | None = None

    def __post_init__(self) -> None:
        if self.u is None and self.v is None:
            raise InvalidRequest(
                Issue(
                    "missing_field",
                    "A piece is given by an interval of u, of v or of both.",
                    "",
                    "no interval",
                    "`u`, `v` or both",
                )
            )
        for name, interval in (("u", self.u), ("v", self.v)):
            if interval is not None and not interval[0] < interval[1]:
                raise InvalidRequest(
                    Issue(
                        "out_of_range",
                        "An interval begins before it ends.",
                        f"/{name}",
                        f"[{format_number(interval[0])}, {format_number(interval[1])}]",
                        "the smaller number first",
                    )
                )


@dataclass(frozen=True, slots=True)
class Insert:
    """Insert a knot into a B-spline at u, at v or at both."""

    u: float | None = None
    v: float | None = None
    patch: int | None = None

    def __post_init__(self) -> None:
        if self.u is None and self.v is None:
            raise InvalidRequest(
                Issue(
                    "missing_field",
                    "A knot is inserted at u, at v or at both.",
                    "",
                    "no parameter",
                    "`u`, `v` or both",
                )
            )


@dataclass(frozen=True, slots=True)
class Transpose:
    """Exchange u and v; the normal changes its sign."""

    patch: int | None = None


@dataclass(frozen=True, slots=True)
class Reverse:
    """Reverse one parameter; the normal changes its sign."""

    direction: Direction
    patch: int | None = None


@dataclass(frozen=True, slots=True)
class ToBezier:
    """Convert a B-spline to the Bézier patches of its spans."""

    patch: int | None = None


@dataclass(frozen=True, slots=True)
class ToTriangle:
    """Convert half of a patch to a triangular patch: lower for u + v ≤ 1, upper for u + v ≥ 1."""

    half: Half
    patch: int | None = None


@dataclass(frozen=True, slots=True)
class Untrim:
    """Take the whole surface of one face of a brep, or of a member of a group.

    Either `face` is given, in a group with the number of the `member`; or `patch`, the number of
    the face among all faces and patches.
    """

    face: int | None = None
    member: int | None = None
    patch: int | None = None

    def __post_init__(self) -> None:
        if self.face is None and self.patch is None:
            message, needed = "One face is taken.", "`face`, or `patch`"
            raise InvalidRequest(Issue("missing_field", message, "/face", "no number", needed))
        if self.patch is not None and (self.face, self.member) != (None, None):
            message, needed = "`patch` names the face, and its member.", "`patch` alone"
            got = "`patch` beside `face` or `member`"
            raise InvalidRequest(Issue("conflicting_options", message, "/patch", got, needed))


@dataclass(frozen=True, slots=True)
class Select:
    """Take some faces of a brep, each once; `member` is the number of a group's member."""

    faces: tuple[int, ...]
    member: int | None = None

    def __post_init__(self) -> None:
        seen: set[int] = set()
        for position, face in enumerate(self.faces):
            if face in seen:
                message, where = "Each face is chosen once.", f"/faces/{position}"
                issue = Issue("repeated_face", message, where, f"face {face} again", "each once")
                raise InvalidRequest(issue)
            seen.add(face)


@dataclass(frozen=True, slots=True)
class Orient:
    """Turn patches so that neighbours agree and volumes are positive.

    Neighbours are found as in a mesh with this `weld_tolerance`.
    """

    weld_tolerance: float


PatchOperation: TypeAlias = (
    Elevate | Split | Restrict | Insert | Transpose | Reverse | ToBezier | ToTriangle
)
"""The operations that change patches: all, or the one with the number `patch`."""

SurfaceOperation: TypeAlias = PatchOperation | Untrim | Select
"""The operations that depend on the control points of one surface alone."""

Operation: TypeAlias = SurfaceOperation | Orient
