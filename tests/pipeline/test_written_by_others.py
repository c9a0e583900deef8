"""B-splines as other systems write them are closed where these systems mean them to be closed.

Such systems repeat control points, omit end knots, scale knots, and round coordinates.
"""

from typing import Any

import numpy as np
import orjson
import pytest
from scipy.interpolate import BSpline

from service.encoders.registry import BY_NAME
from service.pipeline.mesh import render
from service.schemas.document import DocumentLimits
from service.schemas.request import MeshRequest
from service.schemas.validation import parse_request
from service.surface.bspline import BsplineSurface
from service.surface.convert.operations import Elevate
from service.surface.convert.table import convert
from service.surface.examples.splines import CIRCLE

WEIGHT = np.sqrt(0.5)
"""The weight of the corner between two points of a quarter circle."""
# Of the control points of a circle, only the corners have two coordinates other than 0.
CIRCLE_WEIGHTS = np.array([WEIGHT if x * y else 1.0 for x, y in CIRCLE])
CIRCLE_KNOTS = [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1]
HALF_CIRCLE = np.array([(0, -1, 1), (1, -1, WEIGHT), (1, 0, 1), (1, 1, WEIGHT), (0, 1, 1)])
"""A profile (radius, height, weight) of two quarter circles."""


def revolve(
    profile: Any, circle_knots: Any, profile_knots: Any, scale: float = 1, shift: Any = (0, 0, 0)
) -> Any:
    """The JSON of a surface of revolution about the z axis, of a profile (radius, height, weight).

    u runs around the axis, and v along the profile. The surface is scaled, then shifted.
    """
    net = [[[x * r, y * r, z] for r, z, _ in profile] for x, y in CIRCLE]
    points = np.array(net) * scale + np.array(shift, float)
    return {
        "degree": [2, len(profile_knots) - len(profile) - 1],
        "control_net": points,
        "knots": [circle_knots, profile_knots],
        "weights": np.outer(CIRCLE_WEIGHTS, [w for *_, w in profile]),
    }


def build_cylinder(knots: Any = CIRCLE_KNOTS, **transform: Any) -> Any:
    return revolve([(1, 0, 1), (1, 2, 1)], knots, [0, 0, 1, 1], **transform)


def build_sphere() -> Any:
    return revolve(HALF_CIRCLE, CIRCLE_KNOTS, [0, 0, 0, 1, 1, 2, 2, 2])


def add_noise(surface: Any, rows: Any, size: float) -> Any:
    """The surface with random noise of this size on the control points that `rows` selects."""
    net = surface["control_net"].copy()
    net[rows] += np.random.default_rng(7).normal(size=net[rows].shape) * size
    return surface | {"control_net": net}


def build_wrapped_torus(knot_distance: float, knot_shift: float) -> Any:
    """A torus of degree 3 over uniform knots; the first rows and columns follow again at the end.

    The knots along u and v are the multiples of `knot_distance`, shifted.
    """
    u, v = np.meshgrid(np.arange(8) * np.pi / 4, np.arange(6) * np.pi / 3, indexing="ij")
    radius = 3 + np.cos(v)
    ring = np.stack([radius * np.cos(u), radius * np.sin(u), np.sin(v)], axis=-1)
    net = np.pad(ring, [(0, 3), (0, 3), (0, 0)], mode="wrap")
    knots = [(np.arange(-3, n + 4) * knot_distance + knot_shift).tolist() for n in (8, 6)]
    return {"degree": 3, "control_net": net, "knots": knots}


def build_open_sheet(*knots: Any, shift: Any = (0, 0, 0), scale: float = 1) -> Any:
    """A surface that is not closed, with these knots along u; by default with clamped knots.

    The control points are scaled, then shifted.
    """
    x, y = np.meshgrid(np.arange(6.0), np.arange(4.0), indexing="ij")
    net = np.stack([x, y, np.sin(x)], axis=-1) * scale + shift
    return {"degree": 3, "control_net": net, "knots": [list(knots) or "clamped", "clamped"]}


def build_face(axis: int, side: int, rng: Any) -> Any:
    """A face of a cube of 1 cm, about 1000 km from zero, with random degrees and knots."""
    net = np.zeros((2, 2, 3))
    net[..., axis] = side
    # The other two coordinates are u and v; negative indices continue cyclically.
    net[1, :, axis - 2], net[:, 1, axis - 1] = 1, 1
    (p, q), (t, scale) = rng.integers(1, 4, 2), rng.uniform(0.2, 3, 2)
    surface: Any = convert(BsplineSurface(net, (1, 1)), [Elevate((p, q))])
    # One more knot along u, somewhere inside; then all knots along u are scaled and shifted.
    spline = BSpline(surface.knot_vectors[0], surface.control_net, p).insert_knot(t / 4)
    return {
        "type": "bspline",
        "control_net": spline.c * 0.01 + [1e6, -1e6, 3e5],
        "degree": [int(p), int(q)],
        "knots": [spline.t * scale - 1, surface.knot_vectors[1]],
    }


