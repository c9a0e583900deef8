"""Wireframes in all formats: lengths of files, colours, and refused options."""

import numpy as np
import pytest

from oracles.gltf import read_glb
from service.encoders.format import EncodeOptions, Format
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.options import MeshOptions, WireForm
from service.errors import InvalidRequest, SurfaceError, UnsupportedByFormat
from service.pipeline.limits import Limits
from service.pipeline.mesh import plan_mesh, render
from service.pipeline.mesh_counts import mesh_size
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import find

TEAPOT = find("utah-teapot").surface()
FORMS: tuple[WireForm, ...] = ("lines", "tubes", "ribbons")

each_form = pytest.mark.parametrize("wires", FORMS)


def build_options(wires: WireForm, has_faces: bool = False) -> MeshOptions:
    return MeshOptions((4, 4), isocurves=(2, 2), wires=wires, has_faces=has_faces, wire_sides=5)


@pytest.mark.slow
@each_form
@pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)
def test_wireframes_are_not_longer_than_their_bound_or_are_refused(
    fmt: Format, wires: WireForm
) -> None:
    """All formats have tubes and ribbons; formats without overlays refuse lines."""
    for has_faces in (True, False):
        options = build_options(wires, has_faces)
        if wires == "lines" and not fmt.has_overlays:
            with pytest.raises(UnsupportedByFormat) as error:
                render(TEAPOT, options, fmt)
            assert error.value.issues[0].pointer == "/wires"
            continue
        size = mesh_size(TEAPOT.size(), options, fmt)
        bound = fmt.byte_bound(size, EncodeOptions())
        plan = plan_mesh(TEAPOT, options, fmt, limits=Limits(max_bytes=bound))
        assert len(plan.run().content) <= bound


def test_the_wires_of_gltf_have_a_colour() -> None:
    gltf = read_glb(render(TEAPOT, build_options("tubes", has_faces=True), BY_NAME["glb"]))
    faces_material, wires_material = gltf.document["materials"]
    assert faces_material["name"] == "surface"
    assert wires_material["name"] == "surface #ed8a40"
    assert gltf.primitive("isocurves")["material"] == 1


def test_oogl_with_patches_has_lines_but_refuses_tubes_and_missing_faces() -> None:
    oogl, encode_options = BY_NAME["oogl"], EncodeOptions("bez")
    content = render(TEAPOT, build_options("lines", has_faces=True), oogl, encode_options)
    assert b"BEZ" in content
    assert b"SKEL" in content
    for options in (build_options("tubes", has_faces=True), build_options("lines")):
        with pytest.raises(UnsupportedByFormat) as error:
            render(TEAPOT, options, oogl, encode_options)
        assert error.value.issues[0].pointer == "/oogl"


@pytest.mark.parametrize(
    ("options", "pointer"),
    [
        (MeshOptions(isocurves=(1, 1)), "/isocurves"),
        (MeshOptions(has_faces=False, overlays=("control_net",)), "/faces"),
    ],
)
def test_tubes_have_no_isocurves_and_cannot_be_drawn_without_faces(
    options: MeshOptions, pointer: str
) -> None:
    with pytest.raises(InvalidRequest) as error:
        render(find("trefoil-tube").surface(), options, BY_NAME["json"])
    (issue,) = error.value.issues
    assert (issue.code, issue.pointer) == ("not_parametric", pointer)


def test_wires_beyond_single_precision_are_refused() -> None:
    """Coordinates must fit into float32, also in formats that store float64."""
    large = BezierSurface(3e38 * np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]))
    options = MeshOptions(isocurves=(1, 1), wires="tubes", wire_width=1e38)
    with pytest.raises(SurfaceError) as error:
        render(large, options, BY_NAME["json"])
    (issue,) = error.value.issues
    assert (issue.code, issue.pointer) == ("coordinate_too_large", "/wire_width")


def test_too_many_wires_are_refused() -> None:
    options = MeshOptions((1000, 1000), isocurves=(1000, 1000), wires="tubes", has_faces=False)
    with pytest.raises(SurfaceError) as error:
        render(TEAPOT, options, BY_NAME["glb"])
    assert error.value.issues[0].code == "too_many_vertices"
