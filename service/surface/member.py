"""One member of a group: a surface with a name, a colour and a placement, or a frame for others."""

from dataclasses import dataclass, field

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue, count_nouns
from service.surface.placement import is_identity, validate_matrix
from service.surface.sizes import SurfaceKind

FRAME_NAME = "assembly"
"""The name of a member without a surface, if it has no other."""


@dataclass(frozen=True, eq=False, slots=True)
class Member:
    """One surface of a group, or a frame for the members below it.

    A name that equals the surface's name becomes None; a matrix that is the identity becomes None,
    too. An opacity of 1 is removed from the colour. So equal members have equal values.

    Attributes
    ----------
    surface : SurfaceKind or None
        Of any kind except a group; None for a member that only places others.
    name : str or None
        Name of its glTF node; None stands for the name of the surface, or for `FRAME_NAME`.
    color : tuple of three or four floats, or None
        Base colour: red, green, blue and, unless it is 1, the opacity. sRGB, from 0 to 1. None
        stands for that of the parent, if it has one.
    matrix : ndarray of float64, shape (4, 4), or None
        Placement in the group, or in the frame of the parent: affine, acts on columns. None stands
        for the identity.
    parent : int or None
        The number of an earlier member, in whose frame this one is.
    definition : int or None
        If the request has the surface among its definitions, its number there: for the pointers of
        errors.

    Raises
    ------
    InvalidRequest
        On creation, with pointers relative to the member.
    """

    surface: SurfaceKind | None = None
    name: str | None = None
    color: tuple[float, ...] | None = None
    matrix: FloatArray | None = None
    parent: int | None = None
    definition: int | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if self.name is not None and self.name == self._default_name:
            object.__setattr__(self, "name", None)
        if self.color is not None:
            object.__setattr__(self, "color", _validate_color(self.color))
        if self.matrix is not None:
            try:
                matrix = validate_matrix(self.matrix)
            except InvalidRequest as error:
                raise error.within("/matrix") from None
            object.__setattr__(self, "matrix", None if is_identity(matrix) else matrix)

    @property
    def full_name(self) -> str:
        """Its name, or the name that it has without one."""
        return self._default_name if self.name is None else self.name

    @property
    def _default_name(self) -> str:
        return FRAME_NAME if self.surface is None else self.surface.name


def _validate_color(color: tuple[float, ...]) -> tuple[float, ...]:
    """Check a colour; an opacity of 1 is removed."""
    if len(color) not in (3, 4):
        raise InvalidRequest(
            Issue(
                "wrong_length",
                "A colour is red, green, blue and, if it has a fourth number, opacity.",
                "/color",
                count_nouns(len(color), "numbers"),
                "three or four",
            )
        )
    for index, value in enumerate(color):
        if not 0 <= value <= 1:
            raise InvalidRequest(
                Issue(
                    "out_of_range",
                    "The numbers of a colour are from 0 (dark) to 1 (full).",
                    f"/color/{index}",
                    f"{value:.6g}",
                    "0 to 1",
                )
            )
    # Adding 0 turns −0 into 0, so that equal colours have equal bytes.
    numbers = tuple(float(value) + 0.0 for value in color)
    return numbers[:3] if numbers[3:] == (1.0,) else numbers