@pytest.mark.parametrize("options", [{"resolution": [2, 3]}, {"relative_tolerance": 0.01}])
@pytest.mark.parametrize("kind", ["multipatch", "group"])
def test_a_cube_of_splines_far_from_zero_is_closed(kind: str, options: Any) -> None:
    """Points of adjacent faces differ by rounding, which is 1e-8 of the cube so far from zero."""
    rng = np.random.default_rng(3)
    faces = [build_face(axis, side, rng) for axis in range(3) for side in (0, 1)]
    surface = {"type": kind, "surfaces": faces}
    if kind == "group":
        surface = {"type": kind, "members": [{"surface": each} for each in faces]}
    body = orjson.dumps({"surface": surface, **options}, option=orjson.OPT_SERIALIZE_NUMPY)
    request = parse_request(MeshRequest, body, DocumentLimits())
    report = orjson.loads(render(request.to_surface(), request.mesh_options(), BY_NAME["json"]))[
        "report"
    ]
    assert report["watertight"]
    # How far points of the faces moved, at most, so that sides became equal.
    assert 0 < report["moved"] < 1e-7


CASES: dict[str, tuple[Any, tuple[bool, bool, bool], int]] = {
    # name: surface, (watertight, closed in u, closed in v), number of knots merged into others
    "cylinder": (build_cylinder(), (False, True, False), 0),
    "cylinder, without first and last knot": (
        build_cylinder(CIRCLE_KNOTS[1:-1]), (False, True, False), 0,
    ),
    "cylinder in mm, knots are arc lengths, far from zero": (
        build_cylinder(
            (np.array(CIRCLE_KNOTS) * 2 * np.pi * 25.4).tolist(), scale=25.4, shift=(1e6, -2e6, 3e5)
        ),
        (False, True, False), 0,
    ),
    "cylinder, seam equal up to rounding": (
        add_noise(build_cylinder(), -1, 1e-14), (False, True, False), 0,
    ),
    "cylinder, seam open": (add_noise(build_cylinder(), -1, 1e-8), (False, False, False), 0),
    "sphere": (build_sphere(), (True, True, False), 0),
    "sphere, poles equal up to rounding": (
        add_noise(build_sphere(), np.s_[:, [0, -1], :2], 1e-16), (True, True, False), 0,
    ),
    "sphere of tiny weights": (
        build_sphere() | {"weights": build_sphere()["weights"] * 1e-7}, (True, True, False), 0,
    ),
    "torus, repeated points": (build_wrapped_torus(1, 0), (True, True, True), 0),
    "torus, knots of sevenths about 1000": (
        build_wrapped_torus(1 / 7, 1000), (True, True, True), 0,
    ),
    "torus in mm, far from zero": (
        build_wrapped_torus(1 / 7, 1000)
        | {"control_net": build_wrapped_torus(1, 0)["control_net"] * 1e-3 + 1e6},
        (True, True, True), 0,
    ),
    "cylinder, knots in degrees, seam equal up to rounding far from zero": (
        add_noise(
            build_cylinder((np.array(CIRCLE_KNOTS) * 360).tolist(), shift=(1e6, 1e6, 0)), -1, 1e-10
        ),
        (False, True, False), 0,
    ),
    "knots 1e-8 of their range apart, about 1e4": (
        build_open_sheet(*(1e4 + np.array([0, 0, 0, 0, 0.5, 0.5 + 1e-8, 1, 1, 1, 1])).tolist()),
        (False, False, False), 0,
    ),
    "knots 1e-14 apart": (
        build_open_sheet(0, 0, 0, 0, 0.5, 0.5 + 1e-14, 1, 1, 1, 1), (False, False, False), 1,
    ),
    "end knots equal up to rounding": (
        build_open_sheet(0, 1e-16, 2e-16, 3e-16, 0.3, 0.7, 1 - 2e-16, 1 - 1e-16, 1, 1),
        (False, False, False), 5,
    ),
    "knots about 1e9": (
        build_open_sheet(*(1e9 + np.array([0, 0, 0, 0, 0.25, 0.75, 1, 1, 1, 1])).tolist()),
        (False, False, False), 0,
    ),
    "coordinates of a map": (build_open_sheet(shift=(4.5e5, 5.4e6, 120)), (False, False, False), 0),
    "microns in metres": (build_open_sheet(scale=1e-6), (False, False, False), 0),
    "discontinuous at a knot": (
        build_open_sheet() | {"degree": [1, 3], "knots": [[0, 0, 1, 1, 2, 2, 3, 3], "clamped"]},
        (False, False, False), 0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("options", [{"resolution": 5}, {"relative_tolerance": 0.01}])
@pytest.mark.parametrize("name", CASES)
def test_surfaces_of_other_systems_are_closed_as_meant(name: str, options: Any) -> None:
    surface, (is_watertight, is_closed_u, is_closed_v), merged_count = CASES[name]
    json_values = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in surface.items()}
    body = orjson.dumps({"surface": {"type": "bspline"} | json_values, **options})
    request = parse_request(MeshRequest, body, DocumentLimits())
    content = render(request.to_surface(), request.mesh_options(), BY_NAME["json"])
    report = orjson.loads(content)["report"]
    assert report["watertight"] == is_watertight
    assert (report["closed_u"], report["closed_v"]) == (is_closed_u, is_closed_v)
    assert report.get("merged_knots", 0) == merged_count
    # The relative tolerance is a share of the diagonal, which is at most √3 times this extent.
    extent = np.ptp(surface["control_net"].reshape(-1, 3), axis=0).max()
    assert report["deviation_bound"] < (0.1 if "resolution" in options else 0.02) * extent
