"""Each format in the registry does what its entry states."""

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
from service.surface.examples import find
from tests.meshes import add_attributes, add_overlays, build_silo, remove_faces

each_format = pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)


def test_every_module_that_writes_a_format_is_in_the_registry() -> None:
    bounds = {fmt.byte_bound for fmt in FORMATS}
    for result in iter_modules(service.encoders.__path__, "service.encoders."):
        module = import_module(result.name)
        bound = getattr(module, "byte_bound", None)
        if bound and "size" in signature(bound).parameters:
            assert bound in bounds, f"service/encoders/registry.py lacks {result.name}"


def test_media_types_differ_and_have_no_parameters() -> None:
    media_types = [fmt.media_type for fmt in FORMATS]
    assert len(set(media_types)) == len(media_types)
    assert not any(";" in media_type for media_type in media_types)


@each_format
def test_quads_are_written_or_refused(fmt: Format) -> None:
    mesh = build_silo(faces="quads")
    if fmt.quads:
        assert fmt.encode(mesh, EncodeOptions())
        return
    with pytest.raises(UnsupportedByFormat) as refused:
        fmt.encode(mesh, EncodeOptions())
    (issue,) = refused.value.issues
    assert (issue.code, issue.pointer) == ("unsupported_by_format", "/faces")


@each_format
def test_overlays_are_written_by_the_formats_that_state_them(fmt: Format) -> None:
    bare, decorated = build_silo(), add_overlays(build_silo())
    differ = fmt.encode(bare, EncodeOptions()) != fmt.encode(decorated, EncodeOptions())
    assert differ == fmt.overlays


@each_format
@pytest.mark.parametrize("kind", ["colors", "uvs", "attribute"])
def test_channels_are_written_by_the_formats_that_state_them(
    fmt: Format, kind: ChannelKind
) -> None:
    """The form of OOGL that can store most channels."""
    options = EncodeOptions("off")
    full = add_attributes(build_silo())
    lacking = {
        "colors": replace(full, colors=None),
        "uvs": replace(full, uvs=None),
        "attribute": replace(full, attributes=()),
    }
    differ = fmt.encode(full, options) != fmt.encode(lacking[kind], options)
    assert differ == (kind in fmt.carries)


@each_format
def test_strided_arrays_are_accepted(fmt: Format) -> None:
    mesh = build_silo()
    assert mesh.normals is not None
    assert mesh.uvs is not None
    assert mesh.welds is not None
    strided = replace(
        mesh,
        positions=mesh.positions.repeat(2, axis=0)[::2],
        normals=mesh.normals.repeat(2, axis=0)[::2],
        uvs=mesh.uvs.repeat(2, axis=0)[::2],
        triangles=mesh.triangles.repeat(2, axis=0)[::2],
        welds=mesh.welds.repeat(2)[::2],
    )
    assert fmt.encode(strided, EncodeOptions()) == fmt.encode(mesh, EncodeOptions())


@pytest.mark.parametrize("fmt", [f for f in FORMATS if f.name != "oogl"], ids=lambda f: f.name)
def test_a_mesh_without_faces_is_still_a_file(fmt: Format) -> None:
    assert fmt.encode(remove_faces(build_silo()), EncodeOptions())


def test_memory_is_free_at_once() -> None:
    """Arrays in a cycle would wait for the garbage collector, which may not come for minutes."""
    surface, options = find("saddle").surface(), MeshOptions(resolution=(4, 4))
    for fmt in FORMATS:
        render(surface, options, fmt)  # fills caches that stay
    gc.collect()
    gc.disable()
    gc.freeze()  # older objects need not be examined
    try:
        for fmt in FORMATS:
            render(surface, options, fmt)
            assert gc.collect() == 0, fmt.name
    finally:
        gc.unfreeze()
        gc.enable()
