"""Numbers of damaged files: NaN, infinities, 1e308, 5e-324. One error, or finite geometry."""

import warnings
from collections.abc import Callable
from functools import partial
from math import inf, nan, pi

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from service.decoders.cad import splines
from service.decoders.cad.conics import BasisCurve, Ellipse, Hyperbola, Line, Parabola
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.elementary import (
    Cone,
    Cylinder,
    Elementary,
    Plane,
    Sphere,
    Torus,
    find_gap,
)
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Frame, Vector, build_frame, check_point
from service.decoders.cad.outline import Outline
from service.decoders.cad.parts import PartBuilder
from service.decoders.cad.pieces import cut_between
from service.decoders.cad.swept import Extrusion, Revolution
from service.surface.spline_checks import check_curves, check_surfaces
from tests.decoders.cad.tables import tabulate_curves, tabulate_surface

NUMBERS = st.sampled_from(
    [
        *(0.0, 1.0, -1.0, 2.0, 0.5, 1e-9, 1e-12, 1e9, 1e12, 1e13, 1e155, 1e308, -1e308, 5e-324),
        *(1e-160, nan, inf, -inf, pi, 1e-7),
    ]
) | st.floats(-3, 3)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)
POINTS = st.lists(VECTORS, min_size=1, max_size=6)


def check_curve(curve: Curve) -> None:
    assert np.isfinite(curve.points).all()
    assert not len(check_curves(tabulate_curves([curve]))[1])


def check_surface(surface: Surface) -> None:
    assert np.isfinite(surface.points).all()
    assert not len(check_surfaces(tabulate_surface(surface))[1])


def try_all(*steps: Callable[[], object]) -> None:
    """Run steps, each of which may refuse its numbers."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for step in steps:
            try:
                made = step()
            except InvalidGeometry:
                continue
            if isinstance(made, Curve):
                check_curve(made)
            elif isinstance(made, Surface):
                check_surface(made)


def call(
    kind: Callable[..., object], values: tuple[object, ...], method: str, *rest: object
) -> object:
    """The result of a method of a new object."""
    return getattr(kind(*values), method)(*rest)


def try_elementary(build: Callable[[], Elementary], outline: Outline, a: float, b: float) -> None:
    try_all(
        lambda: build().cut(outline),
        lambda: build().offset(b).cut(outline),
        lambda: build().trim((a, b), (b, a)),
        lambda: find_gap(build(), outline),
    )


def try_edges(
    basis: BasisCurve, numbers: tuple[float, float], ends: tuple[Vector, Vector], is_loop: bool
) -> None:
    try_all(
        lambda: cut_between(basis, *ends, is_loop=is_loop).curve,
        lambda: cut_between(basis, *ends, same_sense=False).curve,
        lambda: None if isinstance(basis, Curve) else basis.cut(*numbers),
    )


def build_outline(points: list[Vector]) -> Outline:
    """The outline of vertices that a builder accepts."""
    builder = PartBuilder()
    kept = []
    for number, point in enumerate(points):
        try:
            kept.append(builder.add_vertex(number, point))
        except InvalidGeometry:
            continue
    return builder.find_outline([], kept)


def build_bases(frame: Frame, a: float, b: float, vector: Vector) -> list[BasisCurve]:
    made: list[BasisCurve] = []
    builders: list[Callable[[], BasisCurve]] = [
        lambda: Line(frame.origin, vector),
        lambda: Ellipse(frame, a, b),
        lambda: Parabola(frame, a),
        lambda: Hyperbola(frame, a, b),
        lambda: splines.build_curve(1, [0, 0, a, a], [frame.origin, vector]),
    ]
    for build in builders:
        try:
            made.append(build())
        except InvalidGeometry:
            continue
    return made


def find_frame(origin: Vector, z: Vector, x: Vector) -> Frame:
    try:
        return build_frame(origin, z, x)
    except InvalidGeometry:
        return build_frame((0.0, 0.0, 0.0))


@settings(max_examples=60)
@given(
    frame=st.builds(find_frame, VECTORS, VECTORS, VECTORS),
    a=NUMBERS,
    b=NUMBERS,
    points=POINTS,
    vector=VECTORS,
)
def test_surfaces_of_any_numbers(
    frame: Frame, a: float, b: float, points: list[Vector], vector: Vector
) -> None:
    outline = build_outline(points)
    kinds: tuple[Callable[[], Elementary], ...] = (
        partial(Plane, frame),
        partial(Cylinder, frame, a),
        partial(Cone, frame, a, b),
        partial(Sphere, frame, a),
        partial(Torus, frame, a, b),
        partial(Torus, frame, a, b, is_outer=False),
    )
    for build in kinds:
        try_elementary(build, outline, a, b)
    for basis in build_bases(frame, a, b, vector):
        try_all(
            partial(call, Extrusion, (basis, vector), "cut", outline),
            partial(call, Extrusion, (basis, vector), "trim", (a, b), (0.0, a)),
            partial(call, Revolution, (basis, frame.origin, vector), "cut", outline),
            partial(call, Revolution, (basis, points[0], vector), "trim", (a, b), (b, a)),
        )


@settings(max_examples=60)
@given(
    frame=st.builds(find_frame, VECTORS, VECTORS, VECTORS),
    numbers=st.tuples(NUMBERS, NUMBERS),
    ends=st.tuples(VECTORS, VECTORS),
    vector=VECTORS,
    is_loop=st.booleans(),
)
def test_edges_of_any_numbers(
    frame: Frame,
    numbers: tuple[float, float],
    ends: tuple[Vector, Vector],
    vector: Vector,
    is_loop: bool,
) -> None:
    a, b = numbers
    try:
        for point in ends:
            check_point(point)
    except InvalidGeometry:
        return
    for basis in build_bases(frame, a, b, vector):
        try_edges(basis, numbers, ends, is_loop)


@settings(max_examples=60)
@given(
    knots=st.lists(NUMBERS, min_size=4, max_size=9).map(sorted),
    points=st.lists(VECTORS, min_size=2, max_size=7),
    weights=st.none() | st.lists(NUMBERS, min_size=7, max_size=7),
    degree=st.integers(-1, 4),
    cut=st.tuples(NUMBERS, NUMBERS),
)
def test_splines_of_any_numbers(
    knots: list[float],
    points: list[Vector],
    weights: list[float] | None,
    degree: int,
    cut: tuple[float, float],
) -> None:
    own = None if weights is None else weights[: len(points)]
    needed = len(points) + degree + 1
    full = (knots * 3)[:needed] if degree % 2 else sorted((knots * 3)[: max(0, needed)])
    try_all(
        lambda: splines.build_curve(degree, full, points, own),
        lambda: splines.segment(splines.build_curve(degree, full, points, own), *cut),
        lambda: splines.elevate(splines.build_curve(degree, full, points, own), degree + 1),
        lambda: splines.reverse(splines.build_curve(degree, full, points, own)),
    )
