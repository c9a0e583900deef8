"""The built-in example surfaces, with readable ids."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import sqrt
from types import MappingProxyType
from typing import Any

import numpy as np

from service.errors import Issue, UnknownSurface
from service.surface.bezier import BezierSurface
from service.surface.checks import Up
from service.surface.examples import (
    hull,
    quadrics,
    rounded,
    spline_shapes,
    swept_shapes,
    tea,
    wing,
)
from service.surface.examples.colored import color_by_height, heated_panel
from service.surface.kinds import Surface
from service.surface.patches import PatchSurface
from service.surface.triangle import TriangleSurface


@dataclass(frozen=True, slots=True)
class Example:
    """A built-in surface; the first call of `surface()` builds it by `build`."""

    id: str
    title: str
    description: str
    build: Callable[[], Surface]

    def surface(self) -> Surface:
        """The surface; the first call builds it, and later calls return the same object."""
        return _build(self.id)


def find(surface_id: str) -> Example:
    """The example of this id.

    Raises
    ------
    UnknownSurface
        No example has this id.
    """
    example = EXAMPLES.get(surface_id)
    if example is None:
        raise UnknownSurface(
            Issue(
                "unknown_surface",
                "No surface has this id.",
                got="an unknown id",
                needed="one of " + ", ".join(EXAMPLES),
            )
        )
    return example


@cache
def _build(surface_id: str) -> Surface:
    return EXAMPLES[surface_id].build()


def _data(name: str) -> dict[str, Any]:
    text = (files("service.surface.examples") / "data" / f"{name}.json").read_text(encoding="utf-8")
    content: dict[str, Any] = json.loads(text)
    return content


def _net(name: str, up: Up) -> BezierSurface:
    return BezierSurface(np.array(_data(name)["control_net"]), up=up, name=name)


def _teapot(name: str, z_factor: float) -> PatchSurface:
    data = _data("utah-teapot")
    return PatchSurface(
        np.array(data["vertices"]) * (1.0, 1.0, z_factor),
        np.array(data["patches"]),
        parts=tuple((part, tuple(members)) for part, members in data["parts"].items()),
        up="z",
        name=name,
    )


def _saddle() -> BezierSurface:
    corners = [[[-1, -1, 1], [-1, 1, -1]], [[1, -1, -1], [1, 1, 1]]]
    return BezierSurface(np.array(corners, dtype=np.float64), up="z", name="saddle")


def _monkey_saddle() -> TriangleSurface:
    """The graph of z = Re((x + iy)³) over the triangle whose corners are the cube roots of unity.

    The control points have the heights Re(a b c), the blossom of z, where a, b, c are corners.
    """
    half = sqrt(3) / 2
    corners = np.array([1, complex(-0.5, half), complex(-0.5, -half)])
    # For each control point, the numbers of the three corners a, b, c.
    rows = ["000 001 011 111", "002 012 112", "022 122", "222"]
    arguments = np.array([[corners[int(c)] for c in word] for row in rows for word in row.split()])
    middles, products = arguments.mean(axis=1), arguments.prod(axis=1)
    # The exact heights are multiples of 1/2: cosines of multiples of 120°.
    heights = np.round(2 * products.real) / 2
    net = np.stack([middles.real, middles.imag, heights], axis=1)
    return TriangleSurface(net, up="z", name="monkey-saddle")


EXAMPLES: Mapping[str, Example] = MappingProxyType(
    {
        example.id: example
        for example in (
            Example(
                "utah-teapot",
                "Utah teapot",
                "Martin Newell's teapot of 1975 with Frank Crow's bottom, in its usual "
                "proportions: 32 bicubic patches over 306 control points, z up, normals outward.",
                lambda: _teapot("utah-teapot", 1.0),
            ),
            Example(
                "utah-teapot-original",
                "Utah teapot, original height",
                "The teapot as Newell measured it, a third taller than usual.",
                lambda: _teapot("utah-teapot-original", 4.0 / 3.0),
            ),
            Example(
                "bourke-1111",
                "Random surface",
                "Paul Bourke's random 6 × 5 control net (seed 1111), one patch of degree (5, 4).",
                lambda: _net("bourke-1111", "z"),
            ),
            Example(
                "bourke-1111-colors",
                "Random surface, coloured by its height",
                "The surface `bourke-1111` with `colors`: a net in the surface's own degree, from "
                "blue in the valleys to yellow on the hills.",
                lambda: color_by_height(_net("bourke-1111", "z"), "bourke-1111-colors"),
            ),
            Example(
                "tveit",
                "Tutorial patch",
                "A bicubic patch over 16 control points, taken from a tutorial.",
                lambda: _net("tveit", "y"),
            ),
            Example(
                "saddle",
                "Saddle",
                "The patch of degree (1, 1) over four corners: the hyperbolic paraboloid z = xy.",
                _saddle,
            ),
            Example(
                "heated-panel",
                "Heated panel",
                "A biquadratic panel with the attribute `temperature`, colours that follow it, and "
                "texture coordinates in metres: each in a net with its own degree.",
                heated_panel,
            ),
            Example(
                "cylinder",
                "Cylinder",
                "Exact cylinder of radius 1 and height 2 with its caps: rational, degree (2, 1).",
                quadrics.cylinder,
            ),
            Example(
                "cone",
                "Cone",
                "Exact cone of radius 1 and height 2 with its base: rational, degree (2, 1).",
                quadrics.cone,
            ),
            Example(
                "sphere",
                "Sphere",
                "Exact unit sphere: eight rational patches of degree (2, 2) meeting at two poles.",
                quadrics.sphere,
            ),
            Example(
                "torus",
                "Torus",
                "Exact torus of radius 1, tube radius 0.4: sixteen rational biquadratic patches.",
                quadrics.torus,
            ),
            Example(
                "monkey-saddle",
                "Monkey saddle",
                "z = x³ − 3xy² over a triangle, a saddle for two legs and a tail: one triangular "
                "patch of degree 3.",
                _monkey_saddle,
            ),
            Example(
                "octahedral-sphere",
                "Sphere of eight triangles",
                "Exact unit sphere without poles: eight rational triangular patches of degree 4.",
                rounded.octahedral_sphere,
            ),
            Example(
                "rounded-box",
                "Rounded box",
                "Box with round edges, exact and smooth everywhere: 18 rational patches of degree "
                "(4, 4), and eight triangles of degree 4 as its corners.",
                rounded.rounded_box,
            ),
            Example(
                "trefoil-tube",
                "Trefoil knot",
                "A closed tube about a trefoil knot, which is a periodic cubic B-spline: "
                "watertight, its rings meet without a twist.",
                swept_shapes.trefoil_tube,
            ),
            Example(
                "ribbon",
                "Ribbon",
                "A stripe along a cubic B-spline; it faces +z, and its width is a Bézier function "
                "that begins and ends at 0.",
                swept_shapes.streamer,
            ),
            Example(
                "hair",
                "Hair",
                "A tube along one curve of degree 7 whose radius tapers to a point.",
                swept_shapes.curl,
            ),
            Example(
                "tea-service",
                "Tea service",
                "A group: the teapot, four cups and saucers around it and a tray, each placed and "
                "coloured; the cups are one surface, two of them mirrored.",
                lambda: tea.tea_service(_teapot("utah-teapot", 1.0)),
            ),
            Example(
                "bspline-hills",
                "Hills",
                "A uniform bicubic B-spline over 7 × 8 control points; it touches none of them.",
                spline_shapes.hills,
            ),
            Example(
                "nurbs-goblet",
                "Goblet",
                "A NURBS surface of revolution, degree (2, 3): exact circles, sharp at foot and "
                "rim, closed at two poles.",
                spline_shapes.goblet,
            ),
            Example(
                "bspline-ring",
                "Ring",
                "A bicubic B-spline, periodic in u and v: it closes with continuous curvature.",
                spline_shapes.ring,
            ),
            Example(
                "swept-wing",
                "Swept wing",
                "A closed body of four B-splines: two skins whose knots crowd at the leading edge, "
                "down to 1e-8 of their range, and ruled caps at root and tip.",
                wing.wing,
            ),
            Example(
                "ship-hull",
                "Ship",
                "Nine B-splines of three degrees as one closed surface: the sides, port and "
                "starboard, the keel, the deck and the transom share their borders.",
                hull.hull,
            ),
        )
    }
)
"""The examples by id, in the order in which the service lists them."""
