"""Names and conventions of other programs for control points, degrees, knots and weights."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

MAX_LETTERS = 40
"""No known name has more letters; further ones are not looked at."""


def fold_name(name: str) -> str:
    """A name without case and marks, so that `knots_u`, `knotsU` and `KnotsU` are one name."""
    return "".join(letter for letter in name[:MAX_LETTERS].lower() if letter.isalnum())


_NAMES: Mapping[str, str] = MappingProxyType(
    {
        "points": "ctrlpts ctrlpts2d controlpoints controlpoints2d controlpolygon coefs "
        "coefficients poles points cvs controlvertices patch",
        "homogeneous": "ctrlptsw pw weightedcontrolpoints",
        "weights": "weights pointweights",
        "degree": "degree degrees degreeu degreev udegree vdegree degree1 degree2",
        "order": "order orders orderu orderv uorder vorder",
        "knots": "knots knotvector knotvectors knotvectoru knotvectorv uknotvector vknotvector "
        "knotsu knotsv uknots vknots knots1 knots2",
        "multiplicities": "multiplicities mults umultiplicities vmultiplicities multiplicitiesu "
        "multiplicitiesv umults vmults multsu multsv mult",
        "size": "sizeu sizev usize vsize ctrlptssizeu ctrlptssizev ctrlptssize countu countv "
        "ucount vcount uvertexcount vvertexcount pointcountu pointcountv pointcount "
        "controlmeshresolutions",
        "closed": "uform vform isclosedu isclosedv isperiodic isperiodicu isperiodicv periodic "
        "periodicu periodicv usecyclicu usecyclicv useendpointu useendpointv closedu closedv",
        "sampling": "delta deltau deltav samplesize samplesizeu samplesizev evalpts splinesteps "
        "resolutionu resolutionv",
        "trims": "trims trimcurves trimcurvecounts",
        "dimension": "dimension dim rational isrational pdimension",
        "wrapper": "nurbs nurbssurface nurbspatch nurbscurve spline bsplinesurface beziersurface",
    }
)
"""Folded names of fields, by their role."""

ROLES: Mapping[str, str] = MappingProxyType(
    {name: role for role, names in _NAMES.items() for name in names.split()}
)
"""The role of each folded name."""


@dataclass(frozen=True, slots=True)
class Convention:
    """How a program orders and weights control points.

    Attributes
    ----------
    program : str
    marks : frozenset of str
        Names of fields, as they are, of which only this program has one.
    is_u_fastest : bool
        Whether in a flat list u varies fastest.
    fourth : str
        The fourth number of a point: "weight" beside x, y, z, or "homogeneous" if these are
        multiplied by it.
    """

    program: str
    marks: frozenset[str]
    is_u_fastest: bool
    fourth: str = ""


def _convention(program: str, marks: str, *, is_u_fastest: bool, fourth: str = "") -> Convention:
    return Convention(program, frozenset(marks.split()), is_u_fastest, fourth)


CONVENTIONS = (
    _convention(
        "geomdl",
        "ctrlpts ctrlptsw ctrlpts2d knotvector_u knotvector ctrlpts_size_u ctrlpts_size",
        is_u_fastest=False,
        fourth="homogeneous",
    ),
    _convention("splinepy", "knot_vectors KnotVectors control_mesh_resolutions", is_u_fastest=True),
    _convention("G+Smo", "coefs", is_u_fastest=True),
    _convention("USD", "uVertexCount uOrder uKnots pointWeights uForm", is_u_fastest=True),
    _convention(
        "Blender",
        "point_count_u order_u use_cyclic_u use_endpoint_u",
        is_u_fastest=True,
        fourth="weight",
    ),
    _convention(
        "Rhino",
        "CountU KnotsU OrderU point_count knots_u IsRational",
        is_u_fastest=False,
        fourth="homogeneous",
    ),
    _convention("three.js", "degree1 knots1", is_u_fastest=False, fourth="weight"),
    _convention(
        "Open CASCADE", "poles Poles UMultiplicities u_multiplicities UMults u_mults UKnots",
        is_u_fastest=False,
    ),
    _convention("verb", "degreeU knotsU controlPoints", is_u_fastest=False, fourth="homogeneous"),
)  # fmt: skip
"""The conventions of the programs whose fields are known."""


def find_program(fields: Mapping[str, Any]) -> Convention | None:
    """The program that has these fields; None if several or none may have them."""
    return next((each for each in CONVENTIONS if each.marks & fields.keys()), None)
