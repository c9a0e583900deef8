"""Wireframes in files: their bytes, colours and limits in every format."""

import numpy as np
import pytest

from service.encoders.format import EncodeOptions, Format
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.options import MeshOptions, WireForm
from service.errors import InvalidRequest, SurfaceError, UnsupportedByFormat
from service.pipeline.cost import mesh_size
from service.pipeline.limits import Limits
from service.pipeline.mesh import plan_mesh, render
from service.surface.bezier import BezierSurface
from service.surface.examples import find
from tests.encoders.gltf.reader import read_glb

TEAPOT = find("utah-teapot").surface()
FORMS: tuple[WireForm, ...] = ("lines", "tubes", "ribbons")

each_form = pytest.mark.parametrize("wires", FORMS)


def build_options(wires: WireForm, surface: bool = False) -> MeshOptions:
    return MeshOptions((4, 4), isocurves=(2, 2), wires=wires, has_faces=surface, wire_sides=5)


@each_form
@pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)
def test_every_format_takes_tubes_and_those_with_lines_take_lines(
    fmt: Format, wires: WireForm
) -> None:
    """The files stay within the predicted bytes."""
    for surface in (True, False):
        options = build_options(wires, surface)
        if wires == "lines" and not fmt.overlays:
            with pytest.raises(UnsupportedByFormat) as caught:
                render(TEAPOT, options, fmt)
            assert caught.value.issues[0].pointer == "/wires"
            continue
        size = mesh_size(TEAPOT.size(), options, fmt)
        bound = fmt.byte_bound(size, EncodeOptions())
        assert (
            len(plan_mesh(TEAPOT, options, fmt, limits=Limits(max_bytes=bound)).run().content)
            <= bound
        )


def test_the_wires_of_gltf_have_a_colour() -> None:
    gltf = read_glb(render(TEAPOT, build_options("tubes", surface=True), BY_NAME["glb"]))
    plain, orange = gltf.document["materials"]
    assert plain["name"] == "surface"
    assert orange["name"] == "surface #ed8a40"
    assert gltf.primitive("isocurves")["material"] == 1


def test_the_exact_form_takes_lines_and_nothing_else() -> None:
    oogl, exact = BY_NAME["oogl"], EncodeOptions("bez")
    lines = render(TEAPOT, build_options("lines", surface=True), oogl, exact)
    assert b"BEZ" in lines
    assert b"SKEL" in lines
    for options in (build_options("tubes", surface=True), build_options("lines")):
        with pytest.raises(UnsupportedByFormat) as caught:
            render(TEAPOT, options, oogl, exact)
        assert caught.value.issues[0].pointer == "/oogl"


@pytest.mark.parametrize(
    ("options", "pointer"),
    [
        (MeshOptions(isocurves=(1, 1)), "/isocurves"),
        (MeshOptions(has_faces=False, overlays=("control_net",)), "/faces"),
    ],
)
def test_tubes_have_no_isocurves(options: MeshOptions, pointer: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        render(find("trefoil-tube").surface(), options, BY_NAME["json"])
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == ("not_parametric", pointer)


def test_wires_beyond_single_precision_are_refused() -> None:
    large = BezierSurface(3e38 * np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]))
    options = MeshOptions(isocurves=(1, 1), wires="tubes", wire_width=1e38)
    with pytest.raises(SurfaceError) as caught:
        render(large, options, BY_NAME["json"])
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == ("coordinate_too_large", "/wire_width")


def test_too_many_wires_are_refused_before_anything_is_computed() -> None:
    options = MeshOptions((1000, 1000), isocurves=(1000, 1000), wires="tubes", has_faces=False)
    with pytest.raises(SurfaceError) as caught:
        render(TEAPOT, options, BY_NAME["glb"])
    assert caught.value.issues[0].code == "too_many_vertices"
