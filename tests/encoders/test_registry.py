"""Each format writes exactly the elements that its entry in the registry names."""

import gc
from dataclasses import replace
from importlib import import_module
from inspect import signature
from pkgutil import iter_modules

import pytest

import service.encoders
from service.encoders.format import EncodeOptions, Format
from service.encoders.registry import FORMATS
from service.engine.options import MeshOptions
from service.errors import UnsupportedByFormat
from service.pipeline.mesh import render
from service.surface.batches import ChannelKind
from service.surface.examples.catalogue import find
from tools.meshes import add_attributes, add_overlays, build_silo, remove_faces

each_format = pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)


def test_every_module_that_writes_a_format_is_in_the_registry() -> None:
    bounds = {fmt.byte_bound for fmt in FORMATS}
    for info in iter_modules(service.encoders.__path__, "service.encoders."):
        module = import_module(info.name)
        bound = getattr(module, "byte_bound", None)
        # Formats of meshes have the function `byte_bound(size, options)`.
        if bound and "size" in signature(bound).parameters:
            assert bound in bounds, f"service/encoders/registry.py lacks {info.name}"


def test_media_types_differ_and_have_no_parameters() -> None:
    media_types = [fmt.media_type for fmt in FORMATS]
    assert len(set(media_types)) == len(media_types)
    assert not any(";" in media_type for media_type in media_types)


@each_format
def test_quads_are_written_or_refused(fmt: Format) -> None:
    mesh = build_silo(faces="quads")
    if fmt.has_quads:
        assert fmt.encode(mesh, EncodeOptions())
        return
    with pytest.raises(UnsupportedByFormat) as error:
        fmt.encode(mesh, EncodeOptions())
    (issue,) = error.value.issues
    assert (issue.code, issue.pointer) == ("unsupported_by_format", "/faces")


@each_format
def test_overlays_are_written_by_the_formats_that_have_overlays(fmt: Format) -> None:
    mesh = build_silo()
    plain, with_overlays = (
        fmt.encode(each, EncodeOptions()) for each in (mesh, add_overlays(mesh))
    )
    assert (plain != with_overlays) == fmt.has_overlays


@each_format
@pytest.mark.parametrize("kind", ["colors", "uvs", "attribute"])
def test_channels_are_written_by_the_formats_that_have_them(fmt: Format, kind: ChannelKind) -> None:
    # Of all forms of OOGL, "off" can store most channels.
    options = EncodeOptions("off")
    mesh = add_attributes(build_silo())
    meshes_without_kind = {
        "colors": replace(mesh, colors=None),
        "uvs": replace(mesh, uvs=None),
        "attribute": replace(mesh, attributes=()),
    }
    is_written = fmt.encode(mesh, options) != fmt.encode(meshes_without_kind[kind], options)
    assert is_written == (kind in fmt.carries)


@each_format
def test_strided_arrays_are_accepted(fmt: Format) -> None:
    mesh = build_silo()
    assert mesh.normals is not None
    assert mesh.uvs is not None
    assert mesh.welds is not None
    # Every second row of arrays in which each row is repeated: the values are those of the mesh.
    strided_mesh = replace(
        mesh,
        positions=mesh.positions.repeat(2, axis=0)[::2],
        normals=mesh.normals.repeat(2, axis=0)[::2],
        uvs=mesh.uvs.repeat(2, axis=0)[::2],
        triangles=mesh.triangles.repeat(2, axis=0)[::2],
        welds=mesh.welds.repeat(2)[::2],
    )
    assert fmt.encode(strided_mesh, EncodeOptions()) == fmt.encode(mesh, EncodeOptions())


# OOGL refuses a mesh without faces; test_oogl.py tests that.
@pytest.mark.parametrize(
    "fmt", [fmt for fmt in FORMATS if fmt.name != "oogl"], ids=lambda fmt: fmt.name
)
def test_a_mesh_without_faces_can_be_encoded(fmt: Format) -> None:
    assert fmt.encode(remove_faces(build_silo()), EncodeOptions())


def test_encoders_make_no_reference_cycles() -> None:
    """Arrays in a cycle keep their memory until the garbage collector runs, maybe for minutes."""
    surface, options = find("saddle").surface(), MeshOptions(resolution=(4, 4))
    for fmt in FORMATS:
        render(surface, options, fmt)  # fills the caches
    gc.collect()
    gc.disable()
    gc.freeze()  # so that `gc.collect` examines only new objects
    try:
        for fmt in FORMATS:
            render(surface, options, fmt)
            assert gc.collect() == 0, fmt.name
    finally:
        gc.unfreeze()
        gc.enable()
